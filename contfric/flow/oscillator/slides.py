"""Slides of several motions at once, from rest to their first stop, with the derivatives of the flow.

The search is that of :mod:`contfric.flow.oscillator.roots` for the undamped oscillator under one harmonic,
with the same certificates, done for as many motions as a vector has places
(:mod:`contfric.compiling.lanes`): no root is missed. A piece that the certificates leave open is tried
again, a quarter as long. The only root of a part is taken from the quintic that interpolates there, and
corrected twice by the inverse of Taylor's polynomial, of third order: from 1e-3 to 1e-12 to rounding. What
is not decided so, near a grazing, is said, and searched for by itself.
"""

from __future__ import annotations

from contfric.compiled import helper, inlined_helper
from contfric.compiling.lanes import absolute, bits, choose, read, square_root, without, write
from contfric.flow.oscillator.roots import AT_START, PIECE
from contfric.flow.oscillator.scanning import ALONE, FREE, least, most, scanned
from contfric.flow.oscillator.sines import sine_cosine

#: Rows of what is given: frequency, time at the start, position, that and the friction, side, longest time.
OMEGA, TIME, X, LOAD, SIDE, LONGEST = range(6)
#: Rows of what is kept of a root: coefficients of the quintic, start and length of its piece, part, whether.
_C, _START, _LENGTH, _LOW, _WIDE, _FOUND = 6, 12, 13, 14, 15, 16
#: Rows of what is found: time until the stop (-1 if undecided), position there, and the derivatives: of x and
#: v by the time at the start, of x by x, of x by v, of v by v, of x and v by the duration.
TAU, STOP, X_T, V_T, X_X, X_V, V_V, X_D, V_D, ROWS = range(17, 27)
#: Most pieces of a search, and the shortest, as a share of the longest.
_PIECES, _SHORTEST = 64, 0.01
#: A last correction (relative to a radian) up to which what is left of it is rounding.
_NEAR = 1e-9


@inlined_helper
def slid(w, sine, cosine, x0, load, d):  # type: ignore[no-untyped-def]
    """Return what a slide from rest has come to after a duration d.

    By the formulas of :func:`contfric.flow.oscillator.motion.harmonic`; in ``1 - cos d`` nothing cancels.

    Returns
    -------
    tuple
        (x, v, sine and cosine of the excitation's phase, derivatives of the response by the phase at the
        start, sin d, cos d, 1 - cos d).
    """
    p, q = (0.5 * (w - 1.0)) * d, (0.5 * (w + 1.0)) * d
    sp, cp = sine_cosine(p)
    sq, cq = sine_cosine(q)
    half = 0.5 * d
    a = half * choose(absolute(p) > 0.0, sp / p, 1.0)
    b = half * choose(absolute(q) > 0.0, sq / q, 1.0)
    sin_p, cos_p = sine * cp + cosine * sp, cosine * cp - sine * sp
    sin_q, cos_q = sine * cq + cosine * sq, cosine * cq - sine * sq
    sin_d, cos_d = sq * cp - cq * sp, cq * cp + sq * sp
    versine = choose(cos_d > 0.0, sin_d * sin_d / (1.0 + cos_d), 1.0 - cos_d)
    return (
        x0 - load * versine + (a * sin_q - b * sin_p),
        (a * cos_q + b * cos_p) - load * sin_d,
        sin_p * cq + cos_p * sq,
        cos_p * cq - sin_p * sq,
        a * cos_q - b * cos_p,
        0.0 - (a * sin_q + b * sin_p),
        sin_d,
        cos_d,
        versine,
    )


@inlined_helper
def error_of(w, size, step):  # type: ignore[no-untyped-def]
    """Return ``M H^6`` of a piece (:func:`contfric.flow.oscillator.motion.sixth_bound`)."""
    w2, s2 = w * w, step * step
    e = size + w * step
    return ((e + w) + w2 * w + w2 * w2 * w) * (s2 * s2 * s2)


@inlined_helper
def correction(v, rates):  # type: ignore[no-untyped-def]
    """Return the step to a root of v, of third order, and how much its curve matters."""
    a, b, c = rates
    ratio, bend, third = v / a, 0.5 * (b / a), c / (6.0 * a)
    cubed = ratio * ratio * ratio
    step = ratio * (1.0 + ratio * bend) + cubed * (2.0 * bend * bend - third)
    return 0.0 - step, absolute(ratio * bend)


@inlined_helper
def root_in(work, base, step):  # type: ignore[no-untyped-def]
    """Return the root of the quintic in its part, by Newton's method from the chord."""
    c0, c1, c2 = read(work, _C), read(work, _C + 1), read(work, _C + 2)
    c3, c4, c5 = read(work, _C + 3), read(work, _C + 4), read(work, _C + 5)
    p1, p2 = 5.0 * (c1 - c0), 10.0 * (c2 - 2.0 * c1 + c0)
    p3, p4 = 10.0 * (c3 - 3.0 * (c2 - c1) - c0), 5.0 * (c4 - 4.0 * (c3 + c1) + 6.0 * c2 + c0)
    p5 = c5 - 5.0 * (c4 - c1) + 10.0 * (c3 - c2) - c0
    low, width = read(work, _LOW), read(work, _WIDE)
    high = low + width
    before = c0 + low * (p1 + low * (p2 + low * (p3 + low * (p4 + low * p5))))
    end = c0 + high * (p1 + high * (p2 + high * (p3 + high * (p4 + high * p5))))
    s = low + width * (before / (before - end))
    for _ in range(3):
        value = c0 + s * (p1 + s * (p2 + s * (p3 + s * (p4 + s * p5))))
        slope = p1 + s * (2.0 * p2 + s * (3.0 * p3 + s * (4.0 * p4 + s * (5.0 * p5))))
        above = value > 0.0
        low, high = choose(above, s, low), choose(above, high, s)
        s = s - value / slope
        s = choose((s > low) & (s < high), s, 0.5 * (low + high))
    return base + s * step


