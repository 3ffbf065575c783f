"""A march along one curve of equilibria, in one mode, until its range or its region ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from contfric.equilibria.branch import BranchEnd
from contfric.equilibria.events import EquilibriumEvent
from contfric.equilibria.hopf import is_oscillating
from contfric.equilibria.zero_curve import Arc, CurvePoint

#: Steps in the scaled product: the first, the shortest, and how a step that turned little grows.
_FIRST, _SHORTEST, _GROWTH = 1e-3, 1e-10, 1.6
#: Cosine of the angle between the tangents of a step: 10 degrees at most, and it grows below 3.
_TURN, _STRAIGHT = 0.985, 0.9986
#: A fold and a branch point nearer than this are one point: that is located to the root of rounding.
_VERTEX = 1e-6
#: The boundary that a run begins on is met nowhere nearer than this again: a millionth of the first step.
_AT_START = 1e-9
#: A state beyond this many natural sizes has left to infinity.
_AWAY = 1e4


@dataclass(frozen=True, eq=False)
class LocatedSignChange:
    """A change of sign of a test function on a step, located.

    Attributes
    ----------
    test : "SN", "BP", "H", or the name of a surface
    point : where it vanishes
    before, after : the points around it
    """

    test: str
    point: CurvePoint
    before: CurvePoint
    after: CurvePoint


@dataclass(frozen=True, eq=False)
class MarchLimits:
    """Where a march ends: bounds of the parameter, step and number of points."""

    low: float
    high: float
    low_end: BranchEnd
    high_end: BranchEnd
    max_step: float
    max_points: int


@dataclass(eq=False)
class Run:
    """The points of a march in one region, the events among them and its end.

    Attributes
    ----------
    events : the crossings as results, filled by who follows a branch
    """

    arc: Arc
    points: list[CurvePoint] = field(default_factory=list)
    crossings: list[LocatedSignChange] = field(default_factory=list)
    end: BranchEnd = BranchEnd.POINTS
    events: list[EquilibriumEvent] = field(default_factory=list)


def march(arc: Arc, start: CurvePoint, limits: MarchLimits) -> Run:
    """Follow a curve from a point along its tangent; it ends after the first boundary of its region."""
    run, step = Run(arc, [start]), _FIRST
    closes = _Closing(start)
    while len(run.points) < limits.max_points:
        last = run.points[-1]
        following, step = _next(arc, last, min(step, limits.max_step))
        if following is None:
            run.end = BranchEnd.LOST
            return run
        over = _over(arc, following, limits)
        if over is not None:
            following = _at_bound(arc, last, following, over)
            run.end = limits.high_end if over == limits.high else limits.low_end
        if np.max(np.abs(following.x[:-1])) > _AWAY:
            run.end = BranchEnd.AWAY
            return run
        for crossing in crossings(arc, last, following):
            if last is start and _is_start(crossing, start):
                continue
            run.crossings.append(crossing)
            if _leaves(arc, crossing):
                run.points.append(crossing.point)
                run.end = BranchEnd.BOUNDARY
                return run
        run.points.append(following)
        if over is not None:
            return run
        if closes.by(following):
            run.end = BranchEnd.CLOSED
            return run
    return run


def _is_start(crossing: LocatedSignChange, start: CurvePoint) -> bool:
    """Tell whether an event is the boundary that a run begins on: its height there is rounding."""
    on_surface = crossing.test not in ("SN", "BP", "H")
    return on_surface and bool(np.max(np.abs(crossing.point.x - start.x)) < _AT_START)


class _Closing:
    """Tells whether a march passes its start again, in the same direction."""

    def __init__(self, start: CurvePoint) -> None:
        self.start, self.left, self.before = start, False, 0.0

    def by(self, point: CurvePoint) -> bool:
        ahead = float((point.x - self.start.x) @ self.start.tangent)
        near = float(np.linalg.norm(point.x - self.start.x)) < 0.1
        passed = self.left and near and self.before < 0.0 <= ahead
        self.left = self.left or ahead < 0.0
        self.before = ahead
        return passed


def _next(arc: Arc, last: CurvePoint, step: float) -> tuple[CurvePoint | None, float]:
    """Return the next point and the length of the step after it; None if the curve is lost."""
    while step > _SHORTEST:
        found = arc.corrected(last.x + step * last.tangent, last.tangent)
        if found is not None:
            cosine = float(found.tangent @ last.tangent)
            if cosine > _TURN:
                return found, step * _GROWTH if cosine > _STRAIGHT else step
        step *= 0.5
    return None, step


def _at_bound(arc: Arc, last: CurvePoint, following: CurvePoint, bound: float) -> CurvePoint:
    """Return the point of a step at which the parameter reaches a bound."""
    return arc.located(last, following, lambda at: arc.parameter(at.x) - bound) or last


def _over(arc: Arc, point: CurvePoint, limits: MarchLimits) -> float | None:
    """Return the bound of the parameter that a point lies beyond; None if it lies within."""
    value = arc.parameter(point.x)
    return limits.high if value > limits.high else limits.low if value < limits.low else None


def crossings(arc: Arc, before: CurvePoint, after: CurvePoint) -> list[LocatedSignChange]:
    """Return the events of a step, in their order."""
    found = _pairs(arc, before, after)
    for name, test in _tests(arc, before):
        a, b = test(before), test(after)
        if a == 0.0 or not (a * b < 0.0 or b == 0.0):
            continue
        point = arc.located(before, after, test)
        if point is None:
            continue
        found.append(LocatedSignChange(name, point, before, after))
    vertex = [c for c in found if c.test == "BP"]
    found = [  # the vertex of a pitchfork is no fold of its own
        c
        for c in found
        if c.test != "SN"
        or not any(np.max(np.abs(c.point.x - b.point.x)) < _VERTEX for b in vertex)
    ]
    along = after.x - before.x
    return sorted(found, key=lambda c: float((c.point.x - before.x) @ along))


def _eigenvalues(arc: Arc, point: CurvePoint) -> np.ndarray:
    return np.asarray(arc.region.fields.eigenvalues(*arc.at(point)))


def _pairs(arc: Arc, before: CurvePoint, after: CurvePoint) -> list[LocatedSignChange]:
    """Return the complex pairs that cross the imaginary axis on a step.

    If m eigenvalues have a positive real part at one end and more at the other, the real part that is the
    (m + 1)-th largest changes its sign, and so on: pairs that cross together are told apart by their rank.
    """
    counts = [int(np.count_nonzero(_eigenvalues(arc, at).real > 0.0)) for at in (before, after)]
    found, k = [], min(counts)
    while k < max(counts):
        point = arc.located(before, after, partial(_real_part, arc, k))
        oscillating = point is not None and is_oscillating(_eigenvalues(arc, point), k)
        if point is not None and oscillating:
            found.append(LocatedSignChange("H", point, before, after))
        k += 2 if oscillating else 1
    return found


def _real_part(arc: Arc, k: int, at: CurvePoint) -> float:
    return float(_eigenvalues(arc, at)[k].real)


def _tests(arc: Arc, before: CurvePoint) -> Iterator[tuple[str, Callable[[CurvePoint], float]]]:
    """Yield the test functions that are watched after a point, by their names."""
    yield "SN", lambda at: float(at.tangent[-1])
    yield "BP", arc.orientation
    region = arc.region
    domain, _ = region.domain_of(*arc.at(before))
    for name in region.sides(domain):
        if region.bounds(domain, name):
            k = region.heights.names.index(name)
            yield name, partial(_height, arc, k)


def _height(arc: Arc, k: int, at: CurvePoint) -> float:
    return float(arc.region.heights.value(*arc.at(at))[k])


def _leaves(arc: Arc, crossing: LocatedSignChange) -> bool:
    """Tell whether an equilibrium leaves the region of its mode at an event."""
    if crossing.test in ("SN", "BP", "H"):
        return False
    outside = [arc.region.domain_of(*arc.at(p))[1] for p in (crossing.before, crossing.after)]
    return not outside[0] and bool(outside[1])
