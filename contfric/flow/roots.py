"""Roots along a segment of the forced oscillator: where u, v or their rates take a value.

Everything that the march of :mod:`contfric.flow.march` asks for at a time after the start (a value, two
derivatives, and a bound of the third) follows from x, v and the excitation there. Without damping these
take the sines and cosines of ``(w - 1) d / 2`` and ``(w + 1) d / 2`` and the phase at the start; the
rest is the addition theorems.
"""

from __future__ import annotations

import math

from contfric.compiled import helper
from contfric.flow.march import leaving_step, reached, safe_step, window_of
from contfric.flow.pieces import ISOLATED, UNSURE, coefficients, root_of, scan
from contfric.flow.response import forced, free

OMEGA, S, S0, H, ZETA = range(5)
STICK = 2
LOAD, SPEED = range(2)
#: Below this fraction of the natural scale a stationary value at the start counts as being there.
AT_START = 1e-13
#: Error of a stationary time, relative to 1 + the time, at which its search ends: its square counts.
AT_STATIONARY = 2e-10
#: A second rate this small leaves less than the third does on the way to the end of a shortest piece.
FLAT = 1e-7
#: Shortest piece, in natural scales: below it Taylor's march alone goes on.
SHORTEST = 0.02
#: Step past a double root, in natural scales: the square root of rounding.
PAST = 1e-8
#: Length of a piece in natural scales: the interpolation error is about 1e-3 of the size there.
PIECE = 2.2
EPS = 2.220446049250313e-16


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

    The formulas of :func:`contfric.flow.response.undamped`.
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
        half = math.sin(0.5 * d)
        load = x0 + direction(mode) * p[S]
        x = x0 + v0 * sin_d - load * (2.0 * half * half) + one[0]
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
    """Return q with three derivatives, E and the observable; q is observable c or (order 1) its rate.

    E bounds hypot(v, v'); the third derivative is that of an observable only (0 for a rate).
    """
    x, v, f, f1, f2, f3 = point(mode, p, phase, t0, x0, v0, d)
    u = x - f
    if mode == STICK:
        if order == 0:
            return u, -f1, -f2, -f3, 0.0, u
        return -f1, -f2, -f3, 0.0, 0.0, u
    z = 2.0 * p[ZETA]
    a = f - z * v - x - direction(mode) * p[S]
    a1 = f1 - z * a - v
    a2 = f2 - z * a1 - a
    size = math.sqrt(v * v + a * a)
    if c == SPEED:
        if order == 0:
            return v, a, a1, a2, size, v
        return a, a1, a2, 0.0, size, v
    if order == 0:
        return u, v - f1, a - f2, a1 - f3, size, u
    return v - f1, a - f2, a1 - f3, 0.0, size, u


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
def natural_scale(mode, p):  # type: ignore[no-untyped-def]
    """Return the longest window worth a bound: one radian of the fastest motion."""
    fastest = p[OMEGA] if p[H] == 0.0 else 3.0 * p[OMEGA]
    if mode == STICK:
        return 1.0 / fastest
    return 1.0 / max(1.0 + 2.0 * abs(p[ZETA]), fastest)


@helper
def sixth_bound(mode, c, order, p, size, window):  # type: ignore[no-untyped-def]
    """Return a bound of |q^(6)| over a window that starts where hypot(v, v') = size.

    By ``v^(k) = f^(k-1) - 2 zeta v^(k-1) - v^(k-2)``, from the bound of hypot(v, v') as above.
    """
    w, h, zeta = p[OMEGA], abs(p[H]), p[ZETA]
    w2 = w * w
    w6 = w2 * w2 * w2
    if mode == STICK:
        return w6 * (1 + 729 * h) if order == 0 else w6 * w * (1 + 2187 * h)
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


@helper
def leaving_side(q1, q2):  # type: ignore[no-untyped-def]
    """Return the sign that a function takes behind a root."""
    return 1.0 if (q1 > 0.0 or (q1 == 0.0 and q2 > 0.0)) else -1.0


