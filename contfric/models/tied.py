"""A model with parameters that follow others: what users give as ``{"S0": {"tie": "S"}}``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from contfric.errors import ModelError, ParameterError, shown
from contfric.models import load_model

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


def declaration(model: Model) -> Model | None:
    """Return the model that declares the formulas of a model, most often itself; None if none does."""
    if model.definition:
        return model
    return load_model(_FORMULAS[model.name]) if model.name in _FORMULAS else None


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
    from contfric.models.reading.files import from_data

    for name in ties:
        model.index_of(name)
    source = declaration(model)
    if source is None:
        raise ParameterError(
            f"model '{model.name}' is not declared by formulas: its parameters cannot be tied"
        )
    data = source.description.data()
    name = f"{model.name} with {', '.join(f'{k} = {v}' for k, v in ties.items())}"
    parameters = {**data["parameters"], **{name: {_TIE: text} for name, text in ties.items()}}
    try:
        return from_data({**data, "name": name, "parameters": parameters})
    except ModelError as error:
        raise ParameterError(f"{name}: {error}") from None
