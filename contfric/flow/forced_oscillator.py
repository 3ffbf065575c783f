"""Closed-form flow of the forced oscillator with a constant friction force on each side.

Slide in direction s: ``x'' + 2 zeta x' + x = f(t) - s S`` with ``f(t) = cos(Omega t) + h cos(3 Omega t)``.
After a duration d from ``(t0, x0, v0)``, with G, C, R of :func:`contfric.flow.response.free` and the
responses X, V of :func:`contfric.flow.response.forced`::

    x = x0 + v0 G - (x0 + s S) R + X(Omega) + h X(3 Omega)
    v = v0 C      - (x0 + s S) G + V(Omega) + h V(3 Omega)

At rest x is held and v = 0. The load on the contact is ``u = x - f(t)``.

Modes: 0 slides with v > 0, 1 slides with v < 0, 2 sticks. Observables: 0 is u, 1 is v. Surfaces: 0 is
``u = S0``, 1 is ``u = -S0``, 2 is ``v = 0``. Parameters: Omega, S, S0, h, zeta.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import (
    flow_signature,
    helper,
    hit_signature,
    kernel,
    level_signature,
    observe_signature,
    period_signature,
    turning_signature,
)
from contfric.flow.interface import CompiledFlow
from contfric.flow.march import leaving_step, reached, safe_step, window_of
from contfric.flow.response import divided_exponentials, forced, free, roots

OMEGA, S, S0, H, ZETA = range(5)
STICK = 2
LOAD, SPEED = range(2)
#: Below this fraction of the natural scale a stationary value at the start counts as being there.
_AT_START = 1e-13


@helper
def excitation(p, t):  # type: ignore[no-untyped-def]
    """Return f(t) and its first two time derivatives."""
    w, h = p[OMEGA], p[H]
    c, s = math.cos(w * t), math.sin(w * t)
    f, f1, f2 = c, -w * s, -w * w * c
    if h != 0.0:
        c3, s3 = math.cos(3 * w * t), math.sin(3 * w * t)
        f, f1, f2 = f + h * c3, f1 - 3 * w * h * s3, f2 - 9 * w * w * h * c3
    return f, f1, f2


@helper
def direction(mode):  # type: ignore[no-untyped-def]
    """Return the sign of the velocity in a slide."""
    return 1.0 if mode == 0 else -1.0


@helper
def slide(s, p, t0, x0, v0, d):  # type: ignore[no-untyped-def]
    """Return (x, v) after a slide of duration d in direction s."""
    w, h = p[OMEGA], p[H]
    g, c, r = free(p[ZETA], d)
    load = x0 + s * p[S]
    one = forced(p[ZETA], w, w * t0, d)
    x = x0 + v0 * g - load * r + one[0]
    v = v0 * c - load * g + one[1]
    if h != 0.0:
        three = forced(p[ZETA], 3 * w, 3 * w * t0, d)
        x += h * three[0]
        v += h * three[1]
    return x, v


@helper
def damping_slope(s, p, t0, x0, v0, d):  # type: ignore[no-untyped-def]
    """Return d(x, v)/dzeta: the response ``-2 G * v`` to the velocity (the equation differentiated)."""
    w, h = p[OMEGA], p[H]
    a, b = roots(p[ZETA])
    # G*G, its slope G*C, and C*C' by exp_d over the repeated roots
    e = divided_exponentials(np.array([a, b, a, b]), d)
    g2 = e[3]
    g2_1 = b * e[3] + e[2]
    g2_2 = b * g2_1 + a * e[2] + e[1]
    load = x0 + s * p[S]
    x = v0 * g2_1 - load * g2
    v = v0 * g2_2 - load * g2_1
    for k in range(1, 4, 2):
        size = 1.0 if k == 1 else h
        if size != 0.0:
            node = complex(0.0, k * w)
            q = divided_exponentials(np.array([a, b, a, b, node]), d)[4]
            q1 = node * q + g2
            q2 = node * q1 + g2_1
            turn = size * complex(math.cos(k * w * t0), math.sin(k * w * t0))
            x += turn * q1
            v += turn * q2
    return -2.0 * x.real, -2.0 * v.real


@helper
def parameter_slope(index, s, p, t0, x0, v0, d):  # type: ignore[no-untyped-def]
    """Return d(x, v) with respect to one parameter after a slide."""
    w, h, zeta = p[OMEGA], p[H], p[ZETA]
    if index == OMEGA:
        one = forced(zeta, w, w * t0, d)
        x = t0 * one[2] + one[4]
        v = t0 * one[3] + one[5]
        if h != 0.0:
            three = forced(zeta, 3 * w, 3 * w * t0, d)
            x += 3 * h * (t0 * three[2] + three[4])
            v += 3 * h * (t0 * three[3] + three[5])
        return x, v
    if index == S:
        g, _, r = free(zeta, d)
        return -s * r, -s * g
    if index == H:
        three = forced(zeta, 3 * w, 3 * w * t0, d)
        return three[0], three[1]
    if index == ZETA:
        return damping_slope(s, p, t0, x0, v0, d)
    return 0.0, 0.0


@kernel(flow_signature)
def flow(mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Advance a state by ``dt`` in one mode, with derivatives where ``jac`` has room for them."""
    if mode == STICK:
        y1[0] = y0[0]
        y1[1] = 0.0
        if jac.shape[0] > 0:
            jac[:, :] = 0.0
            jac[0, 1] = 1.0
        return
    s = direction(mode)
    x0, v0 = y0[0], y0[1]
    if jac.shape[0] == 0:
        y1[0], y1[1] = slide(s, p, t0, x0, v0, dt)
        return
    w, h, zeta = p[OMEGA], p[H], p[ZETA]
    g, c, r = free(zeta, dt)
    load = x0 + s * p[S]
    one = forced(zeta, w, w * t0, dt)
    x = x0 + v0 * g - load * r + one[0]
    v = v0 * c - load * g + one[1]
    jac[0, 0] = w * one[2]
    jac[1, 0] = w * one[3]
    if h != 0.0:
        three = forced(zeta, 3 * w, 3 * w * t0, dt)
        x += h * three[0]
        v += h * three[1]
        jac[0, 0] += 3 * w * h * three[2]
        jac[1, 0] += 3 * w * h * three[3]
    y1[0], y1[1] = x, v
    jac[0, 1] = 1.0 - r
    jac[0, 2] = g
    jac[1, 1] = -g
    jac[1, 2] = c
    jac[0, 3] = v
    jac[1, 3] = excitation(p, t0 + dt)[0] - 2 * zeta * v - x - s * p[S]
    for k in range(which.shape[0]):
        jac[0, 4 + k], jac[1, 4 + k] = parameter_slope(which[k], s, p, t0, x0, v0, dt)


