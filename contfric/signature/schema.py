"""Signature files: their schema, and reading one with errors that name the line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

from pydantic import ConfigDict, Field

from contfric.base.yaml_lines import LocatedYaml, read_yaml
from contfric.base.yaml_schema import SchemaPart, Truth, validated
from contfric.errors import NotationError, ParameterError, did_you_mean
from contfric.models import Model, load_model
from contfric.models.paths import is_path, relative_name
from contfric.signature.library import signature_path
from contfric.signature.notation import Signature, split_segments, walk_fault

SignatureLike: TypeAlias = str | Path | Signature


class SignatureFile(SchemaPart):
    """The content of a signature file.

    Examples
    --------
    >>> walk = "stick -> x-v+ -> x0v+"
    >>> SignatureFile(name="1a, 3seg", model="coulomb", segments=walk).periods
    1
    """

    model_config = ConfigDict(allow_inf_nan=True)  # the model says what its parameters may be

    name: str = Field(min_length=1, description="a text (quote it if YAML reads it as a number)")
    model: str = Field(description="the name of a model")
    periods: int = Field(1, ge=1, description="a whole number >= 1")
    segments: str | list[str] = Field(
        description="a text such as 'x0v+ -> stick -> x-v+' or a list of domains"
    )
    symmetric: Truth | None = Field(None, description="true or false")
    example: dict[str, float] | None = Field(None, description="a mapping of parameters to numbers")
    description: str | None = Field(None, description="a text")


def load_signature(source: SignatureLike, model: str | Model | None = None) -> Signature:
    """Return a signature by its name in the library, by the path of its file, or as it is.

    Parameters
    ----------
    source : str, Path or Signature
        A text that ends in ``.yaml`` or ``.yml`` or has a folder in it is a path.
    model : str or Model, optional
        The model that it must be of; needed for a model that has no entry point.

    Returns
    -------
    Signature

    Raises
    ------
    NotationError
        If there is no such signature, the file is wrong (``file.yaml:LINE: ...``), or it belongs
        to another model.

    Examples
    --------
    >>> load_signature("1a").stops
    1
    """
    if isinstance(source, Signature):
        return _same_model(source, model)
    if not isinstance(source, (str, Path)):
        raise NotationError(
            f"a signature is a name, a path or a Signature, got {type(source).__name__}"
        )
    path = Path(source) if is_path(source) else signature_path(str(source), model)
    return read_signature(path, model)


def read_signature(path: Path, model: str | Model | None = None) -> Signature:
    """Read one signature file; see :func:`load_signature`."""
    located = read_yaml(path)
    content = validated(located, SignatureFile)
    owner = _owner(located, content.model, model)
    segments = split_segments(content.segments, owner)
    fault = walk_fault(owner, segments)
    if fault is not None:
        located.fail(("segments", fault.index), fault.message)
    own = owner.name == content.model or is_path(content.model)
    if content.example is not None and own:  # a tied parameter has no value of its own
        _check_example(located, owner, content.example)
    try:
        return Signature(
            owner, segments, content.periods, content.symmetric, content.name, content.example
        )
    except NotationError as error:
        # all else has been checked: what is left is that the walk cannot be symmetric
        located.fail(("symmetric",), str(error))


def _alike(declared: Model, model: str | Model | None) -> bool:
    """Tell whether a model has the domains and transitions of another: one with tied parameters does."""
    if not isinstance(model, Model) or not model.name.startswith(f"{declared.name} with "):
        return False
    return declared.targets == model.targets


def _same_model(signature: Signature, model: str | Model | None) -> Signature:
    wanted = model.name if isinstance(model, Model) else model
    if wanted not in (None, signature.model.name):
        if isinstance(model, Model) and _alike(signature.model, model):
            return replace(signature, model=model)
        raise NotationError(
            f"the signature is of model '{signature.model.name}', not of '{wanted}'"
        )
    return signature


def _owner(located: LocatedYaml, name: str, model: str | Model | None) -> Model:
    """Return the model of a file; it must be the wanted one."""
    wanted = model.name if isinstance(model, Model) else model
    try:
        # a path is meant from the folder of the signature's file
        found = load_model(relative_name(name, located.path)) if is_path(name) else None
        declared = found.name if found else name
        if wanted not in (None, declared) and not _alike(found or load_model(name), model):
            located.fail(("model",), f"the signature is of model '{declared}', not of '{wanted}'")
        return model if isinstance(model, Model) else found or load_model(name)
    except ParameterError as error:
        located.fail(("model",), str(error))


def _check_example(located: LocatedYaml, model: Model, example: dict[str, float]) -> None:
    for key in example:
        if key not in model.parameter_names:
            hint = did_you_mean(key, model.parameter_names)
            located.fail(("example", key), f"model '{model.name}' has no parameter '{key}'{hint}")
    located.attempt(("example",), lambda: model.check_params(example))
