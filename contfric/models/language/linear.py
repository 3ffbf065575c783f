"""Expressions that are linear in names, as the constraints of parameters are."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence

from contfric.models.language.grammar import FLOATS, Scope

#: Rounding of a linear expression, relative to 1 + its value.
_SAME = 1e-9


def linear_form(tree: ast.expr, names: Sequence[str]) -> tuple[float, dict[str, float]] | None:
    """Return the constant and the factor of each name in an expression; None if it is not linear in them.

    Raises
    ------
    ModelError
        For another name.

    Examples
    --------
    >>> from contfric.models.language.grammar import parse
    >>> linear_form(parse("1 + 2*a - b"), ["a", "b"])
    (1.0, {'a': 2.0, 'b': -1.0})
    >>> linear_form(parse("a*b"), ["a", "b"]) is None
    True
    """

    def value(at: Mapping[str, float]) -> float:
        return Scope(FLOATS, dict(at)).evaluate(tree)

    try:
        zero = dict.fromkeys(names, 0.0)
        constant = value(zero)
        slopes = {name: value({**zero, name: 1.0}) - constant for name in names}
        for stretch in (0.5, 2.0, -3.0):
            point = {name: stretch * (1.0 + i) for i, name in enumerate(names)}
            line = constant + sum(slopes[name] * at for name, at in point.items())
            if not abs(value(point) - line) <= _SAME * (1.0 + abs(line)):
                return None
    except ArithmeticError:
        return None
    return constant, slopes
