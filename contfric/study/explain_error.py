"""From pydantic's report to one message: which key, what it must be, and what was given."""

from __future__ import annotations

import reprlib
from enum import Enum
from typing import TYPE_CHECKING, NoReturn

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from contfric.errors import did_you_mean, shown
from contfric.study.schema import (
    ContinueTask,
    ExploreTask,
    Figure,
    FigureKind,
    Format,
    Journal,
    LyapunovTask,
    PlaneTask,
    Row,
    SeedsTask,
    Simulated,
    Start,
    StudyFile,
    Want,
)
from contfric.study.schema_response import (
    BasinsTask,
    EnsembleTask,
    EquilibriaTask,
    PoincareTask,
    SweepTask,
)
from contfric.yaml_lines import comma_hint

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

    from contfric.yaml_lines import Address, LocatedYaml

#: Keys below which a part of its own stands.
_PARTS: dict[str, type[BaseModel]] = {
    "start": Start,
    "simulate": Simulated,
    "explore": ExploreTask,
    "seeds": SeedsTask,
    "lyapunov": LyapunovTask,
    "continue": ContinueTask,
    "plane": PlaneTask,
    "sweep": SweepTask,
    "poincare": PoincareTask,
    "basins": BasinsTask,
    "equilibria": EquilibriaTask,
    "ensemble": EnsembleTask,
    "figures": Figure,
}
#: Keys whose values are names out of a list.
_NAMES: dict[str, type[Enum]] = {
    "want": Want,
    "kind": FigureKind,
    "rows": Row,
    "format": Format,
    "journal": Journal,
}


def fail_with(located: LocatedYaml, error: ValidationError) -> NoReturn:
    """Raise the error ``file.yaml:LINE: ...`` for what pydantic rejected."""
    details = error.errors()
    # a misspelled key makes another one missing: the cause comes first
    unknown = [entry for entry in details if entry["type"] == "extra_forbidden"]
    entry = (unknown or details)[0]
    address: Address = entry["loc"]
    located.fail(address, _message(entry, address))


def _message(entry: ErrorDetails, address: Address) -> str:
    if entry["type"] == "extra_forbidden":
        hint = comma_hint(str(address[-1]), entry["input"])
        hint = hint or did_you_mean(str(address[-1]), _fields(_part(address[:-1])))
        return f"unknown key '{address[-1]}'{hint}"
    key, info = _described(address)
    wanted = f"it must be {info.description}" if info else "see the guide"
    if entry["type"] == "missing":
        return f"key '{key}' is missing; {wanted}"
    given = entry["input"]
    if entry["type"] == "enum":
        hint = did_you_mean(str(given), [member.value for member in _NAMES[key]])
        return f"'{key}' has no '{given}'{hint}"
    if key == "params" and len(address) > 1:
        return f"parameter '{address[1]}' must be a finite number, got {_shown(given)}"
    return f"'{key}': {wanted}, got {_shown(given)}"


def _shown(value: object) -> str:
    """Return a value and, where YAML may surprise, why it is what it is."""
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


def _part(address: Address) -> type[BaseModel]:
    """Return the part of the schema that an address leads to."""
    part: type[BaseModel] = StudyFile
    for key in address:
        part = _PARTS.get(str(key), part)
    return part


def _described(address: Address) -> tuple[str, FieldInfo | None]:
    """Return the last key of an address that the schema knows, and its field."""
    found: tuple[str, FieldInfo | None] = (str(address[0]) if address else "", None)
    part: type[BaseModel] = StudyFile
    for key in address:
        info = _fields(part).get(str(key))
        if info is not None:
            found = (str(key), info)
        part = _PARTS.get(str(key), part)
    return found
