"""Expressions in many digits (mpmath), straight from their text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath

from contfric.models.description import Description
from contfric.models.evaluate import Evaluator
from contfric.models.grammar import UNARY, Algebra

#: Enough for differences of differences with 15 good digits.
DIGITS = 60

MANY_DIGITS: Algebra[Any] = Algebra(
    number=mpmath.mpf,
    functions={
        **{name: getattr(mpmath, name) for name in UNARY if name not in ("abs", "sign")},
        "abs": abs,
        "sign": mpmath.sign,
    },
    where=lambda d, a, b: a if d > 0 else b,
    divide=lambda a, b: a / b,
    power=lambda base, exponent: base**exponent,
    pi=mpmath.pi,
)


def digits(description: Description) -> Evaluator[Any]:
    """Return a description in many digits; evaluate within ``mpmath.workdps(DIGITS)``."""
    return Evaluator(description, MANY_DIGITS)


def slopes(function: Any, point: list[Any], steps: Sequence[Any]) -> list[list[Any]]:
    """Return the derivatives of a vector function by differences, one row a value; a step a variable."""
    columns = []
    for i, step in enumerate(steps):
        ahead, behind = list(point), list(point)
        ahead[i] += step
        behind[i] -= step
        up, down = function(ahead), function(behind)
        columns.append([(a - b) / (2 * step) for a, b in zip(up, down, strict=True)])
    return [list(row) for row in zip(*columns, strict=True)]
