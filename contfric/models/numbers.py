"""Formulas as functions of numbers, for Python callers: values at single states, real or complex.

This module imports sympy, and is loaded where such values are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import sympy


def _power(base: Any, exponent: Any) -> Any:
    return np.sign(base) * np.abs(base) ** exponent


def _power_log(base: Any, exponent: Any) -> Any:
    return 0.0 if base == 0.0 else _power(base, exponent) * np.log(np.abs(base))


#: Functions of the language of expressions that numpy does not have (:mod:`contfric.models.formulas`).
_OWN = {
    "Sign": np.sign,
    "Abs": np.abs,
    "Where": lambda d, a, b: a if d > 0 else b,
    "Power": _power,
    "PowerLog": _power_log,
}


def function_of_numbers(arguments: Sequence[Any], formulas: Any) -> Callable[..., Any]:
    """Return formulas as a function of numbers; ``arguments`` are symbols or lists of them.

    Examples
    --------
    >>> x = sympy.Symbol("x")
    >>> [float(value) for value in function_of_numbers([x], [x**2, sympy.cos(x)])(0.0)]
    [0.0, 1.0]
    """
    found: Callable[..., Any] = sympy.lambdify(
        list(arguments), formulas, modules=[_OWN, "numpy"], cse=True
    )
    return found
