"""Expressions of a model as functions of Python, for ordinary numbers: tens of times faster than their trees.

The trees are those of :mod:`contfric.models.language.grammar`, which has refused everything but numbers,
names and functions of a list; what is written here consists of these alone.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from contfric.models.language.grammar import FLOATS, PI, TIME, UNARY, parse

if TYPE_CHECKING:
    from contfric.models.language.names import Names

#: value(params, t, y)
Function = Callable[[Mapping[str, float], float, Sequence[float]], float]

_NAMES = {
    "divide": FLOATS.divide,
    "power": FLOATS.power,
    "pi": FLOATS.pi,
    "choose": FLOATS.where,
    **{f"f_{name}": FLOATS.functions[name] for name in UNARY},
}
_SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*"}


def function_of(names: Names, text: str) -> Function:
    """Return an expression as a function of the parameters, the time and the state.

    Raises
    ------
    ModelError
        If the text is no expression.
    """
    writer = _ExpressionWriter(names)
    result = writer.text(parse(text))
    lines = [*writer.lines, f"return {result}"]
    scope: dict[str, Any] = dict(_NAMES)
    exec("def value(p, t, y):\n" + "\n".join(f"    {line}" for line in lines), scope)
    return scope["value"]  # type: ignore[no-any-return]


class _ExpressionWriter:
    """Writes an expression, and the named parts that it needs before it."""

    def __init__(self, names: Names) -> None:
        self._names, self._parts = names, names.parts
        self._written: dict[str, str] = {}
        self.lines: list[str] = []

    def text(self, node: ast.expr) -> str:
        """Return the code of a tree."""
        if isinstance(node, ast.Constant):
            return repr(float(repr(node.value)))
        if isinstance(node, ast.Name):
            return self._name(node.id)
        if isinstance(node, ast.UnaryOp):
            inner = self.text(node.operand)
            return f"(-{inner})" if isinstance(node.op, ast.USub) else inner
        if isinstance(node, ast.BinOp):
            left, right = self.text(node.left), self.text(node.right)
            if type(node.op) in _SIGNS:
                return f"({left} {_SIGNS[type(node.op)]} {right})"
            return f"{'divide' if isinstance(node.op, ast.Div) else 'power'}({left}, {right})"
        assert isinstance(node, ast.Call)
        assert isinstance(node.func, ast.Name)
        return self._call(node.func.id, node.args)

    def _name(self, name: str) -> str:
        if name in (TIME, PI):
            return "t" if name == TIME else "pi"
        if name in self._names.states:
            return f"y[{self._names.states.index(name)}]"
        if name in self._names.parameters:
            return f"p[{name!r}]"
        if name not in self._written:
            code = self.text(parse(self._parts[name]))
            self._written[name] = f"d{len(self._written)}"
            self.lines.append(f"{self._written[name]} = {code}")
        return self._written[name]

    def _call(self, name: str, arguments: list[ast.expr]) -> str:
        if name == "where":
            yes, no = self.text(arguments[1]), self.text(arguments[2])
            return f"({yes} if {self._condition(arguments[0])} else {no})"
        values = [self.text(argument) for argument in arguments]
        if name in UNARY:
            return f"f_{name}({values[0]})"
        found = values[0]
        for value in values[1:]:
            first, second = (found, value) if name == "min" else (value, found)
            found = f"choose({value} - {found}, {first}, {second})"
        return found

    def _condition(self, node: ast.expr) -> str:
        """Return a condition; ``a >= b`` is ``not b > a``: what is no number counts as in the trees."""
        if isinstance(node, ast.UnaryOp):
            return f"(not {self._condition(node.operand)})"
        if isinstance(node, ast.BoolOp):
            joint = " or " if isinstance(node.op, ast.Or) else " and "
            return "(" + joint.join(self._condition(part) for part in node.values) + ")"
        assert isinstance(node, ast.Compare)
        sides = [self.text(side) for side in (node.left, *node.comparators)]
        pairs = zip(node.ops, sides, sides[1:], strict=False)
        return "(" + " and ".join(_compared(op, a, b) for op, a, b in pairs) + ")"


def _compared(operator: ast.cmpop, a: str, b: str) -> str:
    if isinstance(operator, ast.Gt):
        return f"{a} - {b} > 0"
    if isinstance(operator, ast.Lt):
        return f"{b} - {a} > 0"
    if isinstance(operator, ast.GtE):
        return f"not {b} - {a} > 0"
    return f"not {a} - {b} > 0"
