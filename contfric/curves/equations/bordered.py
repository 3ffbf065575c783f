"""The bordered function of SN, BP and PD with its exact gradient, compiled.

Let J be the Jacobian of the chain with respect to its joints, closed by ``v_N = sigma K v_0``: sigma = 1
for a multiplier 1 of the turn, sigma = -1 for a multiplier -1 (a period doubling; on the half of a
symmetric orbit the breaking of its symmetry). With two fixed vectors b and c

    [ J    b ] [ v ]   [ 0 ]          [ J^T  c ] [ u ]   [ 0 ]
    [ c^T  0 ] [ g ] = [ 1 ],         [ b^T  0 ] [ g ] = [ 1 ],

g is zero exactly where J is singular, and ``dg = -u^T (dJ) v``: the directional second derivatives of the
segments (A. Griewank and G. W. Reddien, SIAM J. Numer. Anal. 21 (1984) 176-185; W. Govaerts, Numerical
Methods for Bifurcations of Dynamical Equilibria, SIAM 2000, chapter 4). b and c follow u and v from point to
point, so that the bordered matrices stay well conditioned.

The transposed chain is a chain again: its row r links ``u_r`` and ``u_{r+1}`` by ``B_r^T`` and
``A_{r+1}^T``, and closes with ``u_N = u_0``. The same elimination solves both.

*Autonomous orbits.* The end of a turn is pinned to time 0, ``z_N = (0, K y_0)``, and so is its variation:
``v_N = (0, sigma K v_0)``, for sigma = -1 as well. With P the map of a turn in the section,
``dy_N = P dy_0`` and ``dt_N = dt_0 + a dy_0``; what closes is ``P dy_0 = sigma K dy_0``, and dt_0 = -a dy_0,
minus the variation of the duration, follows. So J is singular exactly where P has the multiplier, and the
trivial one is not in it. A period doubling has null vectors of two turns, ``(-v + s, v)`` with a shift s of
the first in time; segments do not feel it, and nothing below changes.

Resets and short segments are in :mod:`contfric.curves.equations.bending`. Where an exit row is divided by the
duration u scales with it, and g by a factor that is not zero.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.bvp.short_exits import is_divided
from contfric.compiled import helper
from contfric.curves.equations.bending import bend_flow, bend_mean_rate, bend_observable
from contfric.curves.equations.chain import chain_solve, fill_blocks, set_border

#: Step of the third derivatives along a null vector of size 1: with Richardson's extrapolation its error
#: and its rounding are both about 1e-11.
_THIRD = 2e-3


@helper
def null_vectors(border, sign, workspace):  # type: ignore[no-untyped-def]
    """Fill v and u from the blocks; return g, NaN where even the bordered matrix is singular."""
    bordered = workspace.bordered
    v, u, close = bordered.v, bordered.u, workspace.equations.close
    count, m = v.shape
    bordered.even[:, :] = 0.0
    set_border(bordered, border[1], 0.0, 1.0)
    plain, turned = count < 0, count > 0  # flags, but no literals
    if not chain_solve(bordered, sign, border[0], bordered.even, plain, close, workspace.pencil):
        return np.nan
    for i in range(count):
        for j in range(m):
            v[i, j] = bordered.work.z[i, j, 0]
    g = bordered.work.w[0, 0]
    set_border(bordered, border[0], 0.0, 1.0)
    if not chain_solve(bordered, sign, border[1], bordered.even, turned, close, workspace.pencil):
        return np.nan
    for i in range(count):
        for j in range(m):
            u[i, j] = bordered.work.z[i, j, 0]
    return g


@helper
def segment_direction(vectors, i, sign, close, along):  # type: ignore[no-untyped-def]
    """Write the direction of segment i's (t0, y0, duration); return that of its end in ``along`` of m."""
    _count, m = vectors.shape
    along[0] = vectors[i, 0]
    for j in range(1, m):
        along[j] = vectors[i, j]
    along[m] = end_of(vectors, i, sign, close, 0) - vectors[i, 0]


@helper
def end_of(vectors, i, sign, close, j):  # type: ignore[no-untyped-def]
    """Return component j of a direction at the end of segment i."""
    count, m = vectors.shape
    if i + 1 < count:
        return vectors[i + 1, j]
    value = 0.0
    for k in range(m):
        value += close[j, k] * vectors[0, k]
    return sign * value


@helper
def add_curvature(way, i, z):  # type: ignore[no-untyped-def]
    """Add what segment i contributes to the gradient ``-u^T dJ v``."""
    from_, sign, layout, workspace = z[i], way.condition.sign, way.layout, way.workspace
    bordered, equations = workspace.bordered, workspace.equations
    count, m = z.shape
    n, free = m - 1, way.which.shape[0]
    after = z[i + 1] if i + 1 < count else equations.last
    along, u, grad = bordered.along, bordered.u, equations.grad
    segment_direction(bordered.v, i, sign, equations.close, along)
    lasts = after[0] - from_[0]
    bent = bordered.bent
    bend_flow(way, i, from_, lasts, along, bent)
    divided = is_divided(way.functions, layout, i, from_, lasts, way.p, way.which, equations)
    if divided:
        bend_mean_rate(way, i, from_, lasts, along)
    for k in range(grad.shape[0]):
        grad[k] = 0.0
    for k in range(2 + n + free):
        value = 0.0
        for j in range(n):
            value -= u[i, j] * bent[j, k]
        if divided:
            value -= u[i, n] * bordered.divided[k]
        if k == 0:
            workspace.d[1, i, 0] += value
        elif k < 1 + n:
            workspace.d[1, i, k] += value
        elif k == 1 + n:
            workspace.d[1, i, 0] -= value
            grad[0] += value
        else:
            grad[m + k - 2 - n] += value
    if divided:
        spread_end(grad, i, workspace)
        return
    for j in range(m):
        along[j] = end_of(bordered.v, i, sign, equations.close, j)
    flow_part = bordered.other  # the gradient so far: differences use the workspace's gradient
    flow_part[0] = grad[0]
    params = bordered.plus[0]
    for k in range(free):
        params[k] = grad[m + k]
    bend_observable(way, layout.observables[layout.exits[i]], after, along, bordered.bent)
    for k in range(m):
        grad[k] = (flow_part[0] if k == 0 else 0.0) - u[i, n] * bordered.bent[0, k]
    for k in range(free):
        grad[m + k] = params[k] - u[i, n] * bordered.bent[0, m + k]
    spread_end(grad, i, workspace)


@helper
def spread_end(grad, i, workspace):  # type: ignore[no-untyped-def]
    """Add a gradient with respect to the end of segment i and the parameters to the second border row."""
    d, e, close, close_w = (
        workspace.d,
        workspace.e,
        workspace.equations.close,
        workspace.equations.close_w,
    )
    count, m = d.shape[1], d.shape[2]
    free = e.shape[1]
    for j in range(m):
        if i + 1 < count:
            d[1, i + 1, j] += grad[j]
            continue
        for k in range(m):
            d[1, 0, k] += grad[j] * close[j, k]
        for k in range(free):
            e[1, k] += grad[j] * close_w[j, k]
    for k in range(free):
        e[1, k] += grad[m + k]


@helper
def spectral_value(way, z):  # type: ignore[no-untyped-def]
    """Return g, with its gradient in the second border row (cleared before)."""
    if not fill_blocks(way, z):
        return np.nan
    g = null_vectors(way.border, way.condition.sign, way.workspace)
    if not math.isfinite(g):
        return np.nan
    for i in range(z.shape[0]):
        add_curvature(way, i, z)
    return g
