"""Response of ``x'' + 2 zeta x' + x = cos(theta + w r)`` from rest: no resonance, no special damping.

With the roots ``a, b = -zeta +- sqrt(zeta^2 - 1)`` the response to ``e^{i w r}`` from rest after a
duration d is the divided difference of ``z -> e^{z d}`` at the nodes ``(a, b, i w)``::

    P(d) = int_0^d G(d - r) e^{i w r} dr = exp_d[a, b, i w],      G = exp_d[a, b],

because the Laplace transform of a divided difference is ``1 / ((z - a)(z - b)(z - i w))``. Divided
differences are entire functions of their nodes, so nothing happens at resonance (``i w = a``) nor at
critical damping (``a = b``), provided that they are evaluated as such:

* two nodes: ``exp_d[a, b] = d e^{(a+b)d/2} sinhc((a-b)d/2)``, ``sinhc z = sinh(z)/z``;
* three nodes: the recurrence over the two nodes that are farthest apart.

Without damping this collapses to products of real functions (``p = (w-1)d/2``, ``q = (w+1)d/2``)::

    X = d/2 [ sinc(p) sin(theta + q) - sinc(q) sin(theta + p) ],
    V = d/2 [ sinc(p) cos(theta + q) + sinc(q) cos(theta + p) ].

Source of the identity: C. de Boor, "Divided differences", Surveys in Approximation Theory 1 (2005),
section 11; the product form is the sum-to-product rule applied to the convolution integral.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from contfric.compiled import allocating_helper, helper


@helper
def sinc(x):  # type: ignore[no-untyped-def]
    """Return sin(x)/x; the quotient is accurate for every x but 0."""
    return 1.0 if x == 0.0 else math.sin(x) / x


@helper
def sinc_slope(x):  # type: ignore[no-untyped-def]
    """Return d/dx sin(x)/x; below 0.5 by its series, where the quotient would cancel."""
    if abs(x) < 0.5:
        # sum of (-1)^k 2k x^(2k-1) / (2k+1)!; seven terms leave less than 1e-17 at 0.5
        y = x * x
        return x * (
            -1 / 3
            + y
            * (
                1 / 30
                + y
                * (
                    -1 / 840
                    + y * (1 / 45360 + y * (-1 / 3991680 + y * (1 / 518918400 - y / 93405312000)))
                )
            )
        )
    return (math.cos(x) - math.sin(x) / x) / x


@helper
def undamped(w, theta, d):  # type: ignore[no-untyped-def]
    """Return (X, V, dX/dtheta, dV/dtheta, dX/dw, dV/dw) for zeta = 0; theta is held for d/dw."""
    p = 0.5 * (w - 1.0) * d
    q = 0.5 * (w + 1.0) * d
    half = 0.5 * d
    a = half * sinc(p)
    b = half * sinc(q)
    sp = math.sin(theta + p)
    cp = math.cos(theta + p)
    sq = math.sin(theta + q)
    cq = math.cos(theta + q)
    aw = half * half * sinc_slope(p)
    bw = half * half * sinc_slope(q)
    return (
        a * sq - b * sp,
        a * cq + b * cp,
        a * cq - b * cp,
        -a * sq - b * sp,
        aw * sq - bw * sp + half * (a * cq - b * cp),
        aw * cq + bw * cp - half * (a * sq + b * sp),
    )


@helper
def sinhc(z):  # type: ignore[no-untyped-def]
    """Return sinh(z)/z and its derivative for a complex z."""
    if abs(z) < 0.5:
        # even series 1 + z^2/3! + ...; the terms beyond z^14 are below 1e-17 at 0.5
        y = z * z
        value = 1 + y / 6 * (
            1 + y / 20 * (1 + y / 42 * (1 + y / 72 * (1 + y / 110 * (1 + y / 156))))
        )
        slope = z * (
            1 / 3
            + y
            * (
                1 / 30
                + y
                * (
                    1 / 840
                    + y * (1 / 45360 + y * (1 / 3991680 + y * (1 / 518918400 + y / 93405312000)))
                )
            )
        )
        return value, slope
    value = cmath.sinh(z) / z
    return value, (cmath.cosh(z) - value) / z


@helper
def difference(a, b, d):  # type: ignore[no-untyped-def]
    """Return exp_d[a, b] and its derivative with respect to b."""
    z = 0.5 * (a - b) * d
    if abs(z.real) > 20.0:
        # the larger exponential dominates by e^40: no cancellation, and sinh would overflow
        eb = cmath.exp(b * d)
        value = (cmath.exp(a * d) - eb) / (a - b)
        return value, (value - d * eb) / (a - b)
    middle = d * cmath.exp(0.5 * (a + b) * d)
    value, slope = sinhc(z)
    return middle * value, 0.5 * d * middle * (value - slope)


@helper
def roots(zeta):  # type: ignore[no-untyped-def]
    """Return the two characteristic roots as complex numbers."""
    r = cmath.sqrt(complex(zeta * zeta - 1.0, 0.0))
    if zeta > 1.0:
        # the small root as a quotient: -zeta + sqrt(zeta^2 - 1) would cancel
        far = -zeta - r
        return 1.0 / far, far
    return -zeta + r, -zeta - r


@helper
def free(zeta, d):  # type: ignore[no-untyped-def]
    """Return (G, C, R): kernel, its slope, and the response ``1 - C - 2 zeta G`` to a unit force."""
    if zeta == 0.0:
        s = math.sin(0.5 * d)
        return math.sin(d), math.cos(d), 2.0 * s * s
    a, b = roots(zeta)
    g = difference(a, b, d)[0].real
    r = transfer(a, b, 0.0, d)[0].real
    if zeta > 1.0:  # after the fast exponential the slope is small of second order
        return g, a.real * g + math.exp(b.real * d), r
    return g, 1.0 - r - 2.0 * zeta * g, r


@helper
def transfer(a, b, w, d):  # type: ignore[no-untyped-def]
    """Return P = exp_d[a, b, i w] and dP/dw, by the two nodes that are farthest apart."""
    c = complex(0.0, w)
    bc, bc_c = difference(b, c, d)
    if abs(a - b) >= abs(a - c):
        ac, ac_c = difference(a, c, d)
        return (ac - bc) / (a - b), 1j * (ac_c - bc_c) / (a - b)
    ab = difference(a, b, d)[0]
    p = (ab - bc) / (a - c)
    return p, 1j * (p - bc_c) / (a - c)


@helper
def forced(zeta, w, theta, d):  # type: ignore[no-untyped-def]
    """Return (X, V, dX/dtheta, dV/dtheta, dX/dw, dV/dw) for any damping; theta is held for d/dw."""
    if zeta == 0.0:
        return undamped(w, theta, d)
    a, b = roots(zeta)
    g = difference(a, b, d)[0]
    p, pw = transfer(a, b, w, d)
    e = complex(math.cos(theta), math.sin(theta))
    v = e * (1j * w * p + g)
    x = e * p
    xw = e * pw
    vw = e * (1j * p + 1j * w * pw)
    return x.real, v.real, -x.imag, -v.imag, xw.real, vw.real


@allocating_helper
def divided_exponentials(nodes, d):  # type: ignore[no-untyped-def]
    """Return exp_d over the leading nodes: entry j is exp_d[nodes[0..j]], for nodes that may repeat.

    First row of the exponential of the bidiagonal matrix of the nodes, by a Taylor series and
    repeated squaring (A. McCurdy, K. C. Ng, B. N. Parlett, Math. Comp. 43 (1984) 501-528).
    """
    n = len(nodes)
    norm = 0.0
    for node in nodes:
        norm = max(norm, abs(node) * abs(d))
    norm += abs(d)
    squarings = max(0, math.ceil(math.log2(max(norm, 1e-300))) + 1)  # scaled norm at most 1/2
    step = d / 2.0**squarings
    total = np.empty((n, n), dtype=np.complex128)  # below its diagonal nothing is read
    for i in range(n):
        for j in range(i, n):
            total[i, j] = 1.0 if i == j else 0.0
    for k in range(16, 0, -1):  # Horner; 0.5^17 / 17! is below 1e-19
        share = step / k
        for i in range(n):  # in place: row i of the product is made of rows i and i + 1
            own = nodes[i] * share
            total[i, i] = own * total[i, i] + 1.0
            for j in range(i + 1, n):
                total[i, j] = own * total[i, j] + share * total[i + 1, j]
    for _ in range(squarings):
        square_upper(total)
    return total[0]


@helper
def square_upper(a):  # type: ignore[no-untyped-def]
    """Square an upper triangular matrix in place: what an entry is made of is overwritten after it."""
    n = a.shape[0]
    for i in range(n):
        for j in range(n - 1, i - 1, -1):
            value = a[i, i] * a[i, j]
            for k in range(i + 1, j + 1):
                value += a[i, k] * a[k, j]
            a[i, j] = value