@helper
def roots_along(mode, c, order, target, on, sign, phase, t0, y0, end, p, times, values):  # type: ignore[no-untyped-def]
    """Find the first root of an observable less a target, or (order 1) all roots of its rate.

    Parameters
    ----------
    on, sign : whether q takes the target at the start itself, which does not count, and the side to
        which it leaves (0: found from the derivatives)
    times, values : places for the interior roots of a rate, and for the observable there

    Returns
    -------
    tuple
        (number of roots, -1 if they do not fit; the last one found, -1 if none).
    """
    single = order == 0
    natural = natural_scale(mode, p)
    longest = PIECE * natural
    if not single:
        longest = end / math.ceil(end / longest)
    # a stationary point within its own error of a joint is at the joint
    near = 2.0 * AT_STATIONARY * (1.0 + end)
    first, last = min(near, 0.5 * end), max(end - near, 0.5 * end)
    x0, v0 = y0[0], y0[1]
    tau, leaving, length, count = 0.0, on, longest, 0
    q, q1, q2, _, size, value = quantity(mode, c, order, p, phase, t0, x0, v0, 0.0)
    q -= target
    if not single:
        leaving = abs(q) <= AT_START * (1.0 + size)
    while tau < end:
        if leaving and abs(q1) <= AT_START * (1.0 + size):
            q1 = 0.0  # the rate vanishes at the start (a release with S0 = S): rounding is no sign
        if sign == 0.0:
            sign = leaving_side(q1, q2) if leaving or q == 0.0 else math.copysign(1.0, q)
        root, slope, found = tau, q1, not leaving and sign * q <= 0.0
        if not found:
            after = min(end, tau + length)
            step = after - tau
            r, r1, r2, _, size_r, value_r = quantity(mode, c, order, p, phase, t0, x0, v0, after)
            r -= target
            s2 = step * step
            error = sixth_bound(mode, c, order, p, size, step) * s2 * s2 * s2
            before = 0.0 if leaving else sign * q
            ends = coefficients(before, sign * q1, sign * q2, sign * r, sign * r1, sign * r2, step)
            outcome, low, high, here = scan(ends, error, leaving)
            if outcome == ISOLATED:
                root, slope, at_root = refined(
                    mode,
                    c,
                    order,
                    target,
                    sign,
                    phase,
                    t0,
                    x0,
                    v0,
                    p,
                    tau + low * step,
                    (high - low) * step,
                    root_of(here),
                )
                if single:
                    return 1, root
                if first < root < last:
                    if count == times.shape[0]:
                        return -1, root
                    times[count], values[count] = root, at_root
                    count += 1
                sign = -sign  # and behind the root, up to the end of the part, it falls further
                if high < 1.0:
                    after = tau + high * step
                    r, r1, r2, _, size_r, value_r = quantity(
                        mode, c, order, p, phase, t0, x0, v0, after
                    )
                    r -= target
            if outcome != UNSURE:
                tau, leaving, length = after, False, min(longest, 2.0 * length)
                q, q1, q2, size, value = r, r1, r2, size_r, value_r
                continue
            length = max(0.5 * step, SHORTEST * natural)
            if low > 0.0:
                step = low * step
            elif leaving and q1 == 0.0 and abs(q2) <= FLAT * (1.0 + size):
                # a third-order start, such as a release at the largest force: what the first two rates
                # leave is rounding, and the third decides on which side of the root the function is
                step = SHORTEST * natural
                beyond = quantity(mode, c, order, p, phase, t0, x0, v0, tau + step)[0] - target
                found = sign * beyond <= 0.0
                step = 0.0 if found else step
            elif leaving:
                bound = third_bound(mode, c, order, p, size, natural)
                step = min(leaving_step(sign * q1, sign * q2, bound), natural)
                found = step <= 0.0
            else:
                step, found = taylor_step(mode, c, order, sign, p, q, q1, q2, size, natural, tau)
                root = tau + step
                value += step * (q + step * (0.5 * q1 + step * q2 / 6.0))
            tau += step
        if found:
            if single:
                return 1, root
            if root >= last:
                return count, root
            if root > first:
                if count == times.shape[0]:
                    return -1, root
                times[count], values[count] = root, value
                count += 1
            leaving = sign * slope < 0.0
            sign = -sign if leaving else 0.0
            if not leaving:  # a double root: the rate touches zero; go past its resolution
                tau += PAST * natural
        else:
            leaving = False
        q, q1, q2, _, size, value = quantity(mode, c, order, p, phase, t0, x0, v0, tau)
        q -= target
    return count, -1.0


