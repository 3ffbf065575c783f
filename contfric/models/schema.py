"""What a model file may say: its schema, and how data become what the rest reads.

Data come from a YAML file, a class, :func:`contfric.Mechanism` or a file of results. :func:`checked` returns
them as plain data in one form: every mapping is there, expressions are texts, sides are 1, -1 or 0. What
refers to something else in the file, such as the side of a surface, is checked by :mod:`..describe`.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    model_validator,
)

from contfric.base.yaml_schema import SchemaPart, Truth, explained
from contfric.errors import ModelError
from contfric.models.entries import SIDES, EntryError
from contfric.models.grammar import number_of
from contfric.models.reset_modes import FROM, TO, pairs_of
from contfric.models.structure_names import COORDINATES

#: Tolerances between rounding and what Newton's method on a chain of segments still takes for smooth.
_TOLERANCES = (1e-14, 1e-6)
#: Shares of a range that are steps: below it a branch is millions of points long.
_STEPS = (1e-8, 1.0)
#: Numbers that a model can be computed with: products of some of them are still finite.
_LARGEST, _SMALLEST_UNIT, _LARGEST_UNIT = 1e300, 1e-100, 1e100
#: Keys of the parts of a structure, which a model of states does not have.
STRUCTURAL = ("mass", "damping", "stiffness", "force", "contacts")


def _squeezed(value: Any) -> Any:
    return " ".join(value.split()) if isinstance(value, str) else value


def _expression(value: Any) -> Any:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return str(value) if is_number else _squeezed(value)


def _number(value: Any) -> Any:
    """Return the value of an expression of numbers, such as 2*pi."""
    if isinstance(value, str):
        with suppress(ModelError):
            return number_of(value, {})
    return value


def _side(value: Any) -> int:
    if isinstance(value, bool) or str(value) not in SIDES:
        raise ValueError("no side")
    return SIDES[str(value)]


def _images(value: Any) -> Any:
    """Return ``x -> -x, t -> t + T/2`` as a mapping of names to images."""
    if not isinstance(value, str):
        return value
    pairs = [piece.partition("->") for piece in value.split(",")]
    if not all(arrow for _, arrow, _ in pairs):
        raise ValueError("no arrow")
    return {name.strip(): image for name, _, image in pairs}


def _names(value: Any) -> Any:
    """Return ``{q: 3}`` as the names q1, q2 and q3."""
    if not isinstance(value, dict) or len(value) != 1:
        return value
    ((name, count),) = value.items()
    is_count = isinstance(count, int) and not isinstance(count, bool)
    return [f"{name}{i}" for i in range(1, count + 1)] if is_count else value


def _kind_of_matrix(value: Any) -> str:
    rows = isinstance(value, list) and any(isinstance(row, list) for row in value)
    return "rows" if rows else "diagonal" if isinstance(value, list) else "alone"


def _conditions(value: Any) -> Any:
    """Return a list of inequalities as a mapping to their reasons, which it does not give."""
    is_list = isinstance(value, list) and all(isinstance(text, str) for text in value)
    return {_squeezed(text): "" for text in value} if is_list else value


def _or(nothing: Any) -> BeforeValidator:
    return BeforeValidator(lambda value: nothing if value is None else value)


def _left_out(what: str, **more: Any) -> Any:
    """Return the field of what may be left out, and is not there then."""
    return Field(None, description=what, **more)


def _matrix(key: str, default: str) -> Any:
    entry = f"an entry of '{key}' must be an expression or a finite number"
    return Field(default, description=_MATRIX, json_schema_extra={"item": entry})


def _entries(what: str, entry: str = "'{}' must be an expression", **more: Any) -> Any:
    """Return the field of a mapping that may be left out, and what is said of one of its entries."""
    return Field(
        **{"default_factory": dict, **more}, description=what, json_schema_extra={"entry": entry}
    )


Line: TypeAlias = Annotated[str, BeforeValidator(_squeezed)]
Text: TypeAlias = Annotated[str, _or(""), BeforeValidator(_squeezed)]
Expression: TypeAlias = Annotated[str, BeforeValidator(_expression)]
Said: TypeAlias = Annotated[str, _or(""), BeforeValidator(_expression)]
Expressions: TypeAlias = dict[str, Expression]
Side: TypeAlias = Annotated[int, BeforeValidator(_side)]
Sides: TypeAlias = Annotated[dict[str, Side], _or({})]
Names: TypeAlias = Annotated[
    list[str],
    BeforeValidator(lambda v: v if isinstance(v, list) else [*v] if isinstance(v, dict) else [v]),
]
Number: TypeAlias = Annotated[float, Field(gt=-_LARGEST, lt=_LARGEST)]
Unit: TypeAlias = Annotated[
    float,
    BeforeValidator(_number),
    Field(gt=_SMALLEST_UNIT, lt=_LARGEST_UNIT),
]
Ends: TypeAlias = Annotated[list[Expression], Field(min_length=2, max_length=2)]
Spread: TypeAlias = Expression | Ends
Entry: TypeAlias = str | Number
Matrix: TypeAlias = Annotated[
    Annotated[list[list[Entry]], Tag("rows")]
    | Annotated[list[Entry], Tag("diagonal")]
    | Annotated[Entry, Tag("alone")],
    Discriminator(_kind_of_matrix),
]

_SIDE = "the side of '{}' must be + (above), - (below) or 0 (on)"
_SIDES_OF = "a mapping of surfaces to a side, such as {v: +, F+: -}"
_EXPRESSION = {"entry": "'{}' must be an expression"}
_RATES = "a mapping of states to rates"
_MATRIX = "a matrix: a list of rows, a list of its diagonal, one expression (times identity), or 'identity'"


class Part(SchemaPart):
    """A mapping in a model file; one that says nothing is empty."""

    @model_validator(mode="before")
    @classmethod
    def _empty(cls, value: Any) -> Any:
        return {} if value is None else value


class Parameter(Part):
    """A parameter."""

    default: Number = Field(
        description="a finite number",
        json_schema_extra={"entry": "the default of '{}' must be a finite number"},
    )
    meaning: Text = Field("", description="a text")


class Tied(Part):
    """A parameter that follows others."""

    model_config = ConfigDict(extra="ignore")

    tie: Expression = Field(description="an expression of other parameters")


def _kind_of_parameter(value: Any) -> str:
    if isinstance(value, Part):
        return type(value).__name__
    return "Tied" if isinstance(value, dict) and "tie" in value else "Parameter"


def _number_alone(value: Any) -> Any:
    return value if isinstance(value, dict) else {"default": value}


AnyParameter: TypeAlias = Annotated[
    Annotated[Parameter, Tag("Parameter")] | Annotated[Tied, Tag("Tied")],
    Discriminator(_kind_of_parameter),
    BeforeValidator(_number_alone),
]


class Surface(Part):
    """A surface."""

    observable: Line = Field(description="an observable, a state or an expression")
    level: Expression = Field("0", description="an expression of the parameters")
    switching: Truth | None = _left_out("true or false")
    sliding: Literal["filippov"] | None = _left_out("filippov")


class Mode(Part):
    """A mode."""

    sides: Sides = _entries(_SIDES_OF, _SIDE, alias="in")
    field: Expressions = _left_out(_RATES, json_schema_extra=_EXPRESSION)
    sliding: Truth | None = _left_out("true or false")
    rank: int = _left_out("a whole number from 0 to that of the states", ge=0)


class Domain(Part):
    """A name of a region of a mode."""

    mode: Line = Field(description="the name of a mode")
    sides: Sides = _entries(_SIDES_OF, _SIDE, alias="in")
    label: Said = Field("", description="a text")


class Departure(Part):
    """Where a solution goes that leaves a sliding mode."""

    where: Sides = _entries(_SIDES_OF, _SIDE)
    leaves: Sides = _entries(_SIDES_OF, _SIDE, default_factory=None)


class Led(Part):
    """The sides at which a reset leads into a mode, and the modes from which."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Side]

    modes: Names = _left_out("the name of a mode, or a list of them", alias=FROM)


