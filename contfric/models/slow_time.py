"""Time outside of ``mod(t, T)`` in a model with a clock: it begins again with the clock, or is refused.

A model with a clock knows the time since its last tick and no other. ``sin(2*pi*t/T)`` is the same with
either; ``sin(2*pi*t/(16*T))`` would begin again after a sixteenth of its period, and nothing would say so.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Mapping

import numpy as np

from contfric.base.yaml_lines import Address
from contfric.errors import ModelError
from contfric.models.entries import EntryError
from contfric.models.grammar import FLOATS, PERIOD, TIME, Scope, names_in, parse

#: Values of time and states at which an expression is compared with itself a period later.
_SAMPLES = 6
#: Rounding in an identity of two values.
_SAME = 1e-9


def check_time(
    expressions: Iterable[tuple[Address, str]],
    define: Mapping[str, str],
    parameters: Mapping[str, float],
    period: float,
    is_clock: Callable[[ast.AST], bool],
) -> None:
    """Check that time outside of clocks makes no difference after a period.

    Parameters
    ----------
    expressions : address and text of what is evaluated as the solution goes on
    define : texts of the definitions
    is_clock : tells a clock, ``mod(t, T)``; what it shows is the same after a period

    Raises
    ------
    EntryError
        Where an expression is another one after a period.
    """

    def read(text: str) -> ast.expr | None:
        try:
            tree = ast.parse(text.strip(), mode="eval")
            return parse(ast.unparse(_Stopped(is_clock).visit(tree)))
        except (ModelError, SyntaxError, ValueError, RecursionError, MemoryError):
            return None  # whoever reads the expression says what is wrong

    trees = {name: tree for name, text in define.items() if (tree := read(text)) is not None}
    timed = {name for name, tree in trees.items() if names_in(tree) & {TIME}}
    while grown := {n for n, tree in trees.items() if names_in(tree) & timed} - timed:
        timed |= grown
    for address, text in expressions:
        tree = read(text)
        if tree is None or not names_in(tree) & {TIME, *timed}:
            continue
        if _changes(tree, trees, dict(parameters), period):
            raise EntryError(
                address,
                f"'{text}' is not the same a period of {period:g} later, and a model with a clock has no "
                "time but that since the last tick. What is slower than the clock is a state of its own, "
                "such as a sine: states s, c with rates s: w*c, c: -w*s",
            )


class _Stopped(ast.NodeTransformer):
    """Puts a number in the place of a clock."""

    def __init__(self, is_clock: Callable[[ast.AST], bool]) -> None:
        self.is_clock = is_clock

    def visit_Call(self, node: ast.Call) -> ast.AST:
        return ast.Constant(0.5) if self.is_clock(node) else self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        return ast.Constant(0.5) if self.is_clock(node) else self.generic_visit(node)


def _changes(
    tree: ast.expr, define: Mapping[str, ast.expr], parameters: dict[str, float], period: float
) -> bool:
    """Tell whether an expression has another value a period later, at sampled times and states."""
    rng = np.random.default_rng(1)
    others = set().union(*map(names_in, (tree, *define.values())))
    others -= {*parameters, *define, TIME}
    for _ in range(_SAMPLES):
        values = {**parameters, **{name: float(rng.uniform(0.1, 1.0)) for name in sorted(others)}}
        values[PERIOD], time = period, float(rng.uniform(0.0, period))
        try:
            now, later = (
                float(Scope(FLOATS, {**values, TIME: t}, define).evaluate(tree))
                for t in (time, time + period)
            )
        except (ModelError, ArithmeticError, ValueError):
            continue  # no value at these states
        if abs(later - now) > _SAME * (1.0 + abs(now)):
            return True
    return False
