r"""One orbit of a curve on which a quantity is held: the equations, their null space, Newton's method.

The unknowns are the joints z and two parameters w; in the scaled product of
:mod:`contfric.continuation.geometry` they are one vector x. The orbits F(x) = 0 form a surface. Its
tangent plane, the null space of F', has two directions T, from a QR factorisation of the transpose. A
correction is the shortest step to the surface and a step y in that plane,

.. math:: \delta = \delta_0 + T y, \quad F'\delta_0 = -F, \qquad
   Q'T\,y = c - Q - Q'\delta_0, \qquad t^T T\,y = -t^T (x + \delta_0 - x_0) ,

the last one Keller's plane normal to the tangent t through the prediction. So the quantity is
differentiated in three directions only, and folds of the orbits in either parameter are ordinary points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contfric.curves.problem import Box
from contfric.curves.special import CurveEnd, CurveEndReason
from contfric.models.definition import FloatArray
from contfric.orbit.linear import equations_at
from contfric.orbit.orbit import Orbit
from contfric.quantities.measure import Measured, differentiated
from contfric.quantities.motion import Directions
from contfric.quantities.registry import Quantity

#: Newton steps after which it has failed: it converges quadratically from a prediction, in three or four.
_MOST = 12
#: A correction this small (scaled), or this many units of the flow's rounding, is rounding; and after all
#: steps one below the second is what can be had.
_DONE, _UNITS, _AT_LAST = 1e-12, 10.0, 1e-9


@dataclass(frozen=True, eq=False)
class Held:
    """A quantity that is held at a value while two parameters vary.

    Attributes
    ----------
    orbit : any orbit of the curve: its equations, and the parameters that do not vary
    quantity, value : what is held, and at what; None where :meth:`measured` is another condition
    box : the plane
    """

    orbit: Orbit
    quantity: Quantity | None
    value: float
    box: Box

    @property
    def which(self) -> list[int]:
        """Indices of the two parameters."""
        return [self.orbit.model.index_of(name) for name in self.box.names]

    @property
    def weights(self) -> FloatArray:
        """What the unknowns are divided by to become the scaled vector, shape (N m + 2,)."""
        size = self.orbit.joints.size
        root = np.sqrt(len(self.orbit.joints))
        return np.concatenate([np.full(size, root), self.box.widths])

    def scaled(self, orbit: Orbit) -> FloatArray:
        """Return an orbit as a scaled vector."""
        return np.concatenate([orbit.joints.ravel(), orbit.vector[self.which]]) / self.weights

    def at(self, x: FloatArray) -> Orbit:
        """Return a scaled vector as an orbit."""
        plain = x * self.weights
        vector = self.orbit.vector.copy()
        vector[self.which] = plain[-2:]
        return replace(
            self.orbit, joints=plain[:-2].reshape(self.orbit.joints.shape), vector=vector
        )

    def directions(self, columns: FloatArray) -> Directions:
        """Return scaled directions, shape (N m + 2, D), as motions of joints and parameters."""
        plain = columns * self.weights[:, None]
        vector = np.zeros((len(self.orbit.vector), columns.shape[1]))
        vector[self.which] = plain[-2:]
        return Directions(plain[:-2].reshape(*self.orbit.joints.shape, -1), vector)

    def measured(self, orbit: Orbit, columns: FloatArray) -> Measured:
        """Return what is held, with its slopes in scaled directions, shape (N m + 2, D)."""
        assert self.quantity is not None
        return differentiated(self.quantity, orbit, self.directions(columns))

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
        measured = held.measured(orbit, np.column_stack([shortest, plane]))
        slopes = measured.ahead[1:]
        missing = held.value - measured.value
        step = shortest + plane @ _in_plane(
            slopes, missing - measured.ahead[0], plane, tangent, x + shortest - guess
        )
        size = float(np.linalg.norm(step))
        if not np.isfinite(size):
            return None
        x = x + step
        found = Solved(x, _tangent(slopes, plane, tangent), held.at(x))
        if max(size, abs(missing) / (1.0 + abs(held.value))) < done:
            return found
        last = size
    return found if last < _AT_LAST else None


def _in_plane(
    slopes: FloatArray,
    missing: float,
    plane: FloatArray,
    tangent: FloatArray | None,
    moved: FloatArray,
) -> FloatArray:
    """Return the step y in the tangent plane, shape (2,)."""
    if tangent is None:
        return np.asarray(slopes * missing / (slopes @ slopes))
    both = np.array([slopes, tangent @ plane])
    try:
        return np.asarray(np.linalg.solve(both, np.array([missing, -tangent @ moved])))
    except np.linalg.LinAlgError:
        return np.full(2, np.nan)


def _tangent(slopes: FloatArray, plane: FloatArray, before: FloatArray | None) -> FloatArray:
    """Return the unit direction in the tangent plane along which the quantity stands still."""
    found = plane @ np.array([-slopes[1], slopes[0]]) / np.linalg.norm(slopes)
    sign = 1.0 if before is None or found @ before >= 0.0 else -1.0
    return np.asarray(sign * found)
