"""One curve, traced in both directions from its start to its ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.continuation.points import FIRST_STEP, LARGEST_STEP, MOST_POINTS, Point
from contfric.curves.after_event import Start, goes_on, is_continuum, prove
from contfric.curves.assembly import join_sides
from contfric.curves.codimension_two.births import birth_among
from contfric.curves.curve import Curve
from contfric.curves.half_curve import CurveSide, end_at_birth, end_at_limit, near_limit, resolve
from contfric.curves.points import end_of_march, first_curve_point, march_on
from contfric.curves.problem import Problem, check_start, problem_of
from contfric.curves.ranges import box_of
from contfric.curves.special import CurveEnd, CurveEndReason
from contfric.errors import (
    ConvergenceError,
    ParameterError,
    function_of,
    real_number,
    whole_number,
)
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.models.definition import Model
from contfric.remember.journal import remembered

#: A first point farther than this from the bifurcation (in widths of the ranges) is another one.
_SAME_START = 1e-4
#: A segment that lasts less than minus this does not exist.
_NO_TIME = 1e-9
#: Most changes of the signature along one side of a curve: a chain longer than this goes round.
_MOST_CHANGES = 24
#: A piece of a curve that is shorter than this is at one location: located events are good to 1e-9 or so.
_AT_ONE_LOCATION = 1e-6

Progress = Callable[[str], None]


def continue_bifurcation(
    bifurcation: Bifurcation,
    parameters: tuple[str, str],
    ranges: Mapping[str, tuple[float, float]],
    *,
    max_step: float | None = None,
    max_points: int = MOST_POINTS,
    progress: Progress | None = None,
) -> Curve:
    """Continue a bifurcation in two parameters, both ways, to the ends of its curve.

    Parameters
    ----------
    bifurcation : Bifurcation
        An SN, BP, PD, NS, CS, SS, AS, GS or T of a branch or of a diagram.
    parameters : (str, str)
        The two parameters, such as ``("Omega", "S")``.
    ranges : dict
        Where each of them may go.
    max_step : float, optional
        Largest step along the curve, as a share of the ranges (times 1 + the size of the state); that
        of the model by default, 0.01 if it declares none.
    max_points : int
        Most points of each side; a curve that reaches it says so.
    progress : callable, optional
        Called with one line of text now and then.

    Returns
    -------
    Curve
        With k points: ``values`` of both parameters, shape (k, 2); ``special``, its points of codimension
        two; and two ``ends``.

    Raises
    ------
    ParameterError
        If the parameters, the ranges or the step are not valid, or the bifurcation has no curve.
    ConvergenceError
        If the curve has no unique direction at the start.

    Notes
    -----
    SN, BP and PD are zeros of a bordered function of the chain's Jacobian (Govaerts 2000); CS, SS,
    AS, GS and T of their own margins; NS of the logarithm of the product of its pair.
    ``docs/curves.md`` has the derivation.

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> fold = cf.continue_orbit(orbit, "Omega", (0.4, 0.6)).bifurcations[-2]
    >>> cf.continue_bifurcation(fold, ("Omega", "S"), {"Omega": (0.5, 0.6), "S": (0.2, 0.4)}).label
    'SN_1a'
    """
    if not isinstance(bifurcation, Bifurcation):
        raise ParameterError(
            f"a curve starts from a Bifurcation, got {type(bifurcation).__name__}: take one of "
            "branch.bifurcations or diagram.bifurcations"
        )
    box = box_of(bifurcation.orbit.model, parameters, ranges)
    largest = checked_options(bifurcation.orbit.model, max_step, max_points, progress)
    if bifurcation.kind is Kind.NS:
        from contfric.curves.of_quantities.torus import continue_torus

        check_start(bifurcation, box)
        return continue_torus(bifurcation, box, largest, max_points, progress)
    problem = problem_of(bifurcation, box)
    problem, start, border = start_of_curve(problem, bifurcation, largest)
    ahead = trace_curve_side(problem, start, border, largest, max_points, progress, keep=True)
    if ahead.end.reason is CurveEndReason.CLOSED:
        return join_sides(None, ahead)
    if ahead.last.end.reason is CurveEndReason.INTERRUPTED:
        return join_sides(None, ahead, CurveEnd(CurveEndReason.INTERRUPTED))
    behind = trace_curve_side(
        problem, start.reversed(), border, largest, max_points, progress, keep=True
    )
    return join_sides(behind, ahead)


def checked_options(model: Model, max_step: Any, max_points: Any, progress: Any) -> float:
    """Check what a user gives to any curve; return the largest step."""
    whole_number("max_points", max_points, least=2)
    function_of("progress", progress)
    return largest_step(max_step, model)


def largest_step(max_step: Any, model: Model) -> float:
    """Return the largest step as a share of the ranges: what is asked for, or the model's."""
    if max_step is None:
        return model.max_step or LARGEST_STEP
    given = real_number("max_step", max_step, wanted="is a share of the ranges, in (0, 1]")
    if not 1e-8 <= given <= 1.0:
        raise ParameterError(f"max_step is a share of the ranges, from 1e-8 to 1, got {max_step!r}")
    return given


