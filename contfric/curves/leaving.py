"""The curves that leave a point of codimension two.

==================================  ============================================================
point                               curves that leave
==================================  ============================================================
a smooth event on a sliding one     the curve of SN, BP or PD; where asymmetric (doubled) orbits become
                                    symmetric (undoubled), that of the sliding event of those
a sliding event on a smooth one     the curve of the sliding event, both ways
two sliding events                  in every itinerary that can follow either or both of them: the
                                    curve of each margin that vanishes there, where admissible
SN-PD, SN-BP                        the curve of the other one
degenerate BP, PD                   from the symmetric (undoubled) side the fold curve of the
                                    asymmetric (doubled) orbits, from that the BP or PD
turnover of CS and SS               the AS of the short stick whose release is tangential
==================================  ============================================================

The last two start near the point, where their own equations are singular: a small distance away along
the direction in which the new orbits differ (the null vector; the length of the stick).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import EventFunction, Margin
from contfric.continuation.points import Point
from contfric.continuation.singular_points.vertices import symmetric_part, undoubled_part
from contfric.curves.after_event import Start, itineraries_at, prove, starts_of
from contfric.curves.codimension_two.births import simpler_problem
from contfric.curves.curve import CurvePart
from contfric.curves.points import solve_point
from contfric.curves.problem import Problem, border_of, problem_of
from contfric.curves.ranges import PlaneRanges
from contfric.curves.special import CodimTwo, SpecialPoint
from contfric.errors import ContfricError, NotationError
from contfric.events.bifurcation import TERMINAL, Bifurcation, Kind
from contfric.events.incident.candidates import edited_orbit
from contfric.events.outcomes.outcomes import outcome_at
from contfric.events.sliding_kinds import kind_of_margin
from contfric.orbit.orbit import Orbit

#: Distances near a degenerate point at which the curve that leaves is started: as for branches.
_DISTANCES = (1e-2, 3e-3, 1e-3)
#: Margins below this vanish at a located point; those of two located events agree to about 1e-8.
_VANISHES = 1e-6


def leaving(special: SpecialPoint, problem: Problem, largest: float) -> Iterator[Start]:
    """Yield the starts of the curves that leave a point, each in one direction."""
    box = problem.box
    if special.kind in (CodimTwo.DBP, CodimTwo.GPD):
        yield from _born(special, problem, largest)
    elif special.kind is CodimTwo.TURNOVER:
        yield from _tangential_release(special, problem, largest)
    elif special.meets in (Kind.SN, Kind.BP, Kind.PD) or special.kind in (
        CodimTwo.SN_PD,
        CodimTwo.SN_BP,
    ):
        event = special.bifurcation()
        if event is not None:
            yield from starts_of(event, box, largest)
        yield from _of_simpler(special, problem, largest)
    elif special.meets in TERMINAL:
        yield from _sliding(special, problem, largest)


def _of_simpler(special: SpecialPoint, problem: Problem, largest: float) -> Iterator[Start]:
    """Yield the curve of the same event of symmetric (undoubled) orbits, where orbits become those."""
    found = simpler_problem(problem, special.orbit)
    own, part = found or (problem, special.orbit)
    if found is not None and own.test is not None:
        event = Bifurcation(own.kind, part.params, part, (own.test,))
        yield from starts_of(event, problem.box, largest)


def _sliding(special: SpecialPoint, problem: Problem, largest: float) -> Iterator[Start]:
    """Yield the curves of all margins that vanish at a point, in all itineraries for the solution there."""
    seen: set[tuple[int, EventFunction]] = set()  # systems are built once each
    for orbit in (special.orbit, *itineraries_at(special), *_itineraries_of_own(special, problem)):
        for test, value in zip(orbit.system.tests, orbit.margins, strict=True):
            if not abs(value) < _VANISHES or (id(orbit.system), test) in seen:
                continue
            seen.add((id(orbit.system), test))
            kind = kind_of_margin(orbit.system, test, orbit)
            event = Bifurcation(kind, orbit.params, orbit, (test,))
            yield from starts_of(event, problem.box, largest)


def _itineraries_of_own(special: SpecialPoint, problem: Problem) -> Iterator[Orbit]:
    """Yield the itineraries that follow the curve's own event, and those that follow both."""
    if problem.test is None:
        return
    kind = kind_of_margin(problem.system, problem.test, special.orbit)
    own = replace(special, meets=kind, tests=(problem.test,))
    for orbit in itineraries_at(own):
        yield orbit
        for test, value in zip(orbit.system.tests, orbit.margins, strict=True):
            if abs(value) < _VANISHES:
                meets = kind_of_margin(orbit.system, test, orbit)
                both = replace(own, orbit=orbit, meets=meets, tests=(test,))
                with suppress(ContfricError):
                    yield from itineraries_at(both)


