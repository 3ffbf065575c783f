"""Schemas of YAML files, and pydantic's report in one message: which key, what it must be, what was given."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from contfric.base.yaml_lines import as_truth, comma_hint
from contfric.errors import did_you_mean, shown

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo
    from pydantic_core import ErrorDetails

    from contfric.base.yaml_lines import Address, LocatedYaml

Truth = Annotated[bool, BeforeValidator(as_truth)]


class SchemaPart(BaseModel):
    """A mapping of a YAML file: no other keys than its own, and no types but these.

    The description of a field is what its value must be: messages say "'key' must be {description}".
    ``json_schema_extra`` may have "entry": what is said of one entry of a mapping, with {} for its key, and
    "item": what is said of one of a list.
    """

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, allow_inf_nan=False, defer_build=True
    )


def whole(
    what: str = "", *, least: int = 1, most: int | None = None, default: int | None = None
) -> Any:
    """Return the field of a whole number; its limits stand in its description as well.

    Examples
    --------
    >>> whole("periods", most=16).description
    'a whole number from 1 to 16: periods'
    """
    limits = (
        f"a whole number >= {least}" if most is None else f"a whole number from {least} to {most}"
    )
    return Field(default, ge=least, le=most, description=_said(limits, what))


def positive(what: str = "", *, most: float | None = None) -> Any:
    """Return the field of a number above 0 that may be left out.

    Examples
    --------
    >>> positive("largest step", most=1.0).description
    'a number in (0, 1]: largest step'
    """
    limits = "a number > 0" if most is None else f"a number in (0, {most:g}]"
    return Field(None, gt=0.0, le=most, description=_said(limits, what))


def _said(limits: str, what: str) -> str:
    return f"{limits}: {what}" if what else limits


#: What pydantic calls a key that a part does not have; the second is no text.
_UNKNOWN = ("extra_forbidden", "invalid_key")
#: What it calls a part of an unknown kind, and something else in the place of a mapping.
_NO_KIND = ("union_tag_invalid", "union_tag_not_found")
_NO_MAPPING = ("dict_type", "model_type", "model_attributes_type")

_Schema = TypeVar("_Schema", bound=BaseModel)


def validated(located: LocatedYaml, schema: type[_Schema], data: Any = None) -> _Schema:
    """Return the content of a file, or raise the error ``file.yaml:LINE: ...`` for its first mistake.

    Parameters
    ----------
    data : what to read in the place of the file's own content
    """
    given = located.data if data is None else data
    try:
        return schema.model_validate(given)
    except ValidationError as error:
        located.fail(*explained(error, schema, given))


def explained(error: ValidationError, schema: type[BaseModel], data: Any) -> tuple[Address, str]:
    """Return the place of the first mistake in data, and what is wrong with it and what would be valid."""
    entry = _cause(error, data)
    own = entry["ctx"]["discriminator"].strip("'") if entry["type"] in _NO_KIND else ""
    return _place(data, (*entry["loc"], own)), _message(entry, schema, data)


def keys_of(schema: type[BaseModel]) -> str:
    """Return what a mapping has, in words: the keys that it needs, then those that it may have.

    Examples
    --------
    >>> class Range(SchemaPart):
    ...     low: float
    ...     high: float = 1.0
    >>> keys_of(Range)
    'a mapping with low; also high'
    """
    fields = _fields(schema)
    needed = [key for key, info in fields.items() if info.is_required()]
    others = ", ".join(key for key in fields if key not in needed)
    if not needed:
        return f"a mapping with any of {others}"
    *most, last = needed
    text = f"{', '.join(most)} and {last}" if most else last
    return f"a mapping with {text}" + (f"; also {others}" if others else "")


def _cause(error: ValidationError, data: Any) -> ErrorDetails:
    """Return the mistake to report: a misspelled key, which makes another one missing, comes first.

    Where a value may be a list or something else, the item at fault says more than the whole list.
    """
    details = error.errors()
    unknown = [entry for entry in details if entry["type"] in _UNKNOWN]
    first = (unknown or details)[0]
    place = _place(data, first["loc"])
    for entry in details:
        more = _place(data, entry["loc"])
        items = more[len(place) :]
        if more[: len(place)] == place and items and all(isinstance(k, int) for k in items):
            return entry
    return first


def _place(data: Any, address: Address) -> Address:
    """Return those steps of pydantic's address that lead on in the data; the others name what was tried."""
    found: list[str | int] = []
    for step in address:
        if isinstance(data, Mapping):
            keys = {str(key): key for key in data}
            if str(step) in keys:
                found.append(str(step))
                data = data[keys[str(step)]]
        elif isinstance(data, list) and isinstance(step, int) and step < len(data):
            found.append(step)
            data = data[step]
    return tuple(found)


