"""From a signature to the boundary-value problem: which equations and inequalities an orbit obeys.

A segment starts at a joint ``z_i = (t_i, y_i)`` and ends at the next one, on its exit surface. The
equations are the flow of the segment and its exit surface; the inequalities (margins, positive where
admissible) are

* interior: between its joints a segment does not cross a surface that bounds its mode,
* exit: it meets its exit surface from inside, with a rate that does not vanish,
* joint: where it exits, the other observables are in the domain that the signature names,
* entry: where it begins after a reset, the observables that the reset changes are in its mode.

Crossings of transparent surfaces inside a segment do not matter to the solution; they label it.

A hold (a delayed release, :mod:`contfric.bvp.holds`) has a defining condition at its start, its pin, in the
place of the exit surface. Its exit margin is the acceleration with which it is left, which must not be
negative anywhere on the way (HELD);
one that follows a stick must last, and so must that stick, whose end is tangential, a slide that leads from
one hold to the touch of another, and the last part of a hold in several modes (LASTING). Where such a segment
shrinks to nothing, other margins may have a double zero: they are divided by the square of its duration, for
what is left of them is their sign.

Everything here derives from the model's definition: no model is a special case.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.base.attributes import cached_property
from contfric.bvp.assembly import Assembly
from contfric.bvp.conserved import conserved, kept_by
from contfric.bvp.holds import Hold
from contfric.bvp.margins import EventFunction, Margin
from contfric.bvp.segment_starts import Itinerary, beginnings
from contfric.models.definition import Model
from contfric.remember.stored import made_of

__all__ = [
    "EventFunction",
    "Itinerary",
    "Layout",
    "Margin",
    "System",
    "build_system",
]


class Layout(NamedTuple):
    """A boundary-value problem as arrays, as the compiled engine takes it.

    Attributes
    ----------
    modes, exits : mode and exit surface of each segment, shape (N,); a hold's is the surface it leaves
    observables : observable of each surface, shape (surfaces,)
    exit_signs : sign of the rate at which each exit is met (a hold is left), shape (N,); 0 if tangential
    interior : rows (segment, surface, sign) of the interior margins
    joint : rows (segment, surface, sign, 0) of the joint margins, at the segment's end, and of the entry
        margins, at its beginning (1)
    labels : rows (segment, observable, surfaces that the segment starts and ends on, or -1)
    pins : surface that each hold starts on, shape (N,); -2 after a touch, -1 where there is no hold
    departs : mode in which each hold is left, or its own if it goes on in another one, shape (N,); -1 where
        there is no hold
    resets : surface of the reset that each segment begins after, shape (N,); -1 without one
    returns : 1 for segments that begin on their exit surface, so that they may shrink to nothing, shape (N,);
        0 for the last where all do
    lasting : segments that must last: holds after a stick, and that stick; a slide from a hold to a touch at
        which another begins, shape (k,)
    held : rows (segment, surface, side, mode) of all holds, which could be left at any time: the surface that
        is left, to which side, and in which mode
    doubles : rows (margin, segment): the margin has a double zero where the segment has no length
    closure : state matrix of the closure, shape (n, n)
    closing : the same for corrections, which leave alone what the itinerary conserves, shape (n, n)
    conserved : directions of the linear functions of the state that the itinerary conserves, shape (k, n)
    turn : duration of one turn in periods of the excitation; 0 of an autonomous model
    rank : number of independent directions that survive one turn
    rounding : relative rounding of the flow
    """

    modes: IntArray
    exits: IntArray
    observables: IntArray
    exit_signs: FloatArray
    interior: IntArray
    joint: IntArray
    labels: IntArray
    pins: IntArray
    departs: IntArray
    resets: IntArray
    returns: IntArray
    lasting: IntArray
    held: IntArray
    doubles: IntArray
    closure: FloatArray
    closing: FloatArray
    conserved: FloatArray
    turn: float
    rank: int
    rounding: float


@dataclass(frozen=True)
class System:
    """A boundary-value problem: a reduced itinerary with its closure, over one turn.

    ``half`` says that the turn is half of the orbit and closes by the model's symmetry; ``domains``
    are those of the segments if the problem is in full form, empty if it is reduced; ``holds`` are those
    of the itinerary.
    """

    model: Model
    itinerary: Itinerary
    periods: int
    half: bool
    layout: Layout
    tests: tuple[EventFunction, ...]
    domains: tuple[str, ...] = ()
    holds: tuple[Hold, ...] = ()

    @property
    def segments(self) -> int:
        """Number of segments of one turn."""
        return len(self.itinerary)

    @cached_property
    def closing(self) -> FloatArray:
        """What closes the turn of a disturbance: by states as the orbit, in time if that is given; (m, m)."""
        closing = np.eye(1 + len(self.model.states))
        closing[0, 0] = 0.0 if self.model.autonomous else 1.0  # a turn may take another time
        closing[1:, 1:] = self.layout.closing
        return closing

    @cached_property
    def ends_of_holds(self) -> tuple[tuple[Hold, Hold], ...]:
        """The first and the last part of each hold: the same unless it goes on in other modes."""
        first = [hold for hold in self.holds if not hold.follows]
        last = [hold for hold in self.holds if hold.until is None]
        return tuple(zip(first, last, strict=True))

    def functions(self) -> int:
        """Return the model's compiled functions as kernels take them."""
        return self.model.flow.functions()


