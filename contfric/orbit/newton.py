"""Newton's method on the chain of segments, compiled.

Equations of segment i, from the joint ``z_i = (t_i, y_i)`` to the next one (``z_N`` is the closure
of ``z_0``)::

    phi(mode_i; t_i, y_i, t_{i+1} - t_i; p) - y_{i+1} = 0        (n rows)
    observable(z_{i+1}; p) - level(p) = 0                        (1 row)

The Jacobian is exact. The iteration ends on an estimate of its own error: with quadratic convergence
the error after a correction of size d_k, following one of size d_{k-1}, is about
``d_k^3 / d_{k-1}^2``; at the floor of rounding the corrections stop falling.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import (
    FlowType,
    HitType,
    LevelType,
    ObserveType,
    PeriodType,
    TurningType,
    blocks,
    f8,
    helper,
    i8,
    indices,
    kernel,
    matrix,
    table,
    vector,
)
from contfric.orbit.cyclic import solve_cyclic
from contfric.orbit.system import Layout

#: Type of the model's functions and of a layout, as kernels take them.
FunctionsType = types.Tuple((FlowType, ObserveType, LevelType, TurningType, HitType, PeriodType))
LayoutType = types.NamedTuple(
    [indices, indices, indices, vector, table, table, table, matrix, f8, i8], Layout
)

#: Places in the array of counts that kernels add to.
SOLVES, MULTIPLIERS, CHECKS, EVENTS = range(4)

CONVERGED, NOT_CONVERGED, SINGULAR, NOT_FINITE = range(4)

#: Newton converges quadratically from a predictor in 2 to 4 steps; poor starts are damped and may
#: need more. Beyond this number the start is hopeless or the system singular.
_MOST_STEPS = 25
#: Relative size of corrections at which rounding dominates (a few hundred units in the last place).
_FLOOR = 5e-14
#: Relative residual that is rounding: where the system is ill-conditioned (beside a fold) corrections
#: stop falling earlier, and no iterate can be better.
_ROUNDING = 1e-14
#: Error that the last correction may leave: below one unit in the last place.
_TARGET = 1e-16


@helper
def last_joint(functions, layout, z, p, which, out, close, close_w):  # type: ignore[no-untyped-def]
    """Write the closure of z_0 to ``out``, with its matrices on z_0 and on the parameters."""
    n = layout.closure.shape[0]
    grad = np.zeros(which.shape[0])
    period = functions[5](p, which, grad)
    out[0] = z[0, 0] + layout.turn * period
    for i in range(n + 1):
        for j in range(n + 1):
            close[i, j] = 0.0
        for k in range(which.shape[0]):
            close_w[i, k] = layout.turn * grad[k] if i == 0 else 0.0
    close[0, 0] = 1.0
    for i in range(n):
        value = 0.0
        for j in range(n):
            value += layout.closure[i, j] * z[0, 1 + j]
            close[1 + i, 1 + j] = layout.closure[i, j]
        out[1 + i] = value


@helper
def assemble(functions, layout, z, p, which, last, a, b, c, r):  # type: ignore[no-untyped-def]
    """Fill the blocks and the negative residual; return the largest residual against scale."""
    count, m = z.shape
    n = m - 1
    q = which.shape[0]
    y1 = np.empty(n)
    jac = np.empty((n, 2 + n + q))
    grad = np.zeros(1 + n + q)
    level_grad = np.zeros(q)
    worst = 0.0
    for i in range(count):
        for j in range(m):
            for k in range(m):
                a[i, j, k] = 0.0
                b[i, j, k] = 0.0
        after = z[i + 1] if i + 1 < count else last
        functions[0](layout.modes[i], z[i, 0], z[i, 1:], after[0] - z[i, 0], p, which, y1, jac)
        for j in range(n):
            residual = y1[j] - after[1 + j]
            worst = max(worst, abs(residual) / (1.0 + abs(after[1 + j])))
            r[i, j, 0] = -residual
            a[i, j, 0] = jac[j, 0] - jac[j, 1 + n]
            b[i, j, 0] = jac[j, 1 + n]
            b[i, j, 1 + j] = -1.0
            for k in range(n):
                a[i, j, 1 + k] = jac[j, 1 + k]
            for k in range(q):
                c[i, j, k] = jac[j, 2 + n + k]
        surface = layout.exits[i]
        value = functions[1](layout.observables[surface], after[0], after[1:], p, which, grad)
        residual = value - functions[2](surface, p, which, level_grad)
        worst = max(worst, abs(residual) / (1.0 + abs(value)))
        r[i, n, 0] = -residual
        for k in range(m):
            b[i, n, k] = grad[k]
        for k in range(q):
            c[i, n, k] = grad[m + k] - level_grad[k]
    if not math.isfinite(worst):
        return np.inf
    return worst


@helper
def correction_size(dz, dw, z, p, which):  # type: ignore[no-untyped-def]
    """Return the largest component of a correction against the scale of its unknown."""
    size = 0.0
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            size = max(size, abs(dz[i, j, 0]) / (1.0 + abs(z[i, j])))
    for k in range(which.shape[0]):
        size = max(size, abs(dw[k, 0]) / (1.0 + abs(p[which[k]])))
    return size


@helper
def constraint(z, p, which, z_ref, p_ref, d, e, s):  # type: ignore[no-untyped-def]
    """Fill the right-hand sides of the border rows ``D (z - z_ref) + E (p - p_ref) = 0``."""
    for k in range(which.shape[0]):
        value = 0.0
        for i in range(z.shape[0]):
            for j in range(z.shape[1]):
                value += d[k, i, j] * (z[i, j] - z_ref[i, j])
        for j in range(which.shape[0]):
            value += e[k, j] * (p[which[j]] - p_ref[which[j]])
        s[k, 0] = -value


@helper
def correct(functions, layout, z, p, which, d, e, trust, floor, pencil):  # type: ignore[no-untyped-def]
    """Solve for the orbit from (z, p) in place, border rows anchored at the start.

    Returns
    -------
    tuple
        (status, steps, size of the first correction, last residual). ``pencil`` (2, m, m) holds P
        and Q of the last Jacobian. ``floor`` is the accuracy asked for; ``trust`` the longest
        correction, infinite for the plain method (a number, as a flag would be compiled twice).
    """
    count, m = z.shape
    q = which.shape[0]
    a, b = np.empty((count, m, m)), np.empty((count, m, m))
    c, r = np.empty((count, m, q)), np.empty((count, m, 1))
    dz, dw = np.empty((count, m, 1)), np.empty((q, 1))
    close, close_w = np.empty((m, m)), np.empty((m, q))
    last = np.empty(m)
    s = np.zeros((q, 1))
    z_ref, p_ref = z.copy(), p.copy()
    before, first = np.inf, 0.0
    share, worst_before = 1.0, np.inf
    damped = math.isfinite(trust)
    for step in range(_MOST_STEPS):
        last_joint(functions, layout, z, p, which, last, close, close_w)
        worst = assemble(functions, layout, z, p, which, last, a, b, c, r)
        if not math.isfinite(worst):
            return NOT_FINITE, step, first, worst
        if damped and worst > 2.0 * worst_before and share > 1e-3:
            # the last correction went too far: take back half of it
            share *= 0.5
            move(z, p, which, dz, dw, -share)
            continue
        worst_before = worst
        constraint(z, p, which, z_ref, p_ref, d, e, s)
        if not solve_cyclic(a, b, c, r, close, close_w, d, e, s, dz, dw, pencil[0], pencil[1]):
            return SINGULAR, step, first, worst
        size = correction_size(dz, dw, z, p, which)
        if not math.isfinite(size):
            return NOT_FINITE, step, first, worst
        share = 1.0
        if size > trust:
            share = trust / size
        move(z, p, which, dz, dw, share)
        if step == 0:
            first = size
        left = size if not math.isfinite(before) else size * (size / before) ** 2
        if size <= floor or (size < 1e-3 and left <= max(_TARGET, floor * 1e-3)):
            return CONVERGED, step + 1, first, worst
        if size < _FLOOR * 100 and size >= 0.5 * before:
            return CONVERGED, step + 1, first, worst
        if worst < _ROUNDING and size < 1e-6 and size >= 0.5 * before:
            return CONVERGED, step + 1, first, worst
        if not damped and step > 1 and size > 2.0 * before:
            return NOT_CONVERGED, step + 1, first, worst
        before = size
    return NOT_CONVERGED, _MOST_STEPS, first, worst_before


@helper
def move(z, p, which, dz, dw, share):  # type: ignore[no-untyped-def]
    """Add a share of a correction."""
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            z[i, j] += share * dz[i, j, 0]
    for k in range(which.shape[0]):
        p[which[k]] += share * dw[k, 0]


@helper
def tangent_at(functions, layout, z, p, which, d, e, tz, tw, pencil, share):  # type: ignore[no-untyped-def]
    """Return the tangent along the border row, unnormalised, and move (z, p) by a share of one step.

    The two right-hand sides share one elimination: the polishing correction costs nothing more.
    """
    count, m = z.shape
    q = which.shape[0]
    a, b = np.empty((count, m, m)), np.empty((count, m, m))
    c, r = np.empty((count, m, q)), np.zeros((count, m, 2))
    dz, dw = np.empty((count, m, 2)), np.empty((q, 2))
    close, close_w = np.empty((m, m)), np.empty((m, q))
    last = np.empty(m)
    s = np.zeros((q, 2))
    s[0, 1] = 1.0
    last_joint(functions, layout, z, p, which, last, close, close_w)
    worst = assemble(functions, layout, z, p, which, last, a, b, c, r)
    if not math.isfinite(worst):
        return False, worst
    if not solve_cyclic(a, b, c, r, close, close_w, d, e, s, dz, dw, pencil[0], pencil[1]):
        return False, worst
    move(z, p, which, dz, dw, share)
    for i in range(count):
        for j in range(m):
            tz[i, j] = dz[i, j, 1]
    for k in range(q):
        tw[k] = dw[k, 1]
    return True, worst


@kernel(types.UniTuple(f8, 4)(FunctionsType, LayoutType, matrix, vector, f8, blocks, indices))
def solve(functions, layout, z, p, trust, pencil, counts):  # type: ignore[no-untyped-def]
    """Solve for the orbit at fixed parameters, in place; (status, steps, first, residual)."""
    counts[SOLVES] += 1
    count, m = z.shape
    which = np.empty(0, dtype=np.int64)
    d, e = np.empty((0, count, m)), np.empty((0, 0))
    status, steps, first, worst = correct(
        functions, layout, z, p, which, d, e, trust, _FLOOR, pencil
    )
    a, b = np.empty((count, m, m)), np.empty((count, m, m))
    c, r = np.empty((count, m, 0)), np.empty((count, m, 1))
    close, close_w, last = np.empty((m, m)), np.empty((m, 0)), np.empty(m)
    last_joint(functions, layout, z, p, which, last, close, close_w)
    worst = assemble(functions, layout, z, p, which, last, a, b, c, r)
    return float(status), float(steps), first, worst


@kernel(
    types.boolean(FunctionsType, LayoutType, matrix, vector, blocks, blocks, blocks, blocks, matrix)
)
def linearise(functions, layout, z, p, a, b, c, r, close):  # type: ignore[no-untyped-def]
    """Fill the blocks of the full Jacobian (all parameters) for use outside of the engine."""
    count, m = z.shape
    which = np.arange(p.shape[0])
    close_w = np.empty((m, p.shape[0]))
    last = np.empty(m)
    last_joint(functions, layout, z, p, which, last, close, close_w)
    worst = assemble(functions, layout, z, p, which, last, a, b, c, r)
    # the closure's dependence on the parameters is added to the last segment's columns
    for i in range(m):
        for k in range(p.shape[0]):
            for j in range(m):
                c[count - 1, i, k] += b[count - 1, i, j] * close_w[j, k]
    return math.isfinite(worst)
