"""The pencil of one turn by orthogonal transformations: a chain of blocks without its inner joints.

Where the engine eliminates a joint with row exchanges (:mod:`contfric.bvp.cyclic`), this reflects: the
last m rows of the transposed Q of ``[Q_i; A_i] = Q R`` annihilate a joint, and P and Q are as well
conditioned as the chain (A. Bojanczyk, G. Golub, P. Van Dooren, Proc. SPIE 1770 (1992) 31-42). A reflection
of columns by Householder's method, with the signs of LAPACK's ``dgeqrf``.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import blocks, helper, kernel


@helper
def reflect(rows, m):  # type: ignore[no-untyped-def]
    """Make the first m columns upper triangular by reflections of all rows."""
    count, width = rows.shape
    for j in range(m):
        rest = 0.0
        for i in range(j + 1, count):
            rest = math.hypot(rest, rows[i, j])
        if rest == 0.0:
            continue
        first = rows[j, j]
        size = -math.copysign(math.hypot(first, rest), first)
        factor = (size - first) / size
        for i in range(j + 1, count):
            rows[i, j] /= first - size
        for k in range(j + 1, width):
            total = rows[j, k]
            for i in range(j + 1, count):
                total += rows[i, j] * rows[i, k]
            total *= factor
            rows[j, k] -= total
            for i in range(j + 1, count):
                rows[i, k] -= total * rows[i, j]


@kernel(types.void(blocks, blocks, blocks))
def turn_pencil(a, b, pencil):  # type: ignore[no-untyped-def]
    """Write (P, Q) with ``P z_0 + Q z_N = 0`` for ``a_i z_i + b_i z_{i+1} = 0``, shapes (N, m, m)."""
    m = a.shape[1]
    rows = np.empty((2 * m, 3 * m))  # columns: the joint that goes, z_0, the next joint
    for i in range(m):
        for j in range(m):
            pencil[0, i, j], pencil[1, i, j] = a[0, i, j], b[0, i, j]
    for k in range(1, a.shape[0]):
        for i in range(m):
            for j in range(m):
                rows[i, j], rows[i, m + j], rows[i, 2 * m + j] = (
                    pencil[1, i, j],
                    pencil[0, i, j],
                    0.0,
                )
                rows[m + i, j], rows[m + i, m + j], rows[m + i, 2 * m + j] = (
                    a[k, i, j],
                    0.0,
                    b[k, i, j],
                )
        reflect(rows, m)
        for i in range(m):
            for j in range(m):
                pencil[0, i, j], pencil[1, i, j] = rows[m + i, m + j], rows[m + i, 2 * m + j]
