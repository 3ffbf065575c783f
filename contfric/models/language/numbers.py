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


#: Functions of the language of expressions that numpy does not have
#: (:mod:`contfric.models.language.formulas`).
_OWN = {
    "Sign": np.sign,
    "Abs": np.abs,
    "Where": lambda d, a, b: a if d > 0 else b,
    "Power": _power,
    "PowerLog": _power_log,
}


def function_of_numbers(arguments: Sequence[Any], formulas: Any) -> Callable[..., np.ndarray]:
    """Return formulas as a function of numbers whose values are an array; nan or inf where they have none.

    ``arguments`` are symbols or lists of them.

    Examples
    --------
    >>> x = sympy.Symbol("x")
    >>> function_of_numbers([x], [x**2, sympy.cos(x)])(0.0).tolist()
    [0.0, 1.0]
    """
    evaluate = sympy.lambdify(list(arguments), formulas, modules=[_OWN, "numpy"], cse=True)

    def values(*numbers: Any) -> np.ndarray:
        with np.errstate(all="ignore"):
            found = np.array(evaluate(*numbers))
        return found.astype(np.result_type(found, np.float64), copy=False)

    return values
