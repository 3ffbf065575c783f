"""The schema of a model file, and the conversion of its data to one common form.

Data come from a YAML file, a class, :func:`contfric.Mechanism` or a file of results. :func:`checked` returns
them as plain data in one form, in which every mapping is there. What refers to something else in the file,
such as the side of a surface, is checked by :mod:`contfric.models.reading.describe`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, ConfigDict, Discriminator, Field, Tag, ValidationError

from contfric.base.yaml_schema import SchemaPart, explained
from contfric.models.described.reset_modes import FROM, TO, pairs_of
from contfric.models.entries import EntryError, plain
from contfric.models.reading.schema_values import (
    EMPTY,
    FORMULA,
    LEFT_OUT,
    MODES,
    NOTHING,
    SIDE,
    Default,
    Ends,
    Expression,
    Expressions,
    Flag,
    Formulas,
    Line,
    Matrix,
    Modes,
    Rates,
    Side,
    Sides,
    Text,
    Texts,
    Units,
    conditions,
    images,
    instead,
    mapping,
    numbered,
    said,
)
from contfric.models.structures.names import COORDINATES

#: Tolerances between rounding and what Newton's method on a chain of segments still takes for smooth.
_TOLERANCES = (1e-14, 1e-6)
#: Shares of a range that are steps: below it a branch is millions of points long.
_STEPS = (1e-8, 1.0)
#: Parts of a structure, which a model of states does not have.
_STRUCTURAL = ("mass", "damping", "stiffness", "force", "contacts")


def _kind_of_parameter(value: Any) -> str:
    if isinstance(value, SchemaPart):
        return type(value).__name__
    return "Tied" if isinstance(value, dict) and "tie" in value else "Parameter"


class Parameter(SchemaPart):
    """A parameter."""

    default: Default = said(
        "a finite number, or one by arithmetic such as 3*pi/180",
        "the default of '{}' must be a finite number, or one by arithmetic such as 3*pi/180",
    )
    meaning: Text = ""


class Tied(SchemaPart):
    """A parameter that follows others."""

    model_config = ConfigDict(extra="ignore")

    tie: Expression


AnyParameter: TypeAlias = Annotated[
    Annotated[Parameter, Tag("Parameter")] | Annotated[Tied, Tag("Tied")],
    Discriminator(_kind_of_parameter),
    BeforeValidator(lambda value: value if isinstance(value, dict) else {"default": value}),
]


class Surface(SchemaPart):
    """A surface."""

    observable: Line = said("an observable, a state or an expression")
    level: Expression = "0"
    switching: Flag = None
    sliding: Literal["filippov"] | None = None


class Mode(SchemaPart):
    """A mode."""

    sides: Sides = Field(default_factory=dict, alias="in")
    field: Rates = LEFT_OUT
    sliding: Flag = None
    rank: int = said("a whole number from 0 to that of the states", default=None, ge=0)


class Domain(SchemaPart):
    """A name of a region of a mode."""

    mode: Line = said("the name of a mode")
    sides: Sides = Field(default_factory=dict, alias="in")
    label: Text = ""


class Departure(SchemaPart):
    """Where a solution goes that leaves a sliding mode."""

    where: Sides = EMPTY
    leaves: Sides


class Led(SchemaPart):
    """The sides at which a reset leads into a mode, and the modes from which."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Side]

    modes: Modes = Field(LEFT_OUT, alias=FROM)


