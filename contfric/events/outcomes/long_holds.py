"""Holds that last while other contacts change their states: what follows where one begins, ends, or grows.

Such a hold is several in a row (``docs/bridges.md``): each but the first is pinned to the surface that
another contact meets where it begins, and each but the last ends there.

=========================================  =============================================================
event                                      edit of the itinerary
=========================================  =============================================================
CS, another contact changes as one is      the hold goes on in the next mode; instead of the slide up to
let go                                     that change
CS, the last hold has no length            it is dropped: the slide begins earlier, up to that change
CS, another contact changes as one begins  the two change in the other order: the hold begins in the
to be held                                 mode before it, or after it
the last hold meets its limit              all are sticks
=========================================  =============================================================
"""

from __future__ import annotations

from contfric.base.arrays import FloatArray
from contfric.bvp.holds import Hold
from contfric.bvp.system import EventFunction, Margin
from contfric.errors import NotationError
from contfric.events.local.jumps import leaving_rate
from contfric.events.local.zero_acceleration import first_zero_acceleration, touch_of
from contfric.models.definition import Model
from contfric.orbit.canonical.slides import time_unit
from contfric.orbit.orbit import Orbit
from contfric.signature.edits import Edit
from contfric.signature.holds import (
    departing_on,
    following_rests,
    hold_at,
    is_hold,
    left_surface,
    of_another,
    pinned_surface,
)

#: What is met at the same time is that far apart at most (as a share of the time unit): a slide of no length
#: between is known to the root of the accuracy of an event.
_AT_ONCE = 1e-3

Joints = dict[tuple[int, int], FloatArray]


def hold_in(orbit: Orbit, segment: int) -> Hold:
    """Return the hold that a segment of a whole orbit is."""
    own = segment % len(orbit.itinerary)
    return next(hold for hold in orbit.system.holds if hold.segment == own)


def parts_of(orbit: Orbit, h: int) -> list[int]:
    """Return the segments of all holds that one in several modes consists of, in their order."""
    first = last = h
    while is_hold(orbit.itinerary[first - 1][1]):
        first -= 1
    while last + 1 < len(orbit.itinerary) and is_hold(orbit.itinerary[last + 1][1]):
        last += 1
    return list(range(first, last + 1))


def goes_on(orbit: Orbit, h: int, surface: str) -> tuple[Edit, Joints, str]:
    """Return the edit where another contact meets a surface as a hold ends: it goes on in the next mode.

    Raises
    ------
    NotationError
        If the slide after it does not end there at once, or nothing can be held after that.
    """
    itinerary, model, hold = orbit.itinerary, orbit.model, hold_in(orbit, h)
    count, mode = len(itinerary), itinerary[h][0]
    slide = (h + 1) % count
    if itinerary[slide][1] != surface or orbit.durations[slide] > _AT_ONCE * time_unit(orbit):
        raise NotationError(
            f"{surface} is met where hold {h + 1} ends, and not by the slide after it"
        )
    on = _held_in(model, mode, surface, hold, itinerary[(h + 2) % count][0])
    edit = Edit(frozenset({slide}), {}, {h: ((on, hold_at(surface)),)})
    reason = f"hold {h + 1} goes on as {surface} is met"
    return edit, {(h, 0): orbit.ends[h]}, reason


def _held_in(model: Model, mode: str, surface: str, hold: Hold, after: str) -> str:
    """Return the rest through another contact's surface that is left into a mode, as a hold would be."""
    for on in following_rests(model, mode, surface, hold.leaves):
        try:
            if departing_on(model, hold.departs, hold.leaves, on) == model.whole_mode(after):
                return on
        except NotationError:
            continue
    raise NotationError(f"no rest after '{mode}' at {surface} is left into '{after}'")


def shortened(orbit: Orbit, hold: Hold) -> tuple[Edit, Joints, str]:
    """Return the edit where a part of a hold in several modes has no length.

    Raises
    ------
    NotationError
        If it is not the first or the last one: two other contacts change at once.
    """
    if hold.until is None:
        return ends_earlier(orbit, hold.segment)
    if not hold.follows:
        return begins_later(orbit, (hold.segment - 1) % len(orbit.itinerary))
    raise NotationError(f"{hold.pin} and {hold.until} are met at once in hold {hold.segment + 1}")


def ends_earlier(orbit: Orbit, h: int) -> tuple[Edit, Joints, str]:
    """Return the edit where the last part of a hold has no length: a slide up to the same surface."""
    before, surface = hold_in(orbit, h - 1), str(pinned_surface(orbit.itinerary[h][1]))
    edit = Edit(frozenset({h}), {}, {h: ((before.departs, surface),)})
    reason = f"hold {h} is left before {surface} is met"
    return edit, {(h, 0): orbit.begins[h]}, reason


def at_beginning(orbit: Orbit, location: EventFunction) -> tuple[Edit, Joints, str] | None:
    """Return what follows where a hold begins as another contact changes; None if none begins there."""
    i, count = location.segment, len(orbit.itinerary)
    if location.margin is Margin.LASTING:
        i = (i - 1) % count  # the stick up to the touch at which the hold begins
    elif location.margin is not Margin.JOINT:
        return None
    following = [orbit.itinerary[(i + k) % count] for k in (1, 2)]
    short = orbit.durations[(i + 1) % count] < _AT_ONCE * time_unit(orbit)
    if count < 4 or not short or not is_hold(following[1][1]):
        return None
    if is_hold(following[0][1]):
        met = following[1][1] == hold_at(location.surface)
        return begins_later(orbit, i) if met else None
    own = (
        following[0][1] == location.surface
        and orbit.itinerary[i][1] != hold_in(orbit, i + 2).leaves
    )
    return begins_earlier(orbit, i) if own else None