def _message(entry: ErrorDetails, schema: type[BaseModel], data: Any) -> str:
    address, given = entry["loc"], entry["input"]
    part, key, info = _described(schema, address)
    if entry["type"] in _UNKNOWN:
        unknown = str(address[-1])
        hint = comma_hint(unknown, given) or _missing_instead(unknown, part, data, address)
        hint = hint or _belongs(unknown, part) or did_you_mean(unknown, _fields(part))
        return f"unknown key '{unknown}'{hint}"
    if entry["type"] in _NO_KIND and info is not None:
        own, tag = entry["ctx"]["discriminator"], entry["ctx"].get("tag")
        names = [v for kind in _kinds(info.annotation, BaseModel) for v in _tags(kind)[1:]]
        if tag is None:
            return f"key {own} is missing; it must be {', '.join(names[:-1])} or {names[-1]}"
        return f"{own} has no '{tag}'{did_you_mean(tag, names)}"
    wanted = info.description if info else "as the guide says"
    if entry["type"] == "missing":
        return f"key '{key}' is missing; it must be {wanted}"
    if entry["type"] in ("enum", "literal_error") and info is not None:
        names = _values(info.annotation)
        return f"'{key}' has no '{given}'{did_you_mean(str(given), names)}"
    place = _place(data, address)
    last = next((step for step in reversed(place) if isinstance(step, str)), key)
    extra = info.json_schema_extra if info else None
    said: dict[str, Any] = extra if isinstance(extra, dict) else {}
    got = _given(given)
    if last != key:
        near = did_you_mean(last, _fields(part)) if part.model_config["extra"] == "allow" else ""
        got += comma_hint(last, given) or (near if near.startswith(";") else "")
    if "item" in said and last != place[-1] and entry["type"] != "list_type":
        return f"{said['item'].format(key)}, got {got}"
    if "entry" in said and last != key and entry["type"] not in _NO_MAPPING:
        return f"{said['entry'].format(last)}, got {got}"
    return f"'{key}' must be {wanted}, got {'' if last == key else f'{last}: '}{got}"


def _belongs(unknown: str, part: type[BaseModel]) -> str:
    """Return which keys of a part a key belongs into that the part itself does not have; empty if none."""
    below = {key: _kinds(info.annotation, BaseModel) for key, info in _fields(part).items()}
    homes = [key for key, kinds in below.items() if any(unknown in _fields(kind) for kind in kinds)]
    return (
        f" here: it belongs into {', '.join(homes[:-1])}{' or ' * (len(homes) > 1)}{homes[-1]}"
        if homes
        else ""
    )


def _missing_instead(unknown: str, part: type[BaseModel], data: Any, address: Address) -> str:
    """Return the key that is missing where another one is unknown, unless that looks like a third one."""
    for step in _place(data, address[:-1]):  # a key may be a number or a truth value
        keys = {str(key): key for key in data} if isinstance(data, Mapping) else {}
        data = data[keys.get(str(step), step)]
    fields = _fields(part)
    missing = [key for key, info in fields.items() if info.is_required() and key not in data]
    if len(missing) != 1 or did_you_mean(unknown, missing).startswith("; did"):
        return ""
    return f"; key '{missing[0]}' is missing: {fields[missing[0]].description}"


def _given(value: object) -> str:
    """Return a value and, where YAML may surprise, why it is what it is."""
    if value is None:
        return "nothing"
    try:
        text = f"{reprlib.repr(value)} ({type(value).__name__})"
    except ValueError:  # a number of more digits than Python writes
        return shown(value)
    if isinstance(value, str):
        try:
            float(value)
        except ValueError:
            return text
        return f"{text}; a number has no quotes"
    return text


def _fields(part: type[BaseModel]) -> dict[str, FieldInfo]:
    return {info.alias or name: info for name, info in part.model_fields.items()}


def _described(
    schema: type[BaseModel], address: Address
) -> tuple[type[BaseModel], str, FieldInfo | None]:
    """Return the innermost part that an address leads through, its last known key, and the field."""
    part, key, info = schema, str(address[0]) if address else "", None
    below: list[type[BaseModel]] = []
    for step in address:
        found = _fields(part).get(str(step))
        if found is not None:
            key, info = str(step), found
            below = _kinds(found.annotation, BaseModel)
            if not below:
                break
            part = below[0]
        else:  # of parts that are told apart, the one that was tried has its name in the address
            part = next((kind for kind in below if step in _tags(kind)), part)
    return part, key, info


def _tags(kind: type[BaseModel]) -> list[str]:
    """Return by which names a part is told from others: that of its class, or a value that it must have."""
    return [kind.__name__, *(v for f in kind.model_fields.values() for v in _values(f.annotation))]


def _values(annotation: Any) -> list[str]:
    """Return the names that an annotation lists."""
    if get_origin(annotation) is Literal:
        return [str(value) for value in get_args(annotation)]
    members = [str(member.value) for kind in _kinds(annotation, Enum) for member in kind]
    return members or [name for part in get_args(annotation) for name in _values(part)]


_Kind = TypeVar("_Kind")


def _kinds(annotation: Any, base: type[_Kind]) -> list[type[_Kind]]:
    """Return the classes of one kind in an annotation: of a part, of names out of a list.

    Examples
    --------
    >>> _kinds(list[int | None] | dict[str, str], int)
    [<class 'int'>]
    """
    if isinstance(annotation, type) and not get_args(annotation):
        return [annotation] if issubclass(annotation, base) else []
    return [kind for part in get_args(annotation) for kind in _kinds(part, base)]
