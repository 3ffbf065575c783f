"""Where an event happens: on the shortest problem that its orbit solves, and what vanishes there.

A stick that has shrunk to nothing at the event is taken out of the itinerary, and an orbit that is its own
mirror image is solved on its half: so a symmetric pair of stops that meet their limits together is one
condition and not two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from flint import arb, arb_mat

from contfric.bvp.holds import Hold
from contfric.bvp.margins import EventFunction, Margin
from contfric.bvp.system import build_system
from contfric.certify.equations.extended import EventCondition
from contfric.certify.equations.shortest import VANISHED, NotLocatedError, simplest
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.models.balls.build import ball_model
from contfric.models.balls.numbers import column
from contfric.orbit.measured.samples import stationary_within
from contfric.orbit.orbit import Orbit
from contfric.signature.holds import hold_at, is_hold

#: A touch of the limit by a hold that starts on it is at its start if it is no later.
_AT_START = 1e-5
#: Times in a hold at which the acceleration is looked at: Newton's method goes on from the least one.
_TIMES = 500


@dataclass(frozen=True, eq=False)
class EventPlace:
    """An orbit at an event, and what vanishes there; None for a multiplier.

    Attributes
    ----------
    orbit : on the shortest problem
    condition : what vanishes in addition to the equations of the orbit
    after : approximate time of a touch after the start of its segment
    """

    orbit: Orbit
    condition: EventCondition | None
    after: float = 0.0


def location_of(event: Bifurcation) -> EventPlace:
    """Return where an event happens.

    Raises
    ------
    NotLocatedError
        If several conditions meet, or none is known.
    """
    if not event.located:
        raise NotLocatedError("the event was not located")
    orbit, tests = _released(event.orbit, event.tests)
    if not tests:
        return EventPlace(_multiplier_orbit(event), None)
    try:
        orbit, found = simplest(orbit, tests)
    except NotLocatedError:
        condition = _two_at_once(orbit) if event.kind in (Kind.CS, Kind.T) else None
        if condition is None:
            raise
        return EventPlace(orbit, condition)
    if len(found) != 1:
        raise NotLocatedError(f"{len(found)} independent conditions meet")
    test = found[0]
    if event.kind is Kind.T:
        return _tangency(orbit, test)
    if test.margin is Margin.JOINT:
        return EventPlace(orbit, EventCondition(test.segment, test.surface))
    if test.margin is Margin.EXIT and orbit.system.itinerary[test.segment][1] != test.surface:
        return EventPlace(orbit, _at_stop(orbit, test.segment, test.surface))
    if test.margin is Margin.EXIT:
        return EventPlace(orbit, EventCondition(test.segment, test.surface, rate=True))
    if test.margin is Margin.HELD:
        hold = next(h for h in orbit.system.holds if h.segment == test.segment)
        condition = EventCondition(test.segment, test.surface, within=True, departs=hold.departs)
        return EventPlace(orbit, condition, _least_acceleration(orbit, hold))
    if test.margin is Margin.INTERIOR:
        _, after = _nearest_touch(orbit, test.segment, test.surface)
        pinned = [h.segment for h in orbit.system.holds if h.pin == test.surface]
        if test.segment in pinned and after < _AT_START:  # the load no longer falls at its stop
            return EventPlace(orbit, _at_stop(orbit, test.segment - 1, test.surface))
        return EventPlace(orbit, EventCondition(test.segment, test.surface, within=True), after)
    raise NotLocatedError(f"events of a margin of the kind '{test.margin.value}' are not proved")


def _two_at_once(orbit: Orbit) -> EventCondition | None:
    """Return that two contacts change at the same time: the only segment that vanishes is the one between."""
    itinerary, resets = orbit.system.itinerary, orbit.system.layout.resets
    lasts = orbit.ends[:, 0] - orbit.begins[:, 0]
    found = [i for i in range(len(itinerary)) if lasts[i] < VANISHED]
    if len(found) != 1 or found[0] == 0:
        return None
    i = found[0]
    if max(resets[i], resets[(i + 1) % len(itinerary)]) >= 0:
        return None
    return EventCondition(i, itinerary[i][1], before=itinerary[i - 1][1])


def _released(
    orbit: Orbit, tests: tuple[EventFunction, ...]
) -> tuple[Orbit, tuple[EventFunction, ...]]:
    """Return an orbit at the end of its holds as one without them, and what vanishes on that one.

    A hold that ends on a limit of rest is released there anyway: it is a stick. One that is left without
    acceleration goes on as the rest that follows. One without length is no hold, and the stick before it is
    left where the load is stationary. What is left of the others is that their pin is met. Where the stick up
    to a touch of its limit vanishes, the hold after it starts at a stop on the limit, the load being
    stationary. Where a hold after a touch has no length, one slide touches rest.
    """
    system, (first, last) = orbit.system, (0, 0)
    for k, test in enumerate(tests):
        hold = next((h for h in system.holds if _ends(test, h)), None)
        if hold is None:
            continue
        i, rest = hold.segment, system.itinerary[hold.segment][0]
        if test.margin is Margin.LASTING:
            limit = system.itinerary[i - 1][1]
            vanished = test.segment == i  # the hold itself; else the stick before it
            exit_ = limit if vanished else hold_at(limit)
            moved, (first, last) = EventFunction(Margin.EXIT, i - 2 + vanished, limit), (i - 1, i)
        elif _only_touches(orbit, hold, test):
            rest, exit_ = system.itinerary[i + 1]
            moved, (first, last) = (
                EventFunction(Margin.INTERIOR, i - 1, hold.leaves),
                (i - 1, i + 1),
            )
        else:
            exit_ = _end_of(orbit, hold, test)
            moved = (
                EventFunction(Margin.HELD, i, hold.leaves)
                if is_hold(exit_)
                else _pinned(orbit, hold)
            )
            merged = hold.after_rest and not is_hold(exit_)  # one stick, which touches its limit
            first, last = i - merged, i + 2 * (test.margin is Margin.EXIT)
        if moved.segment < 0:
            raise NotLocatedError("a hold that ends after the first stick is not proved")
        kept = [j for j in range(len(orbit.joints)) if not first < j <= last]
        itinerary = [system.itinerary[j] for j in kept]
        itinerary[first] = (rest, exit_)
        new = build_system(orbit.model, tuple(itinerary), system.periods, system.half)
        others = [t for t in tests[:k] + tests[k + 1 :] if not first <= t.segment <= last]
        left = [replace(t, segment=t.segment - (last - first) * (t.segment > last)) for t in others]
        return _released(replace(orbit, system=new, joints=orbit.joints[kept]), (moved, *left))
    return orbit, tests


def _at_stop(orbit: Orbit, segment: int, surface: str) -> EventCondition:
    """Return that an observable is stationary where the rest after a segment begins."""
    after = orbit.system.itinerary[(segment + 1) % len(orbit.system.itinerary)][0]
    return EventCondition(segment, surface, departs=after)


def _ends(test: EventFunction, hold: Hold) -> bool:
    """Tell whether a hold is no longer one where a margin vanishes."""
    if test.margin is Margin.LASTING:
        return hold.after_rest and hold.segment - test.segment in (0, 1)
    return test.segment == hold.segment and test.margin in (Margin.JOINT, Margin.EXIT)


def _only_touches(orbit: Orbit, hold: Hold, test: EventFunction) -> bool:
    """Tell whether a hold after a touch of rest has no length, so that the slide before it goes on."""
    itinerary, i = orbit.system.itinerary, hold.segment
    if test.margin is not Margin.EXIT or hold.pin is not None or hold.after_rest:
        return False
    if not 0 < i < len(itinerary) - 1 or itinerary[i - 1][0] != itinerary[i + 1][0]:
        return False
    return bool(orbit.ends[i, 0] - orbit.begins[i, 0] < VANISHED)


def _end_of(orbit: Orbit, hold: Hold, test: EventFunction) -> str:
    """Return the exit of the rest that a hold is at the event."""
    itinerary, i = orbit.system.itinerary, hold.segment
    if test.margin is Margin.JOINT:
        return test.surface
    lasts = orbit.ends[i + 1 : i + 2, 0] - orbit.begins[i + 1 : i + 2, 0]
    if i + 2 < len(itinerary) and itinerary[i + 2][0] == itinerary[i][0] and lasts[0] < VANISHED:
        return itinerary[i + 2][1]
    raise NotLocatedError("a hold that is left without acceleration into a slide is not proved")


def _pinned(orbit: Orbit, hold: Hold) -> EventFunction:
    """Return the pin of a hold as a condition on the segment before it."""
    before = hold.segment - 1
    if hold.pin is not None:
        return EventFunction(Margin.JOINT, before, hold.pin)
    if hold.after_rest:
        return EventFunction(Margin.INTERIOR, before, orbit.system.itinerary[before][1])
    return EventFunction(Margin.EXIT, before, hold.leaves)


def _multiplier_orbit(event: Bifurcation) -> Orbit:
    orbit = event.orbit
    if event.kind is Kind.BP:
        orbit = orbit.as_half()
        if not orbit.system.half:
            raise NotLocatedError("a branch point without a symmetry is not proved")
    elif event.kind is Kind.PD:
        orbit = orbit.as_whole()
    elif event.kind not in (Kind.SN, Kind.NS):
        raise NotLocatedError(f"{event.kind.value} is not proved")
    return orbit


def _tangency(orbit: Orbit, test: EventFunction) -> EventPlace:
    """Return where a surface of the test's observable is touched: inside of its segment, or at its ends."""
    model, count = orbit.model, len(orbit.ends)
    ends = {test.segment}
    if (
        test.segment or not orbit.system.half
    ):  # else what is before it is the image of another segment
        ends.add((test.segment - 1) % count)
    names = [s.name for s in model.surfaces if test.surface in (s.name, s.observable)]
    found = []
    for name in names:
        gap, after = _nearest_touch(orbit, test.segment, name)
        found.append((gap, EventCondition(test.segment, name, within=True), after))
        for i in ends:
            if name != orbit.system.itinerary[i][1]:
                end, observable = orbit.ends[i], model.surface_by_name[name].observable
                value = orbit.flow.observe(observable, float(end[0]), end[1:])
                gap = abs(value - orbit.flow.level(name))
                found.append((gap, EventCondition(i, name), 0.0))
    gap, condition, after = min(found, key=lambda row: row[0])
    return EventPlace(orbit, condition, after)


