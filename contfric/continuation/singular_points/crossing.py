"""Branch points at which two curves of orbits cross, with or without a declared symmetry.

The equations of the chain of segments are ``F(z, p) = 0``, N equations for N + 1 unknowns. Along a curve of
orbits the Jacobian ``J = [F_z, F_p]`` has rank N, at a fold as well as elsewhere; where two curves cross its
null space has two dimensions. So a fold (SN) and a branch point (BP) are told apart by J, whatever the
multipliers are: at both of them one is +1.

A branch point is a regular solution of Moore's system (SIAM J. Numer. Anal. 17 (1980) 567-576)

    F + beta psi = 0,    J^T psi = 0,    psi . psi = 1

in (z, p, psi, beta), with beta = 0 if it is one: with another beta it is that of neighbouring equations,
whose two curves have come apart. The directions of the two curves solve the algebraic branching equation
``d^T H d = 0`` in the null space of J, with ``H = (psi . F)''`` (H. B. Keller, 1977).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contfric.base.arrays import FloatArray, with_entries
from contfric.bvp.linear import equations_at
from contfric.bvp.system import System
from contfric.continuation.points import Point, Settings
from contfric.continuation.step import Step
from contfric.orbit.orbit import Orbit, Status

#: Smallest singular value of J against the largest, above which no branch point is near. Near one it is
#: about the distance; steps of a branch are 1e-2 at most.
_REGULAR = 3e-2
#: Newton's method converges from there in 3 to 6 steps.
_MOST_STEPS = 12
#: Corrections longer than the one before after which it is given up: near a solution all are shorter, but for
#: the first ones, which may be rounding.
_MOST_RISES = 2
#: Corrections that end it: far below what the derivatives, which are differences, leave in the next one.
_SETTLED = 1e-12
#: One that is this small and no longer falls is rounding.
_ROUNDED = 1e-8
#: Unfolding beta, in relative roundings of the flow, below which it is one of rounding.
_UNFOLDED = 1e3
#: Roundings of a closed form are less than this, and its sums are good to it.
_LEAST_ROUNDING = 1e-14
#: Step of the differences of the Jacobian: the cube root of its rounding.
_STEP = 6e-6
#: Discriminant of the branching equation, relative to the square of its coefficients, above which two
#: curves cross: below are isolated points and curves that touch.
_CROSSES = 1e-8
#: A direction whose share of the parameter is below this has none: the curve turns there (a pitchfork).
#: Directions are good to the square of the step of differences, about 1e-10.
_TURNS = 1e-6
#: Share of a step by which a branch point may lie outside of it: a change of sign at its very end.
_NEARBY = 1e-3
#: The same, where the step is short, in cube roots of rounding r and sizes of the orbit. At a distance x from
#: where a curve turns an error r moves the parameter by r/x and the slope, of order x, by r/x^2.
_BLURRED = 5.0
#: A located branch point is good to far less than this (scaled product).
LOCATED = 1e-5


@dataclass(frozen=True, eq=False)
class Direction:
    """Direction of a curve of orbits at a branch point, of length 1 in the scaled product.

    ``slope`` is its share of the parameter; exactly 0 where the curve turns there.
    """

    joints: FloatArray
    slope: float

    @property
    def turns(self) -> bool:
        """Whether the parameter turns there: the curve lies on one side of it."""
        return self.slope == 0.0

    def reversed(self) -> Direction:
        """Return the opposite direction."""
        return Direction(-self.joints, -self.slope)

    def cosine(self, joints: FloatArray, slope: float, scale: float) -> float:
        """Return the cosine of the angle with another direction, in the scaled product."""
        size = np.sqrt(_product((joints, slope), (joints, slope), scale))
        return _product((self.joints, self.slope), (joints, slope), scale) / float(size)


def _product(a: tuple[FloatArray, float], b: tuple[FloatArray, float], scale: float) -> float:
    """Return the scaled product of two directions (joints, parameter)."""
    return float(np.sum(a[0] * b[0]) / len(a[0]) + a[1] * b[1] * scale)


@dataclass(frozen=True, eq=False)
class Crossing:
    """A branch point: the orbit there, and the directions of the two curves that cross."""

    orbit: Orbit
    directions: tuple[Direction, Direction]

    def nearest(self, joints: FloatArray, slope: float, scale: float) -> Direction:
        """Return the direction, of the four, that is nearest to a tangent."""
        first = max(self.directions, key=lambda d: abs(d.cosine(joints, slope, scale)))
        return first if first.cosine(joints, slope, scale) >= 0.0 else first.reversed()


def crossing_near(orbit: Orbit, settings: Settings, within: float) -> Crossing | None:
    """Return the branch point within a distance of an orbit (scaled product), or None."""
    system = orbit.system
    active = orbit.model.index_of(settings.parameter)
    problem = _ChainProblem(system, orbit.vector, active, settings.width)
    x = np.append(orbit.joints.ravel(), orbit.vector[active] / settings.width)
    located = _moore(problem, x)
    if located is None:
        return None
    moved = located[0] - x
    far = np.sum(moved[:-1] ** 2) / system.segments + moved[-1] ** 2 > within**2
    x, psi = located
    directions = None if far else _directions(problem, x, psi)
    if directions is None:
        return None
    joints, vector = problem.split(x)
    found = Orbit(system, joints, vector, float(np.abs(problem.at(x)[0]).max()), Status.CONVERGED)
    return Crossing(found, directions)


@dataclass(frozen=True, eq=False)
class _ChainProblem:
    """The equations in the unknowns (joints, parameter over the width of its range)."""

    system: System
    vector: FloatArray
    active: int
    width: float

    def split(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return joints and parameters."""
        vector = with_entries(self.vector, self.active, x[-1] * self.width)
        return x[:-1].reshape(self.system.segments, -1).copy(), vector

    def at(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return F, shape (N,), and J, shape (N, N + 1)."""
        joints, vector = self.split(x)
        residual, jacobian, column = equations_at(
            self.system, joints, vector, (self.active,), at_joints=False
        )  # its differences are second derivatives
        return residual, np.column_stack([jacobian, self.width * column])

    def hessian(self, x: FloatArray, psi: FloatArray) -> FloatArray:
        """Return the second derivatives of psi . F, shape (N + 1, N + 1), by central differences.

        The equations of a segment depend on its two joints. So every second joint is moved at once (every
        third one where their number is odd), and what changes in the equations of a segment is due to the
        one of its joints that moves.
        """
        count, rows = self.system.segments, np.zeros((len(x), len(x)))
        size, shares = len(psi) // count, psi.reshape(count, 1, -1)
        steps = _STEP * (1.0 + np.abs(x))
        colours = np.arange(count) % 2
        colours[-1] += 2 * (count % 2)
        moves = [np.flatnonzero(colours == c) * size + i for c in range(4) for i in range(size)]
        for moved in [*(m for m in moves if len(m)), np.array([len(x) - 1])]:
            ahead, behind = x.copy(), x.copy()
            ahead[moved] += steps[moved]
            behind[moved] -= steps[moved]
            change = self.at(ahead)[1] - self.at(behind)[1]
            change = (shares @ change.reshape(count, size, -1))[:, 0]  # by equations of segments
            for k in moved:
                own = {k // size, (k // size - 1) % count} if k < len(psi) else range(count)
                rows[k] = change[sorted(own)].sum(axis=0)
        rows /= 2.0 * steps[:, None]
        return np.asarray(0.5 * (rows + rows.T))


def _moore(problem: _ChainProblem, x: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Return unknowns and left null vector at the branch point near a point, or None."""
    residual, jacobian = problem.at(x)
    if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
        return None
    left, values, _ = np.linalg.svd(jacobian)
    if not values[-1] < _REGULAR * values[0]:
        return None
    size, psi, beta, before, rises = len(residual), left[:, -1], 0.0, np.inf, 0
    rounding = max(problem.system.model.rounding, _LEAST_ROUNDING)
    full = np.zeros((2 * size + 2, 2 * size + 2))
    for _ in range(_MOST_STEPS):
        full[:size, : size + 1] = jacobian
        full[:size, size + 1 : -1] = beta * np.eye(size)
        full[:size, -1] = psi
        full[size:-1, : size + 1] = problem.hessian(x, psi)
        full[size:-1, size + 1 : -1] = jacobian.T
        full[-1, size + 1 : -1] = 2.0 * psi
        right = -np.concatenate([residual + beta * psi, psi @ jacobian, [psi @ psi - 1.0]])
        if not np.isfinite(full).all():
            return None
        try:
            step = np.linalg.solve(full, right)
        except np.linalg.LinAlgError:
            return None
        x, psi, beta = x + step[: size + 1], psi + step[size + 1 : -1], beta + float(step[-1])
        moved = float(np.abs(step[: size + 1]).max())
        rises += moved > before
        if not moved < 1.0 or rises == _MOST_RISES:
            return None
        if moved < _SETTLED or (moved < _ROUNDED and moved > 0.5 * before):
            unfolded = abs(beta) > _UNFOLDED * rounding * max(1.0, float(values[0]))
            return None if unfolded else (x, psi)
        before = moved
        residual, jacobian = problem.at(x)
    return None


def _directions(
    problem: _ChainProblem, x: FloatArray, psi: FloatArray
) -> tuple[Direction, Direction] | None:
    """Return the directions of the two curves that cross; None if no two do."""
    basis = np.linalg.svd(problem.at(x)[1])[2][-2:]
    form = basis @ problem.hessian(x, psi) @ basis.T
    product = form[0, 0] * form[1, 1]
    discriminant = form[0, 1] ** 2 - product
    if not discriminant > _CROSSES * np.sum(form**2):
        return None
    # the symmetric form is a difference of two squares: its null directions lie between its axes
    values, axes = np.linalg.eigh(form)
    low, high = np.sqrt(-values[0]), np.sqrt(values[1])
    found = [(high * axes[:, 0] + sign * low * axes[:, 1]) @ basis for sign in (1.0, -1.0)]
    first, second = (_direction(problem, d) for d in found)
    return first, second


def _direction(problem: _ChainProblem, d: FloatArray) -> Direction:
    count = problem.system.segments
    d = d / np.sqrt(np.sum(d[:-1] ** 2) / count + d[-1] ** 2)
    slope = 0.0 if abs(d[-1]) < _TURNS else float(d[-1]) * problem.width
    return Direction(d[:-1].reshape(count, -1).copy(), slope)


def crossing_between(step: Step, share: float) -> tuple[Crossing, Point] | None:
    """Return the branch point in a step of a branch, and the point of the branch there.

    Parameters
    ----------
    share : where it is looked for, as a share of the step
    """
    before, after, settings = step.before, step.after, step.settings
    near = replace(
        before,
        joints=before.joints + share * (after.joints - before.joints),
        w=before.w + share * (after.w - before.w),
    )
    chord = after.joints - before.joints, after.value - before.value
    square = _product(chord, chord, settings.scale)
    length = float(np.sqrt(square))
    blurred = _NEARBY * length + _blur(near, step.orbit.model.rounding)
    crossing = crossing_near(step.orbit_at(near), settings, 2.0 * (length + blurred))
    if crossing is None:
        return None
    way = (
        crossing.orbit.joints - before.joints,
        float(crossing.orbit.vector[step.active]) - before.value,
    )
    at = _product(chord, way, settings.scale) / square
    far = np.sqrt(_product(way, way, settings.scale)) > length + blurred
    if far or not -blurred < at * length < length + blurred:
        return None
    arc = min(1.0, max(0.0, at)) * step.length
    return crossing, crossing_point(crossing, before, arc, settings)


def _blur(point: Point, rounding: float) -> float:
    """Return how far from a branch point the sign of a slope is rounding (scaled product)."""
    size = 1.0 + float(np.abs(point.joints[:, 1:]).max(initial=0.0))
    return _BLURRED * size * float(np.cbrt(max(rounding, _LEAST_ROUNDING)))


def crossing_point(crossing: Crossing, before: Point, arc: float, settings: Settings) -> Point:
    """Return the point of a branch at a branch point, an arclength after another of its points."""
    direction = crossing.nearest(before.tangent, before.slope, settings.scale)
    orbit = crossing.orbit
    mu = np.zeros_like(before.mu)
    if settings.stability:
        mu[: orbit.model.directions] = orbit.turn_multipliers
    return replace(
        before,
        joints=orbit.joints,
        w=orbit.vector[[orbit.model.index_of(settings.parameter)]],
        tangent=direction.joints,
        direction=np.array([direction.slope]),
        mu=mu,
        arc=before.arc + arc,
        lost=False,
    )
