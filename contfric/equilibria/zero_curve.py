r"""A curve of zeros ``g(y, p) = 0`` of one region in one parameter, by pseudo-arclength.

In scaled unknowns ``x = (y / s, p / w)`` (s the natural sizes, w the width of the range) the curve has at
each regular point one unit tangent, the null vector of the n by n + 1 Jacobian J. A step goes along it and
comes back in the plane normal to it by Newton's method on

.. math:: \begin{pmatrix} J \\ t^T \end{pmatrix} \delta = -\begin{pmatrix} g \\ t^T (x - \hat x) \end{pmatrix}

(E. L. Allgower, K. Georg, Introduction to Numerical Continuation Methods, SIAM 2003, chapters 2 and 8). The
bordered matrix is regular at folds; at a simple branch point its determinant changes sign.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, with_entries
from contfric.base.interrupts import whole
from contfric.equilibria.regions import ModeRegion

#: Newton's method in the normal plane: quadratic, from a predictor that is near.
_STEPS, _SHORT, _CONVERGED = 12, 1e-14, 1e-10
#: Share of a step by which an event is located: rounding of the arclength.
_LOCATED = 1e-15
#: Share of a step around a branch point within which Newton's method may fail: far above its rounding.
_SINGULAR = 1e-4


class _LostError(ArithmeticError):
    """Newton's method finds no point at a share of a step."""


class CurvePoint(NamedTuple):
    """A point of a curve: the scaled unknowns and the unit tangent, shapes (n + 1,)."""

    x: FloatArray
    tangent: FloatArray


@dataclass(frozen=True, eq=False)
class Arc:
    """The equations of a curve of zeros.

    Parameters
    ----------
    vector : all parameters, of which one varies
    active : its number
    scale : natural size of each state, shape (n,)
    width : that of the parameter
    """

    region: ModeRegion
    vector: FloatArray
    active: int
    scale: FloatArray
    width: float

    def state(self, x: FloatArray) -> FloatArray:
        """Return the state of a point."""
        return np.asarray(x[:-1] * self.scale)

    def parameter(self, x: FloatArray) -> float:
        """Return the parameter of a point."""
        return float(x[-1] * self.width)

    def parameters(self, x: FloatArray) -> FloatArray:
        """Return all parameters of a point."""
        return with_entries(self.vector, self.active, self.parameter(x))

    def at(self, point: CurvePoint) -> tuple[FloatArray, FloatArray]:
        """Return state and parameters of a point of the curve."""
        return self.state(point.x), self.parameters(point.x)

    def unknowns(self, y: FloatArray, value: float) -> FloatArray:
        """Return the scaled unknowns of a state and a parameter."""
        return np.append(y / self.scale, value / self.width)

    def residual(self, x: FloatArray) -> FloatArray:
        """Return the field at a point, relative to the sizes of the states."""
        return self.region.fields.value(self.state(x), self.parameters(x)) / self.scale

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return its derivatives by the unknowns, shape (n, n + 1)."""
        y, p, fields = self.state(x), self.parameters(x), self.region.fields
        by_state = fields.jacobian(y, p) * self.scale
        by_parameter = fields.slope(y, p, self.active) * self.width
        return np.asarray(np.column_stack([by_state, by_parameter]) / self.scale[:, None])

    def corrected(self, guess: FloatArray, normal: FloatArray) -> CurvePoint | None:
        """Return the point in the plane through a guess normal to a direction; None if none is near."""
        x, length = guess.copy(), np.inf
        for _ in range(_STEPS):
            matrix = np.vstack([self.jacobian(x), normal])
            side = np.append(self.residual(x), normal @ (x - guess))
            if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(side))):
                return None
            try:
                step = np.linalg.solve(matrix, -side)
            except np.linalg.LinAlgError:
                return None
            x, before, length = x + step, length, float(np.max(np.abs(step)))
            size = 1.0 + float(np.max(np.abs(x)))
            if length <= _SHORT * size or (length < _CONVERGED * size and length >= 0.5 * before):
                break
        else:
            if length > _CONVERGED:
                return None
        tangent = self.tangent(x, normal)
        return None if tangent is None else CurvePoint(x, tangent)

    def tangent(self, x: FloatArray, along: FloatArray) -> FloatArray | None:
        """Return the unit tangent at a point, on the side of a direction."""
        matrix = np.vstack([self.jacobian(x), along])
        right = np.zeros(len(x))
        right[-1] = 1.0
        try:
            found = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            return None
        size = float(np.linalg.norm(found))
        return np.asarray(found / size) if np.isfinite(size) else None

    def start(self, y: FloatArray, value: float, sign: float) -> CurvePoint | None:
        """Return the point at a parameter, with the tangent along which it grows (sign 1) or falls."""
        upwards = np.zeros(len(y) + 1)
        upwards[-1] = sign
        return self.corrected(self.unknowns(y, value), upwards)

    def orientation(self, point: CurvePoint) -> float:
        """Return the determinant of the bordered matrix as a geometric mean; 0 at a branch point."""
        sign, size = np.linalg.slogdet(np.vstack([self.jacobian(point.x), point.tangent]))
        return float(sign * np.exp(size / len(point.x))) if np.isfinite(size) else 0.0

    def located(
        self, before: CurvePoint, after: CurvePoint, test: Callable[[CurvePoint], float]
    ) -> CurvePoint | None:
        """Return the point between two at which a test function vanishes; None if the curve is lost there.

        At a branch point the equations are singular: the nearest point at which they are not stands for it.
        """
        brentq = whole("scipy.optimize").brentq

        chord = after.x - before.x
        length = float(np.linalg.norm(chord))
        normal = chord / length
        known: list[tuple[float, float, CurvePoint]] = []

        def value(share: float) -> float:
            point = self.corrected(before.x + share * chord, normal)
            if point is None:
                raise _LostError(share)
            known.append((share, test(point), point))
            return known[-1][1]

        try:
            brentq(value, 0.0, 1.0, xtol=_LOCATED, rtol=4.0 * _LOCATED)
        except _LostError as lost:
            if min((abs(share - lost.args[0]) for share, *_ in known), default=1.0) > _SINGULAR:
                return None
        except ValueError:  # no change of sign: rounding at an end
            return None
        return min(known, key=lambda item: abs(item[1]))[2]
