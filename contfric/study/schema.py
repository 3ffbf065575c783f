"""The schema of a study file: what may stand where, and of which type."""

from __future__ import annotations

from enum import Enum
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from contfric.study.schema_response import (
    BasinsTask,
    EnsembleTask,
    EquilibriaTask,
    PoincareTask,
    SweepTask,
)
from contfric.study.schema_response import Part as _Part
from contfric.yaml_lines import as_truth

_Truth = Annotated[bool, BeforeValidator(as_truth)]


class Want(str, Enum):
    """Quantities that a study may ask for, beyond the parameters and the names of the orbits."""

    STABILITY = "stability"
    ASYMMETRY = "asymmetry"
    EXTREMA = "extrema"
    STOPS = "stops"


class FigureKind(str, Enum):
    """Kinds of figures."""

    DIAGRAM = "diagram"
    ORBIT = "orbit"
    TRANSITIONS = "transitions"
    BRANCHES = "branches"
    LYAPUNOV = "lyapunov"
    PLANE = "plane"
    SWEEP = "sweep"
    POINCARE = "poincare"
    BASINS = "basins"
    EQUILIBRIA = "equilibria"
    ENSEMBLE = "ensemble"


class Row(str, Enum):
    """Rows of a diagram."""

    X_MAX = "x_max"
    X_MIN = "x_min"
    STOPS = "stops"
    PSI = "psi"
    PERIOD = "period"

    @property
    def needs(self) -> Want | None:
        """The quantity that the row shows; None for one that is always there."""
        return _NEEDS.get(self)


_NEEDS = {
    Row.X_MAX: Want.EXTREMA,
    Row.X_MIN: Want.EXTREMA,
    Row.STOPS: Want.STOPS,
    Row.PSI: Want.ASYMMETRY,
}


def row_name(row: Row | str) -> str:
    """Return the name of a row."""
    return row.value if isinstance(row, Row) else row


