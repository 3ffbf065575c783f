"""Orbits that leave a branch point or a period doubling.

Where two curves of orbits of one problem cross, :mod:`contfric.continuation.singular_points.crossing` has
their directions. At a branch point of a symmetric orbit the problem on the *whole* cycle, at fixed
parameters, has a null vector phi that is antisymmetric; at a period doubling the problem on the cycle run
through twice has one that changes sign after one turn. The branch that leaves is tangent to ``(phi, 0)``; its
first point is solved normal to phi, a small distance away (H. B. Keller, 1977).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.attributes import altered
from contfric.bvp.linear import assembled
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import EXTRA, Point, Settings, displaced
from contfric.continuation.singular_points.crossing import Direction
from contfric.orbit.orbit import Orbit
from contfric.remember.advance import foreseeable

#: Distance from the branch point to the first point of the branch that leaves, in the scaled product:
#: the square root of it is well above the accuracy of a state at a singular point, and the branch is
#: still a parabola there.
LEAVE = 1e-3
#: Where the branch ends sooner than that, the start is taken nearer.
NEARER = (LEAVE, 1e-4, 1e-5, 1e-6, 1e-7)
#: Share of that distance at which nothing else has happened yet.
_AT_ONCE = 0.01
#: On a parabola the parameter has changed by the square of that share there. One that has changed by more
#: than this share of its whole change has a corner between; below the second number changes are rounding.
_CORNER, _NO_CHANGE = 1e-3, 1e-11


class BranchStart(NamedTuple):
    """A point and direction to start a branch from; ``origin`` is the first one, at the event itself."""

    point: Point
    origin: Point


def null_vector(orbit: Orbit) -> FloatArray | None:
    """Return the unit null vector of a system that is singular at fixed parameters, shape (N, m).

    By the singular value decomposition of the assembled Jacobian; done once a branch point. None where that
    has entries that are no numbers, as where a field has no derivative.
    """
    count, m = orbit.joints.shape
    full = assembled(orbit.system, orbit.joints, orbit.vector)
    try:
        vector: FloatArray = np.linalg.svd(full)[2][-1].reshape(count, m)
    except np.linalg.LinAlgError:
        return None
    return vector / float(np.sqrt(np.sum(vector**2) / count))


def null_direction(orbit: Orbit) -> Direction | None:
    """Return the direction of the null vector of a singular orbit, in which the parameter stands."""
    phi = null_vector(orbit)
    return None if phi is None else Direction(phi, 0.0)


@foreseeable()
def leave_along(
    orbit: Orbit, settings: Settings, direction: Direction, distance: float = LEAVE
) -> BranchStart | None:
    """Return a start on the branch that leaves a singular orbit in a direction."""
    active = orbit.model.index_of(settings.parameter)
    moved = displaced(orbit, active, distance * direction.joints, distance * direction.slope)
    point = first_point(moved, settings, direction.joints, direction.slope)
    if point is None:
        return None
    # the tangent points away from the branch point
    away = Direction(point.joints - orbit.joints, point.value - settings_value(orbit, settings))
    if away.cosine(point.tangent, point.slope, settings.scale) < 0.0:
        point = point.reversed()
    at = np.array([settings_value(orbit, settings)])
    origin = replace(point, joints=orbit.joints, w=at, arc=0.0)  # no solve where it is singular
    point.arc = distance
    return BranchStart(point, origin)


def start_nearby(orbit: Orbit, point: Point, settings: Settings, along: FloatArray) -> BranchStart:
    """Return a point next to a singular orbit as the start of a branch that leaves the orbit.

    Parameters
    ----------
    along : how joints move away from the orbit: the branch goes on to that side
    """
    if float(np.sum(along * point.tangent)) < 0.0:
        point = point.reversed()
    value = np.array([settings_value(orbit, settings)])
    origin = altered(point, joints=orbit.joints, w=value, arc=0.0)
    point.arc = float(np.linalg.norm(point.joints - orbit.joints)) / len(orbit.joints) ** 0.5
    return BranchStart(point, origin)


def overshoots(
    orbit: Orbit,
    settings: Settings,
    departure: BranchStart,
    distance: float,
    along: Direction,
) -> bool:
    """Tell whether a start lies behind something that belongs to the branch, too.

    What watches a multiplier -1 has another sign there than near the branch point, a section is touched in
    between, or the branch is no parabola there. Multipliers, and the parameter, may change so fast near a
    touch of a kink.
    """
    from contfric.continuation.core.steps import CHI_MINUS

    nearer = leave_along(orbit, settings, along, _AT_ONCE * distance)
    if nearer is None:
        return bool(orbit.model.kinks)  # elsewhere there is nothing to fail at
    watched = [float(p.tests[CHI_MINUS - EXTRA]) for p in (departure.point, nearer.point)]
    touched = departure.point.labels != nearer.point.labels
    if watched[0] * watched[1] < 0.0 or touched.any():
        return True
    if not orbit.model.kinks:  # a corner would be the error of the event's own location
        return False
    at = settings_value(orbit, settings)
    size = orbit.model.size_of(orbit.model.index_of(settings.parameter), at)
    far, near = departure.point.value - at, nearer.point.value - at
    straight = distance * along.slope  # two curves that cross leave with a slope of their own
    bent = abs(near - _AT_ONCE * straight) > _CORNER * abs(far - straight)
    return bool(bent and abs(near - _AT_ONCE * straight) > _NO_CHANGE * size)


def settings_value(orbit: Orbit, settings: Settings) -> float:
    """Return the value of the varying parameter."""
    return float(orbit.vector[orbit.model.index_of(settings.parameter)])