@helper
def taylor_step(mode, c, order, sign, p, q, q1, q2, size, natural, tau):  # type: ignore[no-untyped-def]
    """Return a step that passes no root, and whether it has come to one."""
    w = sign * q
    window = window_of(w, sign * q1, natural)
    bound = third_bound(mode, c, order, p, size, window)
    step = safe_step(w, sign * q1, sign * q2, bound, window)
    if step >= window:
        return step, False
    # the remainder of Taylor's formula against the slope that is left at the root
    resolution = 0.0 if order == 0 else AT_STATIONARY  # a root goes to the resolution of time
    slope = -sign * (q1 + q2 * step) - bound * step * step
    error = bound * step * step * (window + step) / 6.0
    return step, reached(step, tau + step) or error < slope * resolution * (1.0 + tau + step)


@helper
def refined(mode, c, order, target, sign, phase, t0, x0, v0, p, start, width, share):  # type: ignore[no-untyped-def]
    """Return the only root of a falling function in a bracket, its rate and the observable there.

    By the inverse of Taylor's polynomial (of third order for an observable, of second for a rate)::

        t = -r - A r^2 - (2 A^2 - B) r^3,   r = q / q', A = q" / 2 q', B = q^(3) / 6 q',

    whose error is ``(5 A^3 - 5 A B + C) r^4``, C = q^(4) / 24 q', or ``(2 A^2 - B) r^3``.
    """
    low, high = start, start + width
    tau = start + share * width
    q1, value = 0.0, 0.0
    for _ in range(100):  # bisection alone needs 60
        q, q1, q2, q3, size, value = quantity(mode, c, order, p, phase, t0, x0, v0, tau)
        q -= target
        if sign * q > 0.0:
            low = tau
        else:
            high = tau
        ratio, bend, third = q / q1, 0.5 * q2 / q1, q3 / (6.0 * q1)
        shift = -ratio * (1.0 + ratio * bend)
        if order == 0:
            shift -= ratio**3 * (2.0 * bend * bend - third)
        following = tau + shift
        if not low <= following <= high:
            if high - low <= 4.0 * EPS * high:
                return tau, q1, value
            tau = 0.5 * (low + high)
            continue
        # a rate's third derivative is the fourth one of its observable
        next_bound = third_bound(mode, c, 1, p, size, abs(shift))
        cube = abs(ratio) ** 3
        if order == 0:
            fourth = 5.0 * abs(bend) * (bend * bend + abs(third)) + next_bound / abs(24.0 * q1)
            if fourth * cube * abs(ratio) <= 0.5 * EPS * following:
                return following, q1 + q2 * shift, value
        else:
            value += shift * (q + shift * (0.5 * q1 + shift * q2 / 6.0))
            left = (2.0 * bend * bend + next_bound / abs(6.0 * q1)) * cube
            # what Taylor's formula leaves of the value must be rounding, too
            accurate = next_bound * cube * abs(shift) / 24.0 <= EPS * (1.0 + size)
            if accurate and left <= AT_STATIONARY * (1.0 + following):
                return following, q1 + q2 * shift, value
        if abs(shift) <= 4.0 * EPS * following:
            return following, q1, value
        tau = following
    return tau, q1, value