class Reset(Part):
    """What a state becomes at a surface."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: Expressions

    leads: Annotated[list[dict[str, Led]], BeforeValidator(pairs_of)] = _left_out(
        "a mode, a list of modes, or a mapping of modes to sides of surfaces",
        alias=TO,
        json_schema_extra={"entry": _SIDE},
    )
    acts: Names = _left_out("the name of a mode, or a list of them", alias=FROM)
    chatter: Truth | None = _left_out("true or false")


class Integration(Part):
    """How modes that are integrated are."""

    method: Literal["explicit", "implicit", "automatic"] = Field(
        "explicit", description="explicit, implicit or automatic"
    )
    tolerance: float = Field(
        1e-12,
        ge=_TOLERANCES[0],
        le=_TOLERANCES[1],
        description="a number from {:g} to {:g}".format(*_TOLERANCES),
    )


class AnyModel(Part):
    """What models of states and structures have both."""

    name: Line = Field(min_length=1, description="a text")
    title: Text = Field("", description="a text")
    references: list[Line] = Field(default_factory=list, description="a list of texts")
    parameters: dict[str, AnyParameter] = Field(
        description="a mapping of names to numbers, or to {default: number, meaning: text}"
    )
    constraints: Annotated[dict[Line, Said], BeforeValidator(_conditions)] = Field(
        default_factory=dict,
        description="a list of inequalities, or a mapping of them to their reasons",
    )
    period: Expression = _left_out("an expression")
    autonomous: Truth | None = _left_out("true or false")
    define: Expressions = _entries("a mapping of names to expressions")
    observables: Expressions = _entries("a mapping of names to expressions")
    quantities: Expressions = _entries(
        "a mapping of names to expressions, such as {energy: integral(c*v**2)}"
    )
    symmetry: Annotated[Expressions, BeforeValidator(_images)] = _left_out(
        "a text such as 'x -> -x, v -> -v, t -> t + T/2', or a mapping of states to images",
        json_schema_extra=_EXPRESSION,
    )
    spread: dict[str, Spread] = _entries(
        "a mapping of states to half-widths, or to ranges such as [0, 1]",
        "the spread of '{}' must be a half-width, or a range of a lowest and a highest value such as [0, 1]",
    )
    units: dict[str, Unit] = _entries(
        "a mapping of states and t to numbers, such as {x: 1.0e-3, t: 0.01}",
        "the unit of '{}' must be a positive number",
    )
    integration: Integration = Field(
        default_factory=Integration, description="{method: explicit, tolerance: 1.0e-12}"
    )
    max_step: float = _left_out(
        "the largest step of a continuation as a share of the range, from {:g} to {:g}".format(
            *_STEPS
        ),
        ge=_STEPS[0],
        le=_STEPS[1],
    )


class ModelFile(AnyModel):
    """A model of states."""

    states: list[str] = Field(min_length=1, description="a list of names, such as [x, v]")
    surfaces: dict[str, Surface] = Field(
        default_factory=dict,
        description="a mapping of names to {observable: name, level: expression}",
    )
    field: Expressions = _left_out(_RATES, json_schema_extra=_EXPRESSION)
    modes: dict[str, Mode] = Field(
        default_factory=dict,
        description="a mapping of names to {in: sides of surfaces, field: {state: rate}}",
    )
    domains: dict[str, Domain] = Field(
        default_factory=dict,
        description="a mapping of names to {mode: name, in: sides of surfaces}",
    )
    departures: list[Departure] = Field(
        default_factory=list, description="a list of {where: sides, leaves: sides}"
    )
    resets: dict[str, Reset] = _entries(
        "a mapping of surfaces to {state: new value, to: mode, from: modes}"
    )
    angles: list[Line] = Field(default_factory=list, description="a list of states")
    stop_surface: Line = _left_out("the name of a surface")
    kinks: list[Line] = Field(
        default_factory=list, description="a list of texts: observables and states"
    )


class FrictionContact(Part):
    """Friction."""

    kind: Literal["friction"]
    velocity: Expression = Field(description="an expression")
    kinetic: Expression = Field(description="an expression")
    static: Expression | None = _left_out("an expression")
    at: Expression | None = _left_out("an expression of the parameters")


class JenkinsContact(Part):
    """A spring in series with a slider."""

    kind: Literal["jenkins"]
    displacement: Expression = Field(description="an expression")
    stiffness: Expression = Field(description="an expression")
    limit: Expression = Field(description="an expression")
    at: Expression | None = _left_out("an expression of the parameters")


class SpringContact(Part):
    """A spring behind a gap."""

    kind: Literal["spring"]
    gap: Expression = Field(description="an expression")
    stiffness: Expression = Field(description="an expression")


class ImpactContact(Part):
    """A wall."""

    kind: Literal["impact"]
    gap: Expression = Field(description="an expression")
    restitution: Expression = Field(description="an expression")
    chatter: Truth | None = _left_out("true or false")


class NoContact(Part):
    """What has none of these kinds."""

    model_config = ConfigDict(extra="ignore")

    kind: Literal["friction", "jenkins", "spring", "impact"] = Field(
        description="friction, jenkins, spring or impact"
    )


def _kind_of_contact(value: Any) -> str:
    if isinstance(value, Part):
        return type(value).__name__
    found = value.get("kind") if isinstance(value, dict) else None
    kinds = ("friction", "jenkins", "spring", "impact")
    return f"{str(found).capitalize()}Contact" if found in kinds else "NoContact"


AnyContact: TypeAlias = Annotated[
    Annotated[FrictionContact, Tag("FrictionContact")]
    | Annotated[JenkinsContact, Tag("JenkinsContact")]
    | Annotated[SpringContact, Tag("SpringContact")]
    | Annotated[ImpactContact, Tag("ImpactContact")]
    | Annotated[NoContact, Tag("NoContact")],
    Discriminator(_kind_of_contact),
]


class StructureFile(AnyModel):
    """A structure with contacts: ``M q'' + C q' + K q = f(t)``."""

    coordinates: Annotated[list[str], BeforeValidator(_names)] = Field(
        min_length=1, description="a list of names such as [q1, q2], or {q: 20}"
    )
    mass: Matrix = _matrix("mass", "identity")
    damping: Matrix = _matrix("damping", "0")
    stiffness: Matrix = _matrix("stiffness", "0")
    force: Expressions = _entries("a mapping of coordinates to expressions")
    contacts: dict[str, AnyContact] = _entries(
        "a mapping of names to contacts",
        "'{}' must be a contact such as {{kind: friction, velocity: v1, kinetic: S, static: S0}}",
    )


