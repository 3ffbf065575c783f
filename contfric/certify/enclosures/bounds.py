"""Bounds of what a preconditioner leaves over along a chord, in floating point that is rounded upwards.

All numbers are not negative, so that a sum of products is off by a relative error of 1e-13 at most: what a
bound is compared with is less by 1e-9.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat

from contfric.base.arrays import FloatArray
from contfric.certify.enclosures.krawczyk import approximate_inverse
from contfric.models.balls.numbers import Vector, around, column, identity

#: Upper bounds are rounded to floats and multiplied by this.
_UP = 1.0 + 1e-12
#: Iterations for the vector that shows a spectral radius below 1.
_ITERATIONS = 40


def upper(matrix: arb_mat) -> FloatArray:
    """Return upper bounds of the moduli of all entries."""
    shape = (matrix.nrows(), matrix.ncols())
    values = [float(x.abs_upper()) for x in matrix.entries()]
    return np.array(values).reshape(shape) * _UP


@dataclass(frozen=True, eq=False)
class Bounds:
    """What is left over of a Jacobian ``J_0 + s J_1 + J_r``, |s| <= h, by ``(1 - s B) C``.

    Attributes
    ----------
    matrices : J_0, J_1, J_r
    inverse : C, near the inverse of J_0
    turn : B, near C J_1
    rest : bounds of C J_r
    gap : bounds of the entries of ``1 - C(s) J``, for all s
    half : h
    """

    matrices: list[arb_mat]
    inverse: arb_mat
    turn: arb_mat
    rest: FloatArray
    gap: FloatArray
    half: float

    @classmethod
    def of(cls, matrices: list[arb_mat], half: float) -> Bounds | None:
        """Return the bounds; None where the value has no inverse."""
        inverse = approximate_inverse(matrices[0])
        if inverse is None:
            return None
        found = cls._with(matrices, inverse, inverse * matrices[1], half)
        return found if np.all(np.isfinite(found.gap)) else None

    def over(self, matrices: list[arb_mat]) -> Bounds:
        """Return the bounds of another Jacobian for the same C(s): that over a wider box."""
        return self._with(matrices, self.inverse, self.turn, self.half)

    @classmethod
    def _with(cls, matrices: list[arb_mat], inverse: arb_mat, turn: arb_mat, half: float) -> Bounds:
        size = matrices[0].nrows()
        one = identity(size)
        slope, rest = inverse * matrices[1], upper(inverse * matrices[2])
        either = np.eye(size) + half * upper(turn)
        gap = either @ (upper(one - inverse * matrices[0]) + rest)
        gap += half * upper(turn - slope) + half**2 * upper(turn * slope)
        return cls(matrices, inverse, turn, rest, gap, half)

    def moved(self, residual: Vector, change: Vector) -> FloatArray:
        """Return bounds of ``C(s) G(c(s))``: how far the curve is from its chord ``m + s d``."""
        d = column(change)
        wanted = column([*[arb(0)] * (len(change) - 1), arb(1)])
        middle, bend = self.inverse * column(residual), self.turn * d * arb(0.5 * self.half**2)
        total = np.maximum(upper(middle), upper(middle + bend))[:, 0]  # of s^2 in [0, h^2]
        total += self.half * upper(self.inverse * (self.matrices[0] * d - wanted))[:, 0]
        total += self.half * (self.rest @ upper(d)[:, 0])
        return (np.eye(len(change)) + self.half * upper(self.turn)) @ total

    def applied(self, values: Vector, s: arb) -> FloatArray:
        """Return bounds of ``C(s) values`` at one s."""
        found = self.inverse * column(values)
        return upper(found - s * (self.turn * found))[:, 0]

    def solution(self) -> Vector | None:
        """Return balls of T, ``J T = e`` with e the last unit vector, for all s; None if none are found.

        ``T = C(s) e + (1 - C(s) J) T``, and ``C(s) e = c - s B c``.
        """
        size = self.inverse.nrows()
        first = column([self.inverse[a, size - 1] for a in range(size)])
        second = self.turn * first
        known = upper(first)[:, 0] + self.half * upper(second)[:, 0]
        error = supersolution(self.gap, self.gap @ known)
        if error is None:
            return None
        spread = (self.half * upper(second)[:, 0] + error) * (1 + 1e-9)
        return [around(first[k, 0], arb(float(r))) for k, r in enumerate(spread)]


def supersolution(gap: FloatArray, moved: FloatArray) -> FloatArray | None:
    """Return u with ``gap u + moved < u``; None if none is found (a spectral radius of 1 or more)."""
    size = len(moved)
    floor = 1e-30 + 1e-6 * moved
    try:
        found = np.asarray(np.linalg.solve(np.eye(size) - gap, moved + floor), dtype=float)
    except np.linalg.LinAlgError:
        return None
    if not np.all(found > 0) or not np.all((gap @ found + moved) * (1 + 1e-9) < found):
        return None
    return found


def regular_along(matrices: list[arb_mat], half: float) -> bool:
    """Tell whether a Jacobian is regular for all s: the spectral radius of the gap is below 1.

    A positive v with ``gap v < v`` shows that (O. Perron, G. Frobenius; L. Collatz).
    """
    bounds = Bounds.of(matrices, half)
    if bounds is None:
        return False
    v = np.ones(len(bounds.gap))
    for _ in range(_ITERATIONS):
        v = bounds.gap @ v
        v = v / v.max() + 1e-12
    return bool(np.all((bounds.gap @ v) * (1 + 1e-9) < v))