@cache
def build_system(
    model: Model,
    itinerary: Itinerary,
    periods: int,
    half: bool = False,
    domains: tuple[str, ...] = (),
) -> System:
    """Assemble the boundary-value problem of an itinerary.

    Parameters
    ----------
    itinerary : tuple of (mode, exit surface)
        One turn: the whole cycle, or its first half if ``half``.
    periods : int
        Excitation periods of the whole orbit.
    domains : tuple of str
        Domains of the segments if the itinerary is in full seven-domain form; by default the itinerary is
        reduced and each segment spans its whole mode.
    """
    made = Assembly(model, itinerary, half, domains)
    joint, interior = _rows([*made.joint, *made.entries], 4), _rows(made.interior, 3)
    symmetry, count = model.symmetry, len(itinerary)
    turns = 0.0 if model.autonomous else float(periods)
    if half and symmetry is not None:
        closure, turns = symmetry.array(), turns * symmetry.fraction
    else:
        closure = np.eye(len(model.states))
    still = conserved(model, itinerary)
    datum = kept_by(closure, still)
    layout = Layout(
        modes=_whole(model.mode_index[mode] for mode, _ in itinerary),
        exits=_whole(model.surface_index[exit_] for exit_ in made.exits),
        observables=_whole(model.observable_index[s.observable] for s in model.surfaces),
        exit_signs=np.array([made.exit_sign(i) for i in range(count)]),
        interior=interior,
        joint=joint,
        labels=_rows(list(made.labels()), 4),
        pins=_whole(made.pin(i) for i in range(count)),
        **beginnings(model, itinerary, made.exits, made.joints, made.held),
        lasting=_whole(i for i, _ in made.lasting),
        held=_rows(made.leaving, 4),
        doubles=_rows(made.doubles, 2),
        closure=closure,
        closing=closure + datum.T @ datum,
        conserved=still,
        turn=turns,
        # a shift in time is no disturbance of an autonomous orbit
        rank=min(model.mode_by_name[mode].rank for mode, _ in itinerary)
        - int(model.autonomous)
        - len(still),
        rounding=model.rounding,
    )
    return System(model, itinerary, periods, half, layout, made.tests, domains, made.holds)


made_of(System, lambda s: (s.model, s.itinerary, s.periods, s.half, s.domains), build_system)


def _rows(rows: list[tuple[int, ...]], width: int) -> IntArray:
    return np.array(rows, dtype=np.int64).reshape(len(rows), width)


def _whole(numbers: Iterable[int]) -> IntArray:
    return np.array(list(numbers), dtype=np.int64)
