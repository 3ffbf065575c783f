"""Sines and cosines of several numbers at once, without a branch.

The multiple of pi/2 next to a number is taken away in three parts (W. J. Cody, W. Waite, Software Manual for
the Elementary Functions, 1980): the first two parts have 33 bits, so that their multiples are exact, and what
the difference loses is carried along. On what is left, in [-pi/4, pi/4], stand the polynomials of fdlibm.
The error is below 0.9 units in the last place for numbers up to 1e5; near zeros it is that of the reduction,
1e-16 of pi/4.
"""

from __future__ import annotations

import math

from contfric.compiled import inlined_helper
from contfric.compiling.lanes import choose

#: Added and taken away again, it rounds to the nearest whole number.
_ROUNDS = 1.5 * 2.0**52
_SHARE = 2.0 / math.pi
#: pi/2 in three parts.
_P0, _P1, _P2 = 1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21
#: Coefficients of x^3, x^5, .. in the sine, and of x^4, x^6, .. in the cosine.
_S0, _S1, _S2 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S3, _S4, _S5 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C0, _C1, _C2 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C3, _C4, _C5 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


@inlined_helper
def rounded(x):  # type: ignore[no-untyped-def]
    """Return the nearest whole numbers."""
    return (x + _ROUNDS) - _ROUNDS


@inlined_helper
def sine_cosine(x):  # type: ignore[no-untyped-def]
    """Return the sines and cosines of lanes."""
    n = rounded(x * _SHARE)
    first, second = x - n * _P0, n * _P1
    r = first - second
    tail = ((first - r) - second) - n * _P2
    z = r * r
    sine = _S0 + z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * _S5))))
    cosine = _C0 + z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * _C5))))
    s = r + (tail + r * z * sine)
    half = 0.5 * z
    near = 1.0 - half
    c = near + (((1.0 - near) - half) - r * tail + z * z * cosine)
    pairs = rounded(0.5 * n - 0.25)  # the half of n, rounded down
    odd = n - 2.0 * pairs > 0.5
    sign = 1.0 - 2.0 * (pairs - 2.0 * rounded(0.5 * pairs - 0.25))
    return sign * choose(odd, c, s), sign * choose(odd, 0.0 - s, c)