def start_of_curve(problem: Problem, bifurcation: Bifurcation, largest: float) -> Start:
    """Return the problem of a curve, its first point and the border there.

    Raises
    ------
    ConvergenceError
        If Newton fails there, ends somewhere else, or no orbit near it is admissible.
    """
    near = bifurcation.orbit
    orbit = problem.orbit(problem.joints_of(near), near.vector[problem.which])
    found = first_curve_point(problem, orbit)
    if found is None:
        raise ConvergenceError(f"{bifurcation!r} has no curve with a unique direction", orbit)
    point, border = found
    moved = np.max(np.abs(point.w - orbit.vector[problem.which]) / problem.box.widths)
    if moved > _SAME_START:
        raise ConvergenceError(
            f"the curve found near {bifurcation!r} is {moved:.2g} of the ranges away: it is another one",
            orbit,
        )
    if problem.kind is Kind.T:
        return problem, point, border
    for start in (point, point.reversed()):
        proved = prove(problem, start, border, largest)
        if proved is not None:
            point.tests = start.tests
            return proved, point, border
    text = "are a continuum, each marginally stable" if is_continuum(problem, point) else ""
    raise ConvergenceError(
        f"the orbits on the curve near {bifurcation!r} {text or 'are not admissible'}", orbit
    )


def trace_curve_side(
    problem: Problem,
    start: Point,
    border: FloatArray,
    largest: float,
    max_points: int,
    progress: Progress | None = None,
    passed: tuple[tuple[Problem, float], ...] = (),
    keep: bool = False,
) -> CurveSide:
    """Follow a curve from a point along its tangent until it ends, through changes of its signature.

    ``passed`` is what it was before, and the arclengths at which that ended: at one location each comes
    once. ``keep`` is that of :func:`contfric.continuation.trace.trace_side`.
    """
    side = _trace_piece(problem, start, border, largest, max_points, progress, keep)
    special = side.end.special
    passed = *passed, (problem, side.tip.arc)
    meets = side.end.reason is CurveEndReason.MEETS and len(passed) <= _MOST_CHANGES
    if meets and special is not None:
        try:
            on = goes_on(problem, side.ahead, special, largest)
        except KeyboardInterrupt:
            if not keep:
                raise
            side.end = CurveEnd(CurveEndReason.INTERRUPTED, special=special)
            return side
        here = [was for was, arc in passed if side.tip.arc - arc < _AT_ONE_LOCATION]
        if on is not None and not any(_is_same(on[0], was) for was in here):
            other, point, border = on
            point.arc = side.tip.arc
            side.following = trace_curve_side(
                other, point, border, largest, max_points, progress, passed, keep
            )
    return side


def first_points(
    problem: Problem, start: Point, border: FloatArray, largest: float, count: int
) -> CurveSide:
    """Follow a curve for so many points at most, and not beyond a change of its signature."""
    return _trace_piece(problem, start, border, largest, count, None, False)


def _is_same(one: Problem, other: Problem) -> bool:
    """Tell whether two problems follow the same condition in the same itinerary."""
    return one.test == other.test and one.system.itinerary == other.system.itinerary


def _went_to_its_end(side: CurveSide) -> bool:
    return side.end.reason is not CurveEndReason.INTERRUPTED


@remembered(finished=_went_to_its_end)
def _trace_piece(
    problem: Problem,
    start: Point,
    border: FloatArray,
    largest: float,
    max_points: int,
    progress: Progress | None,
    keep: bool,
) -> CurveSide:
    """Follow a curve from a point to its end, or to the next change of its signature."""
    side = CurveSide(problem, [start], border.copy())
    step = FIRST_STEP * largest
    while True:
        try:
            finished, step = _advance(side, step, largest, max_points)
        except KeyboardInterrupt:
            if not keep:
                raise
            side.end = CurveEnd(CurveEndReason.INTERRUPTED)
            return side
        if progress is not None:
            where = problem.box.text(side.tip.w)
            progress(f"{problem.kind.value}: {len(side.points)} points, {where}")
        if finished:
            return side


def _advance(side: CurveSide, step: float, largest: float, most: int) -> tuple[bool, float]:
    """March once and deal with what stopped it; (whether the side is finished, next step)."""
    from contfric.continuation.core.march import EVENT, OUTSIDE

    if len(side.points) >= most:
        side.end = CurveEnd(CurveEndReason.POINTS)
        return True, step
    problem, border = side.problem, side.border.copy()
    marched = march_on(problem, side.points, border, step, largest, most)
    rows, first, stop, why, step = marched
    fresh = rows.points(first, stop)
    lasting = stop - 1 if why == EVENT else stop  # the last point lies after an event
    gone = _first(~np.all(np.diff(rows.joints[first:lasting, :, 0]) > -_NO_TIME, axis=1))
    if gone is not None:
        side.points += fresh[:gone]
        side.end = CurveEnd(CurveEndReason.LOST)
        return True, step
    limit = _first(problem.within_limits(rows.w[first:stop]) < 0.0)
    birth = birth_among(problem, [*side.points[-1:], *fresh]) if fresh else None
    if birth is not None and (limit is None or birth <= limit):
        return end_at_birth(side, fresh, birth), step
    if limit is not None:
        side.points += fresh[:limit]
        return end_at_limit(side, fresh[limit]), step
    if why in (EVENT, OUTSIDE):
        side.points += fresh[:-1]
        return resolve(side, fresh[-1], border), step
    side.points += fresh
    side.border = border
    reason = end_of_march(why)
    if reason is not None:
        side.end = near_limit(problem, side.tip) or CurveEnd(reason)
    return reason is not None, step


def _first(flags: NDArray[np.bool_]) -> int | None:
    """Return the first index that is true; None if none is."""
    locations = np.flatnonzero(flags)
    return int(locations[0]) if len(locations) else None
