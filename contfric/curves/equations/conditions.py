"""The event's own equation with its gradient, compiled: what a curve adds to the equations of an orbit.

==========  ==================================================================================
condition   what vanishes
==========  ==================================================================================
JOINT       observable less level at the end of a segment (CS, SS, T)
START       the same at its start, after its reset (T; CS where another mode follows an impact)
EXIT        rate of the exit's observable at the end of a segment: a tangential exit (AS, GS)
INTERIOR    value of a stationary point inside a segment, less the level (AS, GS, T)
SPECTRAL    the bordered function of the chain's Jacobian (SN, BP, PD), in
            :mod:`contfric.curves.equations.bordered`
QUANTITY    what is asked of a quantity; there may be several
            (:mod:`contfric.curves.equations.held_conditions`)
==========  ==================================================================================

At a stationary point the derivative with respect to its time is zero, so the gradient of its value is
that of the state at a fixed time after the start. All gradients are exact; after a reset they follow by the
chain rule.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.after_reset import apply_reset
from contfric.bvp.cyclic import Elimination, elimination_workspace
from contfric.bvp.equations import EquationWorkspace, equation_workspace, segment_jacobian
from contfric.bvp.spectrum import SpectralWorkspace, spectral_workspace
from contfric.bvp.stationary_points import (
    StationaryPoints,
    find_after_reset,
    find_stationary,
    stationary_workspace,
)
from contfric.bvp.stationary_values import Followed, followed_values
from contfric.compiled import allocating_helper, f8, helper, i8, indices
from contfric.curves.equations.bordered import spectral_value, spread_end
from contfric.curves.equations.chain import BorderedWorkspace, bordered_workspace

JOINT, START, EXIT, INTERIOR, SPECTRAL, QUANTITY = range(6)


class Condition(NamedTuple):
    """What vanishes along a curve, as the compiled engine takes it.

    Attributes
    ----------
    kind, segment, surface : which condition, and where
    sign : of the multiplier (1 or -1) for SPECTRAL; else 1
    rest : mode of rest whose rate at a stop is watched (it tells CS from SS); -1 if none
    pinned : margins that vanish with the condition, and are not watched
    quiet : rows of labels that a pinned joint makes arbitrary
    """

    kind: int
    segment: int
    surface: int
    sign: float
    rest: int
    pinned: IntArray
    quiet: IntArray


ConditionType = types.NamedTuple([i8, i8, i8, f8, i8, indices, indices], Condition)


class CurveWorkspace(NamedTuple):
    """Workspace for the points of one curve: all that corrector and watch need, allocated once.

    ``d`` and ``e`` are border rows on joints and parameters: arclength, and the condition's gradient.
    """

    equations: EquationWorkspace
    elimination: Elimination
    spectral: SpectralWorkspace
    stationary: StationaryPoints
    followed: Followed
    bordered: BorderedWorkspace
    pencil: FloatArray
    d: FloatArray
    e: FloatArray
    s: FloatArray
    z_ref: FloatArray
    p_ref: FloatArray


@allocating_helper
def curve_workspace(count, m, parameters, rows, surfaces, free):  # type: ignore[no-untyped-def]
    """Return the workspace for a curve of chains; ``rows`` of stationary values are followed."""
    right = max(2 - count, 2)  # correction and tangent, but no literal
    return CurveWorkspace(
        equation_workspace(count, m, free),
        elimination_workspace(count, m, free, right),
        spectral_workspace(m),
        stationary_workspace(),
        followed_values(rows, surfaces, m),
        bordered_workspace(count, m, free),
        np.empty((2, m, m)),
        np.empty((free, count, m)),
        np.empty((free, free)),
        np.empty((free, right)),
        np.empty((count, m)),
        np.empty(parameters),
    )


@helper
def interior_value(way, z):  # type: ignore[no-untyped-def]
    """Return the stationary value nearest to the level; NaN if the segment has none."""
    functions, layout, condition, p, which = (
        way.functions,
        way.layout,
        way.condition,
        way.p,
        way.which,
    )
    workspace = way.workspace
    equations, stationary = workspace.equations, workspace.stationary
    i, surface = condition.segment, condition.surface
    c, n = layout.observables[surface], z.shape[1] - 1
    level_grad, grad, jac = equations.level_grad, equations.grad, equations.jac
    if layout.resets[i] >= 0:
        found = find_after_reset(functions, layout, i, c, z, p, equations, stationary)
    else:
        found = find_stationary(functions, layout, i, c, z, p, equations.last, stationary)
    target = functions.level(surface, p, which, level_grad)
    best = -1
    for k in range(found):
        if best < 0 or abs(stationary.values[k] - target) < abs(stationary.values[best] - target):
            best = k
    if best < 0:
        return np.nan
    time, state = stationary.times[best], equations.state
    segment_jacobian(functions, layout, i, z[i], time, p, which, jac, equations)
    value = functions.observe(c, z[i, 0] + time, state, p, which, grad) - target
    workspace.d[1, i, 0] += grad[0]
    for a in range(n):
        for k in range(1 + n):
            workspace.d[1, i, k] += grad[1 + a] * jac[a, k]
        for k in range(which.shape[0]):
            workspace.e[1, k] += grad[1 + a] * jac[a, 2 + n + k]
    for k in range(which.shape[0]):
        workspace.e[1, k] += grad[1 + n + k] - level_grad[k]
    return value


@helper
def start_condition(way, i, c, target, z):  # type: ignore[no-untyped-def]
    """Return an observable less a level where segment i begins, and add the gradient to the border row."""
    functions, layout, p, which = way.functions, way.layout, way.p, way.which
    workspace, equations = way.workspace, way.workspace.equations
    grad, after_reset = equations.grad, equations.after_reset
    n = z.shape[1] - 1
    if layout.resets[i] < 0:
        value = functions.observe(c, z[i, 0], z[i, 1:], p, which, grad) - target
        for j in range(1 + n):
            workspace.d[1, i, j] += grad[j]
    else:
        apply_reset(functions, layout, i, z[i], p, which, equations)
        value = functions.observe(c, z[i, 0], after_reset[n, :n], p, which, grad) - target
        workspace.d[1, i, 0] += grad[0]
        for a in range(n):
            for j in range(1 + n):
                workspace.d[1, i, j] += grad[1 + a] * after_reset[a, j]
            for k in range(which.shape[0]):
                workspace.e[1, k] += grad[1 + a] * after_reset[a, 1 + n + k]
    for k in range(which.shape[0]):
        workspace.e[1, k] += grad[1 + n + k]
    return value


@helper
def condition_value(way, z):  # type: ignore[no-untyped-def]
    """Return what vanishes along the curve, and write its gradient to the second border row.

    The closure of the chain is in the workspace.
    """
    functions, layout, p, which = way.functions, way.layout, way.p, way.which
    condition, workspace = way.condition, way.workspace
    workspace.d[1, :, :] = 0.0
    workspace.e[1, :] = 0.0
    if condition.kind == SPECTRAL:
        return spectral_value(way, z)
    if condition.kind == INTERIOR:
        return interior_value(way, z)
    equations = workspace.equations
    i, surface, grad = condition.segment, condition.surface, equations.grad
    c = layout.observables[surface]
    after = z[i + 1] if i + 1 < z.shape[0] else equations.last
    if condition.kind == EXIT:
        value = functions.rate(layout.modes[i], c, after[0], after[1:], p, which, grad)
        spread_end(grad, i, workspace)
        return value
    level_grad = equations.level_grad
    target = functions.level(surface, p, which, level_grad)
    for k in range(which.shape[0]):
        workspace.e[1, k] -= level_grad[k]
    if condition.kind == JOINT:
        value = functions.observe(c, after[0], after[1:], p, which, grad) - target
        spread_end(grad, i, workspace)
        return value
    return start_condition(way, i, c, target, z)