def begins_later(orbit: Orbit, i: int) -> tuple[Edit, Joints, str]:
    """Return the edit where the first part of a hold has no length: the other contact changes before it.

    Parameters
    ----------
    i : the segment before the hold
    """
    itinerary, model = orbit.itinerary, orbit.model
    near = [(i + k) % len(itinerary) for k in range(3)]
    (mode, exit_), (rest, pin), (on, met) = (itinerary[k] for k in near)
    surface = str(pinned_surface(met))
    for between in _modes_between(model, mode, surface, exit_, on, stick=mode == rest):
        edit = Edit(frozenset(near[1:]), {i: surface}, {i: ((between, exit_), (on, pin))})
        joints = {(i, k): orbit.ends[i] for k in range(2)}
        return edit, joints, f"{surface} is met before hold {i + 2} begins"
    raise NotationError(f"{surface} and {exit_} are met at once, and do not change places there")


def begins_earlier(orbit: Orbit, i: int) -> tuple[Edit, Joints, str]:
    """Return the edit where a hold begins as another contact changes just before: it begins before that.

    Parameters
    ----------
    i : the segment at whose end the other contact changes; after one without length the hold follows
    """
    itinerary, model = orbit.itinerary, orbit.model
    near = [(i + k) % len(itinerary) for k in range(3)]
    (mode, surface), (between, exit_), (on, pin) = (itinerary[k] for k in near)
    hold = hold_in(orbit, near[2])
    rests = [mode] if between == on else _through(model, mode, exit_)
    for rest in rests:
        if model.lies_on(rest, hold.leaves) and on in _through(model, rest, surface):
            held = ((rest, pin), (on, hold_at(surface)))
            edit = Edit(frozenset(near[1:]), {i: exit_}, {i: held})
            joints = {(i, k): orbit.ends[i] for k in range(2)}
            return edit, joints, f"hold {i + 3} begins before {surface} is met"
    raise NotationError(f"{surface} and {exit_} are met at once, and do not change places there")


def _through(model: Model, mode: str, surface: str) -> list[str]:
    """Return the modes that a mode may be left to through a surface."""
    domains = model.domains_of(model.whole_mode(mode))
    targets = [t for d in domains for t in model.targets.get((d.name, surface), ())]
    return list(dict.fromkeys(model.domain_by_name[t].mode for t in targets))


def _modes_between(
    model: Model, mode: str, surface: str, exit_: str, on: str, stick: bool
) -> list[str]:
    """Return modes from which a rest is come to at an exit, after a surface was met first."""
    found = _through(model, mode, surface)
    return [m for m in found if (m == on if stick else on in _through(model, m, exit_))]


def as_sticks(orbit: Orbit, h: int, surface: str, *gone: int) -> Edit:
    """Return the edit that makes a hold up to its part ``h`` the sticks that it stands for.

    The last of them is released at the surface given; other segments are dropped.
    """
    itinerary = orbit.itinerary
    parts = [k for k in parts_of(orbit, h) if k <= h]
    ends = [*(str(pinned_surface(itinerary[k][1])) for k in parts[1:]), surface]
    if hold_in(orbit, parts[0]).after_rest:  # one stick with the one before it
        before = (parts[0] - 1) % len(itinerary)
        renamed = {before: ends[0], **dict(zip(parts[1:], ends[1:], strict=True))}
        return Edit(frozenset({parts[0], *gone}), renamed)
    return Edit(frozenset(gone), dict(zip(parts, ends, strict=True)))


def least_held(orbit: Orbit, hold: Hold) -> FloatArray:
    """Return the joint at which a hold could just not be left, inside of it.

    Raises
    ------
    NotationError
        If it is its end, where another contact changes.
    """
    mode, departs = orbit.itinerary[hold.segment][0], hold.departs
    touch = touch_of(orbit, hold.segment, None)
    if hold.until is not None:
        inside, last = (
            leaving_rate(orbit, mode, departs, z) for z in (touch, orbit.ends[hold.segment])
        )
        if last <= inside:
            raise NotationError(
                f"hold {hold.segment + 1} cannot be left just as {hold.until} is met"
            )
    return touch


class Rest:
    """A rest of one contact from a segment on, through the modes of others, until it is let go."""

    def __init__(self, orbit: Orbit, i: int, start: float, departs: str) -> None:
        self.orbit = orbit
        self.parts = [i]
        #: Modes in which a hold in the parts would be left.
        self.departs = [departs]
        #: The joint in the last part at which it can be left no more; None if it is released before that.
        self.still: FloatArray | None = None
        model, itinerary = orbit.model, orbit.itinerary
        leaves = left_surface(model, itinerary[i][0], departs)
        while True:
            k = self.parts[-1]
            self.still = first_zero_acceleration(orbit, k, start, self.departs[-1])
            mode, exit_ = itinerary[k]
            if self.still is not None or not of_another(model, mode, exit_, leaves):
                break
            following = (k + 1) % len(itinerary)
            if following == i or is_hold(itinerary[following][1]):
                raise NotationError(
                    f"the rest of segment {i + 1} lasts while another contact is held, or for ever"
                )
            self.departs.append(
                departing_on(model, self.departs[-1], leaves, itinerary[following][0])
            )
            self.parts.append(following)
            start = float(orbit.cycle[following, 0])
        self.leaves = leaves

    @property
    def further(self) -> dict[int, str]:
        """The exits of the parts after the first as parts of a hold."""
        itinerary = self.orbit.itinerary
        return {k: hold_at(itinerary[k - 1][1]) for k in self.parts[1:]}
