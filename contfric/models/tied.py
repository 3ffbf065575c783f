"""Parameters that follow others: ``S0: {tie: S}``.

A tied parameter is an expression of others, at every value that these take: a continuation in S moves both.
It is put in its place in all formulas of the model, which has one parameter less; derivatives with respect to
the others are right by themselves. `coulomb`, whose motion is written by hand, is taken by its formulas
(`coulomb-yaml`), which move in closed form too.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from contfric.errors import ParameterError, did_you_mean, shown

if TYPE_CHECKING:
    from contfric.models import ModelSource
    from contfric.models.definition import Model

#: The key that ties a parameter, and models whose formulas stand in another one.
_TIE = "tie"
_FORMULAS = {"coulomb": "coulomb-yaml"}


def tied(model: ModelSource, params: Any = None) -> tuple[Model, Any]:
    """Return a model with the ties that its parameters ask for, and the parameters without these.

    Raises
    ------
    ParameterError
        For a tie to what is no expression of other parameters, or of a model without formulas.

    Examples
    --------
    >>> model, params = tied("coulomb", {"S": 0.3, "S0": {"tie": "S"}})
    >>> model.parameter_names, params
    (('Omega', 'S', 'h', 'zeta'), {'S': 0.3})
    """
    from contfric.models import load_model

    found = load_model(model)
    if not isinstance(params, Mapping):
        return found, params
    ties = {name: value for name, value in params.items() if isinstance(value, Mapping)}
    if not ties:
        return found, params
    free = {name: value for name, value in params.items() if name not in ties}
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
        If an expression is none of the other parameters, or the model has no formulas.
    """
    from contfric.errors import ModelError
    from contfric.models import load_model
    from contfric.models.describe import describe, from_text
    from contfric.models.files import built
    from contfric.models.grammar import names_in, parse

    left = [name for name in model.parameter_names if name not in ties]
    for name, text in ties.items():
        model.index_of(name)
        try:
            used = names_in(parse(text)) - {"pi"}
        except ModelError as error:
            raise ParameterError(f"{name}: {{tie: {text}}}: {error}") from None
        for other in sorted(used - set(left)):
            hint = (
                "is tied itself" if other in ties else f"is no parameter{did_you_mean(other, left)}"
            )
            raise ParameterError(f"{name}: {{tie: {text}}}: '{other}' {hint}")
    source = model if model.definition else load_model(_FORMULAS.get(model.name, model.name))
    if not source.definition:
        raise ParameterError(
            f"model '{model.name}' is not declared by formulas: its parameters cannot be tied"
        )
    data = from_text(source.definition).data()
    try:
        return built(describe(_substituted(data, ties) | {"name": _named(model.name, ties)}))
    except ModelError as error:
        raise ParameterError(f"{_named(model.name, ties)}: {error}") from None


def _named(name: str, ties: Mapping[str, str]) -> str:
    return f"{name} with {', '.join(f'{k} = {v}' for k, v in ties.items())}"


def _substituted(data: dict[str, Any], ties: Mapping[str, str]) -> dict[str, Any]:
    """Return a model's data with expressions in the place of parameters."""
    put = _Put(ties)
    found = dict(data)
    found["parameters"] = {k: v for k, v in data["parameters"].items() if k not in ties}
    found["constraints"] = {put.condition(text): why for text, why in data["constraints"].items()}
    for key in ("define", "observables", "spread"):
        found[key] = put.each(data[key])
    if "period" in data:
        found["period"] = put.text(data["period"])
    found["surfaces"] = {
        name: {**entry, "level": put.text(entry["level"])}
        for name, entry in data["surfaces"].items()
    }
    found["modes"] = {
        name: {**entry, "field": put.each(entry["field"])} for name, entry in data["modes"].items()
    }
    found["resets"] = {
        name: put.each(texts, skip=("to", "from")) for name, texts in data["resets"].items()
    }
    return found


class _Put(ast.NodeTransformer):
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
        return ast.unparse(self.visit(ast.parse(str(text).strip(), mode="eval")))

    def condition(self, text: str) -> str:
        """Return an inequality with the ties put in, as it stood if none is in it."""
        changed = self.text(text)
        return text if changed == ast.unparse(ast.parse(text.strip(), mode="eval")) else changed

    def each(self, texts: Mapping[str, str], skip: Iterable[str] = ()) -> dict[str, str]:
        """Return a mapping of expressions with the ties put in."""
        return {k: v if k in skip else self.text(v) for k, v in texts.items()}
