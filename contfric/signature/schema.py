"""Signature files: their schema, and reading one with errors that name the line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NoReturn, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from contfric.errors import NotationError, ParameterError, did_you_mean
from contfric.models import Model, load_model
from contfric.models.files import is_path, relative_model
from contfric.signature.library import SUFFIXES, signature_path
from contfric.signature.notation import Signature, split_segments, walk_fault
from contfric.yaml_lines import Address, LocatedYaml, as_truth, comma_hint, read_yaml

_Truth = Annotated[bool, BeforeValidator(as_truth)]
SignatureLike: TypeAlias = str | Path | Signature

#: What an entry must be, for messages; the keys are those of the schema.
_WANTED = {
    "name": "a text (quote it if YAML reads it as a number)",
    "model": "the name of a model",
    "periods": "a whole number >= 1",
    "segments": "a text such as 'x0v+ -> stick -> x-v+' or a list of domains",
    "symmetric": "true or false",
    "example": "a mapping of parameters to numbers",
    "description": "a text",
}


class SignatureFile(BaseModel):
    """The content of a signature file.

    Examples
    --------
    >>> walk = "stick -> x-v+ -> x0v+"
    >>> SignatureFile(name="1a, 3seg", model="coulomb", segments=walk).periods
    1
    """

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    name: str = Field(min_length=1, description="what the signature is called")
    model: str = Field(description="name of the model that the domains belong to")
    periods: int = Field(1, ge=1, description="number of periods of the excitation")
    segments: str | list[str] = Field(description="the domains in the order of the visit")
    symmetric: _Truth | None = Field(None, description="whether the orbit is its own mirror image")
    example: dict[str, float] | None = Field(None, description="where it is known to exist")
    description: str | None = Field(None, description="free text")


def load_signature(source: SignatureLike, model: str | Model | None = None) -> Signature:
    """Return a signature by its name in the library, by the path of its file, or as it is.

    Parameters
    ----------
    source : str, Path or Signature
        A text that ends in ``.yaml`` or ``.yml`` or has a folder in it is a path.
    model : str or Model, optional
        The model that it must be of; needed for a model that has no entry point.

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
    path = Path(source) if _is_path(source) else signature_path(str(source), model)
    return read_signature(path, model)


def read_signature(path: Path, model: str | Model | None = None) -> Signature:
    """Read one signature file; see :func:`load_signature`."""
    located = read_yaml(path)
    content = _validated(located)
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


def _is_path(source: str | Path) -> bool:
    text = str(source)
    return isinstance(source, Path) or text.endswith(SUFFIXES) or "/" in text or "\\" in text


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
        found = load_model(relative_model(name, located.path)) if is_path(name) else None
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
    try:
        model.check_params(example)
    except ParameterError as error:
        located.fail(("example",), str(error))


def _validated(located: LocatedYaml) -> SignatureFile:
    for key in located.data:
        if key not in SignatureFile.model_fields:
            hint = comma_hint(str(key), located.data[key])
            hint = hint or did_you_mean(str(key), SignatureFile.model_fields)
            located.fail((str(key),), f"unknown key '{key}'{hint}")
    try:
        return SignatureFile.model_validate(located.data)
    except ValidationError as error:
        address: Address = error.errors()[0]["loc"]
        _explain(located, address)


def _explain(located: LocatedYaml, address: Address) -> NoReturn:
    """Raise the error for the entry that pydantic rejected."""
    key = str(address[0])
    if key not in located.data:
        located.fail((), f"key '{key}' is missing; it must be {_WANTED[key]}")
    value: Any = located.data[key]
    if isinstance(value, dict) and len(address) > 1 and address[1] in value:
        got = f"{address[1]}: {value[address[1]]!r}"
        located.fail(address[:2], f"'{key}' must be {_WANTED[key]}, got {got}")
    if isinstance(value, list) and key == "segments":
        bad = next((i for i, item in enumerate(value) if not isinstance(item, str)), 0)
        located.fail((key, bad), f"'{key}' must be {_WANTED[key]}, got {value!r}")
    located.fail((key,), f"'{key}' must be {_WANTED[key]}, got {value!r}")
