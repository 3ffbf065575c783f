"""Curves from their two halves."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.continuation.points import Point
from contfric.curves.curve import Curve, CurvePart
from contfric.curves.problem import Problem
from contfric.curves.special import CodimTwo, CurveEnd, CurveEndReason, SpecialPoint
from contfric.events.bifurcation import Kind
from contfric.events.sliding_kinds import kind_of_margin

if TYPE_CHECKING:
    from contfric.curves.half_curve import CurveSide


def join_sides(behind: CurveSide | None, ahead: CurveSide, first: CurveEnd | None = None) -> Curve:
    """Return one curve from the two sides of its start, or from one that begins at ``first``."""
    pieces = _pieces(ahead)
    location = None if first is None else first.special
    first = first or CurveEnd(CurveEndReason.CLOSED)
    if location is not None:
        pieces[0] = replace(pieces[0])
        at = replace(location, position=pieces[0].points[0].arc)
        pieces[0].special = [at, *pieces[0].special]
    if behind is not None:
        back = _pieces(behind)
        first = back[-1].end
        joined = replace(pieces[0])
        joined.points = [*(p.on_other_side() for p in back[0].points[:0:-1]), *joined.points]
        joined.special = [*_turned(back[0].special), *joined.special]
        pieces = [*(_reversed(piece) for piece in back[:0:-1]), joined, *pieces[1:]]
    shift = -pieces[0].points[0].arc
    special = [s for piece in pieces for s in piece.special]
    moved = tuple(replace(s, position=s.position + shift) for s in special)
    parts = [part for piece in pieces for part in _parts(piece.problem, piece.points, shift, moved)]
    ends = tuple(
        end if end.special is None else replace(end, special=moved[location])
        for end, location in ((first, 0), (_pieces(ahead)[-1].end, -1))
    )
    problem = ahead.problem
    return Curve(problem.box.names, problem.vector, tuple(parts), moved, (ends[0], ends[1]))


def _pieces(side: CurveSide) -> list[CurveSide]:
    """Return a side and what it goes on as, in order."""
    found = [side]
    while found[-1].following is not None:
        found.append(found[-1].following)
    return found


def _turned(special: list[SpecialPoint]) -> list[SpecialPoint]:
    return [replace(s, position=-s.position) for s in special[::-1]]


def _reversed(piece: CurveSide) -> CurveSide:
    turned = replace(piece)
    turned.points = [p.on_other_side() for p in piece.points[::-1]]
    turned.special = _turned(piece.special)
    return turned


def _parts(
    problem: Problem, points: list[Point], shift: float, special: tuple[SpecialPoint, ...]
) -> tuple[CurvePart, ...]:
    """Cut the points where the kind changes; ``shift`` is added to their arclength."""
    arc = np.array([p.arc for p in points]) + shift
    cuts = [s.position for s in special if s.kind is CodimTwo.TURNOVER]
    inner = [int(np.searchsorted(arc, cut)) for cut in cuts if arc[0] < cut < arc[-1]]
    edges = [0, *inner, len(points)]
    return tuple(
        _part(problem, points[a:b], arc[a:b]) for a, b in itertools.pairwise(edges) if b > a
    )


def _part(problem: Problem, points: list[Point], arc: FloatArray) -> CurvePart:
    kind = problem.kind
    if kind in (Kind.CS, Kind.SS) and problem.test is not None:
        middle = points[len(points) // 2]
        kind = kind_of_margin(problem.system, problem.test, problem.orbit(middle.joints, middle.w))
    return CurvePart(
        kind,
        problem,
        problem.system,
        problem.test,
        np.array([p.w for p in points]),
        np.array([p.joints for p in points]),
        arc,
        np.array([p.labels for p in points], dtype=np.int64).reshape(len(points), -1),
        np.array([p.mu for p in points]),
    )
