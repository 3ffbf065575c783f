"""The part of a study file that asks for what needs no orbit: responses, equilibria, ensembles."""

from __future__ import annotations

from enum import Enum
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field


class Part(BaseModel):
    """A mapping of a study file: no other keys than its own, and no types but these."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class SweepDirection(str, Enum):
    """Directions of a sweep."""

    BOTH = "both"
    UP = "up"
    DOWN = "down"


class Sense(str, Enum):
    """How a surface is crossed."""

    EITHER = "either"
    RISING = "rising"
    FALLING = "falling"


_Section = str | float
_STATE = "a list of finite numbers, one for each state of the model"
_SECTION = "stops, releases, the name of a surface, or a phase from 0 to 1"


class PoincareTask(Part):
    """Points of one solution on a section."""

    section: _Section | None = Field(None, description=_SECTION)
    sense: Annotated[Sense, Field(strict=False)] | None = Field(
        None, description="one of either, rising, falling"
    )
    state: list[float] | None = Field(None, description=_STATE)
    time: float | None = Field(None, description="a finite number: the initial time")
    periods: float | None = Field(
        None, gt=0.0, description="a number > 0: periods of which points are collected"
    )
    transient: float | None = Field(
        None, ge=0.0, description="a number >= 0: periods before points are collected"
    )

    def options(self) -> dict[str, Any]:
        """Return what is given, as arguments."""
        return self.model_dump(mode="json", exclude_none=True)


class BasinsTask(Part):
    """Starts on a grid of two states, labelled by what they converge to."""

    grid: dict[str, list[float]] = Field(
        min_length=2,
        max_length=2,
        description="a mapping of two states, each to [low, high, number of values]",
    )
    at: dict[str, float] = Field(
        {}, description="a mapping of the other states, and of phase, to numbers"
    )
    periods: int | None = Field(
        None, ge=1, description="a whole number >= 1: periods that a start is followed"
    )


class EquilibriaTask(Part):
    """Equilibria over a range of a parameter, with their events."""

    parameter: str = Field(description="the name of a parameter of the model")
    range: list[float] = Field(
        min_length=2, max_length=2, description="two finite numbers [low, high]"
    )
    values: int | None = Field(
        None,
        ge=1,
        description="a whole number >= 1: values of the parameter at which equilibria are looked for",
    )
    starts: int | None = Field(
        None, ge=1, description="a whole number >= 1: starts of Newton's method in a mode"
    )
    max_step: float | None = Field(
        None,
        gt=0.0,
        le=1.0,
        description="a number in (0, 1]: largest step, as a share of the range",
    )

    def options(self) -> dict[str, Any]:
        """Return what is given beyond the parameter and the range, as arguments."""
        return self.model_dump(exclude={"parameter", "range"}, exclude_none=True)


class EnsembleTask(Part):
    """Diagrams of random parameters."""

    parameter: str = Field(description="the name of a parameter of the model")
    range: list[float] = Field(
        min_length=2, max_length=2, description="two finite numbers [low, high]"
    )
    distributions: dict[str, list[float] | dict[str, list[float]]] = Field(
        description="a mapping of parameters to [low, high], or to a distribution of scipy.stats with its "
        "arguments, such as {norm: [0.32, 0.01]}"
    )
    samples: int | None = Field(None, ge=1, description="a whole number >= 1: diagrams")
    seed: int | None = Field(None, ge=0, description="a whole number >= 0")
    row: str | None = Field(None, description="a quantity, of which bands are made")
    values: int | None = Field(
        None, ge=2, description="a whole number >= 2: values of the parameter for bands"
    )
    max_step: float | None = Field(None, gt=0.0, description="a number > 0")
    bridges: bool | None = Field(None, description="true or false")
    max_periods: int | None = Field(None, ge=1, description="a whole number >= 1")
    copies: int | None = Field(None, ge=1, description="a whole number >= 1")
    max_branches: int | None = Field(None, ge=1, description="a whole number >= 1")
    max_points: int | None = Field(None, ge=1, description="a whole number >= 1")
    workers: int | None = Field(None, ge=1, description="a whole number >= 1: processes")

    def options(self) -> dict[str, Any]:
        """Return what is given beyond parameter, range, distributions and processes, as arguments."""
        given = {"parameter", "range", "distributions", "workers"}
        return self.model_dump(exclude=given, exclude_none=True)


class SweepTask(Part):
    """Simulations along a parameter, the state carried over."""

    parameter: str = Field(description="the name of a parameter of the model")
    values: list[float] = Field(
        min_length=3, max_length=3, description="[low, high, number of values]"
    )
    direction: Annotated[SweepDirection, Field(strict=False)] | None = Field(
        None, description="one of both, up, down"
    )
    periods: float | None = Field(
        None, gt=0.0, description="a number > 0: periods of which points are collected"
    )
    transient: float | None = Field(
        None, ge=0.0, description="a number >= 0: periods before points are collected"
    )
    section: _Section | None = Field(None, description=_SECTION)
    sense: Annotated[Sense, Field(strict=False)] | None = Field(
        None, description="one of either, rising, falling"
    )
    state: list[float] | None = Field(None, description=_STATE)

    def options(self) -> dict[str, Any]:
        """Return what is given beyond the parameter and its values, as arguments."""
        given = {"parameter", "values"}
        return self.model_dump(mode="json", exclude=given, exclude_none=True)
