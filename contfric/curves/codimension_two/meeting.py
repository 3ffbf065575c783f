"""Points at which SN, BP or PD meets a tangential exit: both conditions are solved at once.

The rate of such an exit vanishes. Where a stick follows, nothing that comes later depends on when it is
reached, and the multipliers have a limit (:mod:`contfric.bvp.saltation`). But the chain's Jacobian has the
time of that joint as a null vector, all along the curve of the exit: the bordered function vanishes on both
curves, and its gradient where they cross. Newton's method on the curve of the multiplier is singular there,
and a bracket gets no closer than the root of rounding. The curve of the exit is regular: on it the product of
``1 - s mu`` over all multipliers mu has a simple zero.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.base.interrupts import whole
from contfric.bvp.assembly import following_modes
from contfric.bvp.passages import Passage, passage_at
from contfric.bvp.system import EventFunction, Margin
from contfric.continuation.points import Point
from contfric.curves.points import first_curve_point, solve_point
from contfric.curves.problem import Problem
from contfric.orbit.orbit import Orbit

#: A rate at an exit below this vanishes with the margin that a bracket has found: that ends some 1e-5 away.
_TANGENTIAL = 1e-3
#: First step of the secant method, in arclength: a bracket that is singular ends some 1e-5 away.
_FIRST = 1e-5
#: A step of the secant method that is this short has found the point: rounding of the multipliers (1e-14)
#: over the least slope that is expected (1e-4).
_CONVERGED = 1e-10
#: Most steps of the secant method: it takes five or six.
_MOST = 20
#: A point farther than this from where the curve was bracketed (in widths of the ranges) is another one.
_SAME_POINT = 1e-3
#: What is left of the product of ``1 - s mu`` where a multiplier is s: at a point of a curve it is rounding,
#: which a nearly tangential exit enlarges by one over its rate.
_NO_MULTIPLIER = 1e-6


def multiplier_left(orbit: Orbit, sign: float) -> float:
    """Return the product of ``1 - sign mu`` over the multipliers of a turn: zero where one is sign."""
    return float(np.prod(1.0 - sign * orbit.turn_multipliers).real)


def has_multiplier(problem: Problem, orbit: Orbit) -> bool:
    """Tell whether an orbit has the multiplier of a curve; of one that follows a margin none is asked."""
    return (
        problem.test is not None
        or abs(multiplier_left(orbit, problem.condition.sign)) < _NO_MULTIPLIER
    )


def at_once(problem: Problem, point: Point, fine: bool, test: EventFunction) -> tuple[Point, bool]:
    """Return where a curve meets a margin, and whether it is located; as it is where brackets are regular."""
    exit_ = _regular_exit(problem, point, test)
    if exit_ is None:
        return point, fine
    found = with_multiplier(
        _of_exit(problem, exit_), problem.orbit(point.joints, point.w), problem.condition.sign
    )
    if found is None:
        return point, False
    tests = point.tests.copy()
    tests[: len(problem.system.tests)] = problem.orbit(found.joints, found.w).margins
    return replace(point, joints=found.joints, w=found.w, tests=tests), True


def _regular_exit(problem: Problem, point: Point, test: EventFunction) -> EventFunction | None:
    """Return the tangential exit of a margin's segment if multipliers have a limit there; else None."""
    exit_ = replace(test, margin=Margin.EXIT)
    system, i = problem.system, test.segment
    if problem.test is not None or exit_ not in system.tests:
        return None
    if not abs(point.tests[system.tests.index(exit_)]) < _TANGENTIAL:
        return None
    following = following_modes(problem.model, system.itinerary, system.half)[i]
    passage = passage_at(problem.model, *system.itinerary[i], following)
    return None if passage is Passage.JUMP else exit_


def _of_exit(problem: Problem, exit_: EventFunction) -> Problem:
    """Return the problem of the curve along which an exit is tangential."""
    from contfric.curves.equations.conditions import EXIT, Condition

    none = np.empty(0, dtype=np.int64)
    surface = problem.model.surface_index[exit_.surface]
    condition = Condition(EXIT, exit_.segment, surface, 1.0, -1, none, none)
    return replace(problem, condition=condition, test=exit_)


def with_multiplier(own: Problem, near: Orbit, sign: float) -> Point | None:
    """Return the point of a margin's curve at which orbits have a multiplier, by the secant method."""
    root_scalar = whole("scipy.optimize").root_scalar

    first = first_curve_point(own, near)
    if first is None:
        return None
    (start, border), last = first, first[0]

    def value_at(x: float) -> float:
        nonlocal last
        joints, w = start.joints + x * start.tangent, start.w + x * start.direction
        point = solve_point(own, joints, w, start.tangent, start.direction, border.copy())
        if point is None:
            return float("nan")
        last = point
        return multiplier_left(own.orbit(point.joints, point.w), sign)

    found = root_scalar(
        value_at, method="secant", x0=0.0, x1=_FIRST, xtol=_CONVERGED, maxiter=_MOST
    )
    moved = np.max(np.abs(last.w - near.vector[own.which]) / own.box.widths)
    return last if found.converged and moved < _SAME_POINT else None
