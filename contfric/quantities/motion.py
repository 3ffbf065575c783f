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

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from contfric.models.definition import FloatArray, Model
from contfric.quantities.chatter import pieces
from contfric.quantities.duals import Dual

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: Relative rounding of the closed forms written by hand; what is above may be integrated.
_CLOSED = 1e-14
_NONE = np.empty(0, dtype=np.int64)
_EMPTY, _NOTHING = np.empty(0), np.empty((0, 0))


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


@dataclass(frozen=True, eq=False)
class Segment:
    """A smooth piece of an orbit; derivatives have D columns, none if they are not wanted.

    Attributes
    ----------
    model, vector, d_vector : the model, its parameters, and how they move, shape (parameters, D)
    index, mode : which segment of the whole orbit, and its mode
    start, state, lasts : start time, start state behind its reset, and duration
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
    _known: dict[tuple[float, ...], tuple[Dual, list[Dual]]] = field(default_factory=dict)

    @property
    def exact(self) -> bool:
        """Whether derivatives are wanted."""
        return bool(self.d_start.size)

    def at(self, shares: FloatArray) -> tuple[Dual, list[Dual]]:
        """Return time and states at some shares of the segment; the last direction is time."""
        key = tuple(shares.tolist())
        if key not in self._known:
            self._known[key] = self._moved(shares) if self.exact else self._plain(shares)
        return self._known[key]

    @property
    def _chained(self) -> bool:
        """Whether the motion to a node starts at the node before: where it is integrated, step by step."""
        return self.model.rounding > _CLOSED

    def _plain(self, shares: FloatArray) -> tuple[Dual, list[Dual]]:
        flow, m = self.model.flow, self.model.mode_index[self.mode]
        states = np.empty((len(shares), len(self.state)))
        since, state = self.start, self.state
        for k, share in enumerate(shares):
            at = self.start + share * self.lasts
            if at < since:  # a node before the last one
                since, state = self.start, self.state
            flow.flow(m, since, state, at - since, self.vector, _NONE, states[k], _NOTHING)
            if self._chained:
                since, state = at, states[k]
        none = np.empty((len(shares), 0))
        time = Dual(self.start + shares * self.lasts, none)
        return time, [Dual(column, none) for column in states.T.copy()]

    def _moved(self, shares: FloatArray) -> tuple[Dual, list[Dual]]:
        count, columns = len(shares), len(self.d_start) + 1
        d_times = np.ones((count, columns))
        d_times[:, :-1] = self.d_start + np.outer(shares, self.d_lasts)
        times = Dual(self.start + shares * self.lasts, d_times)
        states, jacobians = self._jacobians(times.values)
        n = len(self.state)
        slopes = np.empty((count, n, columns))
        slopes[:, :, -1] = jacobians[:, :, 1 + n]
        begin = first = np.vstack([self.d_start, self.d_state])
        if not self._chained:
            slopes[:, :, :-1] = self._carried(jacobians, begin, d_times)
        for k in range(count if self._chained else 0):
            slopes[k, :, :-1] = self._carried(jacobians[k : k + 1], begin, d_times[k : k + 1])[0]
            onward = k + 1 < count and times.values[k + 1] >= times.values[k]
            begin = np.vstack([d_times[k, :-1], slopes[k, :, :-1]]) if onward else first
        return times, [Dual(states[:, i].copy(), slopes[:, i].copy()) for i in range(n)]

    def _carried(self, jacobians: FloatArray, begin: FloatArray, d_times: FloatArray) -> FloatArray:
        """Return how states move whose motion starts where time and state move by ``begin``, (1 + n, D)."""
        n = len(self.state)
        lasts = d_times[:, None, :-1] - begin[0]
        return np.asarray(
            jacobians[:, :, : 1 + n] @ begin
            + jacobians[:, :, 1 + n, None] * lasts
            + jacobians[:, :, 2 + n :] @ self.d_vector
        )

    def _jacobians(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return states at some times, (k, n), and their derivatives by where the motion to each starts.

        By its time, state and duration and by all parameters, shape (k, n, 2 + n + parameters).
        """
        flow, m, n = self.model.flow, self.model.mode_index[self.mode], len(self.state)
        every = np.arange(len(self.vector))
        states, found = np.empty((len(times), n)), np.empty((len(times), n, 2 + n + len(every)))
        since, state = self.start, self.state
        for k, at in enumerate(times):
            if at < since:  # a node before the last one
                since, state = self.start, self.state
            flow.flow(m, since, state, at - since, self.vector, every, states[k], found[k])
            if self._chained:
                since, state = at, states[k]
        return states, found

    def parameter(self, index: int, count: int) -> Dual:
        """Return a parameter as a constant of so many nodes."""
        slopes = np.zeros((count, len(self.d_start) + 1 if self.exact else 0))
        if self.exact:
            slopes[:, :-1] = self.d_vector[index]
        return Dual(np.full(count, self.vector[index]), slopes)

    def observable(self, name: str, time: Dual, states: list[Dual]) -> Dual:
        """Return an observable of the model at some nodes, with the model's own exact gradient."""
        flow, c = self.model.flow, self.model.observable_index[name]
        count, n = len(time.values), len(states)
        points = np.ascontiguousarray(np.array([s.values for s in states]).T)
        values, slopes = np.empty(count), np.zeros(time.slopes.shape)
        every = np.arange(len(self.vector)) if self.exact else _NONE
        grad = np.empty(1 + n + len(every)) if self.exact else _EMPTY
        for k in range(count):
            values[k] = flow.observe(c, time.values[k], points[k], self.vector, every, grad)
            if self.exact:
                slopes[k] = grad[0] * time.slopes[k]
                slopes[k] += sum(grad[1 + j] * states[j].slopes[k] for j in range(n))
                slopes[k, :-1] += grad[1 + n :] @ self.d_vector
        return Dual(values, slopes)


