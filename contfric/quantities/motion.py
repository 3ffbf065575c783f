r"""An orbit as a function of time, segment by segment, with its derivatives in some directions.

A segment starts at :math:`(t_0, y_0)` and lasts d; at the share s of it time and state are

.. math:: t = t_0 + s d, \qquad y = \varphi(t_0, y_0, s d; p).

Where start, duration and parameters move in a direction by :math:`\delta t_0, \delta y_0, \delta d, \delta
p`, they move by

.. math:: \delta t = \delta t_0 + s\,\delta d, \qquad
   \delta y = \varphi_{t_0}\delta t_0 + \varphi_{y_0}\delta y_0 + \varphi_d s\,\delta d
   + \varphi_p\,\delta p ,

with the flow's own exact derivatives. One more direction, the last one, is time itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.attributes import cached_property
from contfric.models.definition import Model
from contfric.quantities.chatter import pieces
from contfric.quantities.duals import Dual

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

IndexArray = NDArray[np.int64]

#: Relative rounding of the closed forms written by hand; what is above may be integrated.
_CLOSED = 1e-14


@dataclass(frozen=True, eq=False)
class Directions:
    """How an orbit moves in D directions: the joints of its equations, and the parameters.

    Attributes
    ----------
    joints : shape (N, 1 + n, D), of one turn
    vector : shape (parameters, D)
    """

    joints: FloatArray
    vector: FloatArray

    @cached_property
    def moving(self) -> tuple[IndexArray, FloatArray]:
        """The parameters that move, and how."""
        return moving(self.vector)


@cache
def _each(count: int) -> tuple[IndexArray, FloatArray]:
    """Return the numbers of so many parameters, and one direction along each."""
    return np.arange(count), np.eye(count)


def along_parameters(joints: FloatArray) -> Directions:
    """Return how an orbit moves with each of its parameters.

    Parameters
    ----------
    joints : derivatives of the joints of one turn by all parameters, shape (N, 1 + n, parameters)
    """
    each = _each(joints.shape[2])
    found = Directions(joints, each[1])
    vars(found)["moving"] = each  # they all do, and that need not be looked for
    return found


class Place:
    """Where a function of time is evaluated: at shares of one segment, or of several.

    Attributes
    ----------
    model, vector, d_vector : the model, its parameters, and how they move, shape (parameters, D)
    mode : the mode there
    """

    model: Model
    vector: FloatArray
    d_vector: FloatArray
    mode: str

    @property
    def exact(self) -> bool:
        """Whether derivatives are wanted."""
        return bool(self.d_vector.shape[1])

    def at(self, shares: FloatArray) -> tuple[Dual, list[Dual]]:
        """Return time and states at some shares; the last direction is time."""
        raise NotImplementedError

    def parameter(self, index: int, count: int) -> Dual:
        """Return a parameter as a constant of so many nodes."""
        slopes = np.zeros((count, self.d_vector.shape[1] + 1 if self.exact else 0))
        if self.exact:
            slopes[:, :-1] = self.d_vector[index]
        return Dual(np.full(count, self.vector[index]), slopes)

    def observable(self, name: str, time: Dual, states: list[Dual]) -> Dual:
        """Return an observable of the model at some nodes, with the model's own exact gradient."""
        from contfric.quantities.nodes import observe

        c, flow = self.model.observable_index[name], self.model.flow.following()
        values, slopes = np.empty(len(time.values)), np.empty(time.slopes.shape)
        which, moved = moving(self.d_vector)
        points = np.stack([s.values for s in states], axis=1)
        points_moved = np.stack([s.slopes for s in states], axis=1)
        observe(
            *(flow, c, time.values, time.slopes, points, points_moved),
            *(self.vector, which, moved, values, slopes),
        )
        return Dual(values, slopes)


def moving(d_vector: FloatArray) -> tuple[IndexArray, FloatArray]:
    """Return the parameters that move, and how: the flow is differentiated by no others."""
    which = np.flatnonzero(d_vector.any(axis=1))
    return which, np.ascontiguousarray(d_vector[which])


def goes_on(model: Model) -> bool:
    """Tell whether the motion to a node starts at the node before: where it is integrated, step by step."""
    return model.rounding > _CLOSED


