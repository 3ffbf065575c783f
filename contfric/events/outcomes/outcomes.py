"""Outcomes of a sliding event at one location of an orbit: the edit of its itinerary, and the reason.

The solution at the event is known, so the local structure of each outcome can be derived from it
(``docs/bridges.md``). It needs the itinerary, the transitions and the flow; nothing knows what moves.

=====================================  ========================================================
event, at the location                 outcome
=====================================  ========================================================
CS, the state at a stop meets F        swap stick and reversal (a stick of length zero)
CS, two contacts change at once        they change in the other order
SS, followed by a reversal             insert a hold of length zero, pinned to F
SS, followed by a stick                the stick becomes a hold pinned to F
GS, an impact is grazed inside         split it there: an impact of speed zero
the same, and it changes the mode      split it there: two of them, with no time between
GS, an impact has no speed any more    drop it: the segment goes on
AS, a stick is released tangentially   insert a hold of length zero after it
AS, a stick touches F inside           split it there: a hold goes on
GS, a slide touches rest inside        split it there: insert a hold of length zero
the same, and nothing jumps            split it there: insert a stick of length zero
GS, a slide stops tangentially         the stick after it becomes a hold
a hold has no length any more          drop it: the regular orbit with the earlier outcome
a hold reaches its regular release     it becomes a stick: the regular orbit with the later outcome
a hold is left without acceleration    the slide after it is gone: the stick after that takes over
a hold touches F on its way            its pin moves to the touch
the stick up to that touch vanishes    the hold is pinned to the stop
a hold can just not be left inside     split it there: a slide and a second hold
=====================================  ========================================================

Where a stick becomes a hold, the hold lasts to the release, unless before that it cannot be left any
more: there it ends, with a slide of length zero, and the rest of the stick follows. Other contacts may change
their states meanwhile (:mod:`contfric.events.outcomes.long_holds`).

Nothing can be held where rest is left without acceleration (static and kinetic limit agree, as in a system
of Filippov): rest whose load touches its limit slips there for no time, and a slide that touches rest sticks
there for no time (:mod:`contfric.events.outcomes.standing_slides`). Where nothing else is known,
:mod:`contfric.events.incident.from_simulation` lets the flow itself say what follows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from contfric.base.arrays import FloatArray
from contfric.bvp.system import EventFunction, Margin
from contfric.errors import NotationError
from contfric.events.bifurcation import Kind
from contfric.events.local.holdable import (
    NoJump,
    check_held,
    check_inside,
    leaves_smoothly,
    rest_mode,
    vanishes_with,
)
from contfric.events.local.touching import chosen_at, crossed_at, entered_at
from contfric.events.local.zero_acceleration import (
    touch_of,
    touches_again,
)
from contfric.events.outcomes import long_holds
from contfric.events.outcomes import standing_slides as slides
from contfric.events.outcomes.contact_outcomes import continuous_edit, exchanged, modes_through
from contfric.events.outcomes.grazing_impacts import grazing_impact, impact_at_joint
from contfric.models.definition import Model
from contfric.orbit.canonical.slides import time_unit
from contfric.orbit.orbit import Orbit
from contfric.signature.edits import Edit, drop, insert, split, swap_edit
from contfric.signature.holds import TOUCH, ends_rest, hold_at, is_hold, of_another, release_mode

#: A hold this short has no length: an event is located to about 1e-12, at a tangency to its root.
NO_LENGTH = 1e-6
#: The same for a hold at a touch of rest, which is left with an acceleration that grows from zero: what it
#: does to the orbit is the square of its length, so that it is located to the root.
NO_LENGTH_AT_TOUCH = 1e-4
#: A slide between two holds vanishes with a double zero: it is located to the root of that.
NEARLY_NO_LENGTH = 1e-3

#: A slide of length zero appears where the acceleration a that a rest is left with falls through zero,
#: ``a = -k t``: it lasts from -d/2 to d/2, as ``v = k (d^2/4 - t^2) / 2`` vanishes there.
_APPEARS = (-0.5, 0.5)
#: Where a has a double zero, ``a = k (t^2 - w^2) / 2``, a slide that is left at -2w touches rest at w.
_APPEARS_TOUCHING = (-2.0, 1.0)
#: Where the segments of an edited itinerary come from, as :func:`contfric.signature.edits.edited_pieces`
#: says.
Origin = tuple[int, int]


class RestsForEver(NotationError):
    """Nothing follows an event because nothing moves any more."""


@dataclass(frozen=True)
class Successor:
    """What follows at one location: one of the outcomes there.

    Attributes
    ----------
    edit : the change of the itinerary
    joints : start joints of the segments that come in or move, by their origin
    reason : what happens, in words
    away : where the new orbit is singular at the event itself, how fast its joints move in time when it
        leaves: where a slide of length zero appears in a rest, and where a hold is left without
        acceleration
    """

    edit: Edit
    joints: Mapping[Origin, FloatArray]
    reason: str
    away: Mapping[Origin, float] = field(default_factory=dict)


def outcome_at(orbit: Orbit, location: EventFunction, kind: Kind) -> Successor:
    """Return what can follow at one location of a whole orbit.

    Raises
    ------
    NotationError
        If nothing can: the reason says why.
    """
    mode, exit_ = orbit.itinerary[location.segment]
    if is_hold(exit_):
        return _hold_ends(orbit, location)
    if reset := chosen_at(orbit.system, location):
        raise NotationError(f"at '{reset}' another mode is chosen: nothing lies between the two")
    if entered := entered_at(orbit.system, location):
        raise NotationError(
            f"a touch of {location.surface} leads into '{entered}' for good: no orbit is near"
        )
    if location.margin is Margin.ENTRY:
        raise NotationError(
            f"another mode follows the impact before segment {location.segment + 1}"
        )
    if location.margin is Margin.JOINT and orbit.model.reset_at(mode, location.surface) is not None:
        return Successor(*impact_at_joint(orbit, location))
    if (orbit.model.composed and orbit.model.filippov) or crossed_at(orbit, location):
        edit, joints, away, reason = continuous_edit(orbit, location)
        return Successor(edit, joints, reason, away)
    if (held := long_holds.at_beginning(orbit, location)) is not None:
        return Successor(*held)
    if kind is Kind.CS:
        return _two_at_once(orbit, location.segment, location.surface)
    if kind is Kind.SS:
        return _stop_on_surface(orbit, location)
    if orbit.model.reset_at(mode, location.surface) is not None:
        return Successor(*grazing_impact(orbit, location))
    if location.margin is Margin.JOINT:
        raise NoJump(f"{location.surface} is touched at a section: nothing can be held there")
    if location.margin is Margin.LASTING:
        return _pinned_at_stop(orbit, location)
    rests, ends = ends_rest(orbit.model, mode, location.surface), location.margin is Margin.EXIT
    if rests:
        return _released_tangentially(orbit, location) if ends else _limit_touched(orbit, location)
    return _stops_tangentially(orbit, location) if ends else _rest_touched(orbit, location)


def _two_at_once(orbit: Orbit, i: int, surface: str) -> Successor:
    """CS: a surface is met where a segment ends, by the contact that stops there or by another one."""
    if modes_through(orbit.model, orbit.itinerary[i][0], surface):
        edit, reason = exchanged(orbit, i, surface)
    else:
        edit = swap_edit(orbit.itinerary, {i: surface}, orbit.model)
        reason = f"swap stick and reversal at stop {i + 1}, at {surface}"
    return Successor(edit, {(i, 0): orbit.ends[i]}, reason)


def _stop_on_surface(orbit: Orbit, location: EventFunction) -> Successor:
    """SS: the stop is on a surface, and the load falls."""
    model, itinerary, i = orbit.model, orbit.itinerary, location.segment
    j = (i + 1) % len(itinerary)
    if slides.goes_nowhere(orbit, j):
        return Successor(*slides.left_out(orbit, j))
    rest = rest_mode(orbit, i, itinerary[i][1])
    departs = release_mode(model, rest, location.surface)
    rests = model.lies_on(itinerary[j][0], itinerary[i][1])
    if rests and departs is not None and slides.turns_back(orbit, i, location.surface):
        return Successor(*slides.slip_at_stop(orbit, i, rest, departs))
    check_held(orbit, rest, departs, orbit.ends[i])
    if rests:
        return _stick_becomes_hold(orbit, j, hold_at(location.surface), location.surface)
    edit = insert(i, (rest, hold_at(location.surface)))
    reason = f"hold at stop {i + 1}, on {location.surface}, instead of the reversal"
    return Successor(edit, {(i, 0): orbit.ends[i]}, reason)


def _stops_tangentially(orbit: Orbit, location: EventFunction) -> Successor:
    """GS: a stop without acceleration."""
    itinerary, i = orbit.itinerary, location.segment
    j = (i + 1) % len(itinerary)
    rest_mode(orbit, i, itinerary[i][1])
    if not orbit.model.lies_on(itinerary[j][0], itinerary[i][1]):
        raise NotationError(f"the tangential stop of segment {i + 1} is followed by no stick")
    if slides.only_touches(orbit, j):
        return Successor(*slides.touch_alone(orbit, j))
    check_inside(orbit, itinerary[j][0], orbit.ends[i])
    return _stick_becomes_hold(orbit, j, TOUCH, None)


def _released_tangentially(orbit: Orbit, location: EventFunction) -> Successor:
    """AS: a stick is released where its load just reaches the limit."""
    i, (mode, exit_) = location.segment, orbit.itinerary[location.segment]
    if slides.only_touches(orbit, i + 1):
        return Successor(*slides.touch_alone(orbit, (i + 1) % len(orbit.itinerary)))
    check_held(orbit, mode, release_mode(orbit.model, mode, exit_), orbit.ends[i])
    edit = insert(i, (mode, TOUCH))
    reason = f"hold after the tangential release of stick {i + 1} at {orbit.itinerary[i][1]}"
    return Successor(edit, {(i, 0): orbit.ends[i]}, reason)


def _pinned_at_stop(orbit: Orbit, location: EventFunction) -> Successor:
    """AS: the stick up to a touch of the limit has shrunk to nothing, at a stop on the limit."""
    i, surface = location.segment, orbit.itinerary[location.segment][1]
    edit = Edit(frozenset({i}), {(i + 1) % len(orbit.itinerary): hold_at(surface)})
    return Successor(edit, {}, f"stick {i + 1} vanishes: the hold after it starts at the stop")


def _limit_touched(orbit: Orbit, location: EventFunction) -> Successor:
    """AS: inside of a stick its load touches the limit."""
    model, itinerary, i = orbit.model, orbit.itinerary, location.segment
    mode = itinerary[i][0]
    touch = touch_of(orbit, i, location.surface)
    departs = _released(model, mode, location.surface)
    if leaves_smoothly(orbit, mode, departs):
        return Successor(*slides.slip_at_touch(orbit, i, location.surface, departs, touch))
    check_held(orbit, mode, departs, touch)
    reason = f"hold after the touch of {location.surface} in stick {i + 1}"
    if _touched_before(orbit, location):
        raise NotationError(
            f"{reason}: its equal was touched before, and what is left of it slides"
        )
    rest = long_holds.Rest(orbit, i, float(touch[0]), departs)
    return _held_through(orbit, rest, location.surface, ((mode, TOUCH),), {(i, 0): touch}, reason)


def _held_through(
    orbit: Orbit,
    rest: long_holds.Rest,
    first: str,
    pairs: tuple[tuple[str, str], ...],
    joints: dict[Origin, FloatArray],
    reason: str,
) -> Successor:
    """Return the outcome in which a rest, or the rest of it, is held until it is released, or cannot be left.

    Parameters
    ----------
    first : new exit of its first segment
    pairs : what comes after that: the hold, if it begins inside
    """
    itinerary, k = orbit.itinerary, rest.parts[-1]
    mode, exit_ = itinerary[k]
    renamed, inserted = {rest.parts[0]: first, **rest.further}, {rest.parts[0]: pairs}
    if rest.still is not None:
        at, left = len(inserted.get(k, ())), (rest.departs[-1], rest.leaves)
        inserted[k] = (*inserted.get(k, ()), left, (mode, exit_))
        joints = {**joints, (k, at): rest.still, (k, at + 1): rest.still}
        away = {(k, at): _APPEARS[0], (k, at + 1): _APPEARS[1]}
        return Successor(Edit(frozenset(), renamed, inserted), joints, reason, away)
    _same_way(orbit, mode, exit_, rest.departs[-1])
    following = (k + 1) % len(itinerary)
    # one that ended tangentially was held from there on: that hold begins earlier
    gone = frozenset({following}) if is_hold(itinerary[following][1]) else frozenset[int]()
    return Successor(Edit(gone, renamed, inserted), joints, reason)


def _touched_before(orbit: Orbit, location: EventFunction) -> bool:
    """Tell whether a stick touches the limit at which a hold before it began, after a slide of no length.

    The load has maxima of equal height. The slide moves away from the limit: beyond the event the second one
    is below it, and nothing is held there.
    """
    i, itinerary = location.segment, orbit.itinerary
    slid = orbit.durations[i - 1] < NEARLY_NO_LENGTH * time_unit(orbit)
    touched = itinerary[i - 2][1] == TOUCH and itinerary[i - 3][1] == location.surface
    return bool(len(itinerary) > 3 and slid and touched)


def _rest_touched(orbit: Orbit, location: EventFunction) -> Successor:
    """GS: inside of a slide the velocity touches zero."""
    i = location.segment
    mode, exit_ = orbit.itinerary[i]
    touch = touch_of(orbit, i, location.surface)
    rest = rest_mode(orbit, i, location.surface)
    if leaves_smoothly(orbit, rest, mode):
        return Successor(*slides.stick_at_touch(orbit, i, location.surface, rest, touch))
    check_inside(orbit, rest, touch)
    edit = split(i, location.surface, (rest, TOUCH), (mode, exit_))
    reason = f"hold at the touch of rest in slide {i + 1}"
    return Successor(edit, {(i, 0): touch, (i, 1): touch}, reason, {(i, 1): 1.0})


def _stick_becomes_hold(orbit: Orbit, j: int, hold: str, surface: str | None) -> Successor:
    """Return the outcome in which a stick that begins at the event is a hold."""
    departs = (
        orbit.itinerary[j - 1][0]
        if surface is None
        else _released(orbit.model, orbit.itinerary[j][0], surface)
    )
    rest = long_holds.Rest(orbit, j, float(orbit.cycle[j, 0]), departs)
    return _held_through(orbit, rest, hold, (), {}, f"hold instead of stick {j + 1}")


def _released(model: Model, mode: str, surface: str) -> str:
    """Return the mode that a stick is released to through a surface.

    The limit of a load that contacts share has a name for what the others do. Where one of them changes its
    state at the event itself, the stick has another limit than that which is met.
    """
    found = release_mode(model, mode, surface)
    if found is None:
        raise NotationError(
            f"'{mode}' is not released through {surface}: nothing can be held there"
        )
    return found


def _hold_ends(orbit: Orbit, location: EventFunction) -> Successor:
    """Return what follows where a hold comes to an end of its freedom."""
    h, itinerary = location.segment, orbit.itinerary
    hold, before, following = long_holds.hold_in(orbit, h), h - 1, (h + 1) % len(itinerary)
    at_touch = itinerary[h][1] == TOUCH
    no_length = NO_LENGTH_AT_TOUCH if at_touch and not hold.after_rest else NO_LENGTH
    if orbit.durations[h] < no_length * time_unit(orbit) and vanishes_with(orbit, location):
        if hold.follows or hold.until is not None:
            return Successor(*long_holds.shortened(orbit, hold))
        reason = f"hold {h + 1} vanishes"
        if at_touch and not hold.after_rest:  # the slide goes on
            return Successor(*slides.runs_on(orbit, before % len(itinerary), h, following), reason)
        return Successor(drop(h), {}, reason)
    if location.surface != hold.leaves and of_another(
        orbit.model, itinerary[h][0], location.surface, hold.leaves
    ):
        if location.margin is Margin.JOINT and hold.until is None:
            return Successor(*long_holds.goes_on(orbit, h, location.surface))
        raise NotationError(f"{location.surface} is touched in hold {h + 1}, by another contact")
    if location.margin is Margin.JOINT:
        if hold.until is not None:
            raise NotationError(f"hold {h + 1} is at its limit just as {hold.until} is met")
        reason = f"hold {h + 1} lasts to its regular release at {location.surface}"
        return Successor(long_holds.as_sticks(orbit, h, location.surface), {}, reason)
    if location.margin is Margin.EXIT:
        return _never_left(orbit, h)
    if location.margin is Margin.INTERIOR:
        return _pin_moves(orbit, location, hold.after_rest)
    gone = orbit.durations[following] < NEARLY_NO_LENGTH * time_unit(orbit)
    # a second hold, and the slide between them
    if gone and hold.until is None and itinerary[(h + 2) % len(itinerary)][1] == TOUCH:
        return _never_left(orbit, h)
    touch = long_holds.least_held(orbit, hold)
    left = (hold.departs, hold.leaves)
    reason = f"hold {h + 1} cannot be left inside: a slide and a second hold"
    edit = insert(h, left, (itinerary[h][0], TOUCH))
    away = {(h, 0): _APPEARS_TOUCHING[0], (h, 1): _APPEARS_TOUCHING[1]}
    return Successor(edit, {(h, 0): touch, (h, 1): touch}, reason, away)


def _never_left(orbit: Orbit, h: int) -> Successor:
    """Return the outcome where the slide after a hold has vanished: the rest after it takes over."""
    itinerary, count = orbit.itinerary, len(orbit.itinerary)
    slide, rest = (h + 1) % count, (h + 2) % count
    if not orbit.model.lies_on(itinerary[rest][0], itinerary[slide][1]):
        raise NotationError(f"the slide after hold {h + 1} vanishes, and no rest follows it")
    reason = f"the slide after hold {h + 1} vanishes: it is held"
    if rest in (h, (h - 1) % count):
        raise RestsForEver(f"{reason} for ever: nothing else moves in a period")
    if itinerary[rest][1] == TOUCH:  # two holds become one
        return Successor(drop(slide, rest), {}, reason)
    edit = long_holds.as_sticks(orbit, h, itinerary[rest][1], slide, rest)
    return Successor(edit, {}, reason)


def _pin_moves(orbit: Orbit, location: EventFunction, after_rest: bool) -> Successor:
    """Return the outcome where a hold touches its limit: a stick to there, and the hold after it."""
    h = location.segment
    touch = touch_of(orbit, h, location.surface)
    reason = f"hold {h + 1} touches {location.surface}: its pin moves there"
    if after_rest:
        if touches_again(orbit, h, location.surface, float(orbit.cycle[h, 0])):
            raise NotationError(f"{reason}: the same orbits, for the load has equal maxima")
        edit = Edit(renamed={(h - 1) % len(orbit.itinerary): location.surface, h: TOUCH})
        return Successor(edit, {(h, -1): touch}, reason)
    edit = long_holds.as_sticks(orbit, h, location.surface)
    edit = Edit(edit.dropped, edit.renamed, {h: ((orbit.itinerary[h][0], TOUCH),)})
    return Successor(edit, {(h, 0): touch}, reason)


def _same_way(orbit: Orbit, mode: str, exit_: str, departs: str | None) -> None:
    """Check that a stick is released the way in which a hold would be left."""
    released = release_mode(orbit.model, mode, exit_)
    if released != departs:
        raise NotationError(f"the stick is released at {exit_} into '{released}', not '{departs}'")