def _nearest_touch(orbit: Orbit, segment: int, surface: str) -> tuple[float, float]:
    """Return how near a stationary point of an observable comes to its surface, and when."""
    observable = orbit.model.surface_by_name[surface].observable
    times, values = stationary_within(orbit, segment, observable)
    gaps = np.abs(values - orbit.flow.level(surface))
    if not len(gaps):
        return float("inf"), 0.0
    k = int(np.argmin(gaps))
    return float(gaps[k]), float(times[k])


def _least_acceleration(orbit: Orbit, hold: Hold) -> float:
    """Return when in a hold the acceleration with which it would be left comes nearest to zero inside."""
    start = orbit.begins[hold.segment]
    balls, mode = ball_model(orbit.model, orbit.params), orbit.system.itinerary[hold.segment][0]
    state = column(balls.extended(arb(float(start[0])), [arb(float(y)) for y in start[1:]]))
    row = arb_mat([balls.rate(hold.leaves, hold.departs)])
    step = (float(orbit.ends[hold.segment, 0]) - float(start[0])) / _TIMES
    flow, sizes = (balls.fields[mode] * step).exp().mid(), []
    for _ in range(_TIMES - 1):
        state = (flow * state).mid()
        sizes.append(abs(float((row * state)[0, 0].mid())))
    return step * (1 + int(np.argmin(sizes)))
