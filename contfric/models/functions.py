"""Functions for the formulas of a model class; each takes and returns formulas of sympy.

>>> from contfric.models.functions import as_text, cos, where
>>> import sympy
>>> x = sympy.Symbol("x")
>>> as_text(where(x > 1, cos(x), 0.1 * x))
'where(x > 1, cos(x), 0.1*x)'
"""

from __future__ import annotations

from typing import Any

import sympy
from sympy import acos, asin, atan, cos, cosh, exp, log, pi, sign, sin, sinh, sqrt, tan, tanh
from sympy.printing.str import StrPrinter

__all__ = [
    "acos",
    "as_text",
    "asin",
    "atan",
    "cos",
    "cosh",
    "exp",
    "log",
    "maximum",
    "minimum",
    "mod",
    "pi",
    "sign",
    "sin",
    "sinh",
    "sqrt",
    "tan",
    "tanh",
    "where",
]


def where(condition: Any, yes: Any, no: Any) -> Any:
    """Return ``yes`` where a condition such as ``x > 0`` holds, else ``no``."""
    return sympy.Piecewise((yes, condition), (no, True), evaluate=False)


def minimum(*values: Any) -> Any:
    """Return the least of some formulas."""
    return sympy.Min(*values, evaluate=False)


def mod(time: Any, period: Any) -> Any:
    """Return the time since the last tick of a clock: ``mod(t, T)`` with the period of the model."""
    return sympy.Function("mod")(time, period)


def maximum(*values: Any) -> Any:
    """Return the greatest of some formulas."""
    return sympy.Max(*values, evaluate=False)


class _Printer(StrPrinter):  # type: ignore[misc]
    """Prints formulas in the language of a model's expressions."""

    def _print_Float(self, expr: Any) -> str:
        return repr(float(expr))

    def _named(self, expr: Any) -> str:
        return f"{type(expr).__name__.lower()}({self.stringify(expr.args, ', ')})"

    _print_Abs = _print_Sign = _print_Min = _print_Max = _named

    def _print_Exp1(self, expr: Any) -> str:
        return "exp(1)"

    def _print_Piecewise(self, expr: Any) -> str:
        *cases, (last, _) = expr.args
        text: str = self._print(last)
        for value, condition in reversed(cases):
            text = f"where({self._print(condition)}, {self._print(value)}, {text})"
        return text

    def _print_Where(self, expr: Any) -> str:
        apart, yes, no = (self._print(part) for part in expr.args)
        return f"where({apart} > 0, {yes}, {no})"

    def _print_Power(self, expr: Any) -> str:
        base, exponent = (self._print(part) for part in expr.args)
        return f"({base})**({exponent})"

    def _print_And(self, expr: Any) -> str:
        return " and ".join(f"({self._print(a)})" for a in expr.args)

    def _print_Or(self, expr: Any) -> str:
        return " or ".join(f"({self._print(a)})" for a in expr.args)

    def _print_Not(self, expr: Any) -> str:
        return f"not ({self._print(expr.args[0])})"


def as_text(value: Any) -> str:
    """Return a formula as an expression of a model file."""
    text: str = _Printer({"order": "none"}).doprint(sympy.sympify(value))
    return text
