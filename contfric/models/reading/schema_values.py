"""The values in a model file, as its schema reads them: expressions are texts, sides are 1, -1 or 0."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Discriminator, Field, Tag

from contfric.base.yaml_lines import as_truth
from contfric.errors import ModelError
from contfric.models.entries import AUTO, SIDES
from contfric.models.language.grammar import number_of

#: Numbers that a model can be computed with: products of some of them are still finite.
_LARGEST, _SMALL_UNIT, _LARGE_UNIT = 1e300, 1e-100, 1e100
#: What may be left out, and is not in the data then.
LEFT_OUT: Any = None


def _squeezed(value: Any) -> Any:
    return " ".join(value.split()) if isinstance(value, str) else value


def _expression(value: Any) -> Any:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return str(value) if is_number else _squeezed(value)


def _number(value: Any) -> Any:
    """Return the value of an expression of numbers, such as 2*pi."""
    with suppress(ModelError):
        return number_of(value, {}) if isinstance(value, str) else value
    return value


def _side(value: Any) -> int:
    if isinstance(value, bool) or str(value) not in SIDES:
        raise ValueError("no side")
    return SIDES[str(value)]


def images(value: Any) -> Any:
    """Return ``x -> -x, t -> t + T/2`` as a mapping of names to images."""
    if not isinstance(value, str):
        return value
    pairs = [piece.partition("->") for piece in value.split(",")]
    if not all(arrow for _, arrow, _ in pairs):
        raise ValueError("no arrow")
    return {name.strip(): image for name, _, image in pairs}


def _chosen(value: Any) -> Any:
    """Return ``auto`` as the mapping that says it."""
    return {AUTO: 1.0} if value == AUTO else value


def numbered(value: Any) -> Any:
    """Return ``{q: 3}`` as the names q1, q2 and q3."""
    if not isinstance(value, dict) or len(value) != 1:
        return value
    ((name, count),) = value.items()
    return [f"{name}{i}" for i in range(1, count + 1)] if type(count) is int else value


def conditions(value: Any) -> Any:
    """Return a list of inequalities as a mapping to their reasons, which it does not give."""
    is_list = isinstance(value, list) and all(isinstance(text, str) for text in value)
    return dict.fromkeys(value, "") if is_list else value


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, (list, dict)) else [value]


def _kind_of_matrix(value: Any) -> str:
    rows = isinstance(value, list) and any(isinstance(row, list) for row in value)
    return "rows" if rows else "diagonal" if isinstance(value, list) else "alone"


def instead(nothing: Any, read: Callable[[Any], Any] = lambda value: value) -> BeforeValidator:
    """Return what puts a value in the place of one that is not there, and reads others."""
    return BeforeValidator(lambda value: nothing if value is None else read(value))


def said(what: str, entry: str = "", *, item: str = "", **more: Any) -> Any:
    """Return what is said of a value; of an entry, if it is a mapping, and of an item, if it is a list."""
    extra: Any = {key: text for key, text in (("entry", entry), ("item", item)) if text}
    return Field(description=what, json_schema_extra=extra, **more)


def mapping(what: str, entry: str = "") -> Any:
    """Return the same of a mapping that is empty if it is left out."""
    return said(what, entry, default_factory=dict)


FORMULA = "'{}' must be an expression"
SIDE = "the side of '{}' must be + (above), - (below) or 0 (on)"
MODES = "the name of a mode, or a list of them"
EMPTY: Any = Field(default_factory=dict)
NOTHING: Any = Field(default_factory=list)
Text: TypeAlias = Annotated[str, instead("", _expression), said("a text")]
Line: TypeAlias = Annotated[str, BeforeValidator(_squeezed), said("a text", min_length=1)]
Texts: TypeAlias = Annotated[list[Line], said("a list of texts")]
Expression: TypeAlias = Annotated[str, BeforeValidator(_expression), said("an expression")]
Formulas: TypeAlias = dict[str, Expression]
Expressions: TypeAlias = Annotated[Formulas, said("a mapping of names to expressions", FORMULA)]
Rates: TypeAlias = Annotated[Formulas, said("a mapping of states to rates", FORMULA)]
Flag: TypeAlias = Annotated[bool | None, BeforeValidator(as_truth), said("true or false")]
Side: TypeAlias = Annotated[int, BeforeValidator(_side)]
Sides: TypeAlias = Annotated[
    dict[str, Side],
    instead({}),
    said("a mapping of surfaces to a side, such as {v: +, F+: -}", SIDE),
]
Modes: TypeAlias = Annotated[list[str], BeforeValidator(_listed), said(MODES)]
Number: TypeAlias = Annotated[float, said("a finite number", gt=-_LARGEST, lt=_LARGEST)]
Default: TypeAlias = Annotated[Number, BeforeValidator(_number)]
Unit: TypeAlias = Annotated[float, BeforeValidator(_number), Field(gt=_SMALL_UNIT, lt=_LARGE_UNIT)]
Units: TypeAlias = Annotated[
    dict[str, Unit],
    BeforeValidator(_chosen),
    said(
        "'auto', or a mapping of states and t to numbers, such as {x: 1.0e-3, t: 0.01}",
        "the unit of '{}' must be a positive number",
    ),
]
Ends: TypeAlias = Annotated[list[Expression], Field(min_length=2, max_length=2)]
Entry: TypeAlias = str | Number
Matrix: TypeAlias = Annotated[
    Annotated[list[list[Entry]], Tag("rows")]
    | Annotated[list[Entry], Tag("diagonal")]
    | Annotated[Entry, Tag("alone")],
    Discriminator(_kind_of_matrix),
    said(
        "a matrix: a list of rows, a list of its diagonal, one expression (times identity), or 'identity'",
        item="an entry of '{}' must be an expression or a finite number",
    ),
]
