"""The first zero of a function along a segment, guaranteed, from Bernstein's form of its power series.

A segment is cut into windows of equal length. In a window, with ``e = r s`` and ``0 <= s <= 1``, the
velocity is a power series in s whose coefficients follow from the equation of motion, linear in six
numbers z: velocity, acceleration, and sine and cosine of the excitation's phase and of three times it.
Cut after degree n it is a polynomial; its Bernstein coefficients ``b = B z`` enclose its values::

    min b <= p(s) <= max b,      n min(diff b) <= p'(s) <= n max(diff b).

So a window without a zero is proved by the signs of n + 1 numbers, and a single zero by a change of
sign with differences of one sign. Where neither holds the window is halved (de Casteljau). What is
cut off, and the rounding, are added to the bounds.

Two tiers: in double precision, where the margins are far above 1e-13 (nearly always); else in balls of
the working precision, over windows so short that what is cut off lies below 1e-70.

Remainder. With the coefficients ``m_k`` of the velocity and ``f_k`` of the force (at most
``(w r)^k / k!``, w its highest frequency)::

    (k + 2) m_{k+2} = r f_{k+1} - 2 zeta r m_{k+1} - r^2 m_k / (k + 1).

Let ``(1 + 2 |zeta|) r <= 3``, ``w r <= 3``, n = 30 and ``Z = max(|m_{n-1}|, |m_n|, r (w r)^n / n!)``.
Then ``|m_{n+j}| <= Z / 4^j`` by induction (``(1 + 3 + 4 * 9 / 30) / 31 < 1/4``): the rest is below Z, and
its derivative below (n + 1) Z.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise
from math import comb
from typing import Any

import numpy as np
from flint import arb, arb_mat
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Degree at which the series is cut, and the number of radians in a window (see the remainder above).
DEGREE, SPAN = 30, 3.0
#: The windows of the second tier are shorter by this power of two: (3/64)^31 / 31! is below 1e-75.
SHORTER = 2.0**-6
#: Halvings before a tier gives up: 2^-24 of a window parts zeros in double precision, and 2^-110 of
#: a short window parts them to about 1e-35 of a radian.
HALVINGS, FINE_HALVINGS = 24, 110
#: Rounding of a sum of six products of rounded factors, in units of 2^-53 (7 + 2, rounded up); one
#: halving adds a sum of at most 31 products of weights whose sum is 1.
SUM_ROUNDING, HALVING_ROUNDING = 10 * 2.0**-53, 33 * 2.0**-53


class Undecided(Exception):
    """A zero that the working precision cannot tell from none."""


@dataclass(frozen=True)
class Bracket:
    """Part of a window, in units of it, that holds exactly one zero, and the least slope in it."""

    low: float
    high: float
    slope: float


@cache
def to_bernstein(n: int) -> arb_mat:
    """Return the matrix from power to Bernstein coefficients of degree n."""
    return arb_mat(
        [
            [arb(comb(j, i)) / comb(n, i) if i <= j else arb(0) for i in range(n + 1)]
            for j in range(n + 1)
        ]
    )


@cache
def halves(n: int) -> tuple[FloatArray, FloatArray]:
    """Return the matrices that take Bernstein coefficients to those of both halves."""
    left = np.array(
        [[comb(i, j) / 2.0**i if j <= i else 0.0 for j in range(n + 1)] for i in range(n + 1)]
    )
    return left, np.ascontiguousarray(left[::-1, ::-1])


@dataclass(frozen=True)
class Series:
    """Bernstein coefficients of a window as a matrix on z, for one order of the zero at its start."""

    exact: arb_mat
    rest: tuple[arb, ...]

    @cached_property
    def degree(self) -> int:
        return self.exact.nrows() - 1

    @cached_property
    def rounded(self) -> FloatArray:
        table = self.exact.table()
        return np.array([[float(entry) for entry in row] for row in table])

    @cached_property
    def errors(self) -> FloatArray:
        """Bound of the error of each coefficient, per unit of each number of z."""
        rest = np.array([float(r.upper()) for r in self.rest])
        return np.asarray(SUM_ROUNDING * np.abs(self.rounded).max(axis=0) + 1.01 * rest)


def force_powers(omega: arb, h: arb, span: arb, n: int) -> list[list[arb]]:
    """Return the coefficients of the force up to degree n for unit (cos, sin, cos 3, sin 3)."""
    columns: list[list[arb]] = []
    for k, size in ((1, arb(1)), (3, h)):
        term, cosine, sine = size, [], []
        for j in range(n + 1):
            # derivatives of cos: cos, -sin, -cos, sin
            cosine.append((term, arb(0), -term, arb(0))[j % 4])
            sine.append((arb(0), -term, arb(0), term)[j % 4])
            term = term * (k * omega) * span / (j + 1)
        columns += [cosine, sine]
    return columns


def speed_powers(omega: arb, h: arb, zeta: arb, span: arb, n: int) -> list[list[arb]]:
    """Return the coefficients of the velocity for unit (v, a, cos, sin, cos 3, sin 3)."""
    none = [arb(0)] * (n + 2)
    forces = [none, none, *force_powers(omega, h, span, n + 1)]
    columns = []
    for index, force in enumerate(forces):
        m = [arb(int(index == 0)), span if index == 1 else arb(0)]
        for k in range(n - 1):
            pull = span * force[k + 1] - 2 * zeta * span * m[k + 1] - span * span * m[k] / (k + 1)
            m.append(pull / (k + 2))
        columns.append(m)
    return columns


def series(columns: list[list[arb]], rest: list[arb], order: int) -> Series:
    """Return the Bernstein form of power series divided by s^order."""
    powers = arb_mat([list(row) for row in zip(*columns, strict=True)][order:])
    return Series(to_bernstein(powers.nrows() - 1) * powers, tuple(rest))


class Windows:
    """Windows of one length for one set of parameters: of the velocity, or of the force at rest."""

    def __init__(self, omega: arb, h: arb, zeta: arb | None, shorter: float = 1.0) -> None:
        fastest = float(omega) * (3.0 if h != 0 else 1.0)
        free = 0.0 if zeta is None else 1.0 + 2.0 * abs(float(zeta))
        self.length = SPAN / max(fastest, free) * (1 - 2.0**-40) * shorter
        self._law = omega, h, zeta
        self._forms: dict[int, Series] = {}

    def form(self, order: int) -> Series:
        """Return the Bernstein form for a zero of this order at the start."""
        if order not in self._forms:
            if not self._forms:
                self._columns, self._rest = self._powers()
            self._forms[order] = series(self._columns, self._rest, order)
        return self._forms[order]

    def _powers(self) -> tuple[list[list[arb]], list[arb]]:
        omega, h, zeta = self._law
        span = arb(self.length)
        columns = force_powers(omega, h, span, DEGREE)
        sizes = [arb(1), arb(1), abs(h), abs(h)]
        waves = [omega, omega, 3 * omega, 3 * omega]
        ends = [
            a * (w * span) ** DEGREE / arb(DEGREE).fac() for a, w in zip(sizes, waves, strict=True)
        ]
        if zeta is not None:
            columns = speed_powers(omega, h, zeta, span, DEGREE)
            ends = [arb(0), arb(0), *(span * end for end in ends)]
        rest = [
            abs(m[-1]).max(abs(m[-2])).max(end).upper()
            for m, end in zip(columns, ends, strict=True)
        ]
        return columns, rest


def search(form: Series, z: FloatArray, level: float, sign: float) -> Bracket | float | None:
    """Search a window in double precision for the first zero of ``sign * (p - level)``, positive before it.

    Returns
    -------
    Bracket, float or None
        The zero; or a place up to which there is none and beyond which nothing is sure; or no zero.
    """
    n = form.degree
    error = float(form.errors @ np.abs(z)) + 2.0**-52 * abs(level)
    todo = [(sign * (form.rounded @ z - level), 0.0, 1.0, error, 0)]
    left, right = halves(n)
    while todo:
        b, low, width, error, depth = todo.pop()
        if b.min() > error:
            continue
        steepest = n * (np.diff(b).max() + 2 * error) / width + (n + 1) * error
        if steepest < 0.0 and b[0] > error and b[-1] < -error:
            return Bracket(low, low + width, -steepest)
        if depth == HALVINGS or b.max() < -error:
            return low
        worse = error + HALVING_ROUNDING * np.abs(b).max()
        half = 0.5 * width
        todo.append((right @ b, low + half, half, worse, depth + 1))
        todo.append((left @ b, low, half, worse, depth + 1))
    return None


def search_exactly(form: Series, z: list[arb], level: arb, sign: int) -> Bracket | None:
    """Do the same in balls.

    Raises
    ------
    Undecided
        If the working precision does not decide.
    """
    n = form.degree
    rest = sum((r * abs(c) for r, c in zip(form.rest, z, strict=True)), arb(0)).upper()
    column = form.exact * arb_mat([[c] for c in z])
    todo = [([sign * (column[j, 0] - level) for j in range(n + 1)], 0.0, 1.0, 0)]
    while todo:
        b, low, width, depth = todo.pop()
        if all(c > rest for c in b):
            continue
        steepest = [n * (q - p) / width + (n + 1) * rest for p, q in pairwise(b)]
        if b[0] > rest and b[-1] < -rest and all(d < 0 for d in steepest):
            return Bracket(low, low + width, -max(float(d.upper()) for d in steepest))
        if depth == FINE_HALVINGS or all(c < -rest for c in b):
            raise Undecided
        first, last = de_casteljau(b)
        half = 0.5 * width
        todo.append((last, low + half, half, depth + 1))
        todo.append((first, low, half, depth + 1))
    return None


def de_casteljau(b: list[Any]) -> tuple[list[Any], list[Any]]:
    """Return the Bernstein coefficients of both halves."""
    first, last = [b[0]], [b[-1]]
    while len(b) > 1:
        b = [(p + q) / 2 for p, q in pairwise(b)]
        first.append(b[0])
        last.append(b[-1])
    return first, last[::-1]
