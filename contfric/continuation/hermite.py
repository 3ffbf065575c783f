"""Points between two solved points of a branch: predicted by the cubic through both, and solved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.continuation.points import Point, Settings
from contfric.continuation.side import first_point
from contfric.orbit.orbit import Orbit
from contfric.quantities.motion import Directions


def point_between(
    orbit: Orbit, before: Point, after: Point, settings: Settings, share: float
) -> Point | None:
    """Return the solved point at a share of a step, normal to the tangent there; None if Newton fails.

    The prediction is Hermite's cubic, as in :func:`contfric.continuation.geometry.interpolate`.
    """
    x, y, length = share, 1.0 - share, after.arc - before.arc
    ha, hb = y * y * (1.0 + 2.0 * x), x * x * (3.0 - 2.0 * x)
    ga, gb = x * y * y * length, -x * x * y * length
    joints = ha * before.joints + hb * after.joints + ga * before.tangent + gb * after.tangent
    value = ha * before.value + hb * after.value + ga * before.slope + gb * after.slope
    vector = orbit.vector.copy()
    vector[orbit.model.index_of(settings.parameter)] = value
    guess = Orbit(orbit.system, joints, vector, np.inf)
    tangent, slope = y * before.tangent + x * after.tangent, y * before.slope + x * after.slope
    found = first_point(guess, settings, tangent, slope)
    return None if found is None else replace(found, arc=before.arc + x * length)


def along(point: Point, orbit: Orbit, parameter: str) -> Directions:
    """Return the direction of a branch at one of its points: that of growing arclength."""
    vector = np.zeros((len(orbit.vector), 1))
    vector[orbit.model.index_of(parameter), 0] = point.slope
    return Directions(point.tangent[:, :, None], vector)
