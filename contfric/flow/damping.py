"""Derivative of the slide with respect to damping: a response to its own velocity.

The equation differentiated with respect to zeta is ``x'' + 2 zeta x' + x = -2 v``. With the velocity of the
slide, ``v = v0 C - L G + Re sum a_k (..)``, this is a sum of convolutions with the kernel G: divided
differences of the exponential over repeated roots (:mod:`contfric.flow.response`). It is linear in
the load L, in v0 and in the amplitudes ``a_k e^{i k Omega t0}`` of the excitation.
"""

from __future__ import annotations

import numpy as np

from contfric.compiled import allocating_helper
from contfric.flow.motion import OMEGA, ZETA
from contfric.flow.response import divided_exponentials, roots


@allocating_helper
def damping_response(p, load, v0, first, third, d):  # type: ignore[no-untyped-def]
    """Return d(x, v)/dzeta; ``first`` and ``third`` are complex amplitudes of the harmonics at the start."""
    w = p[OMEGA]
    a, b = roots(p[ZETA])
    # G*G, its slope G*C, and C*C' by exp_d over the repeated roots
    nodes = np.empty(5, dtype=np.complex128)
    nodes[0], nodes[1], nodes[2], nodes[3], nodes[4] = a, b, a, b, complex(0.0, w)
    e = divided_exponentials(nodes, d)
    q = e[4]
    g2 = e[3]
    g2_1 = b * e[3] + e[2]
    g2_2 = b * g2_1 + a * e[2] + e[1]
    x = v0 * g2_1 - load * g2
    v = v0 * g2_2 - load * g2_1
    for k in range(1, 4, 2):
        turn = first if k == 1 else third
        if turn != 0.0:
            node = complex(0.0, k * w)
            if k == 3:
                nodes[4] = node
                q = divided_exponentials(nodes, d)[4]
            q1 = node * q + g2
            q2 = node * q1 + g2_1
            x += turn * q1
            v += turn * q2
    return -2.0 * x.real, -2.0 * v.real