@kernel(observe_signature)
def observe(c, t, y, p, which, grad):  # type: ignore[no-untyped-def]
    """Return the load u or the velocity v, with the gradient where there is room for it."""
    if grad.shape[0] > 0:
        grad[:] = 0.0
    if c == SPEED:
        if grad.shape[0] > 0:
            grad[2] = 1.0
        return y[1]
    f, f1, _ = excitation(p, t)
    if grad.shape[0] > 0:
        grad[0] = -f1
        grad[1] = 1.0
        for k in range(which.shape[0]):
            if which[k] == OMEGA:
                grad[3 + k] = -f1 * t / p[OMEGA]
            elif which[k] == H:
                grad[3 + k] = -math.cos(3 * p[OMEGA] * t)
    return y[0] - f


@kernel(level_signature)
def level(k, p, which, grad):  # type: ignore[no-untyped-def]
    """Return the level of a surface: S0, -S0 or 0."""
    sign = 1.0 if k == 0 else (-1.0 if k == 1 else 0.0)
    if grad.shape[0] > 0:
        for j in range(which.shape[0]):
            grad[j] = sign if which[j] == S0 else 0.0
    return sign * p[S0]


@kernel(period_signature)
def period(p, which, grad):  # type: ignore[no-untyped-def]
    """Return the period of the excitation, 2 pi / Omega."""
    value = 2.0 * math.pi / p[OMEGA]
    if grad.shape[0] > 0:
        for j in range(which.shape[0]):
            grad[j] = -value / p[OMEGA] if which[j] == OMEGA else 0.0
    return value


@helper
def quantity(mode, c, order, p, t, x, v):  # type: ignore[no-untyped-def]
    """Return (q, q', q'', E): q is observable c or (order 1) its rate; E bounds hypot(v, v')."""
    f, f1, f2 = excitation(p, t)
    w, h = p[OMEGA], p[H]
    f3 = w * w * w * math.sin(w * t)
    if h != 0.0:
        f3 += 27.0 * h * w * w * w * math.sin(3 * w * t)
    if mode == STICK:
        if order == 0:
            return x - f, -f1, -f2, 0.0
        return -f1, -f2, -f3, 0.0
    z = 2.0 * p[ZETA]
    a = f - z * v - x - direction(mode) * p[S]
    a1 = f1 - z * a - v
    a2 = f2 - z * a1 - a
    size = math.hypot(v, a)
    if c == SPEED:
        if order == 0:
            return v, a, a1, size
        return a, a1, a2, size
    if order == 0:
        return x - f, v - f1, a - f2, size
    return v - f1, a - f2, a1 - f3, size


