"""Continues a curve past another sliding event: the same condition in an edited itinerary.

At the event the motion is known, and every itinerary that can follow it solves the same equations there
(:mod:`contfric.events.incident.candidates`). The condition is found again in the new itinerary by its place:
the same surface at the same time. SN, BP and PD go on if the new itinerary has the multiplier as well: where
the solution is differentiable through the event.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.system import EventFunction, Margin
from contfric.continuation.points import EXTRA, Point, PointRows
from contfric.curves.codimension_two.births import is_simpler
from contfric.curves.codimension_two.meeting import has_multiplier
from contfric.curves.codimension_two.naming import MARGINAL
from contfric.curves.points import first_curve_point, march_rows
from contfric.curves.problem import Problem, problem_of, tangency
from contfric.curves.ranges import PlaneRanges
from contfric.curves.special import SpecialPoint
from contfric.errors import ContfricError, ParameterError
from contfric.events.bifurcation import TERMINAL, Bifurcation, Kind
from contfric.events.incident.candidates import candidates
from contfric.events.sliding_kinds import kind_of_margin
from contfric.orbit.canonical.sections import canonical, moved
from contfric.orbit.measured.samples import stationary_within
from contfric.orbit.orbit import Orbit
from contfric.remember.journal import remembered

#: Times of a joint in two itineraries for one motion agree to this (nondimensional): located events are good
#: to 1e-9 where two of them meet.
_SAME_TIME = 1e-6
#: A multiplier that a fold, branch point or doubling keeps in another itinerary is the same to this.
_SAME_MULTIPLIER = 1e-4
#: The first point of a curve is the point that it leaves to this (relative to the ranges).
_SAME_POINT = 1e-4
#: Margins this small after the proof still vanish: they belong to the condition.
_STILL = 1e-10
#: Lengths of the steps by which a new itinerary is proved, in largest steps. Margins may leave zero with the
#: square of the distance: the longer one tells them from rounding.
_PROOFS = (0.1, 0.01)
#: A segment that lasts less than minus this does not exist.
_NO_TIME = 1e-9

Start = tuple[Problem, Point, FloatArray]


def location_of(orbit: Orbit, test: EventFunction) -> tuple[float, str]:
    """Return when and on which surface a margin of an orbit vanishes."""
    if test.margin is not Margin.INTERIOR:
        return float(orbit.ends[test.segment, 0]), test.surface
    return _touch_time(orbit, test), test.surface


def _tangent_at(orbit: Orbit, test: EventFunction) -> EventFunction:
    """Return the margin at the location of a tangency, whose test names the observable only.

    Raises
    ------
    ParameterError
        If there is no tangency in the segment.
    """
    from contfric.curves.equations.conditions import JOINT, START

    location, segment, surface = tangency(orbit, test)
    if location == START:  # the joint is the end of the segment before it
        return EventFunction(Margin.JOINT, (segment - 1) % len(orbit.itinerary), surface)
    return EventFunction(Margin.JOINT if location == JOINT else Margin.INTERIOR, segment, surface)


def _touch_time(orbit: Orbit, test: EventFunction) -> float:
    """Return the time at which an observable is stationary nearest to a surface inside a segment."""
    i, observable = test.segment, orbit.model.surface_by_name[test.surface].observable
    times, values = stationary_within(orbit, i, observable)
    if len(times) == 0:
        return float("nan")
    level = orbit.flow.level(test.surface)
    return float(float(orbit.begins[i, 0]) + times[int(np.argmin(np.abs(values - level)))])


def same_location(one: Orbit, a: EventFunction, other: Orbit, b: EventFunction) -> bool:
    """Tell whether margins of two itineraries for one solution vanish at one location, up to symmetry."""
    time, surface = location_of(one, a)
    there, on = location_of(other, b)
    period = one.period
    gap = abs((time - there + 0.5 * period) % period - 0.5 * period)
    if on == surface and gap < _SAME_TIME:
        return True
    symmetry = one.model.symmetry
    if symmetry is None or not (one.system.half or other.system.half):
        return False
    gap = abs((time - there + period) % period - 0.5 * period)
    return symmetry.surfaces[on] == surface and gap < _SAME_TIME


def itineraries_at(special: SpecialPoint) -> Iterator[Orbit]:
    """Yield the orbits of all itineraries without holds that can follow the sliding event of a point."""
    if special.meets is Kind.T:
        free = canonical(special.orbit)
        other = moved(free) if free is special.orbit else free
        if other is not None:
            yield other
    event = special.bifurcation()
    if event is None or event.kind not in TERMINAL:
        return
    for candidate in candidates(event):
        if candidate.orbit is not None and not candidate.has_hold and candidate.away is None:
            yield candidate.orbit


def again(problem: Problem, special: SpecialPoint, orbit: Orbit) -> Bifurcation | None:
    """Return the condition of a curve in another itinerary for the motion at a point; None if it has none."""
    if problem.test is None:
        if orbit.system.half is not problem.system.half:
            return None
        gap = float(np.min(np.abs(orbit.turn_multipliers - problem.condition.sign)))
        return Bifurcation(problem.kind, orbit.params, orbit) if gap < _SAME_MULTIPLIER else None
    if problem.kind is Kind.T:
        return _tangency_again(problem.test, special.orbit, orbit)
    for test in orbit.system.tests:
        if test.margin is not problem.test.margin:
            continue
        if same_location(special.orbit, problem.test, orbit, test):
            kind = kind_of_margin(orbit.system, test, orbit)
            return Bifurcation(kind, orbit.params, orbit, (test,))
    return None


def _tangency_again(test: EventFunction, one: Orbit, other: Orbit) -> Bifurcation | None:
    """Return the tangency of a solution in another itinerary for it; None where no segment of it touches."""
    try:
        location = _tangent_at(one, test)
    except ParameterError:
        return None
    observables = [o.name for o in other.model.observables]
    for segment, observable, *_ in other.system.layout.labels:
        touch = EventFunction(Margin.INTERIOR, int(segment), observables[int(observable)])
        try:
            there = _tangent_at(other, touch)
        except ParameterError:
            continue
        if same_location(one, location, other, there):
            return Bifurcation(Kind.T, other.params, other, (touch,))
    return None


@remembered()
def goes_on(
    problem: Problem, ahead: FloatArray, special: SpecialPoint, largest: float
) -> Start | None:
    """Return where a curve goes on after a sliding event, in the direction ``ahead``; None if nowhere.

    What goes on happens at as many locations as before: a curve that is asymmetric does not go on as the
    symmetric one that it has met.
    """
    for orbit in itineraries_at(special):
        event = again(problem, special, orbit)
        if event is None:
            continue
        for start in starts_of(event, problem.box, largest):
            forward = float(np.sum(start[1].direction * ahead / problem.box.widths**2)) > 0.0
            if forward and _locations(start[0]) == _locations(problem):
                return start
    return None


def _locations(problem: Problem) -> int:
    """Return the number of places of the whole orbit at which a curve's event happens."""
    return len(problem.condition.pinned) * (2 if problem.system.half else 1)


