"""Second derivatives of the closed-form flow along a direction, for curves in two parameters.

The state after a slide is linear in the load ``L = x0 + s S``, in v0 and in the excitation. So its variation
in a direction (tau, xi, eta) of (t0, x0, v0) is the response itself with L, v0 replaced by xi, eta and
each harmonic by its derivative, a quarter of a turn ahead: ``d cos(theta)/d theta = cos(theta + pi/2)``.
What is left is the derivative with respect to the duration, which the differential equation gives::

    G' = C,  C' = -2 zeta C - G,  R' = G,  X' = V,  V' = cos(theta + w d) - 2 zeta V - X

and the same differentiated with respect to theta, w and zeta. No divided difference of higher order than
in the first derivatives appears, and nothing happens at a resonance or at critical damping.
"""

from __future__ import annotations

import math

from contfric.compiled import allocating_helper, kernel, second_signature
from contfric.flow.oscillator.damping import damping_response, responses
from contfric.flow.oscillator.motion import (
    OMEGA,
    SPEED,
    STICK,
    ZETA,
    H,
    S,
    direction,
    excitation,
    slide,
)
from contfric.flow.oscillator.response import forced, free

_QUARTER = 0.5 * math.pi


@allocating_helper
def harmonic_columns(k, size, p, t0, d, tau, delta, which, jac, moved):  # type: ignore[no-untyped-def]
    """Add what one harmonic (k times Omega, of this size) contributes to the columns t0, Omega and h.

    And its variation (x, v, acceleration) to ``moved``.
    """
    zeta, w = p[ZETA], k * p[OMEGA]
    theta, end = w * t0, w * (t0 + d)
    x, v, xt, vt, xw, vw = forced(zeta, w, theta, d)
    ahead = forced(zeta, w, theta + _QUARTER, d)
    sine, cosine = math.sin(end), math.cos(end)
    at = -sine - 2.0 * zeta * vt - xt
    moved[0] += size * w * tau * xt
    moved[1] += size * w * tau * vt
    moved[2] -= size * w * tau * sine
    jac[0, 0] += size * w * (-w * tau * x + delta * vt)
    jac[1, 0] += size * w * (-w * tau * v + delta * at)
    for j in range(which.shape[0]):
        if which[j] == OMEGA:
            aw = -d * sine - 2.0 * zeta * vw - xw
            jac[0, 4 + j] += (
                size * k * (tau * (xt - w * t0 * x + w * ahead[4]) + delta * (t0 * vt + vw))
            )
            jac[1, 4 + j] += (
                size * k * (tau * (vt - w * t0 * v + w * ahead[5]) + delta * (t0 * at + aw))
            )
        elif which[j] == H and k == 3:
            jac[0, 4 + j] += w * tau * xt + delta * v
            jac[1, 4 + j] += w * tau * vt + delta * (cosine - 2.0 * zeta * v - x)


@allocating_helper
def damping_column(p, s, t0, y0, d, along, v, out):  # type: ignore[no-untyped-def]
    """Write the variation of d(x, v)/dzeta."""
    w, tau, delta = p[OMEGA], along[0], along[3]
    one, three = w * t0, 3.0 * w * t0
    first = complex(math.cos(one), math.sin(one))
    third = p[H] * complex(math.cos(three), math.sin(three))
    known = responses(p, third, d)
    x, y = damping_response(p, y0[0] + s * p[S], y0[1], first, third, d, known)
    first, third = 1j * w * tau * first, 3j * w * tau * third
    moved = damping_response(p, along[1], along[2], first, third, d, known)
    out[0] = moved[0] + delta * y
    out[1] = moved[1] + delta * (-2.0 * v - 2.0 * p[ZETA] * y - x)


@allocating_helper
def slide_variation(s, t0, y0, d, p, which, along, jac, moved, damping):  # type: ignore[no-untyped-def]
    """Write the variation of the derivatives of a slide."""
    tau, xi, eta, delta = along[0], along[1], along[2], along[3]
    zeta = p[ZETA]
    g, c, r = free(zeta, d)
    x, v = slide(s, p, t0, y0[0], y0[1], d)
    f, f1, _ = excitation(p, t0 + d)
    a = f - 2.0 * zeta * v - x - s * p[S]
    jac[:, :] = 0.0
    moved[0] = xi + eta * g - xi * r
    moved[1] = eta * c - xi * g
    moved[2] = 0.0
    harmonic_columns(1, 1.0, p, t0, d, tau, delta, which, jac, moved)
    wanted = p[H] != 0.0
    for j in range(which.shape[0]):
        wanted = wanted or which[j] == H
    if wanted:
        harmonic_columns(3, p[H], p, t0, d, tau, delta, which, jac, moved)
    jac[0, 1], jac[1, 1] = -g * delta, -c * delta
    jac[0, 2], jac[1, 2] = c * delta, (-2.0 * zeta * c - g) * delta
    jac[0, 3] = moved[1] + a * delta
    jac[1, 3] = moved[2] - 2.0 * zeta * moved[1] - moved[0] + (f1 - 2.0 * zeta * a - v) * delta
    for j in range(which.shape[0]):
        if which[j] == S:
            jac[0, 4 + j], jac[1, 4 + j] = -s * g * delta, -s * c * delta
        elif which[j] == ZETA:
            damping_column(p, s, t0, y0, d, along, v, damping)
            jac[0, 4 + j], jac[1, 4 + j] = damping[0], damping[1]


@allocating_helper
def load_variation(t, tau, p, which, row):  # type: ignore[no-untyped-def]
    """Write the variation of the load's gradient."""
    _, f1, f2 = excitation(p, t)
    row[0] = -f2 * tau
    for j in range(which.shape[0]):
        if which[j] == OMEGA:
            row[3 + j] = -(f2 * t + f1) * tau / p[OMEGA]
        elif which[j] == H:
            row[3 + j] = 3.0 * p[OMEGA] * math.sin(3.0 * p[OMEGA] * t) * tau


@kernel(second_signature)
def second(mode, c, t0, y0, d, p, which, along, jac, workspace):  # type: ignore[no-untyped-def]
    """Write the derivative, in a direction, of the flow's jacobian or of an observable's gradient."""
    if c >= 0:
        jac[0, :] = 0.0
        if c != SPEED:
            load_variation(t0, along[0], p, which, jac[0])
    elif mode == STICK:
        jac[:, :] = 0.0
    else:
        s = direction(mode)
        slide_variation(s, t0, y0, d, p, which, along, jac, workspace[0:3], workspace[3:5])
    return 1