@dataclass(frozen=True, eq=False)
class MeasuredSegment(Place):
    """A smooth piece of an orbit; derivatives have D columns, none if they are not wanted.

    Attributes
    ----------
    model, vector, d_vector : the model, its parameters, and how they move, shape (parameters, D)
    index, mode : which segment of the whole orbit, and its mode
    start, state, lasts : start time, start state after its reset, and duration
    d_start, d_state, d_lasts : how they move, shapes (D,), (n, D) and (D,)
    """

    model: Model
    vector: FloatArray
    d_vector: FloatArray
    index: int
    mode: str
    start: float
    state: FloatArray
    lasts: float
    d_start: FloatArray
    d_state: FloatArray
    d_lasts: FloatArray

    def at(self, shares: FloatArray) -> tuple[Dual, list[Dual]]:
        """Return time and states at some shares of the segment; the last direction is time."""
        return self._alone.at(np.zeros(len(shares), dtype=np.int64), shares)

    @cached_property
    def _alone(self) -> Pieces:
        return Pieces((self,))


@dataclass(frozen=True, eq=False)
class Pieces:
    """Segments of one orbit in arrays: their nodes are computed in one compiled call."""

    segments: Sequence[MeasuredSegment]
    _known: dict[tuple[bytes, bytes], tuple[Dual, list[Dual]]] = field(default_factory=dict)

    def nodes(self, where: IndexArray) -> SegmentNodes:
        """Return some shares of some segments as a place where functions are evaluated."""
        first, mode = self.segments[0], self.segments[int(where[0])].mode
        return SegmentNodes(first.model, first.vector, first.d_vector, mode, self, where)

    def at(self, where: IndexArray, shares: FloatArray) -> tuple[Dual, list[Dual]]:
        """Return time and states at shares of the segments ``where``; the last direction is time."""
        key = where.tobytes(), shares.tobytes()
        if key not in self._known:
            self._known[key] = self._at(where, shares)
        return self._known[key]

    def _at(self, where: IndexArray, shares: FloatArray) -> tuple[Dual, list[Dual]]:
        from contfric.quantities.nodes import move

        first, count = self.segments[0], len(shares)
        n, columns = len(first.state), first.d_vector.shape[1] + 1 if first.exact else 0
        times, d_times = np.empty(count), np.empty((count, columns))
        states, slopes = np.empty((count, n)), np.empty((count, n, columns))
        move(
            *(first.model.flow.following(), *self._arrays, first.vector, *moving(first.d_vector)),
            *(goes_on(first.model), where, shares, times, d_times, states, slopes),
        )
        return Dual(times, d_times), [
            Dual(states[:, i].copy(), slopes[:, i].copy()) for i in range(n)
        ]

    @cached_property
    def _arrays(self) -> tuple[FloatArray | IndexArray, ...]:
        """Modes, starts, states and durations, and how the last three move."""
        own = self.segments
        modes = np.array([s.model.mode_index[s.mode] for s in own], dtype=np.int64)
        return (
            modes,
            np.array([s.start for s in own]),
            np.array([s.state for s in own]),
            np.array([s.lasts for s in own]),
            np.array([s.d_start for s in own]),
            np.array([s.d_state for s in own]),
            np.array([s.d_lasts for s in own]),
        )


@dataclass(frozen=True, eq=False)
class SegmentNodes(Place):
    """Shares of several segments, those of ``where`` in turn."""

    model: Model
    vector: FloatArray
    d_vector: FloatArray
    mode: str
    pieces: Pieces
    where: IndexArray

    def at(self, shares: FloatArray) -> tuple[Dual, list[Dual]]:
        """Return time and states at a share of each segment; the last direction is time."""
        return self.pieces.at(self.where, shares)


