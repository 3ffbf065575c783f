"""Certificates on one piece of time: free of roots, or one root and no other before it.

On a piece of length H let P be the quintic that takes q, q' and q'' of both ends (Hermite). With
``|q^(6)| <= M`` and s in [0, 1] along the piece::

    |q - P|            <= M H^6 s^3 (1 - s)^3 / 720                    <= M H^6 / 46080
    |q - P| / s        <= M H^6 s^2 (1 - s)^3 / 720                    <= M H^6 / 20833
    |d(q - P)/ds|      <= M H^6 s^2 (1 - s)^2 / 120                    <= M H^6 / 1920

(the error formula of Hermite interpolation; for the last line Rolle's theorem on q - P, whose
derivative vanishes twice at both ends and once between them). In Bernstein's basis a polynomial is at
least its smallest coefficient, and its slope at most the largest difference of neighbours. So a
piece, or a part of it, *has no root* if the smallest coefficient exceeds the first bound; it has *one*
if it ends below zero and its slope is negative throughout. The second bound serves a piece that
starts on a root: P / s has the coefficients ``5 c_i / i``.

A piece of two radians is decided by the two evaluations at its ends, where a march of third order
needs five or more.
"""

from __future__ import annotations

from contfric.compiled import helper

#: Outcomes of a scan: no root; one root, in the part that is returned; nothing certain from there on.
FREE, ISOLATED, UNSURE = range(3)
#: Bounds of the interpolation error, of the same over s, and of its slope, in M H^6.
VALUE, RATIO, SLOPE = 1.0 / 46080.0, 1.0 / 20833.0, 1.0 / 1920.0
#: Smallest part of a piece that is looked at: below it a new evaluation tells more.
_SMALLEST = 0.2


@helper
def coefficients(q0, d0, e0, q1, d1, e1, h):  # type: ignore[no-untyped-def]
    """Return the Bernstein coefficients of Hermite's quintic from q, q', q'' at both ends."""
    d0, d1 = 0.2 * h * d0, 0.2 * h * d1
    e0, e1 = 0.05 * h * h * e0, 0.05 * h * h * e1
    return q0, q0 + d0, q0 + 2.0 * d0 + e0, q1 - 2.0 * d1 + e1, q1 - d1, q1


@helper
def left_part(c, s):  # type: ignore[no-untyped-def]
    """Return the coefficients over [0, s] (de Casteljau)."""
    c0, c1, c2, c3, c4, c5 = c
    r = 1.0 - s
    a0, a1, a2, a3, a4 = (
        r * c0 + s * c1,
        r * c1 + s * c2,
        r * c2 + s * c3,
        r * c3 + s * c4,
        r * c4 + s * c5,
    )
    b0, b1, b2, b3 = r * a0 + s * a1, r * a1 + s * a2, r * a2 + s * a3, r * a3 + s * a4
    d0, d1, d2 = r * b0 + s * b1, r * b1 + s * b2, r * b2 + s * b3
    e0, e1 = r * d0 + s * d1, r * d1 + s * d2
    return c0, a0, b0, d0, e0, r * e0 + s * e1


@helper
def reversed_part(c):  # type: ignore[no-untyped-def]
    """Return the coefficients of the same polynomial run backwards."""
    return c[5], c[4], c[3], c[2], c[1], c[0]


@helper
def part(c, low, high):  # type: ignore[no-untyped-def]
    """Return the coefficients over [low, high]."""
    if high < 1.0:
        c = left_part(c, high)
    if low > 0.0:
        c = reversed_part(left_part(reversed_part(c), 1.0 - low / high))
    return c


@helper
def positive(c, bound, ratio, on):  # type: ignore[no-untyped-def]
    """Tell whether a part has no root; ``on``: but the one that it starts on."""
    if on:
        least = min(5.0 * c[1], 2.5 * c[2], 5.0 / 3.0 * c[3], 1.25 * c[4], c[5])
        return least > ratio
    return min(c[0], c[1], c[2], c[3], c[4], c[5]) > bound


@helper
def falling(c, bound):  # type: ignore[no-untyped-def]
    """Tell whether the slope is negative over a part; ``bound`` is that of a fifth of the slope."""
    steepest = max(c[1] - c[0], c[2] - c[1], c[3] - c[2], c[4] - c[3], c[5] - c[4])
    return steepest < -bound


@helper
def scan(c, error, on):  # type: ignore[no-untyped-def]
    """Look along a piece for the first root of a function that is positive at first.

    Parameters
    ----------
    c : coefficients over the piece
    error : M H^6
    on : whether the piece starts on a root, which does not count

    Returns
    -------
    tuple
        (outcome, low, high, coefficients over [low, high]): no root before ``low``; if isolated, one
        root in the part.
    """
    low, width = 0.0, 1.0
    while low < 1.0:
        high = min(1.0, low + width)
        here = part(c, low, high)
        at_root = on and low == 0.0
        # the quotient by s refers to the part's own s: its bound shrinks in proportion
        if positive(here, VALUE * error, RATIO * error * high, at_root):
            low = high
            continue
        last = high == 1.0
        if (
            not at_root
            and here[5] < (0.0 if last else -VALUE * error)
            and falling(here, 0.2 * SLOPE * error * (high - low))
        ):
            return ISOLATED, low, high, here
        if width <= _SMALLEST:
            return UNSURE, low, low, here
        width *= 0.5
    return FREE, 1.0, 1.0, c


@helper
def root_of(c):  # type: ignore[no-untyped-def]
    """Return the root in [0, 1] of a falling quintic, by Newton from its chord."""
    a0 = c[0]
    a1 = 5.0 * (c[1] - c[0])
    a2 = 10.0 * (c[2] - 2.0 * c[1] + c[0])
    a3 = 10.0 * (c[3] - 3.0 * (c[2] - c[1]) - c[0])
    a4 = 5.0 * (c[4] - 4.0 * (c[3] + c[1]) + 6.0 * c[2] + c[0])
    a5 = c[5] - 5.0 * (c[4] - c[1]) + 10.0 * (c[3] - c[2]) - c[0]
    low, high = 0.0, 1.0
    s = c[0] / (c[0] - c[5])
    for _ in range(
        3
    ):  # from a chord: 1e-1, 1e-2, 1e-4, which is what the interpolation is good for
        value = a0 + s * (a1 + s * (a2 + s * (a3 + s * (a4 + s * a5))))
        slope = a1 + s * (2.0 * a2 + s * (3.0 * a3 + s * (4.0 * a4 + s * 5.0 * a5)))
        if value > 0.0:
            low = s
        else:
            high = s
        s = s - value / slope if slope < 0.0 else 2.0
        if not low < s < high:
            s = 0.5 * (low + high)
    return s