def other_itineraries(part: CurvePart, largest: float) -> Iterator[Start]:
    """Yield the starts of a CS curve in the other itineraries for its solution, from its middle.

    The motion is the same, but its neighbours are others: they have their own folds and doublings there.
    """
    problem, k = part.problem, len(part) // 2
    if part.kind is not Kind.CS or problem is None:
        return
    orbit = problem.orbit(part.joints[k], part.values[k])
    tests = tuple(problem.system.tests[int(row)] for row in problem.condition.pinned)
    here = SpecialPoint(CodimTwo.MEETS, "", orbit.params, orbit, Kind.CS, tests)
    for other in itineraries_at(here):
        for test, value in zip(other.system.tests, other.margins, strict=True):
            if abs(value) < _VANISHES and kind_of_margin(other.system, test, other) is Kind.CS:
                event = Bifurcation(Kind.CS, other.params, other, (test,))
                yield from starts_of(event, problem.box, largest)
                break


def _born(special: SpecialPoint, problem: Problem, largest: float) -> Iterator[Start]:
    """Yield the curve of the other side of a degenerate branch point or doubling."""
    if problem.kind is Kind.SN:
        active = special.orbit.model.index_of(problem.box.names[0])
        part = symmetric_part if special.kind is CodimTwo.DBP else undoubled_part
        simple = part(special.orbit, active)
        if simple is not None:
            kind = Kind.BP if special.kind is CodimTwo.DBP else Kind.PD
            yield from starts_of(Bifurcation(kind, simple.params, simple), problem.box, largest)
        return
    whole = special.orbit.as_whole() if special.kind is CodimTwo.DBP else special.orbit.doubled()
    phi = _odd_null_vector(special.orbit, problem, whole)
    fold = fold_problem(whole, problem.box)
    if fold is None:
        return
    for distance in _DISTANCES:
        start = solved_along(fold, whole, phi, distance)
        if start is not None:
            point, border = start
            proved = prove(fold, point, border, largest, born=True)
            if proved is not None:
                yield proved, point, border
                return


def _odd_null_vector(orbit: Orbit, problem: Problem, whole: Orbit) -> FloatArray:
    """Return the null vector of a multiplier -1 over two turns, of size 1: (v, -K v).

    Without excitation v ends at time 0, and -K v begins at -t of its first joint: the first turn is shifted.
    """
    v = border_of(problem, orbit.joints, orbit.vector)[1]
    close = np.eye(v.shape[1])
    close[1:, 1:] = orbit.system.layout.closure
    phi: FloatArray = np.vstack([v, -v @ close.T])
    if orbit.model.autonomous:
        phi[: len(v), 0] -= v[0, 0]
    return phi / float(np.sqrt(np.sum(phi**2) / len(phi)))


def fold_problem(orbit: Orbit, box: PlaneRanges) -> Problem | None:
    """Return the problem of the fold curve of an orbit that has a multiplier 1."""
    with suppress(ContfricError):
        return problem_of(Bifurcation(Kind.SN, orbit.params, orbit), box)
    return None


def solved_along(
    problem: Problem, orbit: Orbit, direction: FloatArray, distance: float
) -> tuple[Point, FloatArray] | None:
    """Solve for a point of a curve a distance away from an orbit along a direction of its joints."""
    border = border_of(problem, orbit.joints, orbit.vector)
    guess = orbit.joints + distance * direction
    point = solve_point(problem, guess, orbit.vector[problem.which], direction, np.zeros(2), border)
    if point is None or not np.all(np.isfinite(point.joints)):
        return None
    moved = float(np.sqrt(np.sum((point.joints - orbit.joints) ** 2) / len(guess)))
    if not 0.3 * distance < moved < 3.0 * distance:
        return None
    if float(np.sum(point.tangent * (point.joints - orbit.joints))) < 0.0:
        point = point.reversed()
    return point, border


def _tangential_release(special: SpecialPoint, problem: Problem, largest: float) -> Iterator[Start]:
    """Yield the AS that begins where the load at a stop stands still: a short stick, left tangentially."""
    assert problem.test is not None
    orbit = special.orbit.as_whole()
    try:
        outcome = outcome_at(orbit, problem.test, Kind.CS)
        edited, _ = edited_orbit(orbit, [outcome])
    except NotationError:
        return
    sticks = [
        i
        for i, (mode, _) in enumerate(edited.system.itinerary)
        if edited.model.mode_by_name[mode].sliding and abs(edited.durations[i]) < _VANISHES
    ]
    for i in sticks:
        test = EventFunction(Margin.EXIT, i, edited.system.itinerary[i][1])
        try:
            own = problem_of(Bifurcation(Kind.AS, edited.params, edited, (test,)), problem.box)
        except ContfricError:
            continue
        longer = np.zeros_like(edited.joints)
        longer[i, 0] = -1.0  # it begins earlier: the release stays where it is
        own = replace(
            own, condition=own.condition._replace(pinned=np.array([own.system.tests.index(test)]))
        )
        for distance in _DISTANCES:
            start = solved_along(own, edited, longer, distance)
            if start is None:
                continue
            proved = prove(own, start[0], start[1], largest)
            if proved is not None:
                yield proved, start[0], start[1]
                break
