"""Motion of the forced oscillator at a time after the start of a segment, for the search of roots.

Everything that the search asks for (an observable or its rate with derivatives, and bounds of the higher
ones) follows from x, v and the excitation there. Without damping these take the sines and cosines of
``(w - 1) d / 2`` and ``(w + 1) d / 2`` and the phase at the start; the rest is the addition theorems.
"""

from __future__ import annotations

import math

from contfric.compiled import helper
from contfric.flow.oscillator.overdamped import STRONG, damped_bound, damped_rates, is_gone
from contfric.flow.oscillator.response import forced, free

OMEGA, S, S0, H, ZETA = range(5)
STICK = 2
LOAD, SPEED = range(2)


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
def phases(p, t0):  # type: ignore[no-untyped-def]
    """Return (sin, cos) of the excitation's phase at the start of a segment, and of three times it."""
    w = p[OMEGA]
    s, c = math.sin(w * t0), math.cos(w * t0)
    if p[H] == 0.0:
        return s, c, 0.0, 1.0
    return s, c, math.sin(3 * w * t0), math.cos(3 * w * t0)


@helper
def harmonic(w, s, c, d):  # type: ignore[no-untyped-def]
    """Return the undamped response (X, V) to one harmonic, (sin, cos) of its phase and of d after d.

    The formulas of :func:`contfric.flow.oscillator.response.undamped`.
    """
    p, q = 0.5 * (w - 1.0) * d, 0.5 * (w + 1.0) * d
    sp, cp, sq, cq = math.sin(p), math.cos(p), math.sin(q), math.cos(q)
    a = 0.5 * d * (1.0 if p == 0.0 else sp / p)
    b = 0.5 * d * (1.0 if q == 0.0 else sq / q)
    sin_p, cos_p = s * cp + c * sp, c * cp - s * sp
    sin_q, cos_q = s * cq + c * sq, c * cq - s * sq
    return (
        a * sin_q - b * sin_p,
        a * cos_q + b * cos_p,
        sin_p * cq + cos_p * sq,
        cos_p * cq - sin_p * sq,
        sq * cp - cq * sp,
        cq * cp + sq * sp,
    )


@helper
def point(mode, p, phase, t0, x0, v0, d):  # type: ignore[no-untyped-def]
    """Return x, v, and the excitation with three derivatives after a duration d in one mode."""
    w, h = p[OMEGA], p[H]
    if d == 0.0:
        x, v = x0, (0.0 if mode == STICK else v0)
        sin1, cos1, sin3, cos3 = phase
    elif mode == STICK or p[ZETA] != 0.0:
        x, v = x0, 0.0
        if mode != STICK:
            x, v = slide(direction(mode), p, t0, x0, v0, d)
        s1, c1 = math.sin(w * d), math.cos(w * d)
        sin1, cos1 = phase[0] * c1 + phase[1] * s1, phase[1] * c1 - phase[0] * s1
        s3, c3 = s1 * (3.0 - 4.0 * s1 * s1), c1 * (4.0 * c1 * c1 - 3.0)
        sin3, cos3 = phase[2] * c3 + phase[3] * s3, phase[3] * c3 - phase[2] * s3
    else:
        one = harmonic(w, phase[0], phase[1], d)
        sin1, cos1, sin_d, cos_d = one[2], one[3], one[4], one[5]
        versine = 1.0 - cos_d
        if d < 1.0:  # where it would cancel
            half = math.sin(0.5 * d)
            versine = 2.0 * half * half
        load = x0 + direction(mode) * p[S]
        x = x0 + v0 * sin_d - load * versine + one[0]
        v = v0 * cos_d - load * sin_d + one[1]
        sin3, cos3 = 0.0, 0.0
        if h != 0.0:
            three = harmonic(3.0 * w, phase[2], phase[3], d)
            x, v = x + h * three[0], v + h * three[1]
            sin3, cos3 = three[2], three[3]
    k = 3.0 * w
    return (
        x,
        v,
        cos1 + h * cos3,
        -w * sin1 - h * k * sin3,
        -w * w * cos1 - h * k * k * cos3,
        w * w * w * sin1 + h * k * k * k * sin3,
    )


