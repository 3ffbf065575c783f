r"""The language of quantities: expressions in which a functional of the orbit is a number.

``mean(x)``, ``max(u)``, ``integral(S*abs(v))`` and the others of :data:`FUNCTIONALS` turn a function of
time along the orbit into a number; outside of them stand parameters, other quantities, and the operators
and functions of a model's expressions (:mod:`contfric.models.language.grammar`): ``(max(x) - min(x))/2``.
``work(brake)`` is what a contact of a structure dissipates; ``force(brake)``, inside of the other
functionals, is what it carries.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

from contfric.errors import ModelError, did_you_mean
from contfric.models.language.grammar import FUNCTIONS, names_in, number_of, parse, unknown_function

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
#: What a contact dissipates, a functional of its name; and what it carries, which varies along an orbit.
WORK, FORCE = "work", "force"
#: The name that stands for the force of a contact inside of an expression.
FORCE_OF = "_force_"


@dataclass(frozen=True, eq=False)
class Functional:
    """One functional of a quantity.

    Attributes
    ----------
    kind : its name, one of :data:`FUNCTIONALS`, or ``work``
    tree, text : the expression that it is of; in the tree the forces of contacts are names
    contacts : whose forces or work it measures
    harmonic : the number of a harmonic, in frequencies of the excitation; 0 of the others
    """

    kind: str
    tree: ast.expr
    text: str
    harmonic: float = 0.0
    contacts: frozenset[str] = frozenset()

    @cached_property
    def rms(self) -> Functional:
        """The root mean square of the same expression."""
        return replace(self, kind="rms", harmonic=0.0)

    @property
    def plain(self) -> str:
        """The expression, with a number in the place of each force."""
        return ast.unparse(_Plain().visit(ast.parse(ast.unparse(self.tree), mode="eval").body))


@dataclass(frozen=True, eq=False)
class Parsed:
    """A quantity that has been read: its tree, in which functionals are names, and those functionals."""

    tree: ast.expr
    functionals: dict[str, Functional]

    @cached_property
    def names(self) -> set[str]:
        """Names outside of functionals: parameters and other quantities."""
        return names_in(self.tree) - set(self.functionals)


@lru_cache(maxsize=512)
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
    >>> len(read("(max(x) + min(x))/(max(x) - min(x))").functionals)
    2
    """
    try:
        tree = ast.parse(" ".join(str(text).split()), mode="eval").body
        taking = _Taking({})
        outer = ast.unparse(taking.visit(tree))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        parse(text)  # which says what is wrong with it
        raise
    try:
        return Parsed(parse(outer), taking.found)
    except ModelError as error:
        raise ModelError(taking.as_written(str(error))) from None


class _Taking(ast.NodeTransformer):
    """Takes functionals out of a tree, and leaves a name in the place of each; one for equal ones."""

    def __init__(self, found: dict[str, Functional]) -> None:
        self.found = found
        self.names: dict[str, str] = {}

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Take a functional out; other calls are looked through."""
        kind = node.func.id if isinstance(node.func, ast.Name) else ""
        if kind == FORCE:
            text = ast.unparse(node)
            raise ModelError(f"{text} varies along an orbit: write a functional of it, max({text})")
        several = kind in ("max", "min") and len(node.args) != 1
        if kind and kind not in (known := dict.fromkeys((*FUNCTIONALS, WORK, *FUNCTIONS))):
            raise ModelError(unknown_function(kind, tuple(known), ast.unparse(node)))
        if kind not in (*FUNCTIONALS, WORK) or several:
            return self.generic_visit(node)
        text = ast.unparse(node)
        name = self.names.setdefault(text, f"_{len(self.found)}")
        if name not in self.found:
            self.found[name] = _functional(kind, node)
        return ast.copy_location(ast.Name(name, ast.Load()), node)

    def as_written(self, message: str) -> str:
        """Return a message with functionals in the place of their names."""
        written = {name: text for text, name in self.names.items()}
        return re.sub(r"\b_\d+\b", lambda found: written.get(found[0], found[0]), message)


class _Plain(ast.NodeTransformer):
    """Puts a number in the place of the force of each contact."""

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Replace a name that stands for a force."""
        return ast.Constant(1) if node.id.startswith(FORCE_OF) else node


class _Forces(ast.NodeTransformer):
    """Puts a name in the place of the force of each contact."""

    def __init__(self) -> None:
        self.contacts: set[str] = set()

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Replace ``force(brake)``; other calls are looked through."""
        if not isinstance(node.func, ast.Name) or node.func.id != FORCE:
            return self.generic_visit(node)
        contact = _contact(node)
        self.contacts.add(contact)
        return ast.copy_location(ast.Name(FORCE_OF + contact, ast.Load()), node)


def _contact(node: ast.Call) -> str:
    """Return the name of the contact that ``work(brake)`` or ``force(brake)`` is of."""
    if len(node.args) != 1 or node.keywords or not isinstance(node.args[0], ast.Name):
        kind = ast.unparse(node.func)
        raise ModelError(
            f"{kind}() takes the name of a contact, such as {kind}(brake), got {ast.unparse(node)}"
        )
    return node.args[0].id


def no_contact(name: str, contacts: Sequence[str]) -> str:
    """Return what to say of a contact that a model does not have."""
    if not contacts:
        return f"there is no contact '{name}': force and work are those of contacts of a structure"
    return f"there is no contact '{name}'{did_you_mean(name, contacts)}"


def _functional(kind: str, node: ast.Call) -> Functional:
    if kind == WORK:
        contact = _contact(node)
        return Functional(kind, node.args[0], contact, contacts=frozenset((contact,)))
    wanted = 2 if kind in HARMONIC else 1
    example = f"{kind}(x, 3)" if wanted == 2 else f"{kind}(x)"
    plain = not node.keywords and not any(isinstance(a, ast.Starred) for a in node.args)
    if len(node.args) != wanted or not plain:
        raise ModelError(f"{kind}() is such as {example}, got {ast.unparse(node)}")
    inside: list[Any] = [n for n in ast.walk(node.args[0]) if isinstance(n, ast.Call)]
    for call in inside:
        name = call.func.id if isinstance(call.func, ast.Name) else ""
        if name in (*FUNCTIONALS, WORK) and not (name in ("max", "min") and len(call.args) > 1):
            raise ModelError(
                f"in {ast.unparse(node)}: a functional cannot stand inside of another one; combine "
                "their numbers, such as sqrt(rms(x)**2 - mean(x)**2)"
            )
    text, forces = ast.unparse(node.args[0]), _Forces()
    tree = parse(ast.unparse(forces.visit(node.args[0])))
    harmonic = _harmonic(node) if kind in HARMONIC else 0.0
    return Functional(kind, tree, text, harmonic, frozenset(forces.contacts))


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
