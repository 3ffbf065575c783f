"""How a solved orbit moves with its parameters: the implicit function theorem on the chain of segments.

The equations F(z, p) = 0 of the joints z hold for every p, so that F_z dz/dp = -F_p. One elimination of the
matrix that Newton's method has solved with gives the derivatives of all joints by all parameters.
"""

from __future__ import annotations

import numpy as np

from contfric.errors import ConvergenceError
from contfric.interrupts import held_back
from contfric.models.definition import FloatArray
from contfric.orbit.linear import jacobian_blocks, stacked
from contfric.orbit.orbit import Orbit

#: Unknowns of the largest system that is solved as a full matrix; a longer one is solved as a sparse one.
_FULL = 200
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
    a, b, c, close = jacobian_blocks(orbit.system, orbit.joints, orbit.vector)
    right = c.reshape(orbit.joints.size, -1)
    try:
        moved = _solved(a, b, close, right)
    except (np.linalg.LinAlgError, RuntimeError):
        moved = np.full(right.shape, np.inf)
    size = 1.0 + float(np.max(np.abs(orbit.joints)))
    if not np.max(np.abs(moved), initial=0.0) < _FOLD * size * (1.0 + np.max(np.abs(right))):
        raise ConvergenceError(
            "the orbit has no derivative by its parameters: it is at a fold or branch point, or one of a "
            "continuum. Move along the branch and ask again",
            orbit,
        )
    return -moved.reshape(*orbit.joints.shape, -1)


def _solved(a: FloatArray, b: FloatArray, close: FloatArray, right: FloatArray) -> FloatArray:
    if len(right) <= _FULL:
        return np.asarray(np.linalg.solve(stacked(a, b, close), right), dtype=np.float64)
    with held_back():
        from scipy.sparse import bsr_matrix, csc_matrix
        from scipy.sparse.linalg import splu

    count, m = a.shape[:2]
    last = b.copy()
    last[-1] = b[-1] @ close
    columns = np.column_stack([np.arange(count), (np.arange(count) + 1) % count])
    order = np.argsort(columns, axis=1)  # of the last row the first block stands behind its own
    blocks = np.stack([a, last], axis=1)
    blocks = np.take_along_axis(blocks, order[:, :, None, None], axis=1).reshape(2 * count, m, m)
    columns = np.take_along_axis(columns, order, axis=1).ravel()
    starts = np.arange(0, 2 * count + 1, 2)
    matrix = csc_matrix(bsr_matrix((blocks, columns, starts), shape=(count * m, count * m)))
    return np.asarray(splu(matrix).solve(right), dtype=np.float64)
