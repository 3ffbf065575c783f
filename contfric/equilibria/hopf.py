r"""Hopf points: what a pair of imaginary eigenvalues becomes, to third order.

At an equilibrium with :math:`A q = i\omega q`, :math:`A^T \bar r = i\omega \bar r` normed to
``<q, q> = <r, q> = 1`` (``<a, b>`` conjugates its first argument), the field
``A u + B(u, u)/2 + C(u, u, u)/6 + ...`` has on its centre manifold the normal form

.. math:: \dot z = (\mu + i\omega) z + c_1 z |z|^2 + O(|z|^4), \qquad u = z q + \bar z \bar q + O(|z|^2),

with the first Lyapunov coefficient :math:`l_1 = \mathrm{Re}\, c_1 / \omega`,

.. math:: l_1 = \frac{1}{2\omega} \mathrm{Re}\, [\langle r, C(q, q, \bar q)\rangle
   - 2 \langle r, B(q, A^{-1} B(q, \bar q))\rangle + \langle r, B(\bar q, (2 i\omega - A)^{-1}
   B(q, q))\rangle]

(Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, 3rd ed., Springer 2004, eq. 5.34). Cycles have
:math:`|z|^2 = -\mu / (\omega l_1)`: they are stable and on the side of the unstable equilibrium for
``l1 < 0`` (supercritical), unstable and on the other side for ``l1 > 0``. The real part ``mu`` changes along
the branch at the rate

.. math:: \mathrm{Re} \langle r, B(q, y') + g_{yp} q \rangle, \qquad y' = -A^{-1} g_p.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.equilibria.regions import ModeRegion
from contfric.equilibria.result import ComplexArray

#: Relative: an imaginary part below this is rounding, as that of a double eigenvalue may be: its root.
_REAL = 1e-7
#: Relative: a coefficient smaller than this, compared with its terms, is zero to rounding.
_CANCELLED = 1e-10
#: Hopf points are located to rounding, some to its root at worst: relative to the parameter, or to the change
#: of it that moves the real part by omega.
_PLACE = 1e-10


@dataclass(frozen=True, eq=False)
class Centre:
    """The centre subspace of a Hopf point and its normal form.

    Attributes
    ----------
    frequency : omega
    vector : q, shape (n,)
    lyapunov : first Lyapunov coefficient; 0.0 where it vanishes to rounding
    rate : of the real part of the pair, by the parameter
    drift : y', shape (n,)
    """

    frequency: float
    vector: ComplexArray
    lyapunov: float
    rate: float
    drift: FloatArray


def is_oscillating(eigenvalues: ComplexArray, k: int) -> bool:
    """Tell whether one of some eigenvalues is complex.

    Examples
    --------
    >>> is_oscillating(np.array([1e-12 + 2j, 1e-12 - 2j, -3]), 0), is_oscillating(np.array([0j, -1]), 0)
    (True, False)
    """
    size = float(np.max(np.abs(eigenvalues)))
    return bool(abs(eigenvalues[k].imag) > _REAL * size)


def centre_of(region: ModeRegion, y: FloatArray, p: FloatArray, active: int) -> Centre:
    """Return the centre subspace and the normal form of a Hopf point.

    A coefficient that has the parameter as a factor, as that of van der Pol's oscillator, is zero where the
    parameter is: then rounding of the place gives it a sign, and the other one next to it.
    """
    found = _normal_form(region, y, p, active)
    unit = found.frequency / abs(found.rate) if found.rate else 0.0
    moved = _PLACE * max(abs(float(p[active])), unit) * np.eye(len(p))[active]
    near = [_normal_form(region, y, p + way * moved, active).lyapunov for way in (-1, 1)]
    return replace(found, lyapunov=0.0) if near[0] * near[1] < 0.0 else found


def _normal_form(region: ModeRegion, y: FloatArray, p: FloatArray, active: int) -> Centre:
    """Return the centre subspace and the normal form at a state and parameters."""
    fields = region.fields
    a = fields.jacobian(y, p)
    values, vectors = np.linalg.eig(a)
    k = _critical(values, region.fields.eigenvalues(y, p))
    omega, q = float(values[k].imag), vectors[:, k] / np.linalg.norm(vectors[:, k])
    lefts, adjoint = np.linalg.eig(a.T)
    r = adjoint[:, int(np.argmin(np.abs(lefts + 1j * omega)))]
    r = r / np.vdot(q, r)  # <r, q> = 1, as vdot conjugates its first argument

    def b(u: ComplexArray, v: ComplexArray) -> ComplexArray:
        return np.asarray(fields.second(y, p, u, v))

    conj, one = q.conj(), np.eye(len(y))
    steady = np.asarray(np.linalg.solve(a, b(q, conj)), dtype=np.complex128)
    doubled = np.asarray(np.linalg.solve(2j * omega * one - a, b(q, q)), dtype=np.complex128)
    third = np.asarray(fields.third(y, p, q, q, conj))
    left = r.conj()
    terms = np.array([left @ third, -2.0 * (left @ b(q, steady)), left @ b(conj, doubled)])
    lyapunov = float(np.sum(terms).real) / (2.0 * omega)
    if abs(lyapunov) * 2.0 * omega <= _CANCELLED * float(np.sum(np.abs(terms))):
        lyapunov = 0.0
    drift = np.asarray(-np.linalg.solve(a, fields.slope(y, p, active)), dtype=np.float64)
    turned = b(q, drift.astype(np.complex128)) + fields.mixed(y, p, active, q)
    return Centre(omega, q, lyapunov, float((left @ turned).real), drift)


def _critical(values: ComplexArray, own: ComplexArray) -> int:
    """Return the number of the eigenvalue i omega: that of the complex pair nearest to the imaginary axis."""
    complex_ones = own[own.imag > _REAL * float(np.max(np.abs(own)))]
    omega = float(complex_ones[int(np.argmin(np.abs(complex_ones.real)))].imag)
    return int(np.argmin(np.abs(values - 1j * omega)))
