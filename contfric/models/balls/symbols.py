"""Formulas of sympy in balls.

Numbers are taken as they are stored: a decimal of a model's file is the binary number next to it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import sympy
from flint import arb


class NotEnclosedError(Exception):
    """A formula has a function that is not enclosed; the message names it."""


_FUNCTIONS: dict[str, Callable[..., arb]] = {
    name: lambda x, name=name: getattr(x, name)()
    for name in ("sin", "cos", "tan", "exp", "log", "sinh", "cosh", "tanh", "atan", "asin", "acos")
}


def in_balls(e: Any, values: Mapping[Any, arb]) -> arb:
    """Return a formula's value in a ball.

    Parameters
    ----------
    e : formula of sympy
    values : ball of each symbol

    Raises
    ------
    NotEnclosedError
        If it has a function that is not enclosed.

    Examples
    --------
    >>> import sympy
    >>> in_balls(sympy.Rational(1, 2) + sympy.cos(0), {}) == 1.5
    True
    """
    if e in values:
        return values[e]
    if e.is_Rational:
        return arb(int(e.p)) / int(e.q)
    if e.is_Float:
        return arb(float(e))
    if e is sympy.pi:
        return arb.pi()
    if e is sympy.E:
        return arb(1).exp()
    if isinstance(e, (sympy.Add, sympy.Mul)):
        found = [in_balls(part, values) for part in e.args]
        total = found[0]
        for part in found[1:]:
            total = total + part if isinstance(e, sympy.Add) else total * part
        return total
    if isinstance(e, sympy.Pow):
        return _power(in_balls(e.base, values), e.exp)
    name = type(e).__name__
    if name == "Abs":
        return abs(in_balls(e.args[0], values))
    if name == "Sign":
        return _sign(in_balls(e.args[0], values))
    if name in _FUNCTIONS and len(e.args) == 1:
        return _FUNCTIONS[name](in_balls(e.args[0], values))
    raise NotEnclosedError(name)


def _power(base: arb, exponent: Any) -> arb:
    if exponent.is_Integer:
        return base ** int(exponent)
    if exponent == sympy.Rational(1, 2):
        return base.sqrt()
    if exponent == sympy.Rational(-1, 2):
        return base.rsqrt()
    raise NotEnclosedError(f"the power {exponent}")


def _sign(x: arb) -> arb:
    if x > 0:
        return arb(1)
    if x < 0:
        return arb(-1)
    return arb(0) if x.is_zero() else arb(0, 1)
