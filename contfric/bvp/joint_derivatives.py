"""Derivatives of an orbit's joints by its parameters, by the elimination of Newton's method, compiled."""

from __future__ import annotations

import math

import numpy as np

from contfric.bvp.blocks import rates_at_joint
from contfric.bvp.cyclic import elimination_workspace, finish, next_rows, take_out
from contfric.bvp.equations import LayoutType, close_chain, equation_workspace, segment_rows
from contfric.bvp.holds import NO_PIN
from contfric.compiled import blocks, f8, kernel, matrix, vector
from contfric.flow.layouts import FlowType


@kernel(f8(FlowType, LayoutType, matrix, vector, blocks))
def move_joints(functions, layout, z, p, out):  # type: ignore[no-untyped-def]
    """Write dz/dp for all parameters, shape (N, m, parameters); return how fast joints move.

    The columns of F_p are right-hand sides of one elimination. The matrix is evaluated at the joints given.
    The largest component of dz/dp is compared with 1 + that of z, times 1 + that of F_p. The quotient is
    infinite if the matrix is singular, or something is not finite.
    """
    count, m = z.shape
    free = p.shape[0]
    which = np.arange(free)
    equations, work = (
        equation_workspace(count, m, free),
        elimination_workspace(count, m, 0, free + 1),
    )
    rows, no_border, largest = work.rows, np.empty((0, count, m)), 0.0
    close_chain(functions, layout, z, p, which, equations)
    for i in range(count):
        if i > 0:
            next_rows(work, no_border, i, m)
        after = z[i + 1] if i + 1 < count else equations.last
        worst = segment_rows(functions, layout, i, m, z[i], after, p, which, equations, rows)
        if not math.isfinite(worst):
            return np.inf
        if layout.pins[i] == NO_PIN:
            rates_at_joint(functions, layout, i, after, p, which, equations, rows)
        for row in range(m, 2 * m):
            for k in range(free):
                if i + 1 == count:  # the closure moves with the parameters as well
                    for j in range(m):
                        rows[row, 3 * m + k] += rows[row, 2 * m + j] * equations.close_w[j, k]
                largest = max(largest, abs(rows[row, 3 * m + k]))
            if i == 0:
                for k in range(m):
                    rows[row, k], rows[row, m + k] = rows[row, m + k], 0.0
        if i > 0 and not take_out(work, i, m):
            return np.inf
    left, right = np.empty((m, m)), np.empty((m, m))
    if not finish(work, equations.close, np.empty((m, 0)), no_border, left, right):
        return np.inf
    fastest, size = 0.0, 0.0
    for i in range(count):
        for j in range(m):
            size = max(size, abs(z[i, j]))
            for k in range(free):
                value = -work.z[i, j, k]
                out[i, j, k] = value
                fastest = max(fastest, abs(value)) if math.isfinite(value) else np.inf
    return fastest / ((1.0 + size) * (1.0 + largest))
