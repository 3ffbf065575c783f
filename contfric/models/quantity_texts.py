r"""The language of quantities: expressions in which a functional of the orbit is a number.

``mean(x)``, ``max(u)``, ``integral(S*abs(v))`` and the others of :data:`FUNCTIONALS` turn a function of
time along the orbit into a number; outside of them stand parameters, other quantities, and the operators
and functions of a model's expressions (:mod:`contfric.models.grammar`): ``(max(x) - min(x))/2``.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from typing import Any

from contfric.errors import ModelError
from contfric.models.grammar import names_in, number_of, parse

#: Names that mean the same for every model; what they are is in :mod:`contfric.quantities.registry`.
BUNDLED = (
    *("x_max", "x_min", "stops", "psi", "period", "multiplier", "sticking", "impact_velocity"),
)
#: The one of them that is a list of numbers.
LIST = "stops"
#: Functionals of one expression, and those of an expression and the number of a harmonic.
PLAIN = ("integral", "max", "mean", "min", "rms")
HARMONIC = ("amplitude", "phase")
FUNCTIONALS = (*PLAIN, *HARMONIC)


@dataclass(frozen=True, eq=False)
class Functional:
    """One functional of a quantity.

    Attributes
    ----------
    kind : its name, one of :data:`FUNCTIONALS`
    tree, text : the expression that it is of
    harmonic : the number of a harmonic, in frequencies of the excitation; 0 of the others
    """

    kind: str
    tree: ast.expr
    text: str
    harmonic: float = 0.0


@dataclass(frozen=True, eq=False)
class Parsed:
    """A quantity that has been read: its tree, in which functionals are names, and those functionals."""

    tree: ast.expr
    functionals: dict[str, Functional]

    @property
    def names(self) -> set[str]:
        """Names outside of functionals: parameters and other quantities."""
        return names_in(self.tree) - set(self.functionals)


def read(text: str) -> Parsed:
    """Read the text of a quantity; names are looked up later.

    Raises
    ------
    ModelError
        If it is no expression of the language.

    Examples
    --------
    >>> found = read("max(x) - S*period")
    >>> sorted(found.names), [f.text for f in found.functionals.values()]
    (['S', 'period'], ['x'])
    """
    try:
        tree = ast.parse(" ".join(str(text).split()), mode="eval").body
        taking = _Taking({})
        outer = ast.unparse(taking.visit(tree))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        parse(text)  # which says what is wrong with it
        raise
    return Parsed(parse(outer), taking.found)


class _Taking(ast.NodeTransformer):
    """Takes functionals out of a tree, and leaves a name in the place of each."""

    def __init__(self, found: dict[str, Functional]) -> None:
        self.found = found

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Take a functional out; other calls are looked through."""
        kind = node.func.id if isinstance(node.func, ast.Name) else ""
        several = kind in ("max", "min") and len(node.args) != 1
        if kind not in FUNCTIONALS or several:
            return self.generic_visit(node)
        name = f"_{len(self.found)}"
        self.found[name] = _functional(kind, node)
        return ast.copy_location(ast.Name(name, ast.Load()), node)


def _functional(kind: str, node: ast.Call) -> Functional:
    wanted = 2 if kind in HARMONIC else 1
    example = f"{kind}(x, 3)" if wanted == 2 else f"{kind}(x)"
    plain = not node.keywords and not any(isinstance(a, ast.Starred) for a in node.args)
    if len(node.args) != wanted or not plain:
        raise ModelError(f"{kind}() is such as {example}, got {ast.unparse(node)}")
    inside: list[Any] = [n for n in ast.walk(node.args[0]) if isinstance(n, ast.Call)]
    for call in inside:
        name = call.func.id if isinstance(call.func, ast.Name) else ""
        if name in FUNCTIONALS and not (name in ("max", "min") and len(call.args) > 1):
            raise ModelError(
                f"in {ast.unparse(node)}: a functional cannot stand inside of another one; combine "
                "their numbers, such as sqrt(rms(x)**2 - mean(x)**2)"
            )
    text = ast.unparse(node.args[0])
    harmonic = _harmonic(node) if kind in HARMONIC else 0.0
    return Functional(kind, parse(text), text, harmonic)


def _harmonic(node: ast.Call) -> float:
    given = ast.unparse(node.args[1])
    try:
        number = number_of(given, {})
    except ModelError:
        number = -1.0
    if not 0.0 < number < 1e6:  # beyond it no integral resolves the oscillation
        raise ModelError(
            f"in {ast.unparse(node)}: the harmonic is a positive number, such as 3 or 1/2, got {given}"
        )
    return number