@helper
def third_bound(mode, c, order, p, size, window):  # type: ignore[no-untyped-def]
    """Return a bound of |q'''| over a window that starts where hypot(v, v') = size.

    From ``v'' + 2 zeta v' + v = f'`` follows ``d/dt hypot(v, v') <= |f'| + 2 max(0, -zeta) hypot``.
    """
    w, h, zeta = p[OMEGA], abs(p[H]), p[ZETA]
    w3 = w * w * w
    if mode == STICK:
        return w3 * (1 + 27 * h) if order == 0 else w3 * w * (1 + 81 * h)
    z = 2.0 * abs(zeta)
    f1 = w * (1 + 3 * h)
    e = size + f1 * window
    if zeta < 0.0:
        e *= math.exp(z * window)
    a1 = (1 + z) * e + f1
    a2 = z * a1 + e + w * w * (1 + 9 * h)
    if c == SPEED:
        return a2 if order == 0 else z * a2 + a1 + w3 * (1 + 27 * h)
    return a1 + w3 * (1 + 27 * h) if order == 0 else a2 + w3 * w * (1 + 81 * h)


@helper
def state(mode, p, t0, y0, d):  # type: ignore[no-untyped-def]
    """Return (x, v) after a duration d in one mode."""
    if mode == STICK:
        return y0[0], 0.0
    return slide(direction(mode), p, t0, y0[0], y0[1], d)


@helper
def natural_scale(mode, p):  # type: ignore[no-untyped-def]
    """Return the longest window worth a bound: one radian of the fastest motion."""
    fastest = p[OMEGA] if p[H] == 0.0 else 3.0 * p[OMEGA]
    if mode == STICK:
        return 1.0 / fastest
    return 1.0 / max(1.0 + 2.0 * abs(p[ZETA]), fastest)


@helper
def next_root(mode, c, order, target, on, sign, t0, y0, start, end, p):  # type: ignore[no-untyped-def]
    """Return the first root of q - target in (start, end], or -1; and the sign of q before it.

    ``on``: q takes the target at ``start`` itself, which does not count; ``sign`` is then the side
    to which q leaves (0: found from the derivatives).
    """
    tau = start
    natural = natural_scale(mode, p)
    window = natural
    leaving = on
    while tau < end:
        x, v = state(mode, p, t0, y0, tau)
        q, q1, q2, size = quantity(mode, c, order, p, t0 + tau, x, v)
        q -= target
        if leaving:
            leaving = False
            if abs(q1) <= _AT_START * (1.0 + size):
                q1 = 0.0  # the rate vanishes at the start (a release with S0 = S): rounding is no sign
            if sign == 0.0:
                sign = 1.0 if (q1 > 0.0 or (q1 == 0.0 and q2 > 0.0)) else -1.0
            bound = third_bound(mode, c, order, p, size, natural)
            step = min(leaving_step(sign * q1, sign * q2, bound), natural)
            if step <= 0.0:
                return tau, sign
            tau += step
            continue
        if sign == 0.0:
            sign = 1.0 if q > 0.0 or (q == 0.0 and q1 > 0.0) else -1.0
        w = sign * q
        if w <= 0.0:
            return tau, sign
        window = window_of(w, sign * q1, natural)
        step = safe_step(
            w, sign * q1, sign * q2, third_bound(mode, c, order, p, size, window), window
        )
        tau += step
        if step < window and reached(step, tau):
            return tau, sign
    return -1.0, sign


@kernel(hit_signature)
def hit(mode, c, target, on, t0, y0, dt_max, p):  # type: ignore[no-untyped-def]
    """Return the first time at which observable c takes a value, or -1."""
    if mode == STICK and c == SPEED:
        return -1.0
    sign = direction(mode) if on and c == SPEED else 0.0  # a slide leaves v = 0 to its own side
    tau, _ = next_root(mode, c, 0, target, on, sign, t0, y0, 0.0, dt_max, p)
    return tau if tau <= dt_max else -1.0


@kernel(turning_signature)
def turning(mode, c, t0, y0, dt, p, out):  # type: ignore[no-untyped-def]
    """Write the interior stationary times of observable c to ``out`` and return their number."""
    if dt <= 0.0 or (mode == STICK and c == SPEED):
        return 0
    count = 0
    tau, sign = 0.0, 0.0
    x, v = y0[0], y0[1]
    q, q1, _, size = quantity(mode, c, 1, p, t0, x, v)
    on = abs(q) <= _AT_START * (1.0 + size)
    while True:
        tau, sign = next_root(mode, c, 1, 0.0, on, sign, t0, y0, tau, dt, p)
        if tau < 0.0 or tau >= dt * (1.0 - 1e-14):
            return count
        if tau > dt * _AT_START:
            if count == out.shape[0]:
                return -1
            out[count] = tau
            count += 1
        x, v = state(mode, p, t0, y0, tau)
        q, q1, _, size = quantity(mode, c, 1, p, t0 + tau, x, v)
        if sign * q1 < 0.0:
            on, sign = True, -sign
        else:  # a double root: the rate touches zero and keeps its sign; go past its resolution
            tau += 1e-8 * natural_scale(mode, p)
            on, sign = False, 0.0


def compiled_flow() -> CompiledFlow:
    """Return the compiled functions of this flow."""
    return CompiledFlow(flow, observe, level, turning, hit, period)
