"""One half of a curve while it is traced: its points, and how it goes on after what it meets."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.continuation.points import Point
from contfric.curves.codimension_two.births import birth_between
from contfric.curves.codimension_two.locating import CurveStep, by_location
from contfric.curves.codimension_two.naming import crossings
from contfric.curves.problem import Problem
from contfric.curves.special import CurveEnd, CurveEndReason, SpecialPoint

#: Share of a range within which a curve that gets no farther has come to a physical limit, where
#: conditions degenerate together.
_NEAR_LIMIT = 1e-3


@dataclass(eq=False)
class CurveSide:
    """One side of a curve: its points, what it has met, why it ended.

    Attributes
    ----------
    problem : what is followed
    points : rows of points, in order
    special : points of codimension two
    end : why it ended
    tip : the last point, with its tangent
    border : the vectors b and c there
    following : what it goes on as after its end, where its signature changes
    """

    problem: Problem
    points: list[Point]
    border: FloatArray
    special: list[SpecialPoint] = field(default_factory=list)
    end: CurveEnd = field(default_factory=lambda: CurveEnd(CurveEndReason.POINTS))
    following: CurveSide | None = None

    @property
    def tip(self) -> Point:
        """The last point."""
        return self.points[-1]

    @property
    def ahead(self) -> FloatArray:
        """Direction in the plane in which it came to its tip.

        The tip's own tangent may be singular: where a margin that ends a curve is an exit's rate.
        """
        came = next((p for p in self.points[-2::-1] if np.any(p.w != self.tip.w)), None)
        return self.tip.direction if came is None else self.tip.w - came.w

    def step_to(self, after: Point) -> CurveStep[Problem]:
        """Return the step from the tip to a point."""
        return CurveStep(self.problem, self.tip, after, self.border)

    @property
    def last(self) -> CurveSide:
        """What it goes on as at its very end."""
        return self if self.following is None else self.following.last


def _beyond(problem: Problem, point: Point) -> float:
    """Return the least value of the model's constraints at a point."""
    return float(problem.within_limits(point.w[None, :])[0])


def end_at_birth(side: CurveSide, fresh: list[Point], at: int) -> bool:
    """End a fold curve of asymmetric (doubled) orbits where they become symmetric (undoubled)."""
    side.points += fresh[:at]
    point, special = birth_between(side.step_to(fresh[at]))
    side.points.append(point)
    side.special.append(special)
    side.end = CurveEnd(CurveEndReason.BIRTH, special=special)
    return True


def end_at_limit(side: CurveSide, after: Point) -> bool:
    """End a side where the model's parameters end."""
    point, _ = side.step_to(after).located(by_location(side.problem.limits))
    if point is not side.tip:
        side.points.append(point)
    side.end = CurveEnd(CurveEndReason.LIMIT)
    return True


def near_limit(problem: Problem, point: Point) -> CurveEnd | None:
    """Return the end at a physical limit that a point is near, where conditions degenerate; else None."""
    near = _beyond(problem, point) < _NEAR_LIMIT * float(np.min(problem.box.widths))
    return CurveEnd(CurveEndReason.LIMIT) if near else None


def resolve(side: CurveSide, after: Point, border: FloatArray) -> bool:
    """Locate what happened over the last step; True if the side ends there."""
    limit = _range_crossed(side, after)
    for crossing in crossings(side.step_to(after)):
        if limit is not None and crossing.point.arc > limit.arc:
            break
        side.special.append(crossing.special)
        if crossing.terminal:
            side.points.append(crossing.point)
            side.end = CurveEnd(CurveEndReason.MEETS, special=crossing.special)
            return True
    if limit is not None:
        side.points.append(limit)
        side.end = CurveEnd(CurveEndReason.RANGE)
        return True
    side.points.append(after)
    side.border = border
    return False


def _range_crossed(side: CurveSide, after: Point) -> Point | None:
    """Return the point on the edge of the box that the last step has crossed."""
    box, before = side.problem.box, side.tip
    if np.all(after.w >= box.low) and np.all(after.w <= box.high):
        return None
    inside = before.w @ box.edges[:, :2].T + box.edges[:, 2]
    if np.min(inside) <= 0.0:
        return before
    point, _ = side.step_to(after).located(by_location(box.edges))
    return point
