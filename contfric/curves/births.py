"""Where fold curves of asymmetric (doubled) orbits begin: the orbits become symmetric (undoubled)."""

from __future__ import annotations

import numpy as np

from contfric.continuation.events import Kind
from contfric.continuation.points import Point
from contfric.continuation.vertices import passed_vertex
from contfric.curves.locating import locate_zero
from contfric.curves.problem import Problem
from contfric.curves.special import CodimTwo, SpecialPoint
from contfric.models.definition import FloatArray


def birth_among(problem: Problem, chain: list[Point]) -> int | None:
    """Return the first point of a chain after which orbits have become their own images."""
    if problem.kind is not Kind.SN or problem.system.half or len(chain) < 2:
        return None
    passed = passed_vertex(problem.system, np.array([p.joints for p in chain]))
    return None if passed is None or not np.isfinite(passed[1]) else passed[0]


def birth_between(
    problem: Problem, before: Point, after: Point, border: FloatArray
) -> tuple[Point, SpecialPoint]:
    """Return the last point of a fold curve between two, and what it is: DBP, or GPD of doubled orbits."""
    reference = _odd_part(problem, before)

    def value(p: Point) -> float:
        return float(np.sum(_odd_part(problem, p) * reference))

    point, fine = locate_zero(problem, before, after, border, value)
    orbit = problem.orbit(point.joints, point.w)
    symmetric = problem.system.periods % 2 == 1 or orbit.mirror_distance < 1e-5
    kind = CodimTwo.DBP if symmetric else CodimTwo.GPD
    return point, SpecialPoint(kind, kind.name, orbit.params, orbit, None, (), point.arc, fine)


def _odd_part(problem: Problem, point: Point) -> FloatArray:
    """Return the states of the second half less the image of the first."""
    n = len(problem.system.itinerary) // 2
    symmetry = problem.model.symmetry
    image = np.eye(len(problem.model.states))
    if symmetry is not None and problem.system.itinerary[:n] != problem.system.itinerary[n:]:
        image = symmetry.array()
    return np.asarray(point.joints[n:, 1:] @ image - point.joints[:n, 1:])
