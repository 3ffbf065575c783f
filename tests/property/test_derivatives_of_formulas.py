"""Derivatives that are kept by their parts are those that sympy returns, to the letter."""

from __future__ import annotations

import random
from typing import Any

import pytest
import sympy

from contfric.models.language.derivatives import derivative
from contfric.models.language.formulas import FORMULAS

x, y, p = sympy.symbols("x y p")


def grown(rng: random.Random, depth: int) -> Any:
    """Return a random formula of the language."""
    if depth == 0:
        return rng.choice([x, y, p, sympy.Rational(rng.randint(-9, 9), 7), x, y])
    one, other = (grown(rng, depth - 1) for _ in range(2))
    kind = rng.randrange(7)
    if kind == 0:
        return one + other
    if kind == 1:
        return one * other
    if kind == 2:
        return one / (2 + other**2)
    if kind == 3:
        return FORMULAS.functions[rng.choice(["sin", "exp", "abs", "sign", "tanh", "atan"])](one)
    if kind == 4:
        return FORMULAS.where(x - p, one, other)
    if kind == 5:
        return FORMULAS.power(1 + one**2, p)
    return (1 + one**2) ** rng.choice([2, -1, 3])


@pytest.mark.parametrize("seed", range(12))
def test_they_are_those_of_sympy(seed: int) -> None:
    formula = sympy.sympify(grown(random.Random(seed), 4))
    for symbol in (x, y, p):
        first = derivative(formula, symbol)
        assert first == formula.diff(symbol)
        if seed < 4:
            assert derivative(first, x) == first.diff(x)
