"""Numbers that carry their derivatives (forward mode), in arrays: expressions are evaluated in them.

A :class:`Dual` holds k values and their derivatives in D directions. The algebra has the functions of
:mod:`contfric.models.language.grammar`; every argument of ``abs``, ``sign`` and ``where`` is noted, as an
expression has its kinks and jumps where such an argument changes its sign.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Union

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.language.grammar import Algebra

Number = Union["Dual", float]


@dataclass(frozen=True, eq=False)
class Dual:
    """Values, shape (k,), with derivatives in D directions, shape (k, D).

    Examples
    --------
    >>> x = Dual(np.array([3.0]), np.array([[1.0]]))
    >>> (x * x).slopes
    array([[6.]])
    """

    values: FloatArray
    slopes: FloatArray

    #: numpy leaves mixed operations to this class
    __array_ufunc__ = None

    def __neg__(self) -> Dual:
        return Dual(-self.values, -self.slopes)

    def __add__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.values + other.values, self.slopes + other.slopes)
        return Dual(self.values + other, self.slopes)

    def __sub__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.values - other.values, self.slopes - other.slopes)
        return Dual(self.values - other, self.slopes)

    def __mul__(self, other: Number) -> Dual:
        if isinstance(other, Dual):
            slopes = _times(self.values, other.slopes) + _times(other.values, self.slopes)
            return Dual(self.values * other.values, slopes)
        return Dual(self.values * other, self.slopes * other)

    def __rsub__(self, other: float) -> Dual:
        return Dual(other - self.values, -self.slopes)

    __radd__, __rmul__ = __add__, __mul__

    def __getitem__(self, rows: Any) -> Dual:
        return Dual(self.values[rows], self.slopes[rows])


def _times(values: FloatArray, slopes: FloatArray) -> FloatArray:
    """Multiply every row of slopes by its value; a slope that is 0 stays 0, by infinity too."""
    return np.where(slopes == 0.0, 0.0, values[:, None] * slopes)


def constant(value: float, like: Dual) -> Dual:
    """Return one number as a dual of the shape of another."""
    return Dual(np.full(like.values.shape, float(value)), np.zeros(like.slopes.shape))


def divide(a: Number, b: Number) -> Number:
    """Return a / b; not finite where b is zero."""
    if isinstance(b, Dual):
        inverse = 1.0 / b.values
        return a * Dual(inverse, _times(-inverse * inverse, b.slopes))
    return a * (1.0 / b) if b != 0.0 else a * math.nan


def power(a: Number, e: Number) -> Number:
    """Return ``a**e``; nan where it has no real value."""
    if isinstance(e, Dual):
        base = a if isinstance(a, Dual) else constant(a, e)
        values = base.values**e.values
        by_base = np.where(e.values == 0.0, 0.0, e.values * base.values ** (e.values - 1.0))
        by_exponent = np.where(base.values > 0.0, values * np.log(np.abs(base.values)), 0.0)
        return Dual(values, _times(by_base, base.slopes) + _times(by_exponent, e.slopes))
    if isinstance(a, Dual):
        rate = e * a.values ** (e - 1.0) if e != 0.0 else np.zeros_like(a.values)
        return Dual(a.values**e, _times(rate, a.slopes))
    return float(np.float64(a) ** e)


#: Functions of one argument, each with its derivative.
_SMOOTH: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
    "sin": (np.sin, np.cos),
    "cos": (np.cos, lambda x: -np.sin(x)),
    "tan": (np.tan, lambda x: 1.0 / np.cos(x) ** 2),
    "asin": (np.arcsin, lambda x: 1.0 / np.sqrt(1.0 - x * x)),
    "acos": (np.arccos, lambda x: -1.0 / np.sqrt(1.0 - x * x)),
    "atan": (np.arctan, lambda x: 1.0 / (1.0 + x * x)),
    "sinh": (np.sinh, np.cosh),
    "cosh": (np.cosh, np.sinh),
    "tanh": (np.tanh, lambda x: 1.0 / np.cosh(x) ** 2),
    "exp": (np.exp, np.exp),
    "log": (np.log, lambda x: 1.0 / x),
    "sqrt": (np.sqrt, lambda x: 0.5 / np.sqrt(x)),
    "abs": (np.abs, np.sign),
    "sign": (np.sign, np.zeros_like),
}


def apply(name: str, x: Number) -> Number:
    """Return a function of one argument.

    Examples
    --------
    >>> apply("exp", Dual(np.array([0.0]), np.array([[2.0]]))).slopes
    array([[2.]])
    """
    value, rate = _SMOOTH[name]
    if isinstance(x, Dual):
        return Dual(value(x.values), _times(rate(x.values), x.slopes))
    return float(value(np.float64(x)))


def _applied(name: str) -> Callable[[Number], Number]:
    return lambda x: apply(name, x)


_APPLIED = {name: _applied(name) for name in _SMOOTH}


@dataclass(eq=False)
class Kinks:
    """The arguments of ``abs``, ``sign`` and ``where`` that an evaluation met, in its order."""

    arguments: list[Dual] = field(default_factory=list)

    def noted(self, x: Number) -> Number:
        """Note an argument."""
        if isinstance(x, Dual):
            self.arguments.append(x)
        return x

    def where(self, d: Number, a: Number, b: Number) -> Number:
        """Return a where d > 0, else b."""
        self.noted(d)
        if not isinstance(d, Dual):
            return a if d > 0.0 else b
        yes = a if isinstance(a, Dual) else constant(a, d)
        no = b if isinstance(b, Dual) else constant(b, d)
        positive = d.values > 0.0
        return Dual(
            np.where(positive, yes.values, no.values),
            np.where(positive[:, None], yes.slopes, no.slopes),
        )

    def algebra(self) -> Algebra[Any]:
        """Return the algebra of duals that notes kinks here."""
        kinked = {name: self._noting(name) for name in ("abs", "sign")}
        return Algebra(float, _APPLIED | kinked, self.where, divide, power, math.pi)

    def _noting(self, name: str) -> Callable[[Number], Number]:
        return lambda x: apply(name, self.noted(x))
