"""Orbits on a curve of orbits through one of them, solved normal to its tangent: also where the curve turns.

A fold of the simpler orbits may lie so near to a vertex that there is no orbit at parameters near it, or
that Newton's method at fixed parameters goes to the other side of the fold. With the unit tangent (t, r) of
the curve at (z*, p*) the orbit at the distance s solves

    F(z, p) = 0,    t . (z - z*) + r (p - p*) = s,

which is regular at a fold (H. B. Keller, 1977). For single orbits, with the assembled Jacobian.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contfric.models.definition import FloatArray
from contfric.orbit.linear import equations_at, tangent_of
from contfric.orbit.orbit import Orbit, Status

#: Most corrections: from near the curve it takes three to five.
_MOST_CORRECTIONS = 12
#: A correction (relative to 1 + the size of the orbit) that is rounding of the equations, and one below which
#: the next would be.
_ROUNDING, _LAST = 1e-14, 1e-9


@dataclass(frozen=True, eq=False)
class Line:
    """A curve of orbits near one of them: an orbit on or near the curve, and its unit tangent there.

    Attributes
    ----------
    orbit : where it begins
    active : index of the parameter
    tangent, slope : the tangent, of the joints and of the parameter
    """

    orbit: Orbit
    active: int
    tangent: FloatArray
    slope: float

    @classmethod
    def through(cls, orbit: Orbit, active: int) -> Line | None:
        """Return the curve through an orbit; None if it has no unique direction there."""
        try:
            tangent, slope = tangent_of(orbit.system, orbit.joints, orbit.vector, active)
        except np.linalg.LinAlgError:
            return None
        size = float(np.sqrt(np.sum(tangent**2) + slope**2))
        if not (np.isfinite(size) and size > 0.0):
            return None
        return cls(orbit, active, tangent / size, slope / size)

    def at(self, distance: float) -> Orbit | None:
        """Return the orbit at a distance along the tangent; None where Newton's method fails."""
        size = self.orbit.joints.size
        along = np.append(self.tangent.ravel(), self.slope)
        start = np.append(self.orbit.joints.ravel(), self.orbit.vector[self.active])
        x, full = start + distance * along, np.empty((size + 1, size + 1))
        full[size] = along
        before = np.inf
        for _ in range(_MOST_CORRECTIONS):
            joints, vector = self._split(x)
            residual, on_joints, on_parameters = equations_at(self.orbit.system, joints, vector)
            full[:size, :size], full[:size, size] = on_joints, on_parameters[:, self.active]
            right = np.append(-residual, distance - along @ (x - start))
            try:
                step = np.linalg.solve(full, right)
            except np.linalg.LinAlgError:
                return None
            if not np.isfinite(step).all():
                return None
            x = x + step
            now = float(np.abs(step).max()) / (1.0 + float(np.abs(x).max()))
            if now < _ROUNDING or (now < _LAST and now >= 0.5 * before):
                joints, vector = self._split(x)
                done = Status.CONVERGED
                return replace(self.orbit, joints=joints, vector=vector, status=done)
            before = now
        return None

    def _split(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        vector = self.orbit.vector.copy()
        vector[self.active] = x[-1]
        return x[:-1].reshape(self.orbit.joints.shape), vector
