"""The linearised equations of one orbit: the assembled Jacobian and the pencil of one turn.

For single orbits; along a branch the engine has the pencil from the elimination it does anyway.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.system import System

#: Indices of the parameters by which equations are differentiated.
Which = Sequence[int] | IntArray
#: Singular values below this share of the largest are zero: at an event they are good to the root of rounding
#: at worst.
_NULL = 1e-7


def jacobian_blocks(
    system: System, joints: FloatArray, vector: FloatArray, which: Which = ()
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the blocks on z_i, z_{i+1} and some parameters, and the closure.

    Shapes (N, m, m), (N, m, m), (N, m, parameters) and (m, m). ``which`` are the indices of the parameters:
    most of the time goes to them where motion is integrated, or they are in the matrices of linear motion.
    """
    a, b, c, close, _ = linearised(system, joints, vector, which)
    return a, b, c, close


def linearised(
    system: System,
    joints: FloatArray,
    vector: FloatArray,
    which: Which = (),
    at_joints: bool = True,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the blocks and, as the last one, what is left of every equation, shape (N m,).

    Parameters
    ----------
    at_joints : take the rates at exits at the joints: more exact where the equations hold, and only there
    """
    from contfric.bvp.blocks import linearise

    count, m = joints.shape
    a, b = np.empty((2, count, m, m))
    chosen = np.array(which, dtype=np.int64)
    c, r = np.empty((count, m, len(chosen))), np.empty((count, m, 1))
    close, by = np.empty((m, m)), int(at_joints)
    linearise(system.functions(), system.layout, joints, vector, chosen, by, a, b, c, r, close)
    return a, b, c, close, r.ravel()


def equations_at(
    system: System,
    joints: FloatArray,
    vector: FloatArray,
    which: Which = (),
    at_joints: bool = True,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return residuals and Jacobians by joints and some parameters: (N m,), (N m, N m), (N m, parameters).

    Where the equations do not hold these are the derivatives of the residuals only without ``at_joints``.
    """
    a, b, c, close, correction = linearised(system, joints, vector, which, at_joints)
    return -correction, stacked(a, b, close), c.reshape(joints.size, -1)


def assembled(system: System, joints: FloatArray, vector: FloatArray) -> FloatArray:
    """Return the Jacobian with respect to all joints, shape (N m, N m)."""
    a, b, _, close = jacobian_blocks(system, joints, vector)
    return stacked(a, b, close)


def stacked(a: FloatArray, b: FloatArray, close: FloatArray) -> FloatArray:
    """Return the cyclic blocks as one matrix."""
    count, m = a.shape[:2]
    full = np.zeros((count * m, count * m))
    for i in range(count):
        rows = slice(i * m, (i + 1) * m)
        full[rows, rows] += a[i]
        if i + 1 < count:
            full[rows, (i + 1) * m : (i + 2) * m] += b[i]
        else:
            full[rows, :m] += b[i] @ close
    return full


def tangent_of(
    system: System, joints: FloatArray, vector: FloatArray, active: int
) -> tuple[FloatArray, float]:
    """Return the direction of the curve of orbits through one, and the parameter's share of it.

    The null vector of the Jacobian with the parameter's column: also where an exit is tangential and a
    joint alone moves. By two steps of inverse iteration, each with the last iterate as border row
    (W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM 2000, section 3.3).

    Raises
    ------
    numpy.linalg.LinAlgError
        If the curve has no unique direction.
    """
    a, b, c, close = jacobian_blocks(system, joints, vector, (active,))
    size = joints.size
    full = np.empty((size + 1, size + 1))
    full[:size, :size] = stacked(a, b, close)
    full[:size, size] = c.ravel()
    wanted = np.zeros(size + 1)
    wanted[size] = 1.0
    null: FloatArray = np.cos(np.arange(1.0, size + 2.0))  # no direction of an orbit
    for _ in range(2):
        full[size] = null / math.sqrt(null.dot(null))
        null = np.asarray(np.linalg.solve(full, wanted), dtype=np.float64)
    return null[:size].reshape(joints.shape), float(null[size])


def null_vectors(system: System, joints: FloatArray, vector: FloatArray) -> FloatArray:
    """Return the null vectors of the Jacobian at fixed parameters, shape (k, N, m)."""
    return null_rows(assembled(system, joints, vector)).reshape(-1, *joints.shape)


def null_space(
    system: System, joints: FloatArray, vector: FloatArray, active: int
) -> tuple[FloatArray, FloatArray]:
    """Return the directions in which curves of orbits may pass through one, and the parameter's shares.

    The null vectors of the Jacobian with the parameter's column, shapes (k, N, m) and (k,): one where the
    curve has a unique direction.
    """
    a, b, c, close = jacobian_blocks(system, joints, vector, (active,))
    full = np.hstack([stacked(a, b, close), c.reshape(-1, 1)])
    found = null_rows(full)
    return found[:, :-1].reshape(len(found), *joints.shape), found[:, -1]


def null_rows(matrix: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the null space of a matrix, rows; none if it is not finite.

    Equations are scaled to one size before: rates of a stiff structure would make all others look like zeros.
    """
    if not np.all(np.isfinite(matrix)):
        return np.empty((0, matrix.shape[1]))
    size = np.linalg.norm(matrix, axis=1, keepdims=True)
    _, singular, right = np.linalg.svd(matrix / np.where(size > _NULL, size, 1.0))
    found: FloatArray = right[int(np.sum(singular > _NULL * singular[0])) :]
    return found


def pencil_of_turn(system: System, joints: FloatArray, vector: FloatArray) -> FloatArray:
    """Return (P, Q) with ``P z_0 + Q z_N = 0`` for one turn, shape (2, m, m): without inner joints.

    Where the rate of an exit does not matter it may vanish (:mod:`contfric.bvp.saltation`).
    """
    from contfric.bvp.pencil import turn_pencil
    from contfric.bvp.saltation import pass_when_due

    a, b, _, _ = jacobian_blocks(system, joints, vector)
    pass_when_due(system, vector, a, b)
    pencil = np.empty((2, *a.shape[1:]))
    turn_pencil(a, b, pencil)
    return pencil


def of_two_halves(mu: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return multipliers of a symmetric orbit from those of its half: their squares, infinite ones too.

    Examples
    --------
    >>> import numpy as np
    >>> of_two_halves(np.array([-0.5, np.inf]) + 0j).real.tolist()
    [0.25, inf]
    """
    finite = np.isfinite(mu)
    return np.where(finite, np.where(finite, mu, 0.0) ** 2, complex(np.inf))
