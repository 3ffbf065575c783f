"""Points of codimension two between two points of a curve: bracketed to the resolution of the arithmetic.

Each trial is predicted by the cubic through both ends of the step and corrected normal to the tangent between
them; its watched value decides on which side the place is.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contfric.curves.points import CurvePoint, solve_point
from contfric.curves.problem import Problem
from contfric.models.definition import FloatArray

#: Share of a step to which a place is bracketed: the resolution of the arithmetic.
_RESOLUTION = 4e-16
#: Bisections after which a bracket has that width, whatever the function.
_MOST_TRIALS = 120
#: Values below this are rounding: a narrower bracket would follow noise.
_NOISE = 2e-15

Value = Callable[[CurvePoint], float]


def between(a: CurvePoint, b: CurvePoint, x: float) -> tuple[FloatArray, ...]:
    """Return joints, parameters, tangent and slope at a share of a step, by the cubic through both ends."""
    y, length = 1.0 - x, b.arc - a.arc
    ha, hb = y * y * (1.0 + 2.0 * x), x * x * (3.0 - 2.0 * x)
    ga, gb = x * y * y * length, -x * x * y * length
    joints = ha * a.joints + hb * b.joints + ga * a.tangent + gb * b.tangent
    w = ha * a.w + hb * b.w + ga * a.slope + gb * b.slope
    return joints, w, y * a.tangent + x * b.tangent, y * a.slope + x * b.slope


def point_between(
    problem: Problem, a: CurvePoint, b: CurvePoint, x: float, border: FloatArray
) -> CurvePoint | None:
    """Return the solved point at a share of a step."""
    point = solve_point(problem, *between(a, b, x), border.copy())
    if point is not None:
        point.arc = a.arc + x * (b.arc - a.arc)
    return point


def locate_zero(
    problem: Problem, a: CurvePoint, b: CurvePoint, border: FloatArray, value: Value
) -> tuple[CurvePoint, bool]:
    """Return the place where a value changes sign, and whether it is bracketed to its last digits.

    By regula falsi with Illinois' halving of the end that stays, and a bisection every fourth trial. A
    trial that is not solved counts as beyond the place.
    """
    low, high, f_low, f_high = 0.0, 1.0, value(a), value(b)
    best, sign, side, lost = a, np.sign(f_low) or 1.0, 0, False
    for trial in range(_MOST_TRIALS):
        x = low + (high - low) * f_low / (f_low - f_high) if f_low != f_high else 0.5
        if trial % 4 == 3 or not low < x < high or not np.isfinite(x):
            x = 0.5 * (low + high)
        point = point_between(problem, a, b, x, border)
        f = -sign if point is None else value(point)
        if not np.isfinite(f):
            f = sign
        if point is not None and (abs(f) < abs(value(best)) or f * sign >= 0.0):
            best = point
        if abs(f) <= _NOISE and point is not None:
            return point, True
        if f * sign > 0.0:
            low, f_low = x, f
            f_high = 0.5 * f_high if side == 1 else f_high
            side = 1
        else:
            high, f_high, lost = x, f, point is None
            f_low = 0.5 * f_low if side == -1 else f_low
            side = -1
        if high - low <= _RESOLUTION:
            break
    return best, not lost and abs(value(best)) < 1e-6
