"""A branch that ends where a quantity takes a value: between which points, and where exactly.

Between two points at which the quantity lies on both sides of the value the location is located by Brent's
method, each trial a solved orbit. Where it comes near and goes away again, the cubic through values and
slopes of both ends of a step says whether it reaches the value between them; the solved orbit at the
extremum of that cubic decides.

Branches of a diagram are listed up to the symmetry of the model, and which of two mirror images is followed
is chance: such a branch ends where the quantity of either has the value.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from contfric.continuation.half_branch import Side
from contfric.continuation.hermite import along, point_between, zero_between
from contfric.continuation.points import Point, Settings
from contfric.events.bifurcation import End, EndReason
from contfric.orbit.orbit import Orbit
from contfric.quantities.measure import differentiated
from contfric.quantities.motion import Directions
from contfric.quantities.registry import Quantity, quantity_of

#: A start whose quantity is this near to the value (relative to 1 + its size) is at it, and leaves it.
_AT_VALUE = 1e-9
#: A quantity that jumps past the value, or passes it by a pole, changes its sign there too, and Brent's
#: method ends there. It does not come nearer to the value than this share of the nearer end of the bracket.
_LEAST = 0.1
#: How near to the value the cubic has to come, as a share of the nearer end of a step, to be looked at.
_NEAR = 0.1


@dataclass(frozen=True)
class Stop:
    """Where a branch ends: the point, and the end."""

    point: Point
    end: End


@dataclass(frozen=True, eq=False)
class _Sought:
    """The value of a quantity that a branch is to end at; of its mirror image if ``mirrored``."""

    orbit: Orbit
    settings: Settings
    quantity: Quantity
    value: float
    mirrored: bool = False

    def miss(self, point: Point) -> float:
        """Return by how much the quantity is above the value."""
        return float(differentiated(self.quantity, self._orbit(point), None).value - self.value)

    def slope(self, point: Point) -> float:
        """Return how fast it grows along the branch."""
        orbit = self._orbit(point)
        ahead = along(point, orbit, self.settings.parameter)
        if self.mirrored:
            ahead = self._image_of(ahead, orbit)
        return float(differentiated(self.quantity, orbit, ahead).ahead[0])

    def _image_of(self, ahead: Directions, orbit: Orbit) -> Directions:
        """Return the direction of the mirror images: states mapped, times later by a share of the period."""
        symmetry = self.orbit.model.symmetry
        assert symmetry is not None
        joints = np.array(ahead.joints)
        joints[:, 1:, 0] = ahead.joints[:, 1:, 0] @ symmetry.array().T
        if not orbit.model.autonomous:
            every = np.arange(len(orbit.vector), dtype=np.int64)
            grad = np.empty(len(orbit.vector))
            orbit.model.flow.period(orbit.vector, every, grad)
            joints[:, 0, 0] += symmetry.fraction * (grad @ ahead.vector[:, 0])
        return replace(ahead, joints=joints)

    def _orbit(self, point: Point) -> Orbit:
        active = self.orbit.model.index_of(self.settings.parameter)
        found = point.orbit(self.orbit, active)
        return found.mirror() if self.mirrored else found

    def crossing(self, before: Point, after: Point) -> Stop | None:
        """Return the location between two points on both sides of the value; None at a jump or pole."""
        last = before

        def miss_at(point: Point) -> float:
            nonlocal last
            last = last if point is after else point
            return self.miss(point)

        reached = f"{self.quantity.name} = {self.value:g}"
        point = zero_between(self.orbit, before, after, self.settings, miss_at)
        if point is None:
            lies = f"{reached} lies beyond this point, and Newton fails on the way"
            return Stop(last, End(EndReason.STOP, lies))
        found, ends = abs(self.miss(point)), (abs(self.miss(before)), abs(self.miss(after)))
        if not (found <= _AT_VALUE * (1.0 + abs(self.value)) or found < _LEAST * min(ends)):
            return None
        return Stop(point, End(EndReason.STOP, f"{EndReason.STOP.value}: {reached}"))


def stop_between(orbit: Orbit, before: Point, after: Point, settings: Settings) -> Stop | None:
    """Return the first location of a step at which a quantity takes the value to stop at, or None."""
    stops = [
        _reached(sought, before, after, sought.miss(before), sought.miss(after), may_dip=True)
        for sought in _all_sought(orbit, settings)
    ]
    return min(filter(None, stops), key=lambda stop: stop.point.arc, default=None)


def stop_among(orbit: Orbit, side: Side, settings: Settings, fresh: int, last: int) -> bool:
    """End a side at the first of its new steps in which a value to stop at is taken; True if one is.

    Parameters
    ----------
    fresh : points that were added since it was last asked
    last : the last row that is looked at
    """
    stops = [
        _first_stop(sought, side, max(side.last - fresh, 0), last)
        for sought in _all_sought(orbit, settings)
    ]
    found = min(filter(None, stops), key=lambda pair: pair[1].point.arc, default=None)
    if found is not None:
        row, stop = found
        side.end_at(row, stop.point, stop.end)
    return found is not None


def _all_sought(orbit: Orbit, settings: Settings) -> Iterator[_Sought]:
    for name, value in settings.stop_at:
        quantity = quantity_of(name, orbit.model)
        yield _Sought(orbit, settings, quantity, value)
        if settings.up_to_mirror and orbit.model.symmetry and not orbit.system.half:
            yield _Sought(orbit, settings, quantity, value, mirrored=True)


def _first_stop(sought: _Sought, side: Side, first: int, last: int) -> tuple[int, Stop] | None:
    """Return the first step between two rows in which the value is taken, by its first row."""
    points = side.rows.points(first, last + 1)
    misses = [sought.miss(point) for point in points]
    if side.count - (side.last - first) == 1 and misses and _is_zero(misses[0], sought):
        points, misses, first = points[1:], misses[1:], first + 1  # it starts at the value
    far = [np.inf, *np.abs(misses), np.inf]  # beyond the rows anything may lie
    for k in range(len(points) - 1):
        near = far[k] >= far[k + 1] and far[k + 2] <= far[k + 3]
        stop = _reached(sought, points[k], points[k + 1], misses[k], misses[k + 1], may_dip=near)
        if stop is not None:
            return first + k, stop
    return None


def _is_zero(miss: float, sought: _Sought) -> bool:
    return abs(miss) < _AT_VALUE * (1.0 + abs(sought.value))


def _reached(
    sought: _Sought, before: Point, after: Point, a: float, b: float, *, may_dip: bool
) -> Stop | None:
    """Return where a step takes the value: at a change of sign, or where it dips across and back."""
    if a * b <= 0.0:
        return sought.crossing(before, after)
    share = _dip(a, b, before, after, sought) if may_dip else None
    if share is None:
        return None
    middle = point_between(sought.orbit, before, after, sought.settings, share)
    if middle is None or a * sought.miss(middle) > 0.0:
        return None
    return sought.crossing(before, middle)


def _dip(a: float, b: float, before: Point, after: Point, sought: _Sought) -> float | None:
    """Return the share of a step at which a quantity comes nearest to the value, if it turns there.

    By the cubic that has values a and b, of one sign, and the slopes at both ends. It is asked for where
    it comes within a tenth of the nearer end, as a cubic is no more than that.
    """
    if not np.isfinite([a, b]).all():
        return None
    sign, length = float(np.sign(a)), after.arc - before.arc
    p = length * sought.slope(before)
    if sign * p >= 0.0:
        return None
    q = length * sought.slope(after)
    if sign * q <= 0.0 or not np.isfinite([p, q]).all():
        return None
    cubic = np.polynomial.Polynomial([a, p, 3.0 * (b - a) - 2.0 * p - q, 2.0 * (a - b) + p + q])
    roots = np.asarray(cubic.deriv().roots(), dtype=np.complex128)
    inside = [float(r.real) for r in roots if abs(r.imag) < 1e-12 and 0.0 < float(r.real) < 1.0]
    heights = {share: sign * float(np.asarray(cubic(share))) for share in inside}
    share = min(inside, key=heights.__getitem__, default=None)
    return None if share is None or heights[share] > _NEAR * min(abs(a), abs(b)) else share
