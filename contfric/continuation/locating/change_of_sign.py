"""A change of sign between two points of a branch, located on the branch."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray, with_entries
from contfric.base.tally import tally
from contfric.bvp.system import System
from contfric.continuation.half_branch import branch_problem
from contfric.continuation.points import Point, PointRows, Settings
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

if TYPE_CHECKING:
    from contfric.continuation.core.geometry import Points
    from contfric.continuation.core.locate import Sought


#: Cosine of an angle by which no tangent turns over a step: twice the most that is accepted.
_TURNED = 0.76


class _Trials(threading.local):
    """Four rows for locations, of the system last at work in this thread: allocated once a branch."""

    system: System | None = None
    rows: PointRows
    arrays: Points

    def between(self, system: System, before: Point, after: Point, scale: float) -> PointRows:
        """Return the rows with both points, and nothing of an earlier location.

        No step turns by as much as :data:`_TURNED`. A tangent by which one does is rounding: a segment has no
        length there, or two curves cross. A cubic with it would leave the branch. It is the one that is
        farther from the chord; in its place there is that of the parabola through both points.
        """
        if self.system is not system:
            self.rows, self.system = PointRows.empty(system, 4), system
            self.arrays = self.rows.arrays()
        rows = self.rows
        rows.put(0, before)
        rows.put(1, after)
        length = after.arc - before.arc
        if length != 0.0 and _along(before, after.tangent, after.direction, scale) < _TURNED:
            joints, w = (after.joints - before.joints) / length, (after.w - before.w) / length
            far = [_along(point, joints, w, scale) for point in (before, after)]
            bad, good = (0, after) if far[0] < far[1] else (1, before)
            rows.tangents[bad] = 2.0 * joints - good.tangent
            rows.directions[bad] = 2.0 * w - good.direction
        rows.arc[2:], rows.tests[2:], rows.labels[2:], rows.mu[2:] = 0.0, 0.0, 0, 0.0
        return rows


def _along(point: Point, tangent: FloatArray, w: FloatArray, scale: float) -> float:
    """Return the product of the tangent of a point with another one: 1 along the same one."""
    along = float(np.vdot(point.tangent, tangent)) / len(tangent)
    return along + scale * float(point.direction @ w)


_TRIALS = _Trials()


def locate_change(
    orbit: Orbit,
    before: Point,
    after: Point,
    settings: Settings,
    kind: int,
    index: int,
    target: float = 0.0,
) -> Point | None:
    """Locate one change of sign; None if no point could be solved on the way."""
    return _located(orbit, before, after, settings, kind, index, target)[0]


def locate_label(
    orbit: Orbit, before: Point, after: Point, settings: Settings, index: int
) -> list[Point]:
    """Locate a change of a label: the first one, seen from the one point, and the last one if it is another.

    Where every trial had one of the two labels the last change, seen from the other point, is the first:
    the same locations are tried. A change at the first point itself, such as an event at which a branch
    starts, is found without a trial, which says nothing of those after it.
    """
    from contfric.continuation.core.locate import BY_LABEL

    found = []
    for one, other in ((before, after), (after, before)):
        point, plain = _located(orbit, one, other, settings, BY_LABEL, index, 0.0)
        found += [] if point is None else [point]
        if point is not None and plain and point.arc != one.arc:
            break
    return found


def _located(
    orbit: Orbit,
    before: Point,
    after: Point,
    settings: Settings,
    kind: int,
    index: int,
    target: float,
) -> tuple[Point | None, bool]:
    """Return the location of one change of sign, and whether a label changes at one location only."""
    from contfric.continuation.core.locate import BY_TEST, locate

    rows = _TRIALS.between(orbit.system, before, after, settings.scale)
    problem, sought = branch_problem(orbit, settings), sought_of(kind, index, target)
    at, plain = locate(problem, sought, bool(orbit.model.kinks), _TRIALS.arrays, tally())
    # behind -2 Newton fails: the last good point, marked as such
    if at == -1.0 or (at < 0.0 and kind != BY_TEST):
        return None, False
    point = rows.point(3)
    point.lost = bool(at < 0.0)
    return point, plain


_NO_PLANES = np.empty((0, 3))


def sought_of(
    kind: int, index: int = 0, target: float = 0.0, planes: FloatArray = _NO_PLANES
) -> Sought:
    """Return a value whose change of sign is sought, as the compiled bracket takes it."""
    from contfric.continuation.core.locate import Sought

    plain = np.zeros(1, dtype=np.int64)
    return Sought(kind, index, target, np.ascontiguousarray(planes, dtype=np.float64), plain)


def locate_value(
    orbit: Orbit, before: Point, after: Point, settings: Settings, target: float
) -> Point:
    """Return the point at which the parameter takes a value."""
    from contfric.continuation.core.locate import BY_PARAMETER

    if before.value == target:
        return before
    found = locate_change(orbit, before, after, settings, BY_PARAMETER, 0, target)
    if found is None:
        return before
    # the bracket ends within rounding of the value: solve at the value itself
    vector = with_entries(orbit.vector, orbit.model.index_of(settings.parameter), target)
    exact = refine(Orbit(orbit.system, found.joints, vector, np.inf), damped=False)
    if exact.converged and np.abs(exact.joints - found.joints).max() < 1e-6:
        found.joints, found.w = exact.joints, np.array([target])
    return found
