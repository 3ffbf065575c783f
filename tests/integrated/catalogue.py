"""Solutions of two states as integrated flows, each for what it shows.

Mode 0 is Van der Pol's oscillator, ``x'' = mu (1 - x^2) x' - x``. Mode 1 is at rest, for observables
that move by themselves. Observables: 0 is x, 1 is x', 2 is a trigonometric sum that moves with time alone::

    q(t, y) = x + a_0 + sum_k a_(2k-1) cos(k t) + a_(2k) sin(k t),      k = 1 to 4,

which is all that an observable can be. Parameters: mu, the absolute tolerance, a_0 to a_8.
"""

from __future__ import annotations

import math

from contfric.compiled import (
    field_signature,
    helper,
    kernel,
    level_signature,
    observe_signature,
    period_signature,
    rate_signature,
    scale_signature,
)
from contfric.flow.integrated import Functions

MU, TOLERANCE, FIRST = 0, 1, 2
OSCILLATOR, REST = range(2)
HARMONICS = 4


@kernel(field_signature)
def field(mode, t, y, p, which, out, jac):
    for i in range(jac.shape[0]):
        for j in range(jac.shape[1]):
            jac[i, j] = 0.0
    if mode == REST:
        out[0] = 0.0
        out[1] = 0.0
        return
    x, v, mu = y[0], y[1], p[MU]
    out[0] = v
    out[1] = mu * (1.0 - x * x) * v - x
    if jac.shape[0] > 0:
        jac[0, 2] = 1.0
        jac[1, 1] = -2.0 * mu * x * v - 1.0
        jac[1, 2] = mu * (1.0 - x * x)
        for k in range(which.shape[0]):
            if which[k] == MU:
                jac[1, 3 + k] = (1.0 - x * x) * v


@helper
def sums(t, p):
    value, slope, bend = p[FIRST], 0.0, 0.0
    for k in range(1, HARMONICS + 1):
        a, b = p[FIRST + 2 * k - 1], p[FIRST + 2 * k]
        c, s = math.cos(k * t), math.sin(k * t)
        value += a * c + b * s
        slope += k * (b * c - a * s)
        bend -= k * k * (a * c + b * s)
    return value, slope, bend


@kernel(observe_signature)
def value_of(c, t, y, p, which, grad):
    if grad.shape[0] > 0:
        grad[:] = 0.0
        grad[1 + c % 2] = 1.0
    if c < 2:
        return y[c]
    value, slope, _ = sums(t, p)
    if grad.shape[0] > 0:
        grad[0] = slope
    return y[0] + value


@kernel(rate_signature)
def rate_of(mode, c, t, y, p, which, grad):
    moves = 1.0 if mode == OSCILLATOR else 0.0
    x, v, mu = y[0], y[1], p[MU]
    if grad.shape[0] > 0:
        grad[:] = 0.0
        grad[2] = moves
    if c == 1:
        if grad.shape[0] > 0:
            grad[1] = moves * (-2.0 * mu * x * v - 1.0)
            grad[2] = moves * mu * (1.0 - x * x)
        return moves * (mu * (1.0 - x * x) * v - x)
    if c == 0:
        return moves * v
    _, slope, bend = sums(t, p)
    if grad.shape[0] > 0:
        grad[0] = bend
    return slope + moves * v


@kernel(period_signature)
def period_of(p, which, grad):
    for k in range(grad.shape[0]):
        grad[k] = 0.0
    return 0.0


@kernel(scale_signature)
def scale_of(i, p):
    return p[TOLERANCE]


@kernel(level_signature)
def level(k, p, which, grad):
    grad[:] = 0.0
    return 0.0


#: The scale of the states is the tolerance, so that one block of memory serves all tolerances.
FUNCTIONS = Functions(
    field=field,
    observe=value_of,
    rate=rate_of,
    period=period_of,
    scale=scale_of,
    modes=2,
    observables=3,
    relative=0.0,
    absolute=1.0,
)
FLOW = FUNCTIONS.flow(level)
flow, hit, stationary = FLOW.flow, FLOW.hit, FLOW.stationary
