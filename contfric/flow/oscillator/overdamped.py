"""The strongly damped slide: a slow and a fast exponential, each bounded by itself.

With the roots ``b < a < 0`` of ``z^2 + 2 zeta z + 1`` the velocity of a slide is a difference of two
numbers, each of which follows an equation of first order::

    v = (w_s - w_f) / (a - b),      w_s = v' - b v,   w_s' = a w_s + f',
                                    w_f = v' - a v,   w_f' = b w_f + f'.

The second one forgets its start within 1/|b|: with the harmonics ``p`` that it then follows,
``w_f = p + g e^{b d}`` exactly, and ``p`` and its derivatives are of order 1/|b|. So every derivative of v
is a number of order ``1 / (a - b)`` with rates a and Omega, and one exponential, ``b^k g e^{b d}``.
From the differential equation alone each derivative would be bounded, and its rounding multiplied, by
2 zeta times the one before, long after the exponential has gone.
"""

from __future__ import annotations

import math

from contfric.compiled import helper

#: Damping from which the two exponentials are kept apart: below, the fast one lasts about as long as the
#: pieces of a search, and both are one motion.
STRONG = 8.0


@helper
def rates(zeta):  # type: ignore[no-untyped-def]
    """Return the slow and the fast rate, and their difference; for zeta > 1."""
    root = math.sqrt((zeta - 1.0) * (zeta + 1.0))
    fast = -zeta - root
    return 1.0 / fast, fast, 2.0 * root


@helper
def followed(b, w, h, cos1, sin1, hcos3, hsin3):  # type: ignore[no-untyped-def]
    """Return the harmonics that w_f follows, with three derivatives.

    To the force ``e^{i w t}`` belongs ``i w / (i w - b) e^{i w t}``; ``hcos3`` and ``hsin3`` are of the
    third harmonic, times its size h.
    """
    share = w / (b * b + w * w)
    c, s = share * (w * cos1 + b * sin1), share * (b * cos1 - w * sin1)
    p, p1, p2, p3 = c, w * s, -w * w * c, -w * w * w * s
    if h != 0.0:
        k = 3.0 * w
        share = k / (b * b + k * k)
        c, s = share * (k * hcos3 + b * hsin3), share * (b * hcos3 - k * hsin3)
        p, p1, p2, p3 = p + c, p1 + k * s, p2 - k * k * c, p3 - k * k * k * s
    return p, p1, p2, p3


@helper
def third_harmonic(w, h, f, f1, f2, f3):  # type: ignore[no-untyped-def]
    """Return cosine and sine of the first harmonic and h times those of the third, from the force."""
    if h == 0.0:
        return f, -f1 / w, 0.0, 0.0
    hcos3 = -(f2 / (w * w) + f) / 8.0
    hsin3 = (f3 / (w * w * w) + f1 / w) / 24.0
    return f - hcos3, -f1 / w - 3.0 * hsin3, hcos3, hsin3


@helper
def fast_start(b, friction, w, h, phase, x0, v0):  # type: ignore[no-untyped-def]
    """Return g: by how much w_f differs at the start from what it follows."""
    force = phase[1] + h * phase[3]
    p = followed(b, w, h, phase[1], phase[0], h * phase[3], h * phase[2])[0]
    return force - x0 - friction + b * v0 - p


@helper
def damped_rates(zeta, friction, w, h, phase, x0, v0, x, v, f, f1, f2, f3, d):  # type: ignore[no-untyped-def]
    """Return v', v'', v''' of a slide after d, |w_s| there, and |g e^{b d}|."""
    a, b, apart = rates(zeta)
    fast = fast_start(b, friction, w, h, phase, x0, v0) * math.exp(b * d)
    cos1, sin1, hcos3, hsin3 = third_harmonic(w, h, f, f1, f2, f3)
    _, p1, p2, p3 = followed(b, w, h, cos1, sin1, hcos3, hsin3)
    slow = f - x - friction + a * v
    slow1 = a * slow + f1
    slow2 = a * slow1 + f2
    slow3 = a * slow2 + f3
    return (
        (slow1 - p1 - b * fast) / apart,
        (slow2 - p2 - b * b * fast) / apart,
        (slow3 - p3 - b * b * b * fast) / apart,
        abs(slow),
        abs(fast),
    )


@helper
def damped_bound(k, zeta, w, h, slow, fast, window):  # type: ignore[no-untyped-def]
    """Return a bound of the k-th derivative of v over a window, from |w_s| and |g e^{b d}| at its start.

    By ``|w_s| <= slow + |f'| window`` and ``w_s^(k) = a w_s^(k-1) + f^(k)``; the rest is in closed form.
    """
    a, b, apart = rates(zeta)
    size, first, third, exponential = 0.0, 1.0, abs(h), fast
    for j in range(k):
        first *= w
        third *= 3.0 * w
        exponential *= -b
        force = first + third
        size = (slow + force * window) if j == 0 else size
        size = -a * size + force
    harmonics = first * w / math.hypot(b, w) + third * 3.0 * w / math.hypot(b, 3.0 * w)
    return (size + harmonics + exponential) / apart


@helper
def is_gone(zeta, fast):  # type: ignore[no-untyped-def]
    """Tell whether the fast exponential no longer shortens a search.

    Its sixth derivative, over a unit of time, is below rounding then.
    """
    b = 2.0 * zeta
    cube = b * b * b
    return fast * cube * cube <= 1e-16