@dataclass(frozen=True, eq=False)
class Motion:
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
        every, grad = np.arange(len(self.orbit.vector)), np.empty(len(self.orbit.vector))
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

    @property
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
    def segments(self) -> tuple[Segment, ...]:
        """The smooth pieces of the whole orbit: its segments, and of chatter its flights."""
        chatters = self.orbit.model.chatter_by_mode
        if not chatters:
            return self._whole_segments
        return tuple(
            piece
            for s in self._whole_segments
            for piece in (pieces(s, chatters[s.mode]) if s.mode in chatters else (s,))
        )

    def last_of(self, index: int) -> Segment:
        """Return the piece that ends with a segment of the orbit."""
        return next(s for s in reversed(self.segments) if s.index == index)

    @cached_property
    def _whole_segments(self) -> tuple[Segment, ...]:
        orbit, moved = self.orbit, self.d_cycle
        ends = np.roll(moved[:, 0], -1, axis=0)
        ends[-1] += self.d_period
        found = []
        for i, (mode, _) in enumerate(orbit.word):
            found.append(
                Segment(
                    model=orbit.model,
                    vector=orbit.vector,
                    d_vector=self.d_vector,
                    index=i,
                    mode=mode,
                    start=float(orbit.begins[i, 0]),
                    state=np.ascontiguousarray(orbit.begins[i, 1:]),
                    lasts=float(orbit.ends[i, 0] - orbit.begins[i, 0]),
                    d_start=moved[i, 0],
                    d_state=self._d_begin(i),
                    d_lasts=ends[i] - moved[i, 0],
                )
            )
        return tuple(found)

    def _d_begin(self, i: int) -> FloatArray:
        """Return how the start of a segment moves: that of its joint, mapped by the reset there."""
        orbit, moved = self.orbit, self.d_cycle[i]
        entry = orbit.word[i - 1][1]
        if entry not in orbit.model.reset_by_surface or not self.count:
            return np.asarray(moved[1:])
        n, every = len(moved) - 1, np.arange(len(orbit.vector))
        k, joint = orbit.model.surface_index[entry], np.ascontiguousarray(orbit.cycle[i])
        out, jac = np.empty(n), np.empty((n, 1 + n + len(every)))
        orbit.model.flow.reset(k, joint[0], joint[1:], orbit.vector, every, out, jac)
        return np.asarray(jac[:, : 1 + n] @ moved + jac[:, 1 + n :] @ self.d_vector)
