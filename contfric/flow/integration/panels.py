"""Where an observable, or its rate, has zeros between two nodes: certificates by Bernstein coefficients.

Between two nodes with q, q' and q'' let P be the quintic that takes all six (Hermite), with Bernstein
coefficients c over s in [0, 1], and Q the cubic that takes the values and first derivatives. They differ by::

    P - Q = 10 s^2 (1 - s)^3 D2 + 10 s^3 (1 - s)^2 D3,      |P - Q| <= 0.35 (|D2| + |D3|),

the error of the cubic. The quintic's own is smaller by ``(w H)^2 / 120`` for a motion of frequency w and
a panel of length H, and steps that are accurate have w H below 2; a tenth of the cubic's error is taken
as a bound e of it. From the error formula of Hermite interpolation follow the bounds of the rest (in
units of e, see :mod:`contfric.flow.pieces` for the formula)::

    q - P: 1,   (q - P)/s: 2.3,   (q - P)/s^2: 6.8,   slope: 24,   slope/s: 58,   second derivative: 120

where the forms with s and s^2 serve a panel that starts on a zero. As a polynomial lies between its
smallest and largest coefficient, panels *without* a zero and panels with *one* are recognised; of all
others the halves are looked at, first of the polynomial, then of the solution itself.
"""

from __future__ import annotations

from contfric.compiled import helper
from contfric.flow.pieces import FREE, ISOLATED, UNSURE, part

#: Share of the cubic's error that bounds the quintic's.
_SHARE = 0.1 * 0.35
#: Bounds of the interpolation error of the quotients, of the slope and so on, in units of that of the
#: value.
_RATIO, _RATIO2, _SLOPE, _SLOPE_RATIO, _SECOND = 2.3, 6.8, 24.0, 58.0, 120.0
#: Rounding of a value, relative to the largest coefficient: a few units in the last place.
_ROUNDING = 1e-15
#: Smallest part of a panel that is looked at: below it a new node tells more.
_SMALLEST = 0.12


@helper
def error_of(c):  # type: ignore[no-untyped-def]
    """Return the bound e of the quintic's error from its coefficients."""
    c0, c1, c2, c3, c4, c5 = c
    b1 = c0 + (c1 - c0) * 5.0 / 3.0
    b2 = c5 + (c4 - c5) * 5.0 / 3.0
    d2 = c2 - 0.1 * (c0 + 6.0 * b1 + 3.0 * b2)
    d3 = c3 - 0.1 * (3.0 * b1 + 6.0 * b2 + c5)
    size = max(abs(c0), abs(c1), abs(c2), abs(c3), abs(c4), abs(c5))
    return _SHARE * (abs(d2) + abs(d3)) + _ROUNDING * size


@helper
def is_positive(c, e, width, multiple):  # type: ignore[no-untyped-def]
    """Tell whether a part has no zero; ``multiple``: but a zero of that order at its start."""
    c0, c1, c2, c3, c4, c5 = c
    if multiple == 1:
        least = min(5.0 * c1, 2.5 * c2, 5.0 / 3.0 * c3, 1.25 * c4, c5)
        return least > _RATIO * e * width
    if multiple == 2:
        least = min(10.0 * c2, 10.0 / 3.0 * c3, 5.0 / 3.0 * c4, c5)
        return least > _RATIO2 * e * width * width
    return min(c0, c1, c2, c3, c4, c5) > e


@helper
def scan_values(c, e, multiple):  # type: ignore[no-untyped-def]
    """Look along a panel for the first zero of a function that is positive at first.

    Returns
    -------
    tuple
        (outcome, low, high, coefficients over [low, high]): no zero before ``low``; if isolated, one in
        the part.
    """
    low, width = 0.0, 1.0
    while low < 1.0:
        high = min(1.0, low + width)
        here = part(c, low, high)
        share = high - low
        order = multiple if low == 0.0 else 0
        if is_positive(here, e, share, order):
            low = high
            continue
        last = high == 1.0
        if order == 0:
            d0, d1, d2, d3, d4 = differences(here)
            falls = max(d0, d1, d2, d3, d4) < -0.2 * _SLOPE * e * share
            if falls and last and here[5] > 0.0:  # the node itself is known, and still positive
                return FREE, 1.0, 1.0, c
            if falls and here[5] <= (0.0 if last else -e):
                return ISOLATED, low, high, here
        if width <= _SMALLEST:
            return UNSURE, low, low, here
        width *= 0.5
    return FREE, 1.0, 1.0, c


@helper
def differences(c):  # type: ignore[no-untyped-def]
    """Return the coefficients of a fifth of the slope."""
    c0, c1, c2, c3, c4, c5 = c
    return c1 - c0, c2 - c1, c3 - c2, c4 - c3, c5 - c4


@helper
def has_slope(d, bound, ratio, at_start):  # type: ignore[no-untyped-def]
    """Tell whether a slope has no zero in a part; ``at_start``: but the one that it starts on."""
    d0, d1, d2, d3, d4 = d
    if at_start:
        a, b, c, e = 4.0 * d1, 2.0 * d2, 4.0 / 3.0 * d3, d4
        return min(a, b, c, e) > ratio or max(a, b, c, e) < -ratio
    return min(d0, d1, d2, d3, d4) > bound or max(d0, d1, d2, d3, d4) < -bound


@helper
def scan_slopes(c, e, at_start):  # type: ignore[no-untyped-def]
    """Look along a panel for the first zero of the slope; see :func:`scan_values`."""
    low, width = 0.0, 1.0
    while low < 1.0:
        high = min(1.0, low + width)
        here = part(c, low, high)
        share = high - low
        d = differences(here)
        bound = 0.2 * _SLOPE * e * share
        on = at_start and low == 0.0
        if has_slope(d, bound, 0.2 * _SLOPE_RATIO * e * share * share, on):
            low = high
            continue
        d0, d1, d2, d3, d4 = d
        bend = 0.05 * _SECOND * e * share * share
        least = min(d1 - d0, d2 - d1, d3 - d2, d4 - d3)
        most = max(d1 - d0, d2 - d1, d3 - d2, d4 - d3)
        if (least > bend or most < -bend) and not on:
            sure = (low == 0.0 or abs(d0) > bound) and (high == 1.0 or abs(d4) > bound)
            if sure and (d0 < 0.0) != (d4 < 0.0):
                return ISOLATED, low, high, here
            if sure:
                low = high
                continue
        if width <= _SMALLEST:
            return UNSURE, low, low, here
        width *= 0.5
    return FREE, 1.0, 1.0, c


@helper
def zero_of_slope(c):  # type: ignore[no-untyped-def]
    """Return the zero in [0, 1] of a monotone slope, by Newton from its chord."""
    d0, d1, d2, d3, d4 = differences(c)
    a1, a2, a3 = (
        4.0 * (d1 - d0),
        6.0 * (d2 - 2.0 * d1 + d0),
        4.0 * (d3 - 3.0 * (d2 - d1) - d0),
    )
    a4 = d4 - 4.0 * (d3 + d1) + 6.0 * d2 + d0
    low, high = 0.0, 1.0
    s = d0 / (d0 - d4)
    for _ in range(4):  # from a chord: 1e-1, 1e-2, 1e-4, 1e-8
        value = d0 + s * (a1 + s * (a2 + s * (a3 + s * a4)))
        slope = a1 + s * (2.0 * a2 + s * (3.0 * a3 + s * 4.0 * a4))
        if (value < 0.0) == (d0 < 0.0):
            low = s
        else:
            high = s
        s = s - value / slope if slope != 0.0 else 2.0
        if not low <= s <= high:
            s = 0.5 * (low + high)
    return s
