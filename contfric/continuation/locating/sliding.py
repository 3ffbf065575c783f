"""Sliding events between two points of a branch: the first margin that vanishes, and its group."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.bvp.system import EventFunction, Margin
from contfric.continuation.half_branch import point_before
from contfric.continuation.located_event import bifurcation_at
from contfric.continuation.locating.change_of_sign import locate_change
from contfric.continuation.locating.vanishing_together import nearer_than_twins, with_holds_forward
from contfric.continuation.points import Point, Settings
from contfric.events.bifurcation import ACCURACY, Bifurcation, Kind
from contfric.events.local.jumps import nothing_jumps
from contfric.events.local.touching import is_rate_of
from contfric.events.outcomes.standing_slides import goes_nowhere
from contfric.events.sliding_kinds import bends_outward, hold_of_test, kind_of_margin
from contfric.models.mode_domains import inside_sign
from contfric.orbit.orbit import Orbit
from contfric.signature.holds import ends_rest, is_hold

#: Margins below this at a located event vanish with it: they form a group. Located margins are
#: zero to about 1e-13; distinct events this near are beyond what a diagram can tell apart.
_TOGETHER = 1e-9
#: A margin that has more than this share of its change over a step left, where another one vanishes, vanishes
#: well behind it. Nearer ones are located: where orbits shrink to a point, Newton's method may find another
#: curve there (the parameter was off by 5e-6, with 2 % of the other margin's change left).
_WELL_AFTER = 0.1
#: Newton may fail right after an event (a slide that vanishes, several conditions at once): it is reached
#: where the margin is this small.
_REACHED = 1e-8
#: Where two conditions fail together at an orbit that is symmetric in time (without damping), Newton fails
#: at the root of that: such an event is as good as this, relative to the range.
ROUGHLY_REACHED = 1e-4
#: The same where several holds end at once; what their lengths do to the orbit is the square of it.
_NEARLY_REACHED = 1e-5
#: Accuracy of an event that is nearly reached, at best: what follows is looked for as at any known roughly.
_ROUGHLY = 2.0 * ACCURACY
#: How far a located point is moved back (arclength): where a slide vanishes joints are known to no more.
_BACK = (1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7)
#: Share of a margin that is left where its sign changes by a jump; where it vanishes that is rounding.
_JUMPS = 1e-2
#: Share of a turn to which the shortest slides are known: the cube root of rounding.
_KNOWN = 1e-5
#: A margin this negative is no rounding of a sum of a few terms of order 1.
_NEGATIVE = 1e-14
#: Share of the period below which a stick at a tangential release has vanished: the square root of
#: the rounding of its quadratic margin.
_VANISHED = 1e-5


def sliding_events(
    orbit: Orbit, before: Point, after: Point, settings: Settings
) -> list[tuple[Bifurcation, Point]]:
    """Return the sliding event that ends the branch between two points, if there is one."""
    located = _first_located(orbit, before, after, settings)
    if located is None:
        return []
    first, point = located
    while hidden := _located_before(orbit, before, point, settings):
        first, point = min(hidden, key=lambda pair: pair[1].arc)
    left = _left_by_jump(orbit, before, point, settings, first)
    tip = nearer_than_twins(orbit, before, point, settings)
    if tip is not None and (found := nearly_reached(orbit, tip, settings)) is not None:
        return [(found, tip)]
    point, here = _pulled_in(orbit, before, point, settings)
    if not _is_inside(here):
        point, here, first = with_holds_forward(here, before, point, settings, first)
    first = _stop_after(here, point, first)
    kind = kind_of_margin(orbit.system, orbit.system.tests[first], here)
    together, known = _TOGETHER, 0.0
    rough = False
    if point.lost:
        # the parameter changes by no more than the margin does, on the way that is left
        known = _NEARLY_REACHED if abs(point.tests[first]) >= _TOGETHER else 0.0
        held = hold_of_test(orbit.system.tests[first], here) is not None
        rough = abs(point.tests[first]) >= (_NEARLY_REACHED if held else _REACHED)
        together = 2.0 * ROUGHLY_REACHED if rough else _NEARLY_REACHED if held else _REACHED
        point.lost = bool(abs(point.tests[first]) >= ROUGHLY_REACHED)
    vanished = _vanished_stick(here, kind, orbit.system.tests[first])
    if vanished is not None:
        point.lost, point.rough = False, rough or left > 0.0
        return [(bifurcation_at(Kind.CS, here, before, None, point, settings, (vanished,)), point)]
    group = tuple(
        test
        for k, test in enumerate(orbit.system.tests)
        if k == first
        or (
            abs(point.tests[k]) < together
            and _is_free(orbit.system.tests[first], test)
            and kind_of_margin(orbit.system, test, here) is kind
        )
    )
    group = _once(here, group)
    found = bifurcation_at(kind, here, before, None, point, settings, group)
    point.rough = rough or left > 0.0
    known = max(known, min(_NEARLY_REACHED, left / settings.width))
    known = ROUGHLY_REACHED if rough else known
    return [(replace(found, bound=max(found.accuracy, known)) if known > 0.0 else found, point)]


def _left_by_jump(
    orbit: Orbit, before: Point, point: Point, settings: Settings, first: int
) -> float:
    """Return what is left of a margin where it changes its sign; 0 where it vanishes.

    It jumps where the last trials went over to another curve: what was located lies before the event. Where a
    slide is as short as it is known to (its cube root of rounding) every step may go to another curve.
    """
    left = float(point.tests[first])
    if point.lost or left <= max(_REACHED, _JUMPS * float(before.tests[first])):
        return 0.0
    here = before.orbit(orbit, orbit.model.index_of(settings.parameter))
    return left if float(here.durations.min()) > _KNOWN * here.turn else 0.0


def _first_located(
    orbit: Orbit, before: Point, after: Point, settings: Settings
) -> tuple[int, Point] | None:
    """Return the violated margin that vanishes first, and where; None if none can be located.

    What comes first ends the branch; what vanishes with it is of its group. They are asked in the order of
    their secants: one that is still positive where another vanishes vanishes behind it, and is not located.
    Nor is one that is positive where Newton's method fails: trials beyond take it tens of steps each.
    """
    from contfric.continuation.core.locate import BY_TEST

    ends = zip(before.tests.tolist(), after.tests[: len(orbit.system.tests)].tolist(), strict=False)
    share = {}  # of the step, to where the secant of a violated margin vanishes
    for k, (value, last) in enumerate(ends):
        if last < 0.0:
            left = min(max(value, 0.0), 1e3)  # some are infinite
            share[k] = left / (left - last)
    best: tuple[float, int, Point] | None = None
    for k in sorted(share, key=share.__getitem__):
        if best is not None and _is_behind(orbit, before, best[2], after, (best[1], k)):
            continue
        if best is not None and best[2].lost and best[2].tests[k] > 0.0:
            continue  # it vanishes later, if trials do not fail there
        point = locate_change(orbit, before, after, settings, BY_TEST, k)
        if point is not None and (best is None or (point.arc, k) < best[:2]):
            best = point.arc, k, point
    return None if best is None else best[1:]


def _is_behind(
    orbit: Orbit, before: Point, point: Point, after: Point, pair: tuple[int, int]
) -> bool:
    """Tell whether where the first of two margins vanishes the other one vanishes later, or just there.

    It is infinite there if the stationary point at which it is violated does not exist yet. What vanishes
    just there is the same on the other half of an orbit that is symmetric but for where its contacts stick.
    """
    first, k = (orbit.system.tests[i] for i in pair)
    left, change = float(point.tests[pair[1]]), float(before.tests[pair[1]] - after.tests[pair[1]])
    just_there = first.margin is k.margin and -_NEGATIVE < left < _TOGETHER * change
    return not point.lost and (left == np.inf or left > _WELL_AFTER * change or just_there)


def _pulled_in(
    orbit: Orbit, before: Point, point: Point, settings: Settings
) -> tuple[Point, Orbit]:
    """Return a located point that is admissible: the same, or one before it, by less than it is located to.

    And the orbit there.
    Where a slide has no length any more the equations are nearly singular, and the last correction takes a
    margin that was zero to either side of it.
    """
    active = orbit.model.index_of(settings.parameter)
    here = point.orbit(orbit, active)
    if point.lost or _is_inside(here):
        return point, here
    for back in _BACK:
        nearer = point_before(here, point, back, settings)
        there = None if nearer is None else nearer.orbit(orbit, active)
        if nearer is not None and there is not None and _is_inside(there):
            return nearer, there
    return point, here


def _is_inside(here: Orbit) -> bool:
    """Tell whether no margin is negative, and no segment lasts less than nothing."""
    lasts = here.durations
    return bool(lasts.min() >= 0.0 and here.margins.min(initial=0.0) > -_NEGATIVE)


def _stop_after(here: Orbit, point: Point, first: int) -> int:
    """Return the margin of the stop that a segment of no length any more begins at, if that vanishes too.

    Where nothing jumps, a slide between two stops shrinks to nothing as the first of them meets the
    boundary of rest: that is what happens, and the tangential end of the slide follows from it.
    """
    tests = here.system.tests
    test = tests[first]
    if test.margin is Margin.LASTING:
        return _hold_after(here, first)
    for i in (test.segment, (test.segment - 1) % here.system.segments):
        if goes_nowhere(here, i):
            return _stop_before(here, point, i, first)
    if test.margin in (Margin.ENTRY, Margin.JOINT):
        return _grazed_stop(here, point, _grazed_wall(here, point, first))
    if test.margin is not Margin.EXIT or hold_of_test(test, here) is not None:
        return first
    i = test.segment
    if ends_rest(here.model, *here.itinerary[i]) or here.durations[i] > _VANISHED * here.period:
        return first
    return _stop_before(here, point, i, first)


def _stop_before(here: Orbit, point: Point, i: int, first: int) -> int:
    """Return the margin of the stop that segment ``i`` begins at, if it vanishes; else ``first``."""
    before = (i - 1) % here.system.segments
    at_stop = (
        k
        for k, test in enumerate(here.system.tests)
        if test.margin is Margin.JOINT
        and test.segment == before
        and abs(point.tests[k]) < _NEARLY_REACHED
    )
    return next(at_stop, first)


def _hold_after(here: Orbit, first: int) -> int:
    """Return the margin of the hold that a slide of no length any more leaves: it cannot be left any more."""
    tests = here.system.tests
    if here.model.mode_by_name[here.system.itinerary[tests[first].segment][0]].sliding:
        return first  # a rest, and what that means is known
    hold = hold_of_test(tests[first], here)
    if hold is None:
        return first
    return tests.index(EventFunction(Margin.HELD, hold.segment, hold.leaves))


def _grazed_wall(here: Orbit, point: Point, first: int) -> int:
    """Return the margin of an impact that has no speed any more, if its own speed is what vanishes first."""
    tests = here.system.tests
    met = tests[first].segment - (tests[first].margin is Margin.ENTRY)
    for k, other in enumerate(tests):
        if (
            other.margin is Margin.EXIT
            and other.segment == met % here.system.segments
            and here.model.reset_at(here.itinerary[other.segment][0], other.surface) is not None
            and abs(point.tests[k]) < _NEARLY_REACHED
        ):
            return k
    return first


def _grazed_stop(here: Orbit, point: Point, first: int) -> int:
    """Return the margin of a tangential stop, if the load at a stop is at its limit for that reason.

    Where nothing jumps, a slide that comes to rest without acceleration has the load that rest is left
    with: both margins are one function, and which of them is located first is rounding. It is a grazing;
    but not where the slide begins in its equilibrium, and goes nowhere. So it is with a slider that reaches
    its limit without velocity: that velocity is the rate of the exit, and has a surface of its own.
    """
    tests = here.system.tests
    test = tests[first]
    if test.margin is not Margin.JOINT:
        return first
    i = test.segment
    limit = _grazed_limit(here, point, first)
    # a hold ends at a load, as rest does: nothing slides up to it
    if limit != first or is_hold(here.itinerary[i][1]):
        return limit
    if here.durations[i] <= _VANISHED * here.period:
        return first
    for k, other in enumerate(tests):
        tangential = other.margin is Margin.EXIT and abs(point.tests[k]) < _NEARLY_REACHED
        if tangential and other.segment == i:
            return k if nothing_jumps(here) else first
    return first


def _grazed_limit(here: Orbit, point: Point, first: int) -> int:
    """Return the margin of the exit whose rate is what vanishes at the joint; else that of the joint."""
    tests = here.system.tests
    mode, exit_ = here.system.itinerary[tests[first].segment]
    if is_hold(exit_) or not is_rate_of(here.model, mode, exit_, tests[first].surface):
        return first
    wanted = EventFunction(Margin.EXIT, tests[first].segment, exit_)
    found = tests.index(wanted) if wanted in tests else first
    return found if abs(point.tests[found]) < _NEARLY_REACHED else first


def _located_before(
    orbit: Orbit, before: Point, point: Point, settings: Settings
) -> list[tuple[int, Point]]:
    """Return the margins violated at a located event: they vanish before it, and come back behind.

    Where several margins vanish together at a singular point, each is known there to the root of rounding,
    and so is the tangent that trials are predicted with: they may end on another curve. A location at which
    more of a margin is left than the event misses it by is such a jump, and no zero.
    """
    from contfric.continuation.core.locate import BY_TEST

    tests = point.tests[: len(orbit.system.tests)].tolist()
    violated = (k for k, value in enumerate(tests) if value < -_TOGETHER)
    found = [(k, locate_change(orbit, before, point, settings, BY_TEST, k)) for k in violated]
    return [
        (k, p)
        for k, p in found
        if p is not None and p.arc < point.arc and abs(p.tests[k]) <= abs(point.tests[k])
    ]


def _vanished_stick(here: Orbit, kind: Kind, test: EventFunction) -> EventFunction | None:
    """Return the stop (as a margin) of a stick that vanishes just where its release is tangential.

    CS and AS at once: the margin vanishes quadratically, and the orbit is one of a continuum (as at
    Omega = 1/2, where a slide lasts a whole natural period whatever its amplitude).
    """
    of_hold = test.margin is Margin.LASTING or hold_of_test(test, here) is not None
    if kind is not Kind.AS or of_hold:
        return None
    start, end = here.cycle[test.segment, 0], here.ends[test.segment, 0]
    if end - start >= _VANISHED * here.period and not _is_at_least_load(here, test):
        return None
    surface, segment = here.itinerary[test.segment][1], test.segment - 1
    if segment < 0:  # of a half: the stop is the mirror image of the last one
        segment += here.system.segments
        symmetry = here.model.symmetry
        if here.system.half and symmetry is not None:
            surface = {image: name for name, image in symmetry.surfaces.items()}[surface]
    stop = EventFunction(Margin.JOINT, segment, surface)
    return (
        stop if stop in here.system.tests else None
    )  # of several contacts: another one cut it short


def _is_at_least_load(here: Orbit, test: EventFunction) -> bool:
    """Tell whether a stick is released where its load is least: it lasts no longer than that is known to."""
    mode, surface = here.itinerary[test.segment]
    if test.margin is not Margin.EXIT or surface not in here.model.surface_by_name:
        return False
    inside = inside_sign(here.model, mode, surface)
    return inside != 0 and bends_outward(here, mode, surface, inside, here.ends[test.segment])


def nearly_reached(orbit: Orbit, tip: Point, settings: Settings) -> Bifurcation | None:
    """Return the event at which several conditions fail at once, where Newton fails just before it.

    The ends of two holds are singular each (a hold without acceleration moves nothing), and together
    they stop Newton at the root of rounding; as does a stick that vanishes at a tangential release.
    """
    found = met_together(orbit, tip, settings)
    if found is None:
        return None
    # the parameter changes by no more than the margins do, on the way that is left; as joints may be off by
    # more, the event counts as known roughly
    values = dict(zip(orbit.system.tests, tip.tests.tolist(), strict=False))
    left = max(values[test] for test in _near(orbit, tip, found.orbit)) / settings.width
    known = min(_NEARLY_REACHED, max(_ROUGHLY, left))
    return replace(found, bound=max(found.accuracy, known))


def met_together(orbit: Orbit, tip: Point, settings: Settings) -> Bifurcation | None:
    """Return the event at a point just before which several conditions fail at once."""
    here = tip.orbit(orbit, orbit.model.index_of(settings.parameter))
    near = _near(orbit, tip, here)
    if not near:
        return None
    # a stick that has no length any more before a hold brings its stop to the limit; else a stop that
    # meets a surface says more
    rank = {Margin.LASTING: 0, Margin.JOINT: 1}
    first = min(near, key=lambda test: rank.get(test.margin, 2))
    if first.margin is Margin.LASTING:
        first = orbit.system.tests[_hold_after(here, orbit.system.tests.index(first))]
    kind = kind_of_margin(orbit.system, first, here)
    group = tuple(test for test in near if kind_of_margin(orbit.system, test, here) is kind)
    return bifurcation_at(kind, here, tip, None, tip, settings, group)


def _near(orbit: Orbit, tip: Point, here: Orbit) -> list[EventFunction]:
    """Return the margins at a point that have nearly vanished."""
    return [
        test
        for test, value in zip(orbit.system.tests, tip.tests, strict=False)
        if 0.0 <= value < _NEARLY_REACHED
        and (value < _TOGETHER or hold_of_test(test, here) is not None)
    ]


def _once(here: Orbit, group: tuple[EventFunction, ...]) -> tuple[EventFunction, ...]:
    """Return the margins without joints whose exit is tangential: what is met there for that is one event."""
    tangential = {(t.segment, t.surface) for t in group if t.margin is Margin.EXIT}
    return tuple(
        t
        for t in group
        if t.margin is not Margin.JOINT
        or (t.segment, here.system.itinerary[t.segment][1]) not in tangential
    )


def _is_free(first: EventFunction, other: EventFunction) -> bool:
    """Tell whether two vanishing margins are two events: not the same surface at the same location."""
    return (first.segment, first.surface) != (other.segment, other.surface)
