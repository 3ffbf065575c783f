"""Points of a curve while it is traced, and calls of the compiled march: q parameters, q - 1 conditions."""

from __future__ import annotations

from contextlib import AbstractContextManager
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.base.pace import Pace
from contfric.base.tally import tally
from contfric.bvp.linear import assembled
from contfric.bvp.system import System
from contfric.continuation.points import SMALLEST_STEP, Point, PointRows
from contfric.curves.problem import Problem, border_of
from contfric.curves.ranges import Ranges
from contfric.curves.special import CurveEndReason
from contfric.orbit.orbit import Orbit

if TYPE_CHECKING:
    from contfric.curves.core.correct import CurveProblem
    from contfric.curves.equations.conditions import Condition
    from contfric.curves.equations.held_conditions import Conditions

#: Points that are marched at a time: limits of the parameters are looked at after each.
CHUNK = 128
#: Size of a correction after which no other is asked for on the way: that of branches.
_ALONG = 3e-13
#: How much one call of the march may do; all curves of a process share what was learned.
_PACE = Pace()
#: The first point is the orbit of the bifurcation to this: located events are good to about 1e-6 at worst.
_SAME_ORBIT = 1e-3


class Conditioned(Protocol):
    """What a curve follows: the equations of its orbits, and q - 1 conditions in q free parameters."""

    @property
    def system(self) -> System:
        """Boundary-value problem of the orbits."""

    @property
    def vector(self) -> FloatArray:
        """All parameters, as they are where the curve starts."""

    @property
    def box(self) -> Ranges:
        """The parameters that vary, with their ranges."""

    @property
    def which(self) -> IntArray:
        """Their indices."""

    def conditions(self) -> tuple[Condition, Conditions]:
        """Return what vanishes, as the compiled engine takes it."""

    def calling(self) -> AbstractContextManager[None]:
        """Return the context in which the compiled engine may call a function of Python."""


def compiled_problem(problem: Conditioned) -> CurveProblem:
    """Return a problem as the compiled engine takes it."""
    from contfric.curves.core.correct import CurveProblem

    system = problem.system
    second, widths = system.model.flow.second_derivatives, problem.box.widths
    condition, held = problem.conditions()
    functions, layout, which = system.functions(), system.layout, problem.which
    return CurveProblem(functions, second, layout, condition, held, problem.vector, which, widths)


def march_rows(
    problem: Conditioned,
    rows: PointRows,
    k: int,
    start: Point,
    taken: int,
    border: FloatArray,
    step: float,
    largest: float,
) -> tuple[int, int, float]:
    """March on from row k by calls between which Ctrl-C is heard; (why it stopped, last row, next step)."""
    from contfric.continuation.core.geometry import Course
    from contfric.continuation.core.march import BUDGET, MORE
    from contfric.continuation.core.steps import AT_EVENT
    from contfric.curves.core.march import march_curve

    compiled, box, counts = compiled_problem(problem), problem.box, tally()
    corners, (start_z, start_w) = np.array([box.low, box.high, box.widths]), start.as_start()
    why, last, arrays = MORE, k, rows.arrays()
    # a step that is refused for its angle is halved, down to the least
    accuracy = _ALONG if k >= 0 else AT_EVENT
    options = np.array([min(step, largest), largest, SMALLEST_STEP, 0.0, 1.0, 0.0, accuracy])
    while why == MORE:
        options[BUDGET], before, began = _PACE.budget, int(counts[0]), perf_counter()
        taken, k = taken + last - k, last
        course = Course(options, corners, k, start_z, start_w, taken, arrays, counts)
        with problem.calling():
            why, last, options[0] = march_curve(compiled, border, course)
        _PACE.took(int(counts[0]) - before, perf_counter() - began)
    return int(why), int(last), float(options[0])


class Marched(NamedTuple):
    """What one march has added: rows from ``first`` to ``stop``, why it stopped, and the next step."""

    rows: PointRows
    first: int
    stop: int
    why: int
    step: float


def march_on(
    problem: Conditioned,
    points: list[Point],
    border: FloatArray,
    step: float,
    largest: float,
    most: int,
) -> Marched:
    """March on from the last of the points of a curve; ``border`` is made to follow."""
    count = len(points)
    first = min(2, count)
    rows = PointRows.empty(problem.system, first + min(CHUNK, most - count), len(problem.which))
    for k in range(first):
        rows.put(k, points[count - first + k])
    why, last, step = march_rows(
        problem, rows, first - 1, points[0], count - 1, border, step, largest
    )
    return Marched(rows, first, last + 1, why, step)


def end_of_march(why: int) -> CurveEndReason | None:
    """Return why a curve ends where its march stops; None where it goes on."""
    from contfric.continuation.core import march as codes

    ends = {
        codes.STEP: CurveEndReason.STEP,
        codes.BROKEN: CurveEndReason.LOST,
        codes.CLOSED: CurveEndReason.CLOSED,
        codes.UNBOUNDED: CurveEndReason.UNBOUNDED,
        codes.ENDLESS: CurveEndReason.PERIOD,
    }
    return ends.get(why)


def solve_point(
    problem: Conditioned,
    joints: FloatArray,
    w: FloatArray,
    tangent: FloatArray,
    slope: FloatArray,
    border: FloatArray,
) -> Point | None:
    """Solve for one point normal to a direction; ``border`` is made to follow it. None if Newton fails."""
    from contfric.continuation.core.march import BROKEN

    rows = PointRows.empty(problem.system, 1, len(w))
    rows.joints[0], rows.w[0] = joints, w
    rows.tangents[0], rows.directions[0] = tangent, slope
    why, _, _ = march_rows(problem, rows, -1, rows.point(0), 0, border, 0.0, 1.0)
    return None if why == BROKEN else rows.point(0)


def first_curve_point(problem: Problem, orbit: Orbit) -> tuple[Point, FloatArray] | None:
    """Return the first point of a curve with its border, solved with one of the parameters fixed.

    Where an exit is tangential the orbit may move although neither parameter does: then the point is
    solved normal to that direction.
    """
    which, flat = problem.which, np.zeros_like(orbit.joints)
    widths = problem.box.widths
    directions = [(flat, widths * np.array([1.0, 0.0])), (flat, widths * np.array([0.0, 1.0]))]
    if problem.test is not None:
        null = np.linalg.svd(assembled(problem.system, orbit.joints, orbit.vector))[2][-1]
        directions.append((null.reshape(orbit.joints.shape), np.zeros(2)))
    for tangent, slope in directions:
        border = border_of(problem, orbit.joints, orbit.vector)
        point = solve_point(problem, orbit.joints, orbit.vector[which], tangent, slope, border)
        if point is not None and np.max(np.abs(point.joints - orbit.joints)) < _SAME_ORBIT:
            return point, border
    return None
