"""The equations of the chain, a segment at a time: residuals, exact Jacobian, rates at the exits.

Equations of segment i, from the joint ``z_i = (t_i, y_i)`` to the next one (``z_N`` is the closure
of ``z_0``)::

    phi(mode_i; t_i, y_i, t_{i+1} - t_i; p) - y_{i+1} = 0        (n rows)
    observable(z_{i+1}; p) - level(p) = 0                        (1 row)

A segment that follows a reset at its entry starts at the image ``R(t_i, y_i; p)`` of the joint, which is
the state before the reset: phi is that of the image, and its derivatives follow by the chain rule. The
joints of an impacting orbit are so the states at which the wall is met.

The closure of z_0 is ``z_N = (t_0 + turn * period, K y_0)``. An autonomous model has no period, and any
shift of an orbit in time is one too: there the end of the turn is pinned, ``z_N = (0, K y_0)``, and t_0,
minus its duration, is found with the rest. (The last exit surface is the section: it fixes the phase.)

The last row of a hold is its pin, a condition on ``z_i``: the observable of a surface less its level, or
the rate of the exit before it.

The exit row of a short segment is that of :mod:`contfric.bvp.short_exits`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray
from contfric.bvp.after_reset import apply_reset, through_reset
from contfric.bvp.holds import NO_PIN, TOUCH_PIN
from contfric.bvp.short_exits import is_divided, mean_rate_row
from contfric.bvp.system import Layout
from contfric.compiled import allocating_helper, f8, helper, i8, indices, matrix, table, vector

#: Type of a layout, as kernels take it.
LayoutType = types.NamedTuple(
    [
        indices,
        indices,
        indices,
        vector,
        table,
        table,
        table,
        indices,
        indices,
        indices,
        indices,
        indices,
        table,
        table,
        matrix,
        matrix,
        matrix,
        f8,
        i8,
        f8,
    ],
    Layout,
)


class EquationWorkspace(NamedTuple):
    """Workspace for the equations of one segment and for the closure; allocated once.

    Attributes
    ----------
    state, jac : end of a segment with its derivatives, shapes (n,) and (n, 2 + n + q)
    between : a state within a segment, shape (n,)
    after_reset : state after a reset, in the last row, and the derivatives of the reset, shape
        (n + 1, 1 + n + q)
    grad, level_grad : gradients of an observable and of a level, shapes (1 + n + q,) and (q,)
    rates : rate of the exit's observable at the end of each segment, shape (N,)
    last, close, close_w : closure of z_0 with its matrices, shapes (m,), (m, m) and (m, q)
    none, empty, nothing : what is handed over where nothing is wanted, shapes (0,), (0,), (0, 0)
    """

    state: FloatArray
    jac: FloatArray
    between: FloatArray
    after_reset: FloatArray
    grad: FloatArray
    level_grad: FloatArray
    rates: FloatArray
    last: FloatArray
    close: FloatArray
    close_w: FloatArray
    none: FloatArray
    empty: FloatArray
    nothing: FloatArray


@allocating_helper
def equation_workspace(count, m, free):  # type: ignore[no-untyped-def]
    """Return the workspace for a chain of ``count`` segments with ``free`` parameters."""
    n = m - 1
    return EquationWorkspace(
        np.empty(n),
        np.empty((n, 2 + n + free)),
        np.empty(n),
        np.empty((n + 1, 1 + n + free)),
        np.empty(1 + n + free),
        np.empty(free),
        np.empty(count),
        np.empty(m),
        np.empty((m, m)),
        np.empty((m, free)),
        np.empty(0, dtype=np.int64),
        np.empty(0),
        np.empty((0, 0)),
    )


@helper
def close_chain(functions, layout, z, p, which, workspace):  # type: ignore[no-untyped-def]
    """Write the closure of z_0, and its matrices on z_0 and on the parameters."""
    last, close, close_w, grad = (
        workspace.last,
        workspace.close,
        workspace.close_w,
        workspace.level_grad,
    )
    n, free = layout.closure.shape[0], which.shape[0]
    for k in range(free):
        for i in range(1 + n):
            close_w[i, k] = 0.0
    if layout.turn == 0.0:  # autonomous: the turn ends at time 0
        last[0], close[0, 0] = 0.0, 0.0
    else:
        last[0], close[0, 0] = z[0, 0] + layout.turn * functions.period(p, which, grad), 1.0
        for k in range(free):
            close_w[0, k] = layout.turn * grad[k]
    for i in range(n):
        close[0, 1 + i] = 0.0
        close[1 + i, 0] = 0.0
        value = 0.0
        for j in range(n):
            value += layout.closure[i, j] * z[0, 1 + j]
            close[1 + i, 1 + j] = layout.closing[i, j]
        last[1 + i] = value


@helper
def segment_jacobian(functions, layout, i, start, duration, p, which, out, workspace):  # type: ignore[no-untyped-def]
    """Write the end of segment i, from its joint, with the derivatives: after a reset by the chain rule."""
    mode, state = layout.modes[i], workspace.state
    if layout.resets[i] >= 0:
        n = state.shape[0]
        apply_reset(functions, layout, i, start, p, which, workspace)
        begin = workspace.after_reset[n, :n]
        functions.flow(mode, start[0], begin, duration, p, which, state, out)
        through_reset(out, workspace.after_reset, workspace.grad, n)
    else:
        functions.flow(mode, start[0], start[1:], duration, p, which, state, out)


@helper
def pin_value(functions, layout, i, start, p, which, grad):  # type: ignore[no-untyped-def]
    """Return what vanishes at the start of hold i, with the gradient where there is space for it."""
    surface = layout.pins[i]
    if surface == TOUCH_PIN:
        c = layout.observables[layout.exits[i - 1]]
        return functions.rate(layout.modes[i - 1], c, start[0], start[1:], p, which, grad)
    value = functions.observe(layout.observables[surface], start[0], start[1:], p, which, grad)
    return value - functions.level(surface, p, which, grad[grad.shape[0] :])


@helper
def pin_row(functions, layout, i, at, start, after, p, which, workspace, rows):  # type: ignore[no-untyped-def]
    """Write the last row of hold i, and the rate with which it is left; return the residual."""
    grad, level_grad = workspace.grad, workspace.level_grad
    m, free, width = start.shape[0], which.shape[0], rows.shape[1]
    row, left = 2 * m - 1, layout.observables[layout.exits[i]]
    none, empty = workspace.none, workspace.empty
    workspace.rates[i] = functions.rate(
        layout.departs[i], left, after[0], after[1:], p, none, empty
    )
    residual = pin_value(functions, layout, i, start, p, which, grad)
    for k in range(width):
        rows[row, k] = 0.0
    for k in range(m):
        rows[row, at + k] = grad[k]
    for k in range(free):
        rows[row, 3 * m + k] = grad[m + k]
    if layout.pins[i] >= 0:
        functions.level(layout.pins[i], p, which, level_grad)
        for k in range(free):
            rows[row, 3 * m + k] -= level_grad[k]
    rows[row, 3 * m + free] = -residual
    return abs(residual)


@helper
def segment_rows(functions, layout, i, at, start, after, p, which, workspace, rows):  # type: ignore[no-untyped-def]
    """Write the rows of segment i to the last m of ``rows``; return its residual against scale.

    The columns are ``[z_0 | z_i | z_{i+1} | parameters | right-hand sides]``, z_i from ``at``; the
    first right-hand side is minus the residual, the others are zero.
    """
    state, jac, grad, level_grad = (
        workspace.state,
        workspace.jac,
        workspace.grad,
        workspace.level_grad,
    )
    n, free, width = state.shape[0], which.shape[0], rows.shape[1]
    m = n + 1
    begin = start[1:]
    if layout.resets[i] >= 0:
        apply_reset(functions, layout, i, start, p, which, workspace)
        begin = workspace.after_reset[n, :n]
    functions.flow(layout.modes[i], start[0], begin, after[0] - start[0], p, which, state, jac)
    if layout.resets[i] >= 0:
        through_reset(jac, workspace.after_reset, grad, n)
    worst = 0.0
    for j in range(n):
        row = m + j
        for k in range(width):
            rows[row, k] = 0.0
        residual = state[j] - after[1 + j]
        worst += abs(residual) / (1.0 + abs(after[1 + j]))
        rows[row, at] = jac[j, 0] - jac[j, 1 + n]
        for k in range(n):
            rows[row, at + 1 + k] = jac[j, 1 + k]
        rows[row, 2 * m] = jac[j, 1 + n]
        rows[row, 2 * m + 1 + j] = -1.0
        for k in range(free):
            rows[row, 3 * m + k] = jac[j, 2 + n + k]
        rows[row, 3 * m + free] = -residual
    surface, row = layout.exits[i], m + n
    if layout.pins[i] != NO_PIN:
        worst += pin_row(functions, layout, i, at, start, after, p, which, workspace, rows)
        return worst if math.isfinite(worst) else np.inf
    value = functions.observe(layout.observables[surface], after[0], after[1:], p, which, grad)
    residual = value - functions.level(surface, p, which, level_grad)
    worst += abs(residual) / (1.0 + abs(value))
    rate = grad[0]
    for k in range(n):
        rate += grad[1 + k] * jac[k, 1 + n]
    workspace.rates[i] = rate
    for k in range(2 * m):
        rows[row, k] = 0.0
    for k in range(3 * m + free + 1, width):
        rows[row, k] = 0.0
    duration = after[0] - start[0]
    if is_divided(functions, layout, i, start, duration, p, which, workspace):
        worst += mean_rate_row(functions, layout, i, at, start, duration, p, which, workspace, rows)
        return worst if math.isfinite(worst) else np.inf
    for k in range(m):
        rows[row, 2 * m + k] = grad[k]
    for k in range(free):
        rows[row, 3 * m + k] = grad[m + k] - level_grad[k]
    rows[row, 3 * m + free] = -residual
    return worst if math.isfinite(worst) else np.inf


@helper
def mismatch(functions, layout, z, p, workspace):  # type: ignore[no-untyped-def]
    """Return the largest residual of a segment against scale; nothing is differentiated."""
    none, empty, state = workspace.none, workspace.empty, workspace.state
    count, m = z.shape
    close_chain(functions, layout, z, p, none, workspace)
    worst = 0.0
    for i in range(count):
        after = z[i + 1] if i + 1 < count else workspace.last
        duration = after[0] - z[i, 0]
        begin = z[i, 1:]
        if layout.resets[i] >= 0:
            apply_reset(functions, layout, i, z[i], p, none, workspace)
            begin = workspace.after_reset[m - 1, : m - 1]
        functions.flow(layout.modes[i], z[i, 0], begin, duration, p, none, state, workspace.nothing)
        if layout.pins[i] != NO_PIN:
            here = abs(pin_value(functions, layout, i, z[i], p, none, empty))
        else:
            surface = layout.exits[i]
            value = functions.observe(
                layout.observables[surface], after[0], after[1:], p, none, empty
            )
            here = abs(value - functions.level(surface, p, none, empty)) / (1.0 + abs(value))
        for j in range(m - 1):
            here += abs(state[j] - after[1 + j]) / (1.0 + abs(after[1 + j]))
        if not math.isfinite(here):
            return np.inf
        worst = max(worst, here)
    return worst
