"""Expressions of a model as functions of Python, for ordinary numbers: tens of times faster than their trees.

The trees are those of :mod:`contfric.models.language.grammar`, which has refused everything but numbers,
names and functions of a list; what is written here consists of these alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from contfric.models.language.grammar import FLOATS, TIME, UNARY, Algebra, Scope, parse

if TYPE_CHECKING:
    from contfric.models.language.names import Names

#: value(params, t, y)
Function = Callable[[Mapping[str, float], float, Sequence[float]], float]

_NAMES = {
    "divide": FLOATS.divide,
    "power": FLOATS.power,
    "pi": FLOATS.pi,
    **{f"f_{name}": FLOATS.functions[name] for name in UNARY},
}


class _Code(str):
    """An expression of Python; sums and products of it are written."""

    __slots__ = ()

    def __add__(self, other: str) -> _Code:
        return _Code(f"({self} + {other})")

    def __sub__(self, other: str) -> _Code:
        return _Code(f"({self} - {other})")

    def __mul__(self, other: object) -> _Code:
        return _Code(f"({self} * {other})")

    def __neg__(self) -> _Code:
        return _Code(f"(-{self})")


_CODE: Algebra[_Code] = Algebra(
    number=lambda text: _Code(repr(float(text))),
    functions={name: lambda x, name=name: _Code(f"f_{name}({x})") for name in UNARY},  # type: ignore[misc]
    where=lambda d, a, b: _Code(f"({a} if {d} > 0 else {b})"),
    divide=lambda a, b: _Code(f"divide({a}, {b})"),
    power=lambda base, exponent: _Code(f"power({base}, {exponent})"),
    pi=_Code("pi"),
)


@dataclass
class _CodeScope(Scope[_Code]):
    """Names as code; what a definition stands for is written once, in a line before the expression."""

    lines: list[str] = field(default_factory=list)

    def _defined(self, name: str) -> _Code:
        code, variable = super()._defined(name), _Code(f"d{len(self.lines)}")
        self.lines.append(f"{variable} = {code}")
        return variable


def function_of(names: Names, text: str) -> Function:
    """Return an expression as a function of the parameters, the time and the state.

    Raises
    ------
    ModelError
        If the text is no expression.
    """
    known = {TIME: _Code("t")}
    known |= {name: _Code(f"p[{name!r}]") for name in names.parameters}
    known |= {name: _Code(f"y[{k}]") for k, name in enumerate(names.states)}
    writer = _CodeScope(_CODE, known, names.trees)
    result = writer.evaluate(parse(text))
    lines = [*writer.lines, f"return {result}"]
    scope: dict[str, Any] = dict(_NAMES)
    exec("def value(p, t, y):\n" + "\n".join(f"    {line}" for line in lines), scope)
    return scope["value"]  # type: ignore[no-any-return]
