"""A point at rest that is watched by a trigonometric sum: what an observable can be at its worst.

``q(t, y) = y + p_0 + sum_k p_(2k-1) cos(k t) + p_(2k) sin(k t)``, k = 1 to 4; mode 0 holds y, mode 1
lets it decay.
"""

from __future__ import annotations

import math

from contfric.compiled import helper, hit_signature, kernel, turning_signature
from contfric.flow.integrated import integrated_hit, integrated_motion, integrated_turning

HARMONICS = 4


@helper
def field(mode, t, y, p, which, out, jac):
    out[0] = -0.5 * y[0] if mode == 1 else 0.0
    if jac.shape[0] > 0:
        for j in range(jac.shape[1]):
            jac[0, j] = 0.0
        jac[0, 1] = -0.5 if mode == 1 else 0.0


@helper
def sums(t, p):
    value, slope, bend = p[0], 0.0, 0.0
    for k in range(1, HARMONICS + 1):
        a, b = p[2 * k - 1], p[2 * k]
        c, s = math.cos(k * t), math.sin(k * t)
        value += a * c + b * s
        slope += k * (b * c - a * s)
        bend -= k * k * (a * c + b * s)
    return value, slope, bend


@helper
def value_of(c, t, y, p, which, grad):
    value, slope, _ = sums(t, p)
    if grad.shape[0] > 0:
        grad[0] = slope
        grad[1] = 1.0
    return y[0] + value


@helper
def rate_of(mode, c, t, y, p, which, grad):
    _, slope, bend = sums(t, p)
    decay = -0.5 if mode == 1 else 0.0
    if grad.shape[0] > 0:
        grad[0] = bend
        grad[1] = decay
    return slope + decay * y[0]


@helper
def period_of(p, which, grad):
    return 2.0 * math.pi


@helper
def scale_of(i, p):
    return 1.0


MOTION = integrated_motion(
    field=field, observe=value_of, rate=rate_of, period=period_of, scale=scale_of
)


@kernel(hit_signature)
def hit(mode, c, target, on, t0, y0, dt_max, p, y1):
    return integrated_hit(MOTION, mode, c, target, on, t0, y0, dt_max, p, y1)


@kernel(turning_signature)
def turning(mode, c, t0, y0, dt, p, times, values):
    return integrated_turning(MOTION, mode, c, t0, y0, dt, p, times, values)
