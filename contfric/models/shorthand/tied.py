"""Parameters that follow others: ``S0: {tie: S}``.

A tied parameter is an expression of others, at every value that these take: a continuation in S moves both.
It is put in its place in all formulas of the model, which has one parameter less; derivatives with respect to
the others are right by themselves. `coulomb`, whose motion is written by hand, is taken by its formulas
(`coulomb-yaml`), which move in closed form too.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from contfric.errors import ParameterError, did_you_mean, shown
from contfric.models.shorthand.rewriting import OF_MODES, OTHERS, SHARED, rewritten, tree_of

if TYPE_CHECKING:
    from contfric.models import ModelSource
    from contfric.models.definition import Model

#: The key that ties a parameter, and models whose formulas stand in another one.
_TIE = "tie"
_FORMULAS = {"coulomb": "coulomb-yaml"}


def tied(model: ModelSource, params: Any = None) -> tuple[Model, Mapping[str, Any]]:
    """Return a model with the ties that its parameters ask for, and the parameters without these.

    None are an empty mapping: the model has its defaults.

    Raises
    ------
    ParameterError
        If the parameters are no mapping, or a tie is not an expression of other parameters, or of a
        model without formulas.

    Examples
    --------
    >>> model, params = tied("coulomb", {"S": 0.3, "S0": {"tie": "S"}})
    >>> model.parameter_names, params
    (('Omega', 'S', 'h', 'zeta'), {'S': 0.3})
    """
    from contfric.models import load_model

    found = load_model(model)
    given = found.given_params(params)
    ties = {name: value for name, value in given.items() if isinstance(value, Mapping)}
    if not ties:
        return found, given
    free = {name: value for name, value in given.items() if name not in ties}
    return with_ties(found, {name: _tie(name, value) for name, value in ties.items()}), free


def _tie(name: str, value: Mapping[str, Any]) -> str:
    if set(value) != {_TIE} or isinstance(value[_TIE], bool):
        raise ParameterError(
            f"parameter '{name}' is a number, or follows others such as {{tie: S}}; got {shown(dict(value))}"
        )
    return str(value[_TIE])


def with_ties(model: Model, ties: Mapping[str, str]) -> Model:
    """Return a model in which parameters are expressions of others.

    Parameters
    ----------
    ties : the expression of each, in those that are left

    Raises
    ------
    ParameterError
        If an expression has other names than those of parameters, or the model has no formulas.
    """
    from contfric.errors import ModelError
    from contfric.models import load_model
    from contfric.models.reading.describe import from_text
    from contfric.models.reading.files import from_data

    for name in ties:
        model.index_of(name)
    source = model if model.definition else load_model(_FORMULAS.get(model.name, model.name))
    if not source.definition:
        raise ParameterError(
            f"model '{model.name}' is not declared by formulas: its parameters cannot be tied"
        )
    data = from_text(source.definition).data()
    name = f"{model.name} with {', '.join(f'{k} = {v}' for k, v in ties.items())}"
    parameters = {**data["parameters"], **{name: {_TIE: text} for name, text in ties.items()}}
    try:
        return from_data({**data, "name": name, "parameters": parameters})
    except ModelError as error:
        raise ParameterError(f"{name}: {error}") from None


def with_ties_put_in(data: dict[str, Any]) -> dict[str, Any]:
    """Return a model's data without the parameters that it ties itself (``S0: {tie: S}``).

    Raises
    ------
    EntryError
        If a tie is not an expression of other parameters.
    """
    from contfric.errors import ModelError
    from contfric.models.entries import EntryError
    from contfric.models.language.grammar import names_in, parse

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
