"""A mass with LuGre friction as a flow by numerical integration.

Equations 7 to 9 of the article: ``x'' + x = cos(Omega t) - F``, ``F = sigma0 z + sigma1 z' + c v`` and
``z' = v - sigma0 |v| z / g(v)``, ``g = S + (S0 - S) exp(-|v| / vS)`` (alpha = 1). The field has a kink
at v = 0: mode 0 moves with v > 0, mode 1 with v < 0, and each is smooth beyond. Observables: 0 is v, 1
is z.
"""

from __future__ import annotations

import math

from coulomb_integrated import OMEGA, period_of

from contfric.compiled import (
    field_signature,
    helper,
    kernel,
    level_signature,
    observe_signature,
    rate_signature,
    scale_signature,
)
from contfric.flow.integrated import Functions

_, S, S0, SIGMA0, SIGMA1, C, VS = range(7)


@helper
def by_parameter(j, t, v, z, e, g, m, dz, sign, p):
    """Derivatives of v' (without the share of sigma1 z') and of z' by one parameter."""
    drag = p[SIGMA0] * m * z / g
    a, b = 0.0, 0.0
    if j == OMEGA:
        a = -t * math.sin(p[OMEGA] * t)
    elif j == S:
        b = drag * (1.0 - e)
    elif j == S0:
        b = drag * e
    elif j == SIGMA0:
        a, b = -z, -m * z
    elif j == SIGMA1:
        a = -dz
    elif j == C:
        a = -v
    elif j == VS:
        b = drag * (p[S0] - p[S]) * e * sign * v / (p[VS] * p[VS])
    return a, b


@kernel(field_signature)
def field(mode, t, y, p, which, out, jac):
    sign = 1.0 if mode == 0 else -1.0
    x, v, z = y[0], y[1], y[2]
    w, s, s0, k, k1, c, vs = p[0], p[1], p[2], p[3], p[4], p[5], p[6]
    e = math.exp(-sign * v / vs)
    g = s + (s0 - s) * e
    m = sign * v / g
    dz = v - k * m * z
    out[0] = v
    out[1] = math.cos(w * t) - x - k * z - k1 * dz - c * v
    out[2] = dz
    if jac.shape[0] == 0:
        return
    dg = -sign / vs * (s0 - s) * e
    dm = sign / g - m * dg / g
    jac[0, 0] = 0.0
    jac[0, 1] = 0.0
    jac[0, 2] = 1.0
    jac[0, 3] = 0.0
    jac[2, 0] = 0.0
    jac[2, 1] = 0.0
    jac[2, 2] = 1.0 - k * dm * z
    jac[2, 3] = -k * m
    jac[1, 0] = -w * math.sin(w * t)
    jac[1, 1] = -1.0
    jac[1, 2] = -k1 * jac[2, 2] - c
    jac[1, 3] = -k - k1 * jac[2, 3]
    for q in range(which.shape[0]):
        a, b = by_parameter(which[q], t, v, z, e, g, m, dz, sign, p)
        jac[0, 4 + q] = 0.0
        jac[1, 4 + q] = a - k1 * b
        jac[2, 4 + q] = b


@kernel(observe_signature)
def value_of(c, t, y, p, which, grad):
    j = 1 if c == 0 else 2
    for k in range(grad.shape[0]):
        grad[k] = 0.0
    if grad.shape[0] > 0:
        grad[1 + j] = 1.0
    return y[j]


@kernel(rate_signature)
def rate_of(mode, c, t, y, p, which, grad):
    """The rate of v or z: a row of the field, whose derivatives are few enough to be written again."""
    sign = 1.0 if mode == 0 else -1.0
    x, v, z = y[0], y[1], y[2]
    s, s0, k, vs = p[S], p[S0], p[SIGMA0], p[VS]
    e = math.exp(-sign * v / vs)
    g = s + (s0 - s) * e
    m = sign * v / g
    dz = v - k * m * z
    if grad.shape[0] > 0:
        dm = sign / g + m * sign / vs * (s0 - s) * e / g
        z_v, z_z = 1.0 - k * dm * z, -k * m
        grad[0], grad[1], grad[2], grad[3] = 0.0, 0.0, z_v, z_z
        if c == 0:
            grad[0] = -p[OMEGA] * math.sin(p[OMEGA] * t)
            grad[1] = -1.0
            grad[2] = -p[SIGMA1] * z_v - p[C]
            grad[3] = -k - p[SIGMA1] * z_z
        for q in range(which.shape[0]):
            a, b = by_parameter(which[q], t, v, z, e, g, m, dz, sign, p)
            grad[4 + q] = a - p[SIGMA1] * b if c == 0 else b
    if c == 1:
        return dz
    return math.cos(p[OMEGA] * t) - x - k * z - p[SIGMA1] * dz - p[C] * v


@kernel(scale_signature)
def scale_of(i, p):
    return 1.0 / p[SIGMA0] if i == 2 else 1.0


@kernel(level_signature)
def level(k, p, which, grad):
    for j in range(grad.shape[0]):
        grad[j] = 0.0
    return 0.0


FUNCTIONS = Functions(
    field=field,
    observe=value_of,
    rate=rate_of,
    period=period_of,
    scale=scale_of,
    modes=2,
    observables=2,
    sides={(0, 0): 1, (1, 0): -1},
    method="automatic",
)


FLOW = FUNCTIONS.flow(level)
flow, hit, stationary, observe, rate = FLOW.flow, FLOW.hit, FLOW.stationary, value_of, rate_of
