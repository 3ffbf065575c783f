"""Curves that are known already: no curve is computed twice."""

from __future__ import annotations

import numpy as np

from contfric.atlas.matching import identity, stops_distance
from contfric.base.arrays import FloatArray
from contfric.continuation.points import Point
from contfric.curves.curve import Curve, CurvePart
from contfric.curves.points import solve_point
from contfric.curves.problem import Problem, border_of
from contfric.events.bifurcation import TERMINAL, Kind
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit

#: A point farther than this from a polyline (relative to the ranges) is not on its curve: a step bends by
#: an eighth of its length times its angle, 5e-4.
_NEAR = 3e-3
#: A point solved on a known curve is the same if parameters (relative) and stops agree to this; where
#: two curves meet they are located to about 1e-8.
_SAME = 1e-6
#: Points of a curve, as shares of them, that are asked whether they lie on one of another kind.
_SHARES = (0.25, 0.5, 0.75)


def group_of(kind: Kind, model: Model) -> Kind:
    """Return the kind under which curves are compared: a CS turns into an SS.

    Where nothing jumps one event may have a name for each of the itineraries that meet there.
    """
    if kind is Kind.SS or (model.filippov and kind in TERMINAL):
        return Kind.CS
    return kind


def is_known(
    problem: Problem, point: Point, curves: list[Curve], same_itinerary: bool = True
) -> int | None:
    """Return the index of the curve that a point lies on; None if on none.

    Without ``same_itinerary`` the solutions are compared, whatever their itineraries.
    """
    orbit = problem.orbit(point.joints, point.w)
    for index, curve in enumerate(curves):
        for part in curve.parts:
            if group_of(part.kind, orbit.model) is not group_of(problem.kind, orbit.model):
                continue
            if same_itinerary and not _same_itinerary(orbit, part):
                continue
            if _on_part(orbit, point.w, part, problem):
                return index
    return None


def _same_itinerary(orbit: Orbit, part: CurvePart) -> bool:
    system = part.system
    if system.periods != orbit.periods or system.half != orbit.system.half:
        return False
    there = Orbit(system, part.joints[0], orbit.vector, 0.0)
    return identity(orbit) == identity(there)


def _on_part(orbit: Orbit, w: FloatArray, part: CurvePart, problem: Problem) -> bool:
    """Tell whether an orbit is on a piece of a curve: solve for the curve near it, and compare."""
    widths = problem.box.widths
    scaled = (part.values - w) / widths
    mirror = orbit.model.symmetry is not None
    near = np.hypot(scaled[:, 0], scaled[:, 1]) < _SAME
    for row in np.flatnonzero(near):
        there = Orbit(part.system, part.joints[row], orbit.vector, 0.0)
        if stops_distance(orbit.stops, there.stops, mirror) < np.sqrt(_SAME):
            return True
    if part.problem is None or len(part) < 2:
        return False
    for k, share, gap in _nearby(scaled):
        if gap < _NEAR and _solved_there(orbit, w, part, k, share, mirror):
            return True
    return False


def _nearby(scaled: FloatArray) -> list[tuple[int, float, float]]:
    """Return the segments of a polyline nearest to the origin: (index, share, distance)."""
    chords = np.diff(scaled, axis=0)
    squares = np.maximum(np.sum(chords**2, axis=1), 1e-300)
    shares = np.clip(-np.sum(scaled[:-1] * chords, axis=1) / squares, 0.0, 1.0)
    gaps = np.linalg.norm(scaled[:-1] + shares[:, None] * chords, axis=1)
    order = np.argsort(gaps)[:4]
    return [(int(k), float(shares[k]), float(gaps[k])) for k in order]


def _solved_there(
    orbit: Orbit, w: FloatArray, part: CurvePart, k: int, share: float, mirror: bool
) -> bool:
    """Solve for the point of a piece on the normal through w in the plane, and compare it."""
    problem = part.problem
    assert problem is not None
    joints = part.joints[k] + share * (part.joints[k + 1] - part.joints[k])
    chord = (part.values[k + 1] - part.values[k]) / problem.box.widths
    if not np.any(chord):
        return False
    vector = problem.vector.copy()
    guess = part.values[k] + share * (part.values[k + 1] - part.values[k])
    vector[problem.which] = guess
    border = border_of(problem, joints, vector)
    found = solve_point(
        problem, joints, guess, np.zeros_like(joints), chord * problem.box.widths, border
    )
    if found is None or np.max(np.abs(found.w - w) / problem.box.widths) > _SAME:
        return False
    there = problem.orbit(found.joints, found.w)
    return bool(stops_distance(orbit.stops, there.stops, mirror) < np.sqrt(_SAME))


def twins_of(curves: list[Curve]) -> tuple[int, ...]:
    """Return for each curve the first one of the same solutions, in whatever itineraries."""
    found: list[int] = []
    for index, curve in enumerate(curves):
        part = max(curve.parts, key=lambda p: float(p.arc[-1] - p.arc[0]))
        first = index
        if part.problem is not None and part.kind in TERMINAL:
            known = is_known(part.problem, _inside(part, 0.5), curves[:index], same_itinerary=False)
            known = _of_other_kind(part, curves[:index]) if known is None else known
            first = index if known is None else found[known]
        found.append(first)
    return tuple(found)


def at_once(curves: list[Curve], twins: tuple[int, ...]) -> list[str]:
    """Return in words which curves are one along which two sliding events happen at once."""
    found = []
    for first in sorted(set(twins)):
        same = [curve for k, curve in enumerate(curves) if twins[k] == first]
        kinds = {group_of(part.kind, part.system.model) for c in same for part in c.parts}
        if len(kinds) > 1 and kinds <= TERMINAL:
            names = " and ".join(dict.fromkeys(curve.label for curve in same))
            found.append(f"{names} are one curve: an event of codimension two all along it")
    return found


def _of_other_kind(part: CurvePart, curves: list[Curve]) -> int | None:
    """Return the curve of another sliding event that has the same solutions all along; None if none has.

    Where the load stands still at a stop on the limit, a CS and an AS happen at once. That takes two
    parameters, but for special values of the others (Omega = 1/2 without damping): then two curves are one.
    Curves of two kinds that only cross are not: all of three points lie on the same one.
    """
    assert part.problem is not None
    model = part.system.model
    for index, curve in enumerate(curves):
        others = [p for p in curve.parts if p.kind in TERMINAL]
        if not others or any(group_of(p.kind, model) is group_of(part.kind, model) for p in others):
            continue
        inside = (_inside(part, share) for share in _SHARES)
        if all(_on_any(point, others, part.problem) for point in inside):
            return index
    return None


def _on_any(point: Point, parts: list[CurvePart], problem: Problem) -> bool:
    orbit = problem.orbit(point.joints, point.w)
    return any(_on_part(orbit, point.w, part, problem) for part in parts)


def _inside(part: CurvePart, share: float) -> Point:
    """Return one of the points of a piece, at a share of them."""
    k = int(share * len(part))
    none = np.empty(0)
    return Point(
        part.joints[k],
        part.values[k],
        none,
        none,
        none,
        part.labels[k],
        part.turn_multipliers[k],
        float(part.arc[k]),
    )
