"""Points between two solved points of a branch or curve: predicted by the cubic through both, and solved."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from contfric.base.arrays import FloatArray, with_entries
from contfric.base.interrupts import whole
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import Point, Settings
from contfric.orbit.orbit import Orbit
from contfric.quantities.motion import Directions

#: Resolution of a location, as a share of a step: that of the arithmetic.
_SHORTEST = 1e-15


def cubic_between(
    a: Point, b: Point, x: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return joints, parameters, tangent and direction at a share of a step, by the cubic through both ends.

    It is Hermite's, as in :func:`contfric.continuation.core.geometry.interpolate`.
    """
    y, length = 1.0 - x, b.arc - a.arc
    ha, hb = y * y * (1.0 + 2.0 * x), x * x * (3.0 - 2.0 * x)
    ga, gb = x * y * y * length, -x * x * y * length
    joints = ha * a.joints + hb * b.joints + ga * a.tangent + gb * b.tangent
    w = ha * a.w + hb * b.w + ga * a.direction + gb * b.direction
    return joints, w, y * a.tangent + x * b.tangent, y * a.direction + x * b.direction


def point_between(
    orbit: Orbit, before: Point, after: Point, settings: Settings, share: float
) -> Point | None:
    """Return the solved point at a share of a step, normal to the tangent there; None if it fails."""
    joints, w, tangent, direction = cubic_between(before, after, share)
    vector = with_entries(orbit.vector, orbit.model.index_of(settings.parameter), w[0])
    guess = Orbit(orbit.system, joints, vector, np.inf)
    found = first_point(guess, settings, tangent, float(direction[0]))
    arc = before.arc + share * (after.arc - before.arc)
    return None if found is None else replace(found, arc=arc)


def zero_between(
    orbit: Orbit, before: Point, after: Point, settings: Settings, value: Callable[[Point], float]
) -> Point | None:
    """Return the point of a step at which a value of its solved points is zero; None if Newton fails.

    The value has different signs at both ends; the location is found by Brent's method. If the value is no
    number somewhere on the way, the point where that is so is returned.
    """
    brentq = whole("scipy.optimize").brentq

    def point_at(share: float) -> Point:
        if share in (0.0, 1.0):
            return before if share == 0.0 else after
        point = point_between(orbit, before, after, settings, share)
        if point is None:
            raise ArithmeticError
        return point

    undefined: list[Point] = []

    def value_at(share: float) -> float:
        point = point_at(share)
        found = value(point)
        if math.isnan(found):
            undefined.append(point)
            return 0.0  # which ends the search
        return found

    try:
        found = point_at(float(brentq(value_at, 0.0, 1.0, xtol=_SHORTEST, rtol=4.0 * _SHORTEST)))
        return undefined[0] if undefined else found
    except ArithmeticError:
        return None  # inside of the step, near an event


def along(point: Point, orbit: Orbit, parameter: str) -> Directions:
    """Return the direction of a branch at one of its points: that of growing arclength."""
    vector = np.zeros((len(orbit.vector), 1))
    vector[orbit.model.index_of(parameter), 0] = point.slope
    return Directions(point.tangent[:, :, None], vector)
