"""Coefficients of the parameters as expressions of the language."""

from __future__ import annotations

from contfric.models.language.coefficients import Atom, Coefficient, Product


def text_of(coefficient: Coefficient) -> str:
    """Return a coefficient as an expression.

    Examples
    --------
    >>> from contfric.models.language.coefficients import number, parameter
    >>> text_of(parameter("k") + number(-2.0))
    '-2.0 + 1.0*k'
    """
    return " + ".join(_part(product, weight) for product, weight in coefficient.parts) or "0"


def _part(product: Product, weight: float) -> str:
    return "*".join([repr(weight), *(_power(atom, power) for atom, power in product)])


def _power(atom: Atom, power: int) -> str:
    return _atom(atom) if power == 1 else f"{_atom(atom)}**({power})"


def _atom(atom: Atom) -> str:
    if not atom.of:
        return atom.name
    first, *others = (f"({text_of(c)})" for c in atom.of)
    if atom.name == "inverse":
        return f"(1/{first})"
    if atom.name == "power":
        return f"({first}**{others[0]})"
    if atom.name == "where":
        return f"where({first} > 0, {others[0]}, {others[1]})"
    return f"{atom.name}{first}"