@dataclass(frozen=True, eq=False)
class OrbitMotion:
    """A whole orbit as its segments, in directions that it may move in.

    Parameters
    ----------
    orbit : Orbit
    directions : Directions or None
        None where no derivatives are wanted.
    """

    orbit: Orbit
    directions: Directions | None = None

    @property
    def count(self) -> int:
        """Number of directions."""
        return 0 if self.directions is None else self.directions.vector.shape[1]

    @cached_property
    def d_vector(self) -> FloatArray:
        """How the parameters move, shape (parameters, D)."""
        if self.directions is None:
            return np.zeros((len(self.orbit.vector), 0))
        return self.directions.vector

    @cached_property
    def d_excitation(self) -> FloatArray:
        """How the period of the excitation moves, shape (D,)."""
        count = len(self.orbit.vector)
        every, grad = _each(count)[0], np.empty(count)
        self.orbit.model.flow.period(self.orbit.vector, every, grad)
        return np.asarray(grad @ self.d_vector)

    @cached_property
    def d_turn(self) -> FloatArray:
        """How the duration of a turn moves, shape (D,)."""
        if self.directions is None:
            return np.zeros(0)
        if self.orbit.model.autonomous:  # a turn ends at time 0
            return np.asarray(-self.directions.joints[0, 0])
        return np.asarray(self.orbit.system.layout.turn * self.d_excitation)

    @cached_property
    def d_period(self) -> FloatArray:
        """How the period of the orbit moves, shape (D,)."""
        return self.d_turn * (2.0 if self.orbit.system.half else 1.0)

    @cached_property
    def d_cycle(self) -> FloatArray:
        """How the joints of the whole orbit move, shape (segments, 1 + n, D)."""
        if self.directions is None:
            return np.zeros((*self.orbit.cycle.shape, 0))
        own = self.directions.joints
        if not self.orbit.system.half:
            return own
        first, other = own.copy(), own.copy()
        if self.orbit.model.autonomous:
            first[:, 0] -= self.d_turn
        other[:, 0] = first[:, 0] + self.d_turn
        closure = self.orbit.system.layout.closure
        other[:, 1:] = np.einsum("ij,kjd->kid", closure, own[:, 1:])
        return np.concatenate([first, other])

    @cached_property
    def segments(self) -> tuple[MeasuredSegment, ...]:
        """The smooth pieces of the whole orbit: its segments, and of chatter its flights."""
        chatters = self.orbit.model.chatter_by_mode
        if not chatters:
            return self._whole_segments
        return tuple(
            piece
            for s in self._whole_segments
            for piece in (pieces(s, chatters[s.mode]) if s.mode in chatters else (s,))
        )

    @cached_property
    def pieces(self) -> Pieces:
        """The same in arrays."""
        return Pieces(self.segments)

    def last_of(self, index: int) -> MeasuredSegment:
        """Return the piece that ends with a segment of the orbit."""
        return next(s for s in reversed(self.segments) if s.index == index)

    @cached_property
    def _whole_segments(self) -> tuple[MeasuredSegment, ...]:
        orbit, moved = self.orbit, self.d_cycle
        ends = np.roll(moved[:, 0], -1, axis=0)
        ends[-1] += self.d_period
        found = []
        for i, (mode, _) in enumerate(orbit.itinerary):
            found.append(
                MeasuredSegment(
                    model=orbit.model,
                    vector=orbit.vector,
                    d_vector=self.d_vector,
                    index=i,
                    mode=mode,
                    start=float(orbit.begins[i, 0]),
                    state=np.ascontiguousarray(orbit.begins[i, 1:]),
                    lasts=float(orbit.durations[i]),
                    d_start=moved[i, 0],
                    d_state=self._d_begin(i),
                    d_lasts=ends[i] - moved[i, 0],
                )
            )
        return tuple(found)

    def _d_begin(self, i: int) -> FloatArray:
        """Return how the start of a segment moves: that of its joint, mapped by the reset there."""
        orbit, moved = self.orbit, self.d_cycle[i]
        before, entry = orbit.itinerary[i - 1]
        if orbit.model.reset_at(before, entry) is None or not self.count:
            return np.asarray(moved[1:])
        n, every = len(moved) - 1, np.arange(len(orbit.vector))
        k, joint = orbit.model.surface_index[entry], np.ascontiguousarray(orbit.cycle[i])
        out, jac = np.empty(n), np.empty((n, 1 + n + len(every)))
        orbit.model.flow.reset(k, joint[0], joint[1:], orbit.vector, every, out, jac)
        return np.asarray(jac[:, : 1 + n] @ moved + jac[:, 1 + n :] @ self.d_vector)