@helper
def search(work):  # type: ignore[no-untyped-def]
    """Find a piece, and a part of it, with the first stop of each slide and no other one."""
    w, x0, load = read(work, OMEGA), read(work, X), read(work, LOAD)
    side, longest = read(work, SIDE), read(work, LONGEST)
    sine, cosine = sine_cosine(w * read(work, TIME))
    friction, tau = load - x0, 0.0 * w
    size = absolute(cosine - load)
    q, q1, q2 = tau, side * (cosine - load), side * (0.0 - w * sine)
    write(work, _FOUND, tau)
    going = q1 > AT_START * (1.0 + size)
    most_step = PIECE / most(w, tau + 1.0)
    step, leaving = most_step, going
    for _ in range(_PIECES):
        if bits(going) == 0:
            break
        error, after = error_of(w, size, step), tau + step
        x, v, sine_1, cosine_1, _, _, _, _, _ = slid(w, sine, cosine, x0, load, after)
        a = cosine_1 - x - friction
        r, r1, r2 = side * v, side * a, side * (0.0 - w * sine_1 - v)
        d0, d1 = (0.2 * step) * q1, (0.2 * step) * r1
        e0, e1 = ((0.05 * step) * step) * q2, ((0.05 * step) * step) * r2
        c = q, q + d0, q + 2.0 * d0 + e0, r - 2.0 * d1 + e1, r - d1, r
        decided, low, wide = scanned(c, error, leaving)
        here = going & (absolute(decided - ALONE) < 0.5)
        if bits(here) != 0:
            keep(work, here, c, (tau, step, low, wide))
        free, unknown = decided < FREE + 0.5, decided > ALONE + 0.5
        going = going & ((free & (after < longest)) | (unknown & (step > _SHORTEST * most_step)))
        leaving = without(leaving, free)
        tau, size = choose(free, after, tau), choose(free, square_root(v * v + a * a), size)
        q, q1, q2 = choose(free, r, q), choose(free, r1, q1), choose(free, r2, q2)
        step = choose(free, least(most_step, 2.0 * step), 0.25 * step)


@inlined_helper
def keep(work, here, c, where):  # type: ignore[no-untyped-def]
    """Keep pieces with one root."""
    for j in range(6):
        write(work, _C + j, choose(here, c[j], read(work, _C + j)))
    for j in range(4):
        write(work, _START + j, choose(here, where[j], read(work, _START + j)))
    write(work, _FOUND, choose(here, 1.0, read(work, _FOUND)))


@helper
def stops(work):  # type: ignore[no-untyped-def]
    """Find the first stops of slides from rest.

    Parameters
    ----------
    work : matrix of :data:`ROWS` rows and as many columns as a vector has places
    """
    search(work)
    w, x0, load, longest = read(work, OMEGA), read(work, X), read(work, LOAD), read(work, LONGEST)
    base, step = read(work, _START), read(work, _LENGTH)
    sine, cosine = sine_cosine(w * read(work, TIME))
    friction, tau = load - x0, root_in(work, base, step)
    x, v, s1, c1, _, _, _, _, _ = slid(w, sine, cosine, x0, load, tau)
    a = c1 - x - friction
    shift, _ = correction(v, (a, 0.0 - w * s1 - v, 0.0 - (w * w) * c1 - a))
    tau = tau + shift
    x, v, s1, c1, xt, vt, sin_d, cos_d, versine = slid(w, sine, cosine, x0, load, tau)
    a = c1 - x - friction
    b = 0.0 - w * s1 - v
    shift, curved = correction(v, (a, b, 0.0 - (w * w) * c1 - a))
    root, low = tau + shift, read(work, _LOW)
    good = (read(work, _FOUND) > 0.5) & ((absolute(shift) < _NEAR) & (curved < _NEAR))
    good = good & (root > base + (low - _NEAR) * step) & (root <= longest)
    good = good & (root < base + (low + read(work, _WIDE) + _NEAR) * step)
    write(work, TAU, choose(good, root, -1.0))
    write(work, STOP, x + shift * (v + (0.5 * shift) * a))
    write(work, X_T, w * (xt + shift * vt))
    write(work, V_T, w * (vt - shift * (s1 + xt)))
    write(work, X_X, 1.0 - versine - shift * sin_d)
    write(work, X_V, sin_d + shift * cos_d)
    write(work, V_V, cos_d - shift * sin_d)
    write(work, X_D, v + shift * a)
    write(work, V_D, a + shift * b)