class Law(Part):
    """What a contact carries and dissipates, of a model that is written out."""

    modes: Expressions = _entries("a mapping of texts")
    texts: Expressions = _entries("a mapping of texts")
    rest: Expression = _left_out("an expression")
    at: Expression = _left_out("an expression")


class Chatter(Part):
    """A mode that begins with infinitely many impacts, of a model that is written out."""

    mode: str = Field(description="a mode")
    flight: str = Field(description="a mode")
    lift: str = Field(description="a surface")
    other: str = Field("", description="a mode")
    other_lift: str = Field("", description="a surface")


class WrittenOut(ModelFile):
    """A model with all that is derived from what is said in short."""

    chatters: dict[str, Chatter] = Field(default_factory=dict, description="chatters")
    forces: dict[str, Law] = Field(
        default_factory=dict, description="a mapping of contacts to {modes: ..., texts: ...}"
    )
    in_units: dict[str, Unit] = _entries(
        "a mapping of states and t to numbers", "the unit of '{}' must be a positive number"
    )
    phase: str = Field("", description="the name of a surface")
    structure: StructureFile | None = _left_out("a structure")


def checked(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a model's data in the one form that is read, of states or of coordinates.

    Raises
    ------
    EntryError
        For the first mistake, with the address of its entry.
    """
    given = _plain(data)
    schema: type[AnyModel] = StructureFile if COORDINATES in given else WrittenOut
    for key in [key for key, value in given.items() if value is None]:
        if key in schema.model_fields:
            del given[key]
    misplaced = [key for key in STRUCTURAL if key in given]
    if schema is WrittenOut and misplaced and "states" not in given:
        raise EntryError(
            (misplaced[0],),
            f"'{misplaced[0]}' needs '{COORDINATES}': write {COORDINATES}: [q1, q2]",
        )
    try:
        found = schema.model_validate(given)
    except ValidationError as error:
        raise EntryError(*explained(error, schema, given)) from None
    return found.model_dump(by_alias=True, exclude_none=True)


def _plain(value: Any) -> Any:
    """Return data as a YAML file has them: keys are texts, arrays and tuples are lists, numbers Python's."""
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return value.tolist() if hasattr(value, "tolist") else value
