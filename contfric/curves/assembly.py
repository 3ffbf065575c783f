"""Curves from the sides of their starts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from contfric.continuation.events import Kind, kind_of_margin
from contfric.curves.curve import Curve, CurvePart
from contfric.curves.points import CurvePoint
from contfric.curves.problem import Problem
from contfric.curves.special import CodimTwo, CurveEnd, CurveEndReason, SpecialPoint

if TYPE_CHECKING:
    from contfric.curves.trace import CurveSide


def join_sides(behind: CurveSide | None, ahead: CurveSide) -> Curve:
    """Return one curve from the two sides of its start."""
    problem, points = ahead.problem, list(ahead.points)
    special, first = list(ahead.special), CurveEnd(CurveEndReason.CLOSED)
    if behind is not None:
        back = [replace(p, arc=-p.arc) for p in behind.points[:0:-1]]
        points = [*back, *points]
        special = [*(replace(s, position=-s.position) for s in behind.special[::-1]), *special]
        first = behind.end
        if first.special is not None:
            first = replace(first, special=special[0])
    shift = -points[0].arc
    moved = {id(s): replace(s, position=s.position + shift) for s in special}
    ends = tuple(
        end if end.special is None else replace(end, special=moved[id(end.special)])
        for end in (first, ahead.end)
    )
    points = [replace(p, arc=p.arc + shift) for p in points]
    listed = tuple(moved[id(s)] for s in special)
    parts = _parts(problem, points, listed)
    return Curve(problem.box.names, problem.vector, parts, listed, (ends[0], ends[1]))


def _parts(
    problem: Problem, points: list[CurvePoint], special: tuple[SpecialPoint, ...]
) -> tuple[CurvePart, ...]:
    """Cut the points where the kind changes."""
    cuts = [s.position for s in special if s.kind is CodimTwo.TURNOVER]
    arc = np.array([p.arc for p in points])
    edges = [0, *(int(np.searchsorted(arc, cut)) for cut in cuts), len(points)]
    return tuple(
        _part(problem, points[a:b]) for a, b in zip(edges[:-1], edges[1:], strict=True) if b > a
    )


def _part(problem: Problem, points: list[CurvePoint]) -> CurvePart:
    kind = problem.kind
    if kind in (Kind.CS, Kind.SS) and problem.test is not None:
        middle = points[len(points) // 2]
        kind = kind_of_margin(problem.system, problem.test, problem.orbit(middle.joints, middle.w))
    return CurvePart(
        kind,
        problem.system,
        problem.test,
        np.array([p.w for p in points]),
        np.array([p.joints for p in points]),
        np.array([p.arc for p in points]),
        np.array([p.labels for p in points], dtype=np.int64).reshape(len(points), -1),
        np.array([p.mu for p in points]),
    )
