"""Parameters that follow others: ``S0: {tie: S}``.

A tied parameter is an expression of others, at every value that these take: a continuation in S moves both.
It is put in its place in all formulas of the model, which has one parameter less; derivatives with respect to
the others are right by themselves.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from typing import Any

from contfric.errors import ModelError, did_you_mean
from contfric.models.entries import EntryError
from contfric.models.language.grammar import names_in, parse
from contfric.models.shorthand.rewriting import OF_MODES, OTHERS, SHARED, rewritten, tree_of

#: The key that ties a parameter.
_TIE = "tie"


def with_ties_put_in(data: dict[str, Any]) -> dict[str, Any]:
    """Return a model's data without the parameters that it ties itself (``S0: {tie: S}``).

    Raises
    ------
    EntryError
        If a tie is not an expression of other parameters.
    """
    parameters = data["parameters"]
    ties = {name: entry[_TIE] for name, entry in parameters.items() if _TIE in entry}
    if not ties:
        return data
    left = [name for name in parameters if name not in ties]
    for name, text in ties.items():
        try:
            foreign = sorted(names_in(parse(text)) - {"pi", *left})
        except ModelError as error:
            raise EntryError(("parameters", name), str(error)) from None
        if foreign:
            other = foreign[0]
            why = f"is no parameter{did_you_mean(other, left)}"
            raise EntryError(
                ("parameters", name),
                f"{{tie: {text}}}: '{other}' {'is tied itself' if other in ties else why}",
            )
    return _substituted(data, ties)


def _substituted(data: dict[str, Any], ties: Mapping[str, str]) -> dict[str, Any]:
    """Return a model's data with expressions in the place of parameters."""
    put = Substitution(ties)
    found = rewritten(
        data, (*SHARED, *OF_MODES, *OTHERS, ("symmetry", None)), lambda text, _: put.text(text)
    )
    found["parameters"] = {k: v for k, v in data["parameters"].items() if k not in ties}
    found["constraints"] = {put.condition(text): why for text, why in data["constraints"].items()}
    return found


class Substitution(ast.NodeTransformer):
    """Puts expressions in the place of names."""

    def __init__(self, ties: Mapping[str, str]) -> None:
        self.trees = {
            name: ast.parse(text.strip(), mode="eval").body for name, text in ties.items()
        }

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Replace a name that is tied."""
        return self.trees.get(node.id, node)

    def text(self, text: str) -> str:
        """Return an expression with the ties put in."""
        tree = tree_of(str(text))
        return text if tree is None else ast.unparse(self.visit(tree))

    def condition(self, text: str) -> str:
        """Return an inequality with the ties put in, as it stood if none is in it."""
        names = {word for word in self.trees if re.search(rf"\b{re.escape(word)}\b", text)}
        return self.text(text) if names else text