class Reset(SchemaPart):
    """What a state becomes at a surface."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: Formulas

    leads: Annotated[list[dict[str, Led]], BeforeValidator(pairs_of)] = said(
        f"{MODES}, or a mapping of them to sides", SIDE, default=None, alias=TO
    )
    acts: Modes = Field(LEFT_OUT, alias=FROM)
    chatter: Flag = None


class Integration(SchemaPart):
    """How modes that are integrated are."""

    method: Literal["explicit", "implicit", "automatic"] = "explicit"
    tolerance: float = said(
        "a number from {:g} to {:g}".format(*_TOLERANCES),
        default=1e-12,
        ge=_TOLERANCES[0],
        le=_TOLERANCES[1],
    )


class AnyModel(SchemaPart):
    """What models of states and structures have both."""

    name: Line
    title: Text = ""
    references: Texts = NOTHING
    parameters: dict[str, AnyParameter] = said(
        "a mapping of names to numbers, or to {default: number, meaning: text}"
    )
    constraints: Annotated[dict[Line, Text], BeforeValidator(conditions)] = mapping(
        "a list of inequalities, or a mapping of them to their reasons"
    )
    period: Expression = LEFT_OUT
    autonomous: Flag = None
    define: Expressions = EMPTY
    observables: Expressions = EMPTY
    quantities: Expressions = EMPTY
    symmetry: Annotated[Formulas, BeforeValidator(images)] = said(
        "a text such as 'x -> -x, v -> -v, t -> t + T/2', or a mapping of states to images",
        FORMULA,
        default=None,
    )
    spread: dict[str, Expression | Ends] = mapping(
        "a mapping of states to half-widths, or to ranges such as [0, 1]",
        "the spread of '{}' must be a half-width, or a range of a lowest and a highest value",
    )
    units: Units = EMPTY
    integration: Integration = said(
        "{method: explicit, tolerance: 1.0e-12}", default_factory=Integration
    )
    max_step: float = said(
        "the largest step of a continuation as a share of the range, from {:g} to {:g}".format(
            *_STEPS
        ),
        default=None,
        ge=_STEPS[0],
        le=_STEPS[1],
    )


class ModelFile(AnyModel):
    """A model of states."""

    states: list[str] = said("a list of names, such as [x, v]", min_length=1)
    surfaces: dict[str, Surface] = mapping("a mapping of names to {observable: ..., level: ...}")
    field: Rates = LEFT_OUT
    modes: Mapping[str, Annotated[Mode, instead({})]] = mapping(
        "a mapping of names to {in: sides of surfaces, field: {state: rate}}"
    )
    domains: dict[str, Domain] = mapping(
        "a mapping of names to {mode: name, in: sides of surfaces}"
    )
    departures: list[Departure] = said(
        "a list of {where: sides, leaves: sides}", default_factory=list
    )
    resets: dict[str, Reset] = mapping(
        "a mapping of surfaces to {state: new value, to: mode, from: modes}", FORMULA
    )
    angles: Texts = said("a list of states", default_factory=list)
    stop_surface: Line = said("the name of a surface", default=None)
    kinks: Texts = said("a list of texts: observables and states", default_factory=list)


class Friction(SchemaPart):
    """A contact that sticks, and slides with friction."""

    kind: Literal["friction"]
    velocity: Expression
    kinetic: Expression
    static: Expression | None = None
    at: Expression | None = None


class Jenkins(SchemaPart):
    """A spring in series with a slider."""

    kind: Literal["jenkins"]
    displacement: Expression
    stiffness: Expression
    limit: Expression
    at: Expression | None = None


class Spring(SchemaPart):
    """A spring across a gap."""

    kind: Literal["spring"]
    gap: Expression
    stiffness: Expression


class Impact(SchemaPart):
    """A wall."""

    kind: Literal["impact"]
    gap: Expression
    restitution: Expression
    chatter: Flag = None


AnyContact: TypeAlias = Annotated[Friction | Jenkins | Spring | Impact, Field(discriminator="kind")]


class StructureFile(AnyModel):
    """A structure with contacts: ``M q'' + C q' + K q = f(t)``."""

    coordinates: Annotated[list[str], BeforeValidator(numbered)] = said(
        "a list of names such as [q1, q2], or {q: 20}", min_length=1
    )
    mass: Matrix = "identity"
    damping: Matrix = "0"
    stiffness: Matrix = "0"
    force: Formulas = mapping("a mapping of coordinates to expressions", FORMULA)
    contacts: dict[str, AnyContact] = mapping(
        "a mapping of names to contacts such as {kind: friction, velocity: v1, kinetic: S}"
    )


class Law(SchemaPart):
    """What a contact carries and dissipates, of a model that is written out."""

    modes: Expressions = EMPTY
    texts: Expressions = EMPTY
    rest: Expression = LEFT_OUT
    at: Expression = LEFT_OUT


class Chatter(SchemaPart):
    """A mode that begins with infinitely many impacts, of a model that is written out."""

    mode: Line
    flight: Line
    lift: Line
    other: Text = ""
    other_lift: Text = ""


class WrittenMode(Mode):
    """A mode of a model that is written out."""

    derived: Flag = None


class WrittenStructure(StructureFile):
    """A structure in units, of a model that is written out."""

    in_units: Units = EMPTY


class WrittenOut(ModelFile):
    """A model with all that is derived from what is said in short."""

    modes: Mapping[str, Annotated[WrittenMode, instead({})]] = mapping(
        "a mapping of names to {in: sides of surfaces, field: {state: rate}}"
    )
    chatters: dict[str, Chatter] = EMPTY
    forces: dict[str, Law] = EMPTY
    in_units: Units = EMPTY
    measured_from: Expressions = EMPTY
    alike: list[Texts] = NOTHING
    phase: Text = ""
    structure: WrittenStructure | None = None


def checked(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a model's data in the one form that is read, of states or of coordinates.

    Raises
    ------
    EntryError
        For the first mistake, with the address of its entry.
    """
    given = plain(data)
    schema: type[AnyModel] = StructureFile if COORDINATES in given else WrittenOut
    for key in [key for key, value in given.items() if value is None]:
        if key in schema.model_fields:
            del given[key]
    misplaced = [key for key in _STRUCTURAL if key in given]
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
