"""Points of a curve while it is traced, and the calls of the compiled march."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np

from contfric.base.tally import tally
from contfric.continuation.points import SMALLEST_STEP, Point, Rows
from contfric.curves.problem import Problem, border_of
from contfric.models.definition import FloatArray
from contfric.orbit.linear import assembled
from contfric.orbit.orbit import Orbit
from contfric.orbit.pace import Pace

#: Points that are marched at a time: limits of the parameters are looked at after each.
CHUNK = 128
#: How much one call of the march may do; all curves of a process share what was learned.
_PACE = Pace()
#: The first point is the orbit of the bifurcation to this: located events are good to about 1e-6 at worst.
_SAME_ORBIT = 1e-3


def paced(
    call: Callable[[FloatArray, int, int], tuple[int, int, float]],
    k: int,
    taken: int,
    step: float,
    largest: float,
) -> tuple[int, int, float]:
    """March on from row k by calls between which Ctrl-C is heard; (why it stopped, last row, next step).

    ``call`` takes the options of a march, the last row, and the points since the curve began.
    """
    from contfric.continuation.march import BUDGET, MORE

    why, last = MORE, k
    # a step that is refused for its angle is halved, down to the least
    options = np.array([min(step, largest), largest, SMALLEST_STEP, 0.0, 1.0, 0.0])
    while why == MORE:
        options[BUDGET], before, began = _PACE.budget, int(tally()[0]), perf_counter()
        taken, k = taken + last - k, last
        why, last, options[0] = call(options, k, taken)
        _PACE.took(int(tally()[0]) - before, perf_counter() - began)
    return int(why), int(last), float(options[0])


def march_rows(
    problem: Problem,
    rows: Rows,
    k: int,
    start: Point,
    taken: int,
    border: FloatArray,
    step: float,
    largest: float,
    accuracy: float,
) -> tuple[int, int, float]:
    """March on from row k; return (why it stopped, last row, next step)."""
    from contfric.curves.march import march_curve

    system, box, second = problem.system, problem.box, problem.model.flow.second_derivatives
    corners, first = np.array([box.low, box.high, box.widths]), start.as_start()

    def call(options: FloatArray, at: int, passed: int) -> tuple[int, int, float]:
        return march_curve(  # type: ignore[no-any-return]
            *(system.functions(), second, system.layout, problem.condition, problem.vector),
            *(problem.which, accuracy, options, corners, at, *first, passed, border),
            *(rows.arrays(), tally()),
        )

    return paced(call, k, taken, step, largest)


def solve_point(
    problem: Problem,
    joints: FloatArray,
    w: FloatArray,
    tangent: FloatArray,
    slope: FloatArray,
    border: FloatArray,
) -> Point | None:
    """Solve for one point normal to a direction; ``border`` is made to follow it. None if Newton fails."""
    from contfric.continuation.march import BROKEN
    from contfric.continuation.steps import AT_EVENT

    rows = Rows.empty(problem.system, 1, 2)
    rows.joints[0], rows.w[0] = joints, w
    rows.tangents[0], rows.directions[0] = tangent, slope
    why, _, _ = march_rows(problem, rows, -1, rows.point(0), 0, border, 0.0, 1.0, AT_EVENT)
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
