"""The blocks of the chain's Jacobian as arrays, compiled: for what is computed outside of the engine."""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.bvp.equations import LayoutType, close_chain, equation_workspace, segment_rows
from contfric.bvp.holds import NO_PIN
from contfric.compiled import blocks, helper, i8, indices, kernel, matrix, vector
from contfric.flow.layouts import FlowType

#: Growth along a segment, times the rate at its exit, from which the rates at the joint are no better than
#: those of the state that the flow comes to: the first are wrong by the square of it, in units of rounding.
_FAR = 1e3


@helper
def rates_at_joint(functions, layout, i, after, p, which, workspace, rows):  # type: ignore[no-untyped-def]
    """Take the rates at the end of segment i at the joint itself, where the exit's condition holds exactly.

    The state that the flow comes to misses it by rounding. Where the exit is tangential, time is divided by
    that: multipliers would be rounding. Where disturbances grow far along the segment (a rest that repels)
    it is the other way around: growth and rate cancel, and only if both are of the same state.
    """
    n = after.shape[0] - 1
    m = n + 1
    jac, grown = workspace.jac, 0.0
    for j in range(n):
        for k in range(n):
            grown = max(grown, abs(rows[m + j, m + 1 + k]))
    if grown * abs(workspace.rates[i]) > _FAR:
        return
    functions.flow(layout.modes[i], after[0], after[1:], 0.0, p, which, workspace.state, jac)
    for j in range(n):
        change = jac[j, 1 + n] - rows[m + j, 2 * m]
        rows[m + j, 2 * m] += change
        rows[m + j, m] -= change


@kernel(
    types.boolean(
        *(FlowType, LayoutType, matrix, vector, indices, i8),
        *(blocks, blocks, blocks, blocks, matrix),
    )
)
def linearise(functions, layout, z, p, which, at_joints, a, b, c, r, close):  # type: ignore[no-untyped-def]
    """Fill the blocks of the full Jacobian for use outside of the engine.

    Differentiated by the parameters ``which``, as many as ``c`` has columns. The rates at exits are those at
    the joints where that is asked for (``at_joints`` is 1): these are the derivatives of the equations where
    they hold, and more exact there. They change in another way, as what is left of the equations does.
    """
    count, m = z.shape
    free = c.shape[2]
    workspace, rows = equation_workspace(count, m, free), np.empty((2 * m, 3 * m + free + 1))
    close_chain(functions, layout, z, p, which, workspace)
    for i in range(m):
        for j in range(m):
            close[i, j] = workspace.close[i, j]
    fine = True
    for i in range(count):
        after = z[i + 1] if i + 1 < count else workspace.last
        worst = segment_rows(functions, layout, i, m, z[i], after, p, which, workspace, rows)
        fine = fine and math.isfinite(worst)
        if layout.pins[i] == NO_PIN and at_joints != 0:
            rates_at_joint(functions, layout, i, after, p, which, workspace, rows)
        for j in range(m):
            for k in range(m):
                a[i, j, k] = rows[m + j, m + k]
                b[i, j, k] = rows[m + j, 2 * m + k]
            for k in range(free):
                c[i, j, k] = rows[m + j, 3 * m + k]
            r[i, j, 0] = rows[m + j, 3 * m + free]
    # the closure's dependence on the parameters is added to the last segment's columns
    for i in range(m):
        for k in range(free):
            for j in range(m):
                c[count - 1, i, k] += b[count - 1, i, j] * workspace.close_w[j, k]
    return fine
