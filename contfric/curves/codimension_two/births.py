"""Points at which a curve of asymmetric (or doubled) orbits begins: they become symmetric (undoubled).

A fold curve does so at a degenerate branch point or doubling. A curve of CS, SS, AS or GS does where the
curve of that event of symmetric (undoubled) orbits meets BP (PD): the event happens at a second place, the
image of the first one, at the same time. Both curves of the event solve the equations of whole orbits there,
so that these are singular; those of the half are not, and along it the multiplier -1 is a simple zero.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import EventFunction
from contfric.continuation.points import Point
from contfric.continuation.singular_points.vertices import passed_vertex, symmetrised, undoubled
from contfric.curves.codimension_two.locating import CurveStep
from contfric.curves.codimension_two.meeting import with_multiplier
from contfric.curves.problem import Problem
from contfric.curves.special import CodimTwo, SpecialPoint
from contfric.events.bifurcation import Kind
from contfric.orbit.orbit import Orbit

#: Orbits are nearly symmetric within this: a bracket of what is singular ends some 1e-5 away.
_NEARLY = 1e-3
#: Orbits on a curve are symmetric to this, where equations are singular to the root of rounding; a short
#: first step along a curve of asymmetric ones leads farther.
_SYMMETRIC = 1e-6


def birth_among(problem: Problem, chain: list[Point]) -> int | None:
    """Return the first point of a chain after which orbits have become their own images."""
    if problem.kind is not Kind.SN or problem.system.half or len(chain) < 2:
        return None
    passed = passed_vertex(problem.system, np.array([p.joints for p in chain]))
    return None if passed is None or not np.isfinite(passed[1]) else passed[0]


def birth_between(step: CurveStep[Problem]) -> tuple[Point, SpecialPoint]:
    """Return the last point of a fold curve between two, and what it is: DBP, or GPD of doubled orbits."""
    problem = step.problem
    reference = _odd_part(problem, step.before)

    def value(p: Point) -> float:
        return float(np.sum(_odd_part(problem, p) * reference))

    point, fine = step.zero_of(value)
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


def is_simpler(problem: Problem, orbit: Orbit) -> bool:
    """Tell whether a whole orbit on a sliding event's curve is symmetric, or another one run through twice.

    Its curve is that of the half, whose equations are regular where the multiplier -1 is passed.
    """
    return problem.test is not None and _part_of(orbit, _SYMMETRIC) is not None


def _part_of(orbit: Orbit, farthest: float) -> Orbit | None:
    """Return the symmetric (undoubled) orbit that an orbit is near, not solved; None if it is near none."""
    part = symmetrised(orbit, farthest)
    return undoubled(orbit, farthest) if part is None else part


def simpler_problem(problem: Problem, orbit: Orbit) -> tuple[Problem, Orbit] | None:
    """Return the curve of the same sliding event of the symmetric (undoubled) orbit that an orbit is near."""
    from contfric.curves.equations.conditions import Condition

    part = None if problem.test is None else _part_of(orbit, _NEARLY)
    if part is None or problem.test is None:
        return None
    own = problem.condition
    turn, segment = divmod(own.segment, part.system.segments)
    surface, name = own.surface, problem.test.surface
    symmetry = problem.model.symmetry
    if turn and part.system.half and symmetry is not None:
        image = symmetry.surfaces[problem.model.surfaces[surface].name]
        surface, name = problem.model.surface_index[image], symmetry.surfaces.get(name, name)
    none = np.empty(0, dtype=np.int64)
    condition = Condition(own.kind, segment, surface, 1.0, -1, none, none)
    test = EventFunction(problem.test.margin, segment, name)
    return Problem(
        problem.kind, part.system, part.vector.copy(), problem.box, condition, test
    ), part


def end_of_asymmetry(
    problem: Problem, point: Point, test: EventFunction
) -> tuple[Point, SpecialPoint] | None:
    """Return the end of a sliding event's curve where its orbits become symmetric (undoubled); None if none.

    ``point`` is where a bracket has found ``test`` to vanish, the image of the curve's own margin.
    """
    half, odd = divmod(problem.system.segments, 2)
    if problem.test is None or odd or abs(test.segment - problem.test.segment) != half:
        return None
    found = simpler_problem(problem, problem.orbit(point.joints, point.w))
    if found is None:
        return None
    own, part = found
    exact = with_multiplier(own, part, -1.0)
    if exact is None:
        return None
    orbit = own.orbit(exact.joints, exact.w)
    whole, meets = (orbit.as_whole(), Kind.BP) if orbit.system.half else (orbit.doubled(), Kind.PD)
    joints = whole.joints.copy()
    if not problem.model.autonomous:
        turns = np.round((point.joints[0, 0] - joints[0, 0]) / whole.period)
        joints[:, 0] += turns * whole.period
    last = replace(point, joints=joints, w=exact.w)
    name = f"{problem.kind.value}-{meets.value}"
    special = SpecialPoint(
        CodimTwo.MEETS, name, orbit.params, problem.orbit(joints, exact.w), meets, (), point.arc
    )
    return last, special