class Format(str, Enum):
    """Formats of figures."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"


class Journal(str, Enum):
    """Widths of figures in a journal."""

    SINGLE = "single"
    DOUBLE = "double"


# YAML has texts where Python has enumerations: these fields alone are converted
# (a text that is none of them is a quantity, which the model has or has not)
_Quantity = Annotated[str, Field(min_length=1)]
_Wants = list[
    Annotated[Annotated[Want, Field(strict=False)] | _Quantity, Field(union_mode="left_to_right")]
]
_Rows = Annotated[
    list[
        Annotated[
            Annotated[Row, Field(strict=False)] | _Quantity, Field(union_mode="left_to_right")
        ]
    ],
    Field(min_length=1),
]


class Simulated(_Part):
    """Start from a simulation: the orbit that the motion converges to."""

    state: list[float] | None = Field(
        None, description="a list of finite numbers, one for each state of the model"
    )
    time: float = Field(0.0, description="a finite number: the initial time")
    periods: int | None = Field(
        None, ge=1, le=64, description="a whole number from 1 to 64: the period wanted"
    )
    longest: int = Field(
        50_000, ge=200, description="a whole number >= 200: periods to simulate at most"
    )


class Start(_Part):
    """Where the first orbit comes from: exactly one of the three."""

    simulate: Simulated | None = Field(
        None, description="a mapping with any of state, time, periods, longest"
    )
    signature: str | None = Field(
        None, min_length=1, description="the name of a signature, or the path of its file"
    )
    orbit: str | None = Field(None, min_length=1, description="the path of a saved orbit (.npz)")


class _Task(_Part):
    parameter: str = Field(description="the name of a parameter of the model")
    range: list[float] = Field(
        min_length=2, max_length=2, description="two finite numbers [low, high]"
    )
    max_step: float | None = Field(
        None,
        gt=0.0,
        le=1.0,
        description="a number in (0, 1]: largest step, as a share of the range",
    )
    max_points: int | None = Field(
        None, ge=10, description="a whole number >= 10: most points of each side of a branch"
    )

    stop_at: dict[str, float] | None = Field(
        None,
        description="a mapping of quantities to the value at which a branch ends, such as {x_max: 1.4}",
    )

    def options(self) -> dict[str, Any]:
        """Return what is given beyond the parameter and the range, as arguments."""
        return self.model_dump(exclude={"parameter", "range"}, exclude_none=True)


class ContinueTask(_Task):
    """Follow the branch of the first orbit to its ends."""


class SeedsTask(_Part):
    """Simulations whose attractors start branches that nothing else reaches."""

    values: int = Field(20, ge=1, description="a whole number >= 1: values of the parameter")
    states: int = Field(3, ge=1, description="a whole number >= 1: initial conditions at each")
    seed: int = Field(0, ge=0, description="a whole number >= 0: seed of the random ones")


class ExploreTask(_Task):
    """Follow all branches that can be reached from the first orbit."""

    seeds: SeedsTask | None = Field(None, description="a mapping with any of values, states, seed")
    bridges: _Truth | None = Field(
        None,
        description="true or false: whether orbits with holds lead on where the flow jumps",
    )
    max_periods: int | None = Field(
        None,
        ge=1,
        le=16,
        description="a whole number from 1 to 16: longest orbits, in periods",
    )
    copies: int | None = Field(
        None,
        ge=1,
        le=16,
        description="a whole number from 1 to 16: most copies of a motion at a sliding event",
    )
    max_branches: int | None = Field(
        None, ge=1, description="a whole number >= 1: most branches to compute"
    )
    verify: _Truth = Field(
        False, description="true or false: whether the diagram is restarted from its own branches"
    )


class LyapunovTask(_Part):
    """Lyapunov exponents on a grid of two parameters."""

    grid: dict[str, list[float]] = Field(
        min_length=2,
        max_length=2,
        description="a mapping of two parameters, each to [low, high, number of values]",
    )
    periods: int | None = Field(
        None, ge=1, description="a whole number >= 1: most periods to average over"
    )
    transient: int | None = Field(
        None, ge=0, description="a whole number >= 0: periods before averaging begins"
    )
    tolerance: float | None = Field(
        None, gt=0.0, description="a number > 0: relative error at which averaging ends"
    )
    confirm: int | None = Field(
        None, ge=0, description="a whole number >= 0: periods that chaos is followed further"
    )
    starts: int | None = Field(
        None, ge=1, description="a whole number >= 1: initial conditions at each point"
    )
    state: list[float] | None = Field(
        None, description="a list of finite numbers, one for each state: where every motion starts"
    )

    def options(self) -> dict[str, Any]:
        """Return what is given beyond the grid, as arguments."""
        return self.model_dump(exclude={"grid"}, exclude_none=True)


class PlaneTask(_Part):
    """Follow the curves of bifurcations in a plane of two parameters."""

    parameters: list[str] = Field(
        min_length=2, max_length=2, description="the names of two parameters of the model"
    )
    range: dict[str, list[float]] = Field(
        description="a mapping of both parameters to two finite numbers [low, high]"
    )
    sections: dict[str, list[float]] | None = Field(
        None, description="a mapping of one or both parameters to lists of values"
    )
    kinds: list[str] | None = Field(
        None, min_length=1, description="a list with any of SN, BP, PD, CS, SS, AS, GS, T"
    )
    seeds: SeedsTask | None = Field(None, description="a mapping with any of values, states, seed")
    max_step: float | None = Field(
        None,
        gt=0.0,
        le=1.0,
        description="a number in (0, 1]: largest step, as a share of the ranges",
    )
    max_periods: int | None = Field(
        None,
        ge=1,
        le=16,
        description="a whole number from 1 to 16: longest orbits whose curves count",
    )
    max_curves: int | None = Field(
        None, ge=1, description="a whole number >= 1: most curves to compute"
    )
    max_sections: int | None = Field(
        None, ge=1, description="a whole number >= 1: most sections, those of the study among them"
    )

    def options(self) -> dict[str, Any]:
        """Return what is given beyond the plane and its sections, as arguments."""
        given = {"parameters", "range", "sections", "seeds"}
        return self.model_dump(exclude=given, exclude_none=True)


class Figure(_Part):
    """One figure."""

    kind: Annotated[FigureKind, Field(strict=False)] = Field(
        description="one of diagram, orbit, transitions, branches, lyapunov, plane, sweep, "
        "poincare, basins, equilibria, ensemble"
    )
    rows: _Rows | None = Field(
        None,
        description="a list of rows of a diagram: x_max, x_min, stops, psi, period, or any quantity",
    )
    file: str | None = Field(None, min_length=1, description="the name of the figure's file")
    format: Annotated[Format, Field(strict=False)] | None = Field(
        None, description="one of png, svg, pdf"
    )
    inset: bool = Field(
        False, description="true: the part of a diagram in which events crowd is drawn larger"
    )
    journal: Annotated[Journal, Field(strict=False)] | None = Field(
        None,
        description="single or double: as wide as a column (88 mm) or the page (180 mm) of a journal",
    )


class StudyFile(_Part):
    """The content of a study file.

    Examples
    --------
    >>> StudyFile(model="coulomb", want=["stability"]).want
    [<Want.STABILITY: 'stability'>]
    """

    title: str | None = Field(None, description="a text")
    model: str = Field(description="the name of a model, or the path of its YAML file")
    params: dict[str, float | dict[str, str]] = Field(
        {},
        description="a mapping of parameters to finite numbers, or to what they follow, such as {tie: S}",
    )
    start: Start = Field(
        Start(simulate=Simulated()),
        description="'simulate', or a mapping with one of simulate, signature, orbit",
    )
    explore: ExploreTask | None = Field(
        None,
        description="a mapping with parameter and range; also bridges, seeds, max_step, "
        "max_points, stop_at, max_periods, copies, max_branches, verify",
    )
    continue_: ContinueTask | None = Field(
        None,
        alias="continue",
        description="a mapping with parameter and range; also max_step, max_points, stop_at",
    )
    lyapunov: LyapunovTask | None = Field(
        None,
        description="a mapping with grid; also periods, transient, tolerance, confirm, starts, "
        "state",
    )
    plane: PlaneTask | None = Field(
        None,
        description="a mapping with parameters and range; also sections, kinds, seeds, max_step, "
        "max_periods, max_curves, max_sections",
    )
    sweep: SweepTask | None = Field(
        None,
        description="a mapping with parameter and values; also direction, periods, transient, "
        "section, sense, state",
    )
    poincare: PoincareTask | None = Field(
        None, description="a mapping with any of section, sense, state, time, periods, transient"
    )
    basins: BasinsTask | None = Field(None, description="a mapping with grid; also at, periods")
    equilibria: EquilibriaTask | None = Field(
        None,
        description="a mapping with parameter and range; also values, starts, max_step",
    )
    ensemble: EnsembleTask | None = Field(
        None,
        description="a mapping with parameter, range and distributions; also samples, seed, row, values, "
        "workers, max_step, bridges, max_periods, copies, max_branches, max_points",
    )
    want: _Wants = Field(
        [],
        description="a list with any of stability, asymmetry, extrema, stops, and of quantities",
    )
    figures: list[Figure] = Field([], description="a list of mappings, each with its kind")

    @property
    def quantities(self) -> list[str]:
        """The quantities that it wants a column of, beyond those that have a name of their own."""
        return [name for name in self.want if not isinstance(name, Want)]

    @property
    def task(self) -> ExploreTask | ContinueTask | None:
        """What is done with the first orbit; None if nothing is."""
        return self.explore or self.continue_

    @property
    def needs_orbit(self) -> bool:
        """Whether anything is asked for that needs the orbit of the start."""
        shown = {figure.kind for figure in self.figures}
        others = (self.sweep, self.poincare, self.basins, self.equilibria, self.ensemble)
        simulated = any(task is not None for task in (self.lyapunov, *others))
        alone = simulated and self.task is None and self.plane is None
        return (
            not alone
            or "start" in self.model_fields_set
            or bool(shown & {FigureKind.ORBIT, FigureKind.TRANSITIONS})
        )

    def as_dict(self) -> dict[str, Any]:
        """Return what the file says, as plain data."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True)
