"""Points of codimension two between two points of a curve: bracketed to the resolution of the arithmetic.

Each trial is predicted by the cubic through both ends of the step and corrected normal to the tangent between
them; its watched value decides on which side the location is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.interrupts import whole
from contfric.base.tally import tally
from contfric.continuation.hermite import cubic_between
from contfric.continuation.locating.change_of_sign import sought_of
from contfric.continuation.points import Point, PointRows
from contfric.curves.points import Conditioned, compiled_problem, solve_point

if TYPE_CHECKING:
    from contfric.continuation.core.locate import Sought

#: Share of a step to which a location is bracketed: the resolution of the arithmetic.
_RESOLUTION = 4e-16
#: Rounding of a number.
_ROUNDING = float(np.finfo(float).eps)
#: Values below this are rounding: a narrower bracket would follow noise.
_NOISE = 2e-15
#: Share of the way to a location after which another bracket begins: some other place.
_SHORTER = 0.38
#: Locations of two brackets that agree to this share of the ranges are one: where Newton's method is regular
#: they do to 1e-12, where it is singular to the root of rounding.
_SAME_LOCATION = 1e-10

Value = Callable[[Point], float]
P = TypeVar("P", bound=Conditioned)


@dataclass(frozen=True, eq=False)
class CurveStep(Generic[P]):
    """A step of a curve in which something may change its sign.

    Attributes
    ----------
    problem : what the curve follows
    before, after : the solved points at its ends
    border : that of the first, shape (2, N, m)
    """

    problem: P
    before: Point
    after: Point
    border: FloatArray

    def point_at(self, share: float) -> Point | None:
        """Return the solved point at a share of the step."""
        a, b = self.before, self.after
        point = solve_point(self.problem, *cubic_between(a, b, share), self.border.copy())
        if point is not None:
            point.arc = a.arc + share * (b.arc - a.arc)
        return point

    def zero_of(self, value: Value) -> tuple[Point, bool]:
        """Return the location where a value changes sign, and whether it is bracketed to its last digits.

        By Brent's method. A trial that is not solved counts as beyond the location, and so does the far end.
        """
        brentq = whole("scipy.optimize").brentq

        first, last = value(self.before), value(self.after)
        sign = float(np.sign(first)) or 1.0
        best, left, lost = self.before, abs(first), False

        def value_at(x: float) -> float:
            nonlocal best, left, lost
            if x in (0.0, 1.0):
                return first if x == 0.0 else -sign * max(-sign * last, _NOISE)
            point = self.point_at(x)
            f = -sign if point is None else value(point)
            f = f if np.isfinite(f) else sign
            if f * sign <= 0.0:
                lost = point is None
            if point is not None and (abs(f) < left or f * sign >= 0.0):
                best, left = point, abs(f)
            return 0.0 if abs(f) <= _NOISE else f

        if first != 0.0:
            brentq(value_at, 0.0, 1.0, xtol=_RESOLUTION, rtol=4.0 * _ROUNDING)
        return best, not lost and left < 1e-6

    def located(self, sought: Sought) -> tuple[Point, bool]:
        """Return the location of a change, and whether it is bracketed to its last digits; compiled."""
        from contfric.curves.core.bracket import locate_on_curve

        rows = PointRows.empty(self.problem.system, 4, 2)
        rows.put(0, self.before)
        rows.put(1, self.after)
        compiled = compiled_problem(self.problem)
        status, _ = locate_on_curve(compiled, self.border.copy(), sought, rows.arrays(), tally())
        return (self.before, False) if status < 0 else (rows.point(3), status == 1)

    def located_twice(self, sought: Sought) -> tuple[Point, bool]:
        """Return the location of a change, and whether another bracket finds it at the same parameters."""
        point, fine = self.located(sought)
        return point, fine and self.found_again(sought, point)

    def found_again(self, sought: Sought, point: Point) -> bool:
        """Tell whether another bracket finds a location at the same parameters.

        Where another curve of the same condition passes through, or conditions degenerate, Newton's method is
        singular: each bracket closes to its last digits, and each somewhere else.
        """
        a, b = self.before.arc, self.after.arc
        if not a < point.arc < b:
            return True
        start = self.point_at(_SHORTER * (point.arc - a) / (b - a))
        if start is None:
            return False
        again, fine = replace(self, before=start).located(sought)
        gap = float(np.max(np.abs(again.w - point.w) / self.problem.box.widths))
        return fine and gap < _SAME_LOCATION


def by_test(index: int) -> Sought:
    """Return the search for the zero of one test."""
    from contfric.continuation.core.locate import BY_TEST

    return sought_of(BY_TEST, index)


def by_label(row: int) -> Sought:
    """Return the search for the change of one label."""
    from contfric.continuation.core.locate import BY_LABEL

    return sought_of(BY_LABEL, row)


def by_location(planes: FloatArray) -> Sought:
    """Return the search for where the least of ``a p + b q + c`` vanishes."""
    from contfric.continuation.core.locate import BY_PARAMETER

    return sought_of(BY_PARAMETER, planes=planes)