def starts_of(event: Bifurcation, box: PlaneRanges, largest: float) -> Iterator[Start]:
    """Yield the directions in which an event's curve leaves a point with admissible orbits."""
    try:
        problem = problem_of(event, box)
    except ContfricError:
        return
    orbit = event.orbit if event.orbit.system is problem.system else event.orbit.as_half()
    found = first_curve_point(problem, orbit)
    if found is None:
        return
    point, border = found
    gap = np.max(np.abs(point.w - orbit.vector[problem.which]) / box.widths)
    if gap > _SAME_POINT:
        return
    for start in (point, point.reversed()):
        proved = prove(problem, start, border, largest)
        if proved is not None:
            yield proved, start, border


def prove(
    problem: Problem, start: Point, border: FloatArray, largest: float, born: bool = False
) -> Problem | None:
    """Return a curve's problem if its orbits are admissible a short step away from a point.

    Margins that vanish at the point but not near it are watched from there on. ``born`` says that a fold
    curve begins near the point: there the normal form is small, and tells of no continuum.
    """
    for share in _PROOFS:
        near = _step_away(problem, start, border, share * largest)
        if near is None:
            continue
        orbit = problem.orbit(near.joints, near.w)
        margins, pinned = orbit.margins, problem.condition.pinned
        held = np.abs(margins[pinned]) < _STILL
        free, still = pinned[~held], np.sort(pinned[held])
        others = np.ones(len(margins), dtype=np.bool_)
        others[still] = False
        lasts = bool(np.all(orbit.durations > -_NO_TIME))
        fine = lasts and bool(np.all(margins[others] > 0.0)) and has_multiplier(problem, orbit)
        if not fine or _is_exit(problem, still) or is_simpler(problem, orbit):
            continue
        if not born and is_continuum(problem, start) and is_continuum(problem, near):
            return None
        if len(free):
            start.tests[free] = np.maximum(0.0, problem.orbit(start.joints, start.w).margins[free])
        return replace(problem, condition=problem.condition._replace(pinned=still))
    return None


def is_continuum(problem: Problem, point: Point) -> bool:
    """Tell whether orbits are one of a continuum at fixed parameters, as at Omega = 1/2.

    There a multiplier is 1, and along a fold or a branch point the normal form vanishes; all that is watched
    is rounding. Where it is so at one point only, that is of codimension two.
    """
    column = len(point.tests) - EXTRA + (0 if problem.test is None else 1)
    return bool(abs(point.tests[column]) < MARGINAL)


def _is_exit(problem: Problem, pinned: IntArray) -> bool:
    """Tell whether a touch inside a segment is nothing but its tangential exit."""
    test = problem.test
    if test is None or test.margin is not Margin.INTERIOR:
        return False
    return replace(test, margin=Margin.EXIT) in [problem.system.tests[k] for k in pinned]


def _step_away(problem: Problem, start: Point, border: FloatArray, step: float) -> Point | None:
    """Return the point a step away from the first one, or None."""
    rows = PointRows.empty(problem.system, 2, 2)
    rows.put(0, start)
    _, last, _ = march_rows(problem, rows, 0, start, 0, border.copy(), step, step)
    return rows.point(1) if last == 1 else None
