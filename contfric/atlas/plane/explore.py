"""Exploration of a plane: from sections to curves, from curves through their points of codimension two.

A section is a one-parameter diagram. Each of its bifurcations starts a curve; each point of codimension
two on a curve starts those that leave it, until nothing new is found. Then the regions between the curves are
looked at: where no section has passed a region, one is laid through it, and what it shows that is new
starts further curves.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from contfric.atlas.plane.known_curves import at_once, is_known, twins_of
from contfric.atlas.plane.plane import Plane
from contfric.atlas.plane.regions import regions_of
from contfric.atlas.plane.sections import section_diagram, sections_of
from contfric.atlas.plane.state import PlaneExploration, Progress
from contfric.atlas.starts.seeds import Seeds
from contfric.continuation.points import MOST_POINTS, Point
from contfric.curves.after_event import Start
from contfric.curves.assembly import join_sides
from contfric.curves.curve import CurvePart
from contfric.curves.half_curve import CurveSide
from contfric.curves.leaving import leaving, other_itineraries
from contfric.curves.problem import Problem, problem_of
from contfric.curves.ranges import box_of
from contfric.curves.special import CodimTwo, CurveEnd, CurveEndReason, SpecialPoint
from contfric.curves.trace import first_points, largest_step, start_of_curve, trace_curve_side
from contfric.errors import (
    ConvergenceError,
    ParameterError,
    did_you_mean,
    function_of,
    items_of,
    shown,
    whole_number,
)
from contfric.events.bifurcation import ACCURACY, Bifurcation, Kind
from contfric.orbit.orbit import Orbit
from contfric.remember.journal import remembered

#: Kinds of curves that are followed by default: T changes labels, and nothing else.
KINDS = ("SN", "BP", "PD", "CS", "SS", "AS", "GS")
#: Simulations along each section: families that nothing else reaches have to be met by chance.
_SEEDS = Seeds(values=8, states=2)
#: A curve shorter than this (relative to the ranges) leaves its start in no direction.
_NOWHERE = 1e-5
#: Points of a curve by which it is told whether it is known: so many steps, which grow from the first, lead
#: well away from where curves meet.
_FIRST = 16
#: Margins below this vanish: those of events that are located twice agree to 1e-8 or so.
_VANISHES = 1e-6
#: Where a curve ends for no reason of its own.
_BROKEN_OFF = {
    CurveEndReason.STEP,
    CurveEndReason.LOST,
    CurveEndReason.POINTS,
    CurveEndReason.BROKEN,
    CurveEndReason.INTERRUPTED,
}
#: A region smaller than this share of the plane gets no section of its own.
_SMALL = 2e-4


def explore_plane(
    orbit: Orbit,
    parameters: tuple[str, str],
    ranges: Mapping[str, tuple[float, float]],
    sections: Mapping[str, Sequence[float]] | None = None,
    *,
    kinds: Sequence[str | Kind] = KINDS,
    max_step: float | None = None,
    max_periods: int = 2,
    max_curves: int = 200,
    max_sections: int = 12,
    seeds: Seeds | None = _SEEDS,
    progress: Progress | None = None,
) -> Plane:
    """Find the bifurcation curves of a plane, the points at which they meet, and its regions.

    Parameters
    ----------
    orbit : Orbit
        Gives the model and the other parameters; sections find their own orbits by simulation.
    parameters, ranges
        The plane, as for :func:`contfric.continue_bifurcation`.
    sections : dict, optional
        Values of one or of both parameters at which the other one is varied; by default that of
        the orbit for the second parameter.
    kinds : sequence of str
        Kinds of curves to follow; T is left out by default.
    max_periods : int
        Longest orbit, in periods of the excitation, whose curves are followed.
    max_curves, max_sections : int
        Most curves, and most sections, those asked for among them; reached, the notes say so.
    seeds : Seeds, optional
        Simulations along each section.

    Returns
    -------
    Plane
        On Ctrl-C what was found so far, with ``complete`` False.

    Raises
    ------
    ParameterError
        If an argument is not valid.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> ranges = {"Omega": (0.52, 0.56), "S": (0.3, 0.39)}
    >>> plane = cf.explore_plane(orbit, ("Omega", "S"), ranges, max_sections=1)
    >>> sorted({curve.label for curve in plane.curves})
    ['BP_2s', 'CS_s', 'SN_1a']
    """
    if not isinstance(orbit, Orbit):
        raise ParameterError(f"a plane is explored from an Orbit, got {type(orbit).__name__}")
    box = box_of(orbit.model, parameters, ranges)
    for name, most in (
        ("max_periods", max_periods),
        ("max_curves", max_curves),
        ("max_sections", max_sections),
    ):
        whole_number(name, most, least=1)
    function_of("progress", progress)
    wanted, seeds = _kinds(kinds), Seeds.given(seeds)
    largest = largest_step(max_step, orbit.model)
    state = PlaneExploration(
        box, orbit.vector.copy(), wanted, max_periods, max_curves, largest, progress
    )
    asked = sections_of(orbit, box, sections)
    try:
        for name, value in asked[:max_sections]:
            _follow_section(state, orbit, name, value, seeds)
        _sample_regions(state, orbit, seeds, max_sections)
    except KeyboardInterrupt:
        state.complete = False
        state.notes.append(CurveEndReason.INTERRUPTED.value)
    return _result(state, orbit)


def _kinds(kinds: Sequence[str | Kind]) -> frozenset[Kind]:
    known = [kind.value for kind in Kind if kind is not Kind.NS]
    if not items_of(kinds):
        raise ParameterError(f"kinds is a list, such as ['SN', 'BP'], got {shown(kinds)}")
    names = [kind.value if isinstance(kind, Kind) else str(kind) for kind in kinds]
    for name in names:
        if name not in known:
            raise ParameterError(f"there are no curves of '{name}'{did_you_mean(name, known)}")
    return frozenset(Kind(name) for name in names)


def _result(state: PlaneExploration, orbit: Orbit) -> Plane:
    regions, cells = regions_of(
        orbit.model, state.vector, state.box, state.curves, state.sections, state.max_periods
    )
    twins = twins_of(state.curves)
    return Plane(
        orbit.model,
        state.box.names,
        np.column_stack([state.box.low, state.box.high]),
        state.vector,
        tuple(state.curves),
        twins,
        regions,
        cells,
        tuple(state.sections),
        state.complete,
        (*state.notes, *at_once(state.curves, twins)),
    )


# ---------------------------------------------------------------------------------- sections


def _follow_section(
    state: PlaneExploration, orbit: Orbit, fixed: str, value: float, seeds: Seeds | None
) -> None:
    """Compute the diagram of a section, and follow its bifurcations."""
    diagram = section_diagram(state, orbit, fixed, value, seeds)
    if diagram is None:
        state.notes.append(f"no periodic orbit was found on the section {fixed} = {value:g}")
        return
    state.sections.append(diagram)
    for branch in diagram.branches:
        if branch.bridge or branch.mirrored:
            continue
        for bifurcation in branch.bifurcations:
            if bifurcation.located:
                _follow_bifurcation(state, bifurcation)
    _follow_special(state)


def _follow_bifurcation(state: PlaneExploration, bifurcation: Bifurcation) -> None:
    """Continue a bifurcation of a section both ways, unless its curve is known."""
    if state.full or bifurcation.kind not in state.kinds:
        return
    if bifurcation.accuracy > ACCURACY and bifurcation.kind is not Kind.SS:
        note = f"{bifurcation!r} is degenerate (located to {bifurcation.accuracy:g} only): not followed"
        state.notes.append(note)
        return
    try:
        problem = problem_of(bifurcation, state.box)
        if not state.wants(problem):
            return
        problem, start, border = start_of_curve(problem, bifurcation, state.largest)
    except (ParameterError, ConvergenceError) as error:
        state.notes.append(f"{bifurcation.label}: {error}")
        return
    if is_known(problem, start, state.curves) is not None:
        return
    ahead = trace_curve_side(problem, start, border, state.largest, MOST_POINTS)
    if ahead.end.reason is CurveEndReason.CLOSED:
        state.add(join_sides(None, ahead), [ahead])
        return
    behind = trace_curve_side(problem, start.reversed(), border, state.largest, MOST_POINTS)
    state.add(join_sides(behind, ahead), [behind, ahead])


# --------------------------------------------------------------------- points of codimension two


def _follow_itineraries(state: PlaneExploration) -> None:
    """Follow CS curves in the other itineraries for their motions."""
    while state.unread:
        for part in state.unread.popleft().parts:
            for starts in _of_other_itineraries(part, state.largest):
                if not state.full and state.wants(starts[0][0]):
                    _follow_starts(state, starts, None)


def _follow_special(state: PlaneExploration) -> None:
    """Follow what leaves the points that wait."""
    _follow_itineraries(state)
    while state.waiting:
        special, problem = state.waiting.popleft()
        if problem.at_limit(np.array([special.params[name] for name in problem.box.names])):
            continue
        if special.meets is Kind.T or special.kind in (CodimTwo.CUSP, CodimTwo.R1, CodimTwo.R2):
            continue
        for starts in _that_leave(special, problem, state.largest):
            if state.full:
                state.complete = False
                state.notes.append(f"stopped at max_curves = {state.max_curves}")
                state.waiting.clear()
                return
            if state.wants(starts[0][0]):
                _follow_starts(state, starts, special)
        _follow_itineraries(state)


@remembered()
def _of_other_itineraries(part: CurvePart, largest: float) -> list[list[Start]]:
    return list(_paired(other_itineraries(part, largest)))


@remembered()
def _that_leave(special: SpecialPoint, problem: Problem, largest: float) -> list[list[Start]]:
    return list(_paired(leaving(special, problem, largest)))


def _paired(starts: Iterable[Start]) -> Iterator[list[Start]]:
    """Yield the two directions of one curve together."""
    waiting: list[Start] = []
    for start in starts:
        if waiting and not _same_curve(waiting[0][0], start[0]):
            yield waiting
            waiting = []
        waiting.append(start)
    if waiting:
        yield waiting


def _same_curve(a: Problem, b: Problem) -> bool:
    return a.system is b.system and a.kind is b.kind and a.test == b.test


def _follow_starts(
    state: PlaneExploration, starts: list[Start], special: SpecialPoint | None
) -> None:
    """Trace a curve that leaves a point in one or two directions, unless it is known."""
    if all(_begins_known(state, start) for start in starts[:2]):
        return
    sides = []
    for problem, point, border in starts[:2]:
        side = trace_curve_side(problem, point, border, state.largest, MOST_POINTS)
        tip = side
        while tip.following is not None:
            tip = tip.following
        if tip.tip.arc - side.points[0].arc > _NOWHERE:
            sides.append(side)
    if not sides or all(
        is_known(side.problem, _inner(side), state.curves) is not None for side in sides
    ):
        return
    if all(_is_degenerate(side) for side in sides):
        return
    if len(sides) == 2:
        state.add(join_sides(sides[1], sides[0]), sides)
        return
    problem, start = sides[0].problem, sides[0].points[0]
    if special is None:
        state.add(join_sides(None, sides[0], CurveEnd(CurveEndReason.START)), sides)
        return
    there = replace(special, orbit=problem.orbit(start.joints, start.w), tests=())
    first = CurveEnd(CurveEndReason.START, special=there)
    state.add(join_sides(None, sides[0], first), sides)


def _is_degenerate(side: CurveSide) -> bool:
    """Tell whether another margin vanishes all along a side: the curve is that of two events at once.

    Its equations are singular, where it goes is rounding, and it ends at the first sign that this has.
    Without damping Omega = 1/2 is such a line: a CS and an AS of a continuum of orbits happen there at once.
    """
    longest, piece = side, side.following
    while piece is not None:
        longest = max(longest, piece, key=lambda s: s.tip.arc - s.points[0].arc)
        piece = piece.following
    margins = _inner(longest).tests[: len(longest.problem.system.tests)]
    others = np.abs(np.delete(margins, longest.problem.condition.pinned))
    return bool(np.min(others, initial=np.inf) < _VANISHES)


def _begins_known(state: PlaneExploration, start: Start) -> bool:
    """Tell by its first points whether a curve is one that is known, to its ends.

    Most that leave the points of codimension two are: traced whole before they were asked they took ten times
    as many points as all that was new. Where a known one breaks off another trace may get farther.
    """
    problem, point, border = start
    side = first_points(problem, point, border, state.largest, _FIRST)
    if side.tip.arc - side.points[0].arc <= _NOWHERE:
        return False
    on_the_way = side.end.reason is CurveEndReason.POINTS
    known = is_known(problem, side.tip if on_the_way else _inner(side), state.curves)
    return known is not None and not any(
        end.reason in _BROKEN_OFF for end in state.curves[known].ends
    )


def _inner(side: CurveSide) -> Point:
    """Return a point of a side away from its ends, where curves meet."""
    return side.points[len(side.points) // 2]


# ----------------------------------------------------------------------------------- regions


def _sample_regions(
    state: PlaneExploration, orbit: Orbit, seeds: Seeds | None, max_sections: int
) -> None:
    """Lay sections through regions that none has crossed, largest first, while there are any."""
    tried: set[float] = set()
    while not state.full:
        regions, _ = regions_of(
            orbit.model, state.vector, state.box, state.curves, state.sections, state.max_periods
        )
        open_ = [r for r in regions if not r.sampled and r.share > _SMALL]
        second = state.box.names[1]
        values = [r.point[second] for r in open_ if round(r.point[second], 9) not in tried]
        if not values:
            return
        if len(state.sections) >= max_sections:
            state.notes.append(f"{len(open_)} regions are not sampled (max_sections)")
            return
        tried.add(round(values[0], 9))
        before = len(state.sections)
        _follow_section(state, orbit, second, values[0], seeds)
        if len(state.sections) == before and len(tried) > 2 * max_sections:
            return
