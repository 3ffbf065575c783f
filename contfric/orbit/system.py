"""From a signature to the boundary-value problem: which equations and inequalities an orbit obeys.

A segment starts at a joint ``z_i = (t_i, y_i)`` and ends at the next one, on its exit surface. The
equations are the flow of the segment and its exit surface; the inequalities (margins, positive where
admissible) are

* interior: between its joints a segment does not cross a surface that bounds its mode,
* exit: it meets its exit surface from inside, with a rate that does not vanish,
* joint: where it exits, the other observables are in the domain that the signature names,
* entry: where it begins after a reset, the observables that the reset changes are in its mode.

Crossings of transparent surfaces inside a segment do not matter to the solution; they label it.

A hold (:mod:`contfric.orbit.holds`) has a pin at its start in the place of the exit surface. Its exit
margin is the acceleration with which it is left, which must not be negative anywhere on the way (HELD);
one that follows a stick must last, and so must that stick, whose end is tangential, and a slide that leads
from one hold to the touch of another (LASTING). Where such a segment shrinks to nothing, other margins have a
double zero: they are divided by the square of its duration, for what is left of them is their sign.

Everything here derives from the model's definition; nothing knows what moves.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contfric.models.definition import FloatArray, Model
from contfric.orbit.begins import beginnings, entry_rows, joints_before
from contfric.orbit.conserved import conserved, kept_by
from contfric.orbit.holds import NO_PIN, TOUCH_PIN, Hold, holds_of
from contfric.orbit.margins import EventFunction, Margin, double_zeros, lasting_segments
from contfric.orbit.structure import (
    ending_sides,
    exit_domains,
    inside_sign,
    mirror_mode,
    mode_bounds,
    mode_domains,
)
from contfric.remember.stored import made_of
from contfric.signature.holds import is_hold

__all__ = [
    "EventFunction",
    "IntArray",
    "Itinerary",
    "Layout",
    "Margin",
    "System",
    "build_system",
    "exit_domains",
    "inside_sign",
    "mirror_mode",
    "mode_bounds",
    "mode_domains",
]

IntArray = NDArray[np.int64]


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
    departs : mode in which each hold is left, shape (N,); -1 where there is no hold
    resets : surface of the reset that each segment begins behind, shape (N,); -1 without one
    returns : 1 for segments that begin on their exit surface, so that they may shrink to nothing, shape (N,);
        0 for the last where all do
    lasting : segments that must last: holds after a stick, and that stick; a slide from a hold to a touch at
        which another begins, shape (k,)
    held : all holds, which could be left at any time, shape (k,)
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


Itinerary = tuple[tuple[str, str], ...]


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
    following = following_modes(model, itinerary, half)
    surfaces = [s.name for s in model.surfaces]
    holds = holds_of(model, itinerary)
    inside = [
        _segment_domains(model, mode, exit_, _leads_to(i, after, holds), domains[i : i + 1])
        for i, ((mode, exit_), after) in enumerate(zip(itinerary, following, strict=True))
    ]
    joints = joints_before(model, itinerary, half)
    entries = entry_rows(model, itinerary, joints, domains)
    ending = [
        ending_sides(model, mode, exit_, _leads_to(i, after, holds), inside[i])
        for i, ((mode, exit_), after) in enumerate(zip(itinerary, following, strict=True))
    ]
    interior, joint, tests = _margins(
        model, itinerary, inside, ending, bool(domains), holds, entries
    )
    exits = [_exit_surface(i, exit_, holds) for i, (_, exit_) in enumerate(itinerary)]
    held = {hold.segment: hold for hold in holds}
    symmetry = model.symmetry
    closure = symmetry.array() if half and symmetry else np.eye(len(model.states))
    still = conserved(model, itinerary)
    datum = kept_by(closure, still)
    layout = Layout(
        modes=np.array([model.mode_index[mode] for mode, _ in itinerary], dtype=np.int64),
        exits=np.array([model.surface_index[exit_] for exit_ in exits], dtype=np.int64),
        observables=_surface_observables(model),
        exit_signs=np.array(
            [_exit_sign(model, i, inside[i], exit_, holds) for i, exit_ in enumerate(exits)]
        ),
        interior=interior,
        joint=joint,
        labels=_label_rows(model, itinerary, half, bool(domains), holds),
        pins=np.array([_pin(held.get(i), surfaces) for i in range(len(itinerary))], dtype=np.int64),
        **beginnings(model, itinerary, exits, joints, held),
        lasting=np.array([i for i, _ in lasting_segments(itinerary, holds)], dtype=np.int64),
        held=np.array([hold.segment for hold in holds], dtype=np.int64),
        doubles=_rows(
            [
                (tests.index(t), i)
                for t, i in double_zeros(model, itinerary, half, holds)
                if t in tests
            ],
            2,
        ),
        closure=closure,
        closing=closure + datum.T @ datum,
        conserved=still,
        turn=_turn(model, periods, half),
        # a shift in time is no disturbance of an autonomous orbit
        rank=min(model.mode_by_name[mode].rank for mode, _ in itinerary)
        - int(model.autonomous)
        - len(still),
        rounding=model.rounding,
    )
    return System(model, itinerary, periods, half, layout, tests, domains, holds)


made_of(System, lambda s: (s.model, s.itinerary, s.periods, s.half, s.domains), build_system)


def _turn(model: Model, periods: int, half: bool) -> float:
    if model.autonomous:
        return 0.0
    return float(periods * (model.symmetry.fraction if half and model.symmetry else 1.0))


def following_modes(model: Model, itinerary: Itinerary, half: bool) -> list[str]:
    """Return the mode after each segment of a turn; behind half an orbit it is the image of the first."""
    first = mirror_mode(model)[itinerary[0][0]] if half else itinerary[0][0]
    return [*(mode for mode, _ in itinerary[1:]), first]


def _segment_domains(
    model: Model, mode: str, surface: str, after: str, given: tuple[str, ...]
) -> tuple[str, ...]:
    """Domains in which the segment may end."""
    if given:
        return given
    if is_hold(surface):
        return mode_domains(model, mode)
    found = exit_domains(model, mode, surface, after)
    if not found:
        raise ValueError(f"no domain of {mode} leads through {surface} into {after}")
    return found


def _leads_to(index: int, after: str, holds: tuple[Hold, ...]) -> str:
    """Mode that a segment leads to by the transitions: after a hold, but where rest is touched (GS).

    The load at a stop on a surface falls: the slide comes from beyond it, where it would reverse.
    """
    for hold in holds:
        if hold.segment == index + 1 and (hold.after_rest or hold.pin is not None):
            return hold.departs
    return after


def _exit_surface(index: int, exit_: str, holds: tuple[Hold, ...]) -> str:
    return next((hold.leaves for hold in holds if hold.segment == index), exit_)


def _pin(hold: Hold | None, surfaces: list[str]) -> int:
    if hold is None:
        return NO_PIN
    return TOUCH_PIN if hold.pin is None else surfaces.index(hold.pin)


def _exit_sign(
    model: Model, index: int, inside: tuple[str, ...], surface: str, holds: tuple[Hold, ...]
) -> float:
    """Sign of the rate of the observable where the exit surface is met from inside."""
    for hold in holds:
        if hold.segment == index:  # it is left to the side on which the departing mode lies
            return float(model.domain_by_name[mode_domains(model, hold.departs)[0]].signs[surface])
        if hold.segment == index + 1 and hold.pin is None:
            return 0.0
    sign = model.domain_by_name[inside[0]].signs[surface]
    return float(-sign)


def _surface_observables(model: Model) -> IntArray:
    return np.array([model.observable_index[s.observable] for s in model.surfaces], dtype=np.int64)


def _margins(
    model: Model,
    itinerary: Itinerary,
    inside: list[tuple[str, ...]],
    ending: list[dict[str, int]],
    full: bool,
    holds: tuple[Hold, ...],
    entries: list[tuple[int, ...]],
) -> tuple[IntArray, IntArray, tuple[EventFunction, ...]]:
    names = [s.name for s in model.surfaces]
    interior: list[tuple[int, ...]] = []
    joint: list[tuple[int, ...]] = []
    pinned = {(h.segment - 1, h.pin) for h in holds}
    for i, (mode, exit_) in enumerate(itinerary):
        own = model.chatter_by_mode.get(mode)
        if own is not None and not own.other:  # its flights stay on their side of the wall
            side = inside_sign(model, own.flight, own.surface)
            interior.append((i, model.surface_index[own.surface], side))
        for surface in names if full else mode_bounds(model)[mode]:
            sign = (
                model.domain_by_name[inside[i][0]].signs[surface]
                if full
                else inside_sign(model, mode, surface)
            )
            if sign != 0 and surface not in model.wraps:
                interior.append((i, model.surface_index[surface], sign))
        for surface in names:
            sign = ending[i].get(surface, 0)
            if sign == 0 or surface == exit_ or (i, surface) in pinned:
                continue
            joint.append((i, model.surface_index[surface], sign, 0))
    tests = (
        *(EventFunction(Margin.INTERIOR, i, names[k]) for i, k, _ in interior),
        *(
            EventFunction(Margin.EXIT, i, _exit_surface(i, exit_, holds))
            for i, (_, exit_) in enumerate(itinerary)
        ),
        *(EventFunction(Margin.JOINT, i, names[k]) for i, k, *_ in joint),
        *(EventFunction(Margin.ENTRY, i, names[k]) for i, k, *_ in entries),
        *(
            EventFunction(Margin.LASTING, i, surface)
            for i, surface in lasting_segments(itinerary, holds)
        ),
        *(EventFunction(Margin.HELD, h.segment, h.leaves) for h in holds),
    )
    return _rows(interior), _rows([*joint, *entries], 4), tests


def _rows(rows: list[tuple[int, ...]], width: int = 3) -> IntArray:
    return np.array(rows, dtype=np.int64).reshape(len(rows), width)


def _label_rows(
    model: Model, itinerary: Itinerary, half: bool, full: bool, holds: tuple[Hold, ...]
) -> IntArray:
    """Segments and observables whose surfaces are transparent there, and where they start and end."""
    if full or model.composed:  # what bounds no mode has no side there
        return _rows([], 4)
    surfaces = [s.name for s in model.surfaces]
    rows: list[tuple[int, ...]] = []
    joints = joints_before(model, itinerary, half)
    for i, ((mode, exit_), entry) in enumerate(zip(itinerary, joints, strict=True)):
        for c, observable in enumerate(model.observables):
            clear = [
                s.name
                for s in model.surfaces
                if s.observable == observable.name
                and s.name != model.phase
                and inside_sign(model, mode, s.name) == 0
            ]
            if clear and not model.mode_by_name[mode].sliding:
                pin = next((h.pin for h in holds if h.segment == i + 1), exit_)
                on = _landed(model, entry, c)
                rows.append((i, c, *(_place(model, s, c, surfaces) for s in (on, pin))))
    return _rows(rows, 4)


def _landed(model: Model, joint: tuple[str, str], c: int) -> str | None:
    """Return the surface of observable c that a segment begins on, after a reset; else that of its entry."""
    reset = model.reset_at(*joint)
    if reset is None:
        return joint[1]
    own = model.observables[c].name
    return next((s for s in reset.lands if model.surface_by_name[s].observable == own), None)


def _place(model: Model, surface: str | None, c: int, surfaces: list[str]) -> int:
    """Return the index of a surface if it is one of observable c, else -1."""
    if surface is None or is_hold(surface):
        return -1
    own = model.surface_by_name[surface].observable == model.observables[c].name
    return surfaces.index(surface) if own else -1