@helper
def quantity(mode, c, order, p, phase, t0, x0, v0, d):  # type: ignore[no-untyped-def]
    """Return q with three derivatives, E, a value and G; q is observable c or (order 1) its rate.

    E and G are what the bounds below start from: E is hypot(v, v') and G is 0; of a strongly damped slide
    they are |w_s| and the fast exponential of :mod:`contfric.flow.oscillator.overdamped`. Of an observable
    the value is x; of a rate it is the observable, and the third derivative is left out (0).
    """
    x, v, f, f1, f2, f3 = point(mode, p, phase, t0, x0, v0, d)
    u = x - f
    if mode == STICK:
        if order == 0:
            return u, -f1, -f2, -f3, 0.0, x, 0.0
        return -f1, -f2, -f3, 0.0, 0.0, u, 0.0
    zeta, friction, fast = p[ZETA], direction(mode) * p[S], 0.0
    if zeta > STRONG:
        a, a1, a2, size, fast = damped_rates(
            zeta, friction, p[OMEGA], p[H], phase, x0, v0, x, v, f, f1, f2, f3, d
        )
    else:
        z = 2.0 * zeta
        a = f - z * v - x - friction
        a1 = f1 - z * a - v
        a2 = f2 - z * a1 - a
        size = math.sqrt(v * v + a * a)
    if c == SPEED:
        if order == 0:
            return v, a, a1, a2, size, x, fast
        return a, a1, a2, 0.0, size, v, fast
    if order == 0:
        return u, v - f1, a - f2, a1 - f3, size, x, fast
    return v - f1, a - f2, a1 - f3, 0.0, size, u, fast


@helper
def third_bound(mode, c, order, p, size, fast, window):  # type: ignore[no-untyped-def]
    """Return a bound of |q'''| over a window that starts where hypot(v, v') = size.

    From ``v'' + 2 zeta v' + v = f'`` follows ``d/dt hypot(v, v') <= |f'| + 2 max(0, -zeta) hypot``.
    """
    w, h, zeta = p[OMEGA], abs(p[H]), p[ZETA]
    w3 = w * w * w
    if mode == STICK:
        return w3 * (1 + 27 * h) if order == 0 else w3 * w * (1 + 81 * h)
    if zeta > STRONG:
        if c == SPEED:
            return damped_bound(3 + order, zeta, w, h, size, fast, window)
        force = w3 * (1 + 27 * h) if order == 0 else w3 * w * (1 + 81 * h)
        return damped_bound(2 + order, zeta, w, h, size, fast, window) + force
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
def natural_scale(mode, p):  # type: ignore[no-untyped-def]
    """Return the longest window worth a bound: one radian of the fastest motion.

    Of a strongly damped slide: of the solution that is left when the fast exponential has gone.
    """
    fastest = p[OMEGA] if p[H] == 0.0 else 3.0 * p[OMEGA]
    if mode == STICK:
        return 1.0 / fastest
    if p[ZETA] > STRONG:
        return 1.0 / max(1.0, fastest)
    return 1.0 / max(1.0 + 2.0 * abs(p[ZETA]), fastest)


@helper
def scale_there(mode, p, natural, fast):  # type: ignore[no-untyped-def]
    """Return the window worth a bound at a place: shorter while the fast exponential lasts."""
    if mode == STICK or not p[ZETA] > STRONG or is_gone(p[ZETA], fast):
        return natural
    return min(natural, 0.5 / p[ZETA])


@helper
def sixth_bound(mode, c, order, p, size, fast, window):  # type: ignore[no-untyped-def]
    """Return a bound of |q^(6)| over a window that starts where hypot(v, v') = size.

    By ``v^(k) = f^(k-1) - 2 zeta v^(k-1) - v^(k-2)``, from the bound of hypot(v, v') as above.
    """
    w, h, zeta = p[OMEGA], abs(p[H]), p[ZETA]
    w2 = w * w
    w6 = w2 * w2 * w2
    if mode == STICK:
        return w6 * (1 + 729 * h) if order == 0 else w6 * w * (1 + 2187 * h)
    if zeta > STRONG:
        if c == SPEED:
            return damped_bound(6 + order, zeta, w, h, size, fast, window)
        force = w6 * (1 + 729 * h) if order == 0 else w6 * w * (1 + 2187 * h)
        return damped_bound(5 + order, zeta, w, h, size, fast, window) + force
    z = 2.0 * abs(zeta)
    f1 = w * (1 + 3 * h)
    e = size + f1 * window
    if zeta < 0.0:
        e *= math.exp(z * window)
    a2 = (1 + z) * e + f1
    a3 = z * a2 + e + w2 * (1 + 9 * h)
    a4 = z * a3 + a2 + w2 * w * (1 + 27 * h)
    a5 = z * a4 + a3 + w2 * w2 * (1 + 81 * h)
    if c == LOAD and order == 0:
        return a5 + w6 * (1 + 729 * h)
    a6 = z * a5 + a4 + w2 * w2 * w * (1 + 243 * h)
    if c == SPEED and order == 0:
        return a6
    if c == LOAD:
        return a6 + w6 * w * (1 + 2187 * h)
    return z * a6 + a5 + w6 * (1 + 729 * h)
