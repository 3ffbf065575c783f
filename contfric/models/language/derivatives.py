"""Derivatives of formulas. They are those that sympy's ``diff`` returns, which begins anew for each part.

A model has the rate of each observable along each mode, and the gradients of all of these: formulas with many
parts in common. Here what is known of a part is kept, so that it is differentiated once.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import sympy

from contfric.models.language.formulas import Where

#: Parts whose derivatives are kept: those of a model with many modes.
_KEPT = 1 << 16


@lru_cache(maxsize=_KEPT)
def derivative(formula: Any, symbol: Any) -> Any:
    """Return the derivative of a formula by a symbol.

    Examples
    --------
    >>> x = sympy.Symbol("x")
    >>> derivative(sympy.sin(x) ** 2, x)
    2*sin(x)*cos(x)
    """
    if not formula.args:
        return sympy.Integer(int(formula == symbol))
    parts = formula.args
    if isinstance(formula, Where):  # a condition has none
        return Where(parts[0], *(derivative(part, symbol) for part in parts[1:]))
    slopes = [derivative(part, symbol) for part in parts]
    if all(slope == 0 for slope in slopes):
        return sympy.Integer(0)
    if isinstance(formula, sympy.Add):
        return sympy.Add(*slopes)
    if isinstance(formula, sympy.Mul):
        own = (k for k, slope in enumerate(slopes) if slope != 0)
        return sympy.Add(*(sympy.Mul(*parts[:k], slopes[k], *parts[k + 1 :]) for k in own))
    if isinstance(formula, sympy.Pow):
        base, exponent = parts
        return formula * (slopes[1] * sympy.log(base) + slopes[0] * exponent / base)
    if isinstance(formula, sympy.Function):
        return sympy.Add(
            *(formula.fdiff(k + 1) * slope for k, slope in enumerate(slopes) if slope != 0)
        )
    return formula.diff(symbol)
