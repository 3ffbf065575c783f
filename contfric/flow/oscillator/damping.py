"""Derivative of the slide with respect to damping: a response to its own velocity.

The equation differentiated with respect to zeta is ``x'' + 2 zeta x' + x = -2 v``. With the velocity of the
slide, ``v = v0 C - L G + Re sum a_k (..)``, this is a sum of convolutions with the kernel G, linear in the
load L, in v0 and in the amplitudes ``a_k e^{i k Omega t0}`` of the excitation. With a dash for the derivative
by d, ``beta^2 = 1 - zeta^2`` and the response P to ``e^{i w r}`` (:mod:`contfric.flow.oscillator.response`),

    G*G = (G - d e^{-zeta d} cos beta d) / (2 beta^2),   (G*G)' = d G / 2 - zeta G*G,
    (G*G)'' = G - 2 zeta (G*G)' - G*G,               G*P = (P - (G*G)' - (2 zeta + i w) G*G) / D,

where ``D = 1 - w^2 + 2 i zeta w``; the last one is the divided difference ``exp_d[a, b, a, b, i w]`` by its
recurrence. Near a resonance and beyond critical damping these cancel, and the divided differences are
computed as such. A short slide and its derivative are Taylor series in d, whose coefficients the equations
give one after the other: no term is larger than the first ones, and it takes a sixth of the time.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.flow.oscillator.motion import OMEGA, ZETA
from contfric.flow.oscillator.response import divided_exponentials, forced, free, roots

#: Least beta d: below it the difference in G*G, of size d^3 made of terms d, loses more than two bits.
_LONG = 1.0
#: Least ``|D| d / w``: the rounding of P, of size d^2, grows by w / |D|; the displacement has the size d^3.
_APART = 0.5
#: Largest ``rate d`` of a short slide, and the terms of its series: 1 / 20! is below 1e-18.
_SHORT, _TERMS = 1.0, 20


@helper
def responses(p, third, d):  # type: ignore[no-untyped-def]
    """Return G, and P of the first and third harmonic; 0 of the third where it is not heard."""
    zeta, w = p[ZETA], p[OMEGA]
    g = free(zeta, d)[0]
    one, three = forced(zeta, w, 0.0, d), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if third != 0.0:
        three = forced(zeta, 3.0 * w, 0.0, d)
    return g, complex(one[0], -one[2]), complex(three[0], -three[2])


@helper
def plain_convolutions(zeta, g, d):  # type: ignore[no-untyped-def]
    """Return G*G with its first and second derivative by d, by its closed form.

    With ``G' + zeta G = e^{-zeta d} cos(beta d)``: after a long slide all of it is small, as G is, while G'
    is known to the rounding of 1, which near critical damping grows by ``d / beta^2``.
    """
    square = (1.0 - zeta) * (1.0 + zeta)
    rest = math.exp(-zeta * d) * math.cos(math.sqrt(square) * d)
    g2 = (g - d * rest) / (2.0 * square)
    g2_1 = 0.5 * d * g - zeta * g2
    return g2, g2_1, g - 2.0 * zeta * g2_1 - g2


@allocating_helper
def convolutions(zeta, w, d):  # type: ignore[no-untyped-def]
    """Return G*G with its first and second derivative by d, and G*P, by divided differences."""
    a, b = roots(zeta)
    # by exp_d over the repeated roots
    nodes = np.empty(5, dtype=np.complex128)
    nodes[0], nodes[1], nodes[2], nodes[3], nodes[4] = a, b, a, b, complex(0.0, w)
    e = divided_exponentials(nodes, d)
    g2 = e[3]
    g2_1 = b * e[3] + e[2]
    return g2.real, g2_1.real, (b * g2_1 + a * e[2] + e[1]).real, e[4]


@helper
def is_plain(zeta, w, d):  # type: ignore[no-untyped-def]
    """Tell whether the closed form of G*P keeps its digits."""
    return abs(complex(1.0 - w * w, 2.0 * zeta * w)) * d >= _APART * w


@helper
def is_short(zeta, w, third, d):  # type: ignore[no-untyped-def]
    """Tell whether a slide is short in all of its rates: 1, 2 zeta and the frequencies that are heard."""
    fastest = 3.0 * w if third != 0.0 else w
    return abs(d) * max(1.0, 2.0 * abs(zeta), abs(fastest)) <= _SHORT


@helper
def short_response(zeta, w, load, v0, first, third, d):  # type: ignore[no-untyped-def]
    """Return d(x, v)/dzeta by the Taylor series of ``y'' + 2 zeta y' + y = f`` and its derivative.

    ``y`` is the load, and ``z'' + 2 zeta z' + z = -2 y'`` its derivative; numbers count the terms.
    """
    y0, y1, z0, z1, x, v = load, v0 * d, 0.0, 0.0, 0.0, 0.0
    one, three, square, drag = first, third, d * d, 2.0 * zeta * d
    turn = complex(0.0, w * d)
    for k in range(_TERMS):
        along, both = k + 1.0, (k + 1.0) * (k + 2.0)
        y2 = (square * (one.real + three.real - y0) - drag * along * y1) / both
        z2 = (-square * z0 - along * (drag * z1 + 2.0 * d * y1)) / both
        x += z2
        v += (k + 2.0) * z2
        one, three = one * turn / along, three * (3.0 * turn) / along
        y0, y1, z0, z1 = y1, y2, z1, z2
    return x, v / d if d != 0.0 else 0.0


@allocating_helper
def damping_response(p, load, v0, first, third, d, known):  # type: ignore[no-untyped-def]
    """Return d(x, v)/dzeta.

    Parameters
    ----------
    first, third : complex amplitudes of the harmonics at the start
    known : of :func:`responses`; who has them for the slide itself need not ask for them again
    """
    zeta, w, (g, p1, p3) = p[ZETA], p[OMEGA], known
    if is_short(zeta, w, third, d):
        return short_response(zeta, w, load, v0, first, third, d)
    plain = (
        abs(zeta) < 1.0 and d * d * (1.0 - zeta * zeta) >= _LONG * _LONG and is_plain(zeta, w, d)
    )
    if plain:
        g2, g2_1, g2_2 = plain_convolutions(zeta, g, d)
        q = complex(0.0, 0.0)
    else:
        g2, g2_1, g2_2, q = convolutions(zeta, w, d)
    x = complex(v0 * g2_1 - load * g2, 0.0)
    v = complex(v0 * g2_2 - load * g2_1, 0.0)
    for k in range(1, 4, 2):
        turn = first if k == 1 else third
        if turn != 0.0:
            node = complex(0.0, k * w)
            if plain and is_plain(zeta, k * w, d):
                rest = (p1 if k == 1 else p3) - g2_1 - (2.0 * zeta + node) * g2
                q = rest / complex(1.0 - (k * w) ** 2, 2.0 * zeta * k * w)
            elif k == 3 or plain:
                q = convolutions(zeta, k * w, d)[3]
            q1 = node * q + g2
            q2 = node * q1 + g2_1
            x += turn * q1
            v += turn * q2
    return -2.0 * x.real, -2.0 * v.real
