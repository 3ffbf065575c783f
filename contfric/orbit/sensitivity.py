"""How a solved orbit moves with its parameters: the implicit function theorem on the chain of segments.

The equations F(z, p) = 0 of the joints z hold for every p, so that F_z dz/dp = -F_p. One elimination, that of
Newton's method with the columns of F_p as right-hand sides, gives the derivatives of all joints by all
parameters: it costs what one step of Newton's method does.
"""

from __future__ import annotations

import numpy as np

from contfric.errors import ConvergenceError
from contfric.models.definition import FloatArray
from contfric.orbit.orbit import Orbit

#: Joints that move this much faster than a parameter (relative): a fold, where they have no derivative.
_FOLD = 1e9


def joint_sensitivities(orbit: Orbit) -> FloatArray:
    """Return the derivatives of the joints by every parameter, shape (N, 1 + n, parameters).

    Raises
    ------
    ConvergenceError
        If the orbit is not solved, or has no derivative: at a fold, or as one of a continuum.
    """
    if not orbit.converged:
        raise ConvergenceError(f"the orbit is not solved: {orbit.status.value}", orbit)
    from contfric.orbit.moved import move_joints

    system, vector = orbit.system, orbit.vector
    moved = np.empty((*orbit.joints.shape, len(vector)))
    right = move_joints(system.functions(), system.layout, orbit.joints, vector, moved)
    size = 1.0 + float(np.max(np.abs(orbit.joints)))
    if not np.max(np.abs(moved), initial=0.0) < _FOLD * size * (1.0 + right) < np.inf:
        raise ConvergenceError(
            "the orbit has no derivative by its parameters: it is at a fold or branch point, or one of a "
            "continuum. Move along the branch and ask again",
            orbit,
        )
    return moved
