"""Segments of zero length in Filippov models: slides that stay in their equilibrium, and mere touches.

Let a spring be the only force on a sliding mass. A slide that starts at a stop where the load exceeds its
limit by w lasts half a natural period, however small w is, and ends where the load is inside the limit by w.
As w goes to zero its margins, and those of the stops at both ends, vanish together, so that rounding decides
which of them is located first. It is one event: at the stop before the slide the load is at its limit (SS).
Without the slide the solution is the same.

A solution that just touches a surface on which it could slide has two forms, with a stick of zero length and
without. Likewise a rest whose load just touches its limit may have a slip of zero length.
"""

from __future__ import annotations

from contfric.base.arrays import FloatArray
from contfric.bvp.system import EventFunction, Margin
from contfric.errors import NotationError
from contfric.events.local.holdable import NO_JUMP, NoJump, leaves_smoothly
from contfric.events.local.jumps import nothing_jumps
from contfric.events.local.touching import rate_along, rate_scale
from contfric.events.outcomes.contact_outcomes import Joints, Speeds
from contfric.orbit.canonical.slides import time_unit
from contfric.orbit.orbit import Orbit
from contfric.signature.edits import Edit, drop, insert, split
from contfric.signature.holds import is_hold, left_surface
from contfric.simulation.starts import signs_at

#: Acceleration below which a slide does not move: where Newton fails just before the event, what is left.
STANDS = 1e-5
#: Sliding from a touch on lasts as the root of how far the touch is beyond the surface, and that is rounding.
_TOUCHES = 1e-4

#: Where a load just exceeds its limit, the acceleration ``k (d^2 - t^2) / 2``, a slip from -d ends at 2d.
_SLIPS = (-1.0, 2.0)
#: Where a slide just passes rest, its velocity ``e - k t^2 / 2``, a stick from -d is left at 0: its load
#: comes back to the limit there, as the acceleration of the slide does.
_STICKS = (-1.0, 0.0)

#: The edit that lets a segment open, its joints, a reason, and how fast the joints move in time then.
Opening = tuple[Edit, Joints, str, Speeds]


def goes_nowhere(orbit: Orbit, i: int, least: float = STANDS) -> bool:
    """Tell whether segment ``i`` is a slide between two stops without acceleration at either of them.

    Accelerations below ``least`` count as zero.
    """
    mode, exit_ = orbit.itinerary[i]
    if is_hold(exit_) or orbit.model.mode_by_name[mode].sliding:
        return False
    at_end = EventFunction(Margin.EXIT, i, exit_)
    if orbit.itinerary[i - 1][1] != exit_ or not nothing_jumps(orbit):
        return False
    if at_end not in orbit.system.tests:
        return False
    left = abs(float(orbit.margins[orbit.system.tests.index(at_end)]))
    return max(left, abs(rate_along(orbit, mode, exit_, orbit.begins[i]))) < least


def left_out(orbit: Orbit, i: int) -> tuple[Edit, Joints, str]:
    """Return the edit that leaves a slide out that goes nowhere, the joints that it moves, and a reason.

    What follows it, a rest inside the limit, begins at the stop before it.
    """
    following = (i + 1) % len(orbit.itinerary)
    reason = f"slide {i + 1} goes nowhere: rest instead"
    stop = orbit.cycle[i].copy()
    if not following:  # the rest that follows begins the orbit
        stop[0] -= orbit.period
    return drop(i), {(following, -1): stop}, reason


def only_touches(orbit: Orbit, j: int) -> bool:
    """Tell whether segment ``j`` moves on a surface for no time, between two of one mode; nothing jumps."""
    itinerary = orbit.itinerary
    j %= len(itinerary)
    lasts = orbit.durations[j]
    before, following = itinerary[j - 1][0], itinerary[(j + 1) % len(itinerary)][0]
    same = orbit.model.whole_mode(before) == orbit.model.whole_mode(following)
    short = bool(lasts < _TOUCHES * time_unit(orbit))
    pairs = (itinerary[j][0], before), (before, itinerary[j][0])
    return same and short and any(leaves_smoothly(orbit, *pair) for pair in pairs)


def touch_alone(orbit: Orbit, j: int) -> tuple[Edit, Joints, str]:
    """Return the edit that makes one segment of two between which motion only touches a surface, and why."""
    count = len(orbit.itinerary)
    reason = f"segment {j + 1} vanishes: its surface is only touched"
    return *runs_on(orbit, (j - 1) % count, j, (j + 1) % count), reason


