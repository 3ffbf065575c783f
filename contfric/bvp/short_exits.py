"""The exit row of a short segment, divided by its duration, compiled.

A segment that begins on its exit surface (a slide does) may shrink to nothing, where its exit row is
singular: a duration of zero solves it whatever the rates. It is divided by the duration there: with v on
the level at ``z_i``, ``v(d) / d`` is the mean of v' over the slide, a quadrature without cancellation.

A flow that oscillates within such a segment is beyond the quadrature (a stiff mode: the error of five points
is ``4e-13 (omega d)^10``): the row is divided only where the quadrature gives the change of the observable.
"""

from __future__ import annotations

import numpy as np

from contfric.bvp.after_reset import apply_reset, through_reset
from contfric.compiled import helper

#: Where a segment that begins on its exit surface is shorter than this (nondimensional), its exit row is
#: divided by the duration if five points of Gauss are exact there; the row as it stands is well conditioned
#: beyond.
_SHORT = 0.1
#: Exact is a mean that gives the change of the observable to this (nondimensional, against scale): hundreds
#: of roundings of a closed form over so short a time, and far below what an orbit is asked for. An
#: integrated flow is allowed ten of its own.
_EXACT, _ROUNDINGS = 1e-13, 10.0
#: Abscissas and weights of Gauss and Legendre on (0, 1), five points.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_NODES, _WEIGHTS = 0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS


@helper
def mean_rate_row(functions, layout, i, at, start, duration, p, which, workspace, rows):  # type: ignore[no-untyped-def]
    """Write the exit row of a short segment, divided by its duration; return the residual."""
    state, jac, grad = workspace.state, workspace.jac, workspace.grad
    n, free = state.shape[0], which.shape[0]
    m = n + 1
    row, mode, c = 2 * m - 1, layout.modes[i], layout.observables[layout.exits[i]]
    for k in range(rows.shape[1]):
        rows[row, k] = 0.0
    mean = 0.0
    for k in range(_NODES.shape[0]):
        share, weight = _NODES[k], _WEIGHTS[k]
        time = share * duration
        if layout.resets[i] >= 0:
            functions.flow(mode, start[0], workspace.after_reset[n, :n], time, p, which, state, jac)
            through_reset(jac, workspace.after_reset, grad, n)
        else:
            functions.flow(mode, start[0], start[1:], time, p, which, state, jac)
        mean += weight * functions.rate(mode, c, start[0] + time, state, p, which, grad)
        for j in range(2 + n + free):  # t_0, y_0, duration, parameters
            slope = 0.0
            for a in range(n):
                slope += grad[1 + a] * jac[a, j]
            if j == 0 or j == 1 + n:
                slope += grad[0]
            elif j >= 2 + n:
                slope += grad[m + j - 2 - n]
            slope *= weight
            if j == 1 + n:
                rows[row, at] -= share * slope
                rows[row, 2 * m] += share * slope
            elif j < 1 + n:
                rows[row, at + j] += slope
            else:
                rows[row, 3 * m + j - 2 - n] += slope
    rows[row, 3 * m + free] = -mean
    return abs(mean)


@helper
def is_divided(functions, layout, i, start, duration, p, which, workspace):  # type: ignore[no-untyped-def]
    """Tell whether the exit row of segment i is divided by its duration."""
    if not (abs(duration) < _SHORT and layout.returns[i] & 1 == 1):
        return False
    state, none, empty, nothing = (
        workspace.between,
        workspace.none,
        workspace.empty,
        workspace.nothing,
    )
    n, mode, c = state.shape[0], layout.modes[i], layout.observables[layout.exits[i]]
    begin, change = start[1:], 0.0
    if layout.resets[i] >= 0:
        apply_reset(functions, layout, i, start, p, which, workspace)
        begin = workspace.after_reset[n, :n]
    for k in range(_NODES.shape[0]):
        time = _NODES[k] * duration
        functions.flow(mode, start[0], begin, time, p, none, state, nothing)
        change += _WEIGHTS[k] * functions.rate(mode, c, start[0] + time, state, p, none, empty)
    change *= duration
    functions.flow(mode, start[0], begin, duration, p, none, state, nothing)
    value = functions.observe(c, start[0] + duration, state, p, none, empty)
    difference = value - functions.observe(c, start[0], begin, p, none, empty)
    exact = max(_EXACT, _ROUNDINGS * layout.rounding) * (1.0 + abs(value))
    return abs(difference - change) <= exact
