"""From formulas to lines of Python for numba: common subexpressions once, and only where wanted.

A block has one section of values, one of derivatives that are always wanted together, and one for each
parameter. A common subexpression is computed in the first section that needs it; what only one
parameter's derivative needs is computed only if that derivative is asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import sympy
from sympy.printing.pycode import PythonCodePrinter

#: Sections of a block: values, derivatives, and then one a parameter (its index).
VALUES, SLOPES = -2, -1


#: Functions of the language that Python does not have, or under another name.
_FUNCTIONS = {"Abs": "abs", "Sign": "sign", "Power": "power", "PowerLog": "power_log"}


class Printer(PythonCodePrinter):  # type: ignore[misc]
    """Prints formulas as scalar Python in floating point."""

    def _print_Float(self, expr: Any) -> str:
        return repr(float(expr))

    _print_Integer = _print_Rational = _print_Float

    def _print_Pow(self, expr: Any, rational: bool = False, sqrt: str = "math.sqrt") -> str:
        base, exponent = expr.base, expr.exp
        inner = f"({self._print(base)})"
        if exponent == sympy.Rational(1, 2):
            return f"math.sqrt({self._print(base)})"
        if exponent == sympy.Rational(-1, 2):
            return f"(1.0 / math.sqrt({self._print(base)}))"
        if exponent.is_Integer:
            power = inner if abs(exponent) == 1 else f"{inner} ** {abs(int(exponent))}"
            return f"({power})" if exponent > 0 else f"(1.0 / {power})"
        return f"({inner} ** ({self._print(exponent)}))"

    def _print_Where(self, expr: Any) -> str:
        d, a, b = (self._print(arg) for arg in expr.args)
        return f"(({a}) if ({d}) > 0.0 else ({b}))"


def printed(expression: Any) -> str:
    """Return a formula as Python."""
    settings = {"fully_qualified_modules": True, "user_functions": _FUNCTIONS}
    return str(Printer(settings).doprint(expression))


@dataclass(frozen=True)
class Output:
    """A formula and the place that it is written to, in a section of its block."""

    section: int
    target: str
    expression: Any


@dataclass
class Lines:
    """Indented lines of code."""

    lines: list[str] = field(default_factory=list)
    depth: int = 0

    def add(self, *texts: str) -> None:
        """Add lines at the present depth."""
        self.lines.extend("    " * self.depth + text if text else "" for text in texts)

    def open(self, head: str) -> None:
        """Add the head of a block and go inside."""
        self.add(head)
        self.depth += 1

    def close(self) -> None:
        """Leave a block."""
        self.depth -= 1

    def __str__(self) -> str:
        return "\n".join(self.lines) + "\n"


def write_block(
    code: Lines,
    outputs: Sequence[Output],
    derivatives: str,
    columns: Sequence[str],
    result: str | None,
) -> None:
    """Write a block that computes outputs, and returns.

    Parameters
    ----------
    derivatives : the array for them: they are not wanted if it is empty
    columns : assignments ``target[...] = 0`` for one parameter that nothing depends on
    result : name of the value to return, or None
    """
    prefix = "c"
    temporaries, reduced = sympy.cse(
        [o.expression for o in outputs], symbols=sympy.numbered_symbols(prefix), order="none"
    )
    places = _places(temporaries, reduced, outputs)
    back = "return" if result is None else f"return {result}"

    def section(wanted: int) -> list[str]:
        lines = [f"{s} = {printed(e)}" for s, e in temporaries if places.get(s) == wanted]
        lines += [
            f"{o.target} = {printed(e)}"
            for o, e in zip(outputs, reduced, strict=True)
            if o.section == wanted
        ]
        return lines

    code.add(*section(VALUES))
    slopes = section(SLOPES)
    own = sorted({o.section for o in outputs if o.section >= 0})
    if not slopes and not own and not columns:
        code.add(back)
        return
    code.open(f"if {derivatives}.shape[0] == 0:")
    code.add(back)
    code.close()
    code.add(*slopes)
    if columns:
        code.open("for j in range(which.shape[0]):")
        _write_parameters(code, own, section, columns)
        code.close()
    code.add(back)


def _write_parameters(code: Lines, own: list[int], section: Any, columns: Sequence[str]) -> None:
    if not own:
        code.add(*columns)
        return
    for index, parameter in enumerate(own):
        code.open(f"{'if' if index == 0 else 'elif'} which[j] == {parameter}:")
        code.add(*section(parameter))
        code.close()
    code.open("else:")
    code.add(*columns)
    code.close()


def _places(
    temporaries: Sequence[tuple[Any, Any]], reduced: Sequence[Any], outputs: Sequence[Output]
) -> dict[Any, int]:
    """Return the section in which each temporary is computed: the first that all its users reach."""
    users: dict[Any, set[int]] = {symbol: set() for symbol, _ in temporaries}

    def note(expression: Any, sections: Iterable[int]) -> None:
        for symbol in expression.free_symbols:
            if symbol in users:
                users[symbol].update(sections)

    for output, expression in zip(outputs, reduced, strict=True):
        note(expression, {output.section})
    for symbol, expression in reversed(temporaries):
        note(expression, users[symbol])
    return {
        symbol: VALUES
        if VALUES in sections
        else SLOPES
        if SLOPES in sections or len(sections) > 1
        else next(iter(sections))
        for symbol, sections in users.items()
        if sections  # sympy.cse may name what nothing uses
    }