def runs_on(orbit: Orbit, i: int, *following: int) -> tuple[Edit, Joints]:
    """Return the edit, and its joints, that lets segment ``i`` go on to the end of the last one after it."""
    end = orbit.itinerary[following[-1]]
    if end in orbit.model.sections:  # its mode says from which side it is crossed
        return Edit(frozenset({i, *following}), {}, {i: (end,)}), {(i, 0): orbit.cycle[i]}
    return Edit(frozenset(following), {i: end[1]}), {}


def slip_at_touch(orbit: Orbit, i: int, surface: str, departs: str, touch: FloatArray) -> Opening:
    """Return what lets rest ``i`` slip for no time where its load touches its limit.

    Raises
    ------
    NotationError
        If the rest begins at the touch, after such a slip, or ends at it, before one.
    """
    mode, after = orbit.itinerary[i][0], (i + 1) % len(orbit.itinerary)
    short = _TOUCHES * time_unit(orbit)
    began, ended = touch[0] - orbit.begins[i, 0] < short, orbit.ends[i, 0] - touch[0] < short
    for near, slip, side in ((began, i - 1, "before"), (ended, after, "after")):
        if near and orbit.itinerary[slip][0] == departs and only_touches(orbit, slip):
            raise NotationError(f"the slip {side} stick {i + 1} is at this touch of {surface}")
    inside = departs, left_surface(orbit.model, mode, departs)
    reason = f"slip at the touch of {surface} in stick {i + 1}"
    return _opening(orbit, i, (surface, touch), inside, _SLIPS, reason)


def turns_back(orbit: Orbit, i: int, limit: str) -> bool:
    """Tell whether a rest after stop ``i`` begins at its limit and leaves it at once, where nothing jumps.

    Beyond the limit there is a slide, as long as the load is beyond it. (One whose load is moved by nothing
    else lasts half a natural period, however small it is.)
    """
    rest = orbit.itinerary[(i + 1) % len(orbit.itinerary)][0]
    rate = rate_along(orbit, rest, limit, orbit.ends[i])
    return abs(rate) > STANDS * rate_scale(orbit, rest, limit) and nothing_jumps(orbit)


def slip_at_stop(orbit: Orbit, i: int, rest: str, departs: str) -> Opening:
    """Return what lets rest after stop ``i`` begin with a slide of no length, where it is at its limit.

    The acceleration ``w - k t`` of a slide from a load that is beyond its limit by w falls: it ends at
    ``2 w / k``, where its velocity does.
    """
    inside = departs, left_surface(orbit.model, rest, departs)
    following = (i + 1) % len(orbit.itinerary)
    reason = f"slide at stop {i + 1}, whose load is at its limit, before rest"
    return insert(i, inside), {(i, 0): orbit.ends[i]}, reason, {(following, -1): 1.0}


def stick_at_touch(orbit: Orbit, i: int, surface: str, rest: str, touch: FloatArray) -> Opening:
    """Return what lets slide ``i`` stick for no time where it touches rest.

    Raises
    ------
    NotationError
        If such a stick is at this touch already, or would not be left there.
    """
    model, mode = orbit.model, orbit.model.whole_mode(orbit.itinerary[i][0])
    short = _TOUCHES * time_unit(orbit)
    began, ended = touch[0] - orbit.begins[i, 0] < short, orbit.ends[i, 0] - touch[0] < short
    if (began and only_touches(orbit, i - 1)) or (ended and only_touches(orbit, i + 1)):
        raise NotationError(f"the stick next to slide {i + 1} is at this touch of {surface}")
    signs = signs_at(model, float(touch[0]), touch[1:].copy(), orbit.vector, within=NO_JUMP)
    for domain in model.domains_of(rest):
        for back, target in model.exits_of(domain.name):
            if model.domain_by_name[target].mode == mode and signs[back] == 0:
                reason = f"stick at the touch of rest in slide {i + 1}"
                return _opening(orbit, i, (surface, touch), (rest, back), _STICKS, reason)
    raise NoJump(f"'{rest}' is not left to '{mode}' where slide {i + 1} touches {surface}")


def _opening(
    orbit: Orbit,
    i: int,
    met: tuple[str, FloatArray],
    inside: tuple[str, str],
    lasts: tuple[float, float],
    reason: str,
) -> Opening:
    """Return what puts a segment into segment ``i`` at a touch; it begins and ends there, and opens."""
    (surface, touch), (first, last) = met, lasts
    edit = split(i, surface, inside, orbit.itinerary[i])
    return edit, {(i, 0): touch, (i, 1): touch}, reason, {(i, 0): first, (i, 1): last}
