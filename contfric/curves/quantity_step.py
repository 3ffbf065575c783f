r"""One orbit of a curve on which a quantity is held: the equations, their null space, Newton's method.

The unknowns are the joints z and q parameters w (two for a quantity with one value); in the scaled product of
:mod:`contfric.continuation.geometry` they are one vector x. The orbits F(x) = 0 form a surface. Its
tangent plane, the null space of F', has q directions T, from a QR factorisation of the transpose. On the
surface q - 1 conditions C(x) = 0 leave a curve. A correction is the shortest step to the surface and a step y
in that plane,

.. math:: \delta = \delta_0 + T y, \quad F'\delta_0 = -F, \qquad
   C'T\,y = -C - C'\delta_0, \qquad t^T T\,y = -t^T (x + \delta_0 - x_0) ,

the last one Keller's plane normal to the tangent t through the prediction. So conditions are differentiated
in q + 1 directions only, and folds of the orbits in any parameter are ordinary points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from contfric.curves.problem import Ranges
from contfric.curves.special import CurveEnd, CurveEndReason
from contfric.models.definition import FloatArray
from contfric.orbit.linear import equations_at
from contfric.orbit.orbit import Orbit
from contfric.quantities.measure import differentiated
from contfric.quantities.motion import Directions
from contfric.quantities.registry import Quantity

#: Newton steps after which it has failed: it converges quadratically from a prediction, in three or four.
_MOST = 12
#: A correction this small (scaled), or this many units of the flow's rounding, is rounding; and after all
#: steps one below the second is what can be had.
_DONE, _UNITS, _AT_LAST = 1e-12, 10.0, 1e-9


class Conditions(NamedTuple):
    """What vanishes on the curve, shape (c,), and its slopes in D directions, shape (c, D)."""

    values: FloatArray
    slopes: FloatArray


@dataclass(frozen=True, eq=False)
class Held:
    """A quantity that is held at a value while two parameters vary.

    Attributes
    ----------
    orbit : any orbit of the curve: its equations, and the parameters that do not vary
    quantity, value : what is held, and at what; None where :meth:`conditions` are others
    box : the parameters that vary
    """

    orbit: Orbit
    quantity: Quantity | None
    value: float
    box: Ranges

    @property
    def which(self) -> list[int]:
        """Indices of the parameters that vary."""
        return [self.orbit.model.index_of(name) for name in self.box.names]

    @property
    def weights(self) -> FloatArray:
        """What the unknowns are divided by to become the scaled vector, shape (N m + q,)."""
        size = self.orbit.joints.size
        root = np.sqrt(len(self.orbit.joints))
        return np.concatenate([np.full(size, root), self.box.widths])

    def scaled(self, orbit: Orbit) -> FloatArray:
        """Return an orbit as a scaled vector."""
        return np.concatenate([orbit.joints.ravel(), orbit.vector[self.which]]) / self.weights

    def at(self, x: FloatArray) -> Orbit:
        """Return a scaled vector as an orbit."""
        plain, size = x * self.weights, self.orbit.joints.size
        vector = self.orbit.vector.copy()
        vector[self.which] = plain[size:]
        return replace(
            self.orbit, joints=plain[:size].reshape(self.orbit.joints.shape), vector=vector
        )

    def directions(self, columns: FloatArray) -> Directions:
        """Return scaled directions, shape (N m + q, D), as motions of joints and parameters."""
        plain, size = columns * self.weights[:, None], self.orbit.joints.size
        vector = np.zeros((len(self.orbit.vector), columns.shape[1]))
        vector[self.which] = plain[size:]
        return Directions(plain[:size].reshape(*self.orbit.joints.shape, -1), vector)

    def conditions(self, orbit: Orbit, columns: FloatArray) -> Conditions:
        """Return what vanishes, with its slopes in scaled directions, shape (N m + q, D)."""
        assert self.quantity is not None
        found = differentiated(self.quantity, orbit, self.directions(columns))
        return Conditions(np.array([found.value - self.value]), found.ahead[None])

    def solved(self) -> None:
        """Note that a point has been found."""

    def left(self, values: FloatArray) -> float:
        """Return the largest of the conditions, relative to what is held."""
        return float(np.max(np.abs(values))) / (1.0 + abs(self.value))

    def bounds(self, orbit: Orbit) -> FloatArray:
        """Return what else has to be positive along the curve."""
        return np.empty(0)

    def end_at_bound(self, orbit: Orbit) -> CurveEnd:
        """Return why the curve ends where one of these is zero."""
        return CurveEnd(CurveEndReason.LOST)


@dataclass(frozen=True, eq=False)
class Solved:
    """A solved point: the scaled vector, its unit tangent, and the orbit."""

    x: FloatArray
    tangent: FloatArray
    orbit: Orbit


def solve_held(held: Held, guess: FloatArray, tangent: FloatArray | None) -> Solved | None:
    """Solve for the point of the curve normal to a tangent through a guess; None if Newton fails.

    Without a tangent the nearest point is solved for, and the tangent may have either sign.
    """
    x, last, found = guess.copy(), np.inf, None
    done = max(_DONE, _UNITS * held.orbit.model.rounding)
    for _ in range(_MOST):
        orbit = held.at(x)
        left, on_joints, on_parameters = equations_at(held.orbit.system, orbit.joints, orbit.vector)
        jacobian = np.hstack([on_joints, on_parameters[:, held.which]]) * held.weights
        if not (np.all(np.isfinite(jacobian)) and np.all(np.isfinite(left))):
            return None
        basis, upper = np.linalg.qr(jacobian.T, mode="complete")
        rows = len(left)
        try:
            shortest = -basis[:, :rows] @ np.linalg.solve(upper[:rows].T, left)
        except np.linalg.LinAlgError:
            return None
        plane = basis[:, rows:]
        values, slopes = held.conditions(orbit, np.column_stack([shortest, plane]))
        slopes, missing = slopes[:, 1:], -values - slopes[:, 0]
        step = shortest + plane @ _in_plane(slopes, missing, plane, tangent, x + shortest - guess)
        size = float(np.linalg.norm(step))
        if not np.isfinite(size):
            return None
        x = x + step
        found = Solved(x, _tangent(slopes, plane, tangent), held.at(x))
        if max(size, held.left(values)) < done:
            return found
        last = size
    return found if last < _AT_LAST else None


def _in_plane(
    slopes: FloatArray,
    missing: FloatArray,
    plane: FloatArray,
    tangent: FloatArray | None,
    moved: FloatArray,
) -> FloatArray:
    """Return the step y in the tangent plane, shape (q,)."""
    if not np.all(np.isfinite(slopes)):
        return np.full(slopes.shape[1], np.nan)
    try:
        if tangent is None:
            return np.asarray(np.linalg.lstsq(slopes, missing)[0])
        both = np.vstack([slopes, tangent @ plane])
        return np.asarray(np.linalg.solve(both, np.array([*missing, -tangent @ moved])))
    except np.linalg.LinAlgError:
        return np.full(slopes.shape[1], np.nan)


def _tangent(slopes: FloatArray, plane: FloatArray, before: FloatArray | None) -> FloatArray:
    """Return the unit direction in the tangent plane along which all conditions stand still."""
    found = plane @ np.linalg.svd(slopes)[2][-1]
    sign = 1.0 if before is None or found @ before >= 0.0 else -1.0
    return np.asarray(sign * found)
