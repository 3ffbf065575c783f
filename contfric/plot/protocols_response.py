"""What the drawings need to know of sweeps, return maps and basins."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from contfric.models import Model
from contfric.models.definition import FloatArray
from contfric.plot.protocols import OrbitLike


class SweepLike(Protocol):
    """Simulated points along a parameter."""

    @property
    def parameter(self) -> str:
        """The parameter that varies."""

    @property
    def params(self) -> Mapping[str, float]:
        """The parameters that do not vary."""

    @property
    def values(self) -> FloatArray:
        """Its values."""

    @property
    def model(self) -> Model:
        """The model that moves."""

    @property
    def section(self) -> str | float:
        """What the points lie on."""

    @property
    def runs(self) -> Mapping[str, object]:
        """The directions."""

    def state_index(self, state: str | None) -> int:
        """Return the number of a state by its name."""

    def points(self, direction: str, state: str | None = None) -> tuple[FloatArray, FloatArray]:
        """Return the parameter and one state of each point."""

    def quantity(self, row: str) -> Iterable[tuple[str, FloatArray, FloatArray]]:
        """Return (direction, parameter, what a diagram shows in one of its rows)."""


class ReturnsLike(Protocol):
    """Points of a solution on a section."""

    @property
    def model(self) -> Model:
        """The model that moves."""

    def pairs(self, coordinate: str | None, step: int) -> tuple[FloatArray, FloatArray]:
        """Return a coordinate of each point and that of a later one."""


class ReleaseMapLike(Protocol):
    """The map from one release to the next."""

    @property
    def period(self) -> float:
        """Period of the phase."""

    @property
    def branches(self) -> Sequence[tuple[FloatArray, FloatArray]]:
        """Phases and images of each branch."""

    def cobweb(self, phase: float, count: int) -> FloatArray:
        """Return the phases of a release and of those that follow it."""


class ShareLike(Protocol):
    """The share of one attractor."""

    @property
    def name(self) -> str:
        """What it is."""

    @property
    def orbit(self) -> int:
        """Number of the orbit, -1 if there is none."""

    @property
    def share(self) -> float:
        """Share of all starts."""


class BasinsLike(Protocol):
    """What starts on a grid converge to."""

    @property
    def model(self) -> Model:
        """The model that moves."""

    @property
    def axes(self) -> Mapping[str, FloatArray]:
        """The two states that vary, and their values."""

    @property
    def at(self) -> Mapping[str, float]:
        """The other states, and the phase."""

    @property
    def orbits(self) -> Sequence[OrbitLike]:
        """The orbits."""

    @property
    def names(self) -> Sequence[str]:
        """Their names."""

    @property
    def labels(self) -> NDArray[np.int32]:
        """Number of the orbit of each start, -1 if there is none."""

    @property
    def motions(self) -> NDArray[np.uint8]:
        """What each start is."""

    @property
    def shares(self) -> Sequence[ShareLike]:
        """Shares of all that occurs."""
