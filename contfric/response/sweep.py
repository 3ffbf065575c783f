"""A sweep: points of simulated solutions on a section, along a parameter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.extras import need_xarray
from contfric.base.named import Named
from contfric.base.tabled import Columns, Tabled
from contfric.errors import ParameterError, shown
from contfric.models.definition import Model
from contfric.models.shorthand.clocks import TICK
from contfric.response.outcome import Outcome
from contfric.response.sections import RELEASES, STOPS

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Quantities of a diagram that the displacements at stops have, too.
ROWS = ("stops", "x_max", "x_min", "psi")


@dataclass(frozen=True, eq=False)
class SweepRun:
    """One direction of a sweep; points stand in the order of the values, from the lowest up.

    Attributes
    ----------
    outcomes : ndarray, shape (values,)
        Code of the :class:`~contfric.response.outcome.Outcome` at each value.
    periods : ndarray, shape (values,)
        Periods after which the solution repeats itself (1 without excitation); 0 if it does not.
    index : ndarray, shape (points,)
        Number of the value that each point belongs to.
    cycles, modes : ndarray, shape (points,)
        Periods completed since the value was set, and number of the mode that met the section.
    times : ndarray, shape (points,)
        Phase in the period (time since the start without excitation).
    states : ndarray, shape (points, n)
        State on the section.
    """

    outcomes: NDArray[np.uint8]
    periods: NDArray[np.int32]
    index: NDArray[np.int32]
    cycles: NDArray[np.int32]
    modes: NDArray[np.uint8]
    times: FloatArray
    states: FloatArray

    def __len__(self) -> int:
        return len(self.times)


@dataclass(frozen=True, eq=False)
class Sweep(Tabled):
    """Points of simulated solutions along a parameter; the result of :func:`contfric.sweep`.

    Attributes
    ----------
    model : Model
    parameter : str
        The parameter that varies.
    values : ndarray, shape (values,)
        Its values, ascending.
    vector : ndarray, shape (parameters,)
        The other parameters.
    section : str or float
        What the points lie on.
    runs : dict
        A :class:`SweepRun` for each direction, "up" and "down".

    Examples
    --------
    >>> import contfric as cf
    >>> cf.sweep("coulomb", "Omega", [0.4, 0.45, 0.5]).up.periods.tolist()
    [1, 1, 1]
    """

    model: Model
    parameter: str
    values: FloatArray
    vector: FloatArray
    section: str | float
    runs: dict[str, SweepRun]

    @property
    def params(self) -> dict[str, float]:
        """The parameters that do not vary."""
        named = self.model.mapping(self.vector)
        return Named({name: value for name, value in named.items() if name != self.parameter})

    @property
    def up(self) -> SweepRun:
        """The direction of growing values."""
        return self._run("up")

    @property
    def down(self) -> SweepRun:
        """The direction of falling values."""
        return self._run("down")

    def _run(self, direction: str) -> SweepRun:
        if direction not in self.runs:
            raise ParameterError(
                f"the sweep has no direction '{direction}': {', '.join(self.runs)}"
            )
        return self.runs[direction]

    @property
    def complete(self) -> bool:
        """Whether all values have been computed; False after an interrupt."""
        return not any(bool(np.any(r.outcomes == Outcome.MISSING.code)) for r in self.runs.values())

    def counts(self) -> dict[Outcome, int]:
        """Return how many solutions there are of each kind that occurs, over both directions."""
        every = np.concatenate([run.outcomes for run in self.runs.values()])
        found = np.bincount(every, minlength=len(Outcome))
        return {o: int(found[o.code]) for o in Outcome if found[o.code]}

    def points(
        self, direction: str = "up", state: str | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return the parameter and one state (the displacement by default) of each point."""
        run = self._run(direction)
        return self.values[run.index], run.states[:, self.state_index(state)]

    def state_index(self, state: str | None) -> int:
        """Return the number of a state by its name; that of the displacement by default.

        Raises
        ------
        ParameterError
            If there is no such state.
        """
        if state is None:
            return 0
        if state not in self.model.states:
            raise ParameterError(
                f"a state of '{self.model.name}' is one of {', '.join(self.model.states)}, got {shown(state)}"
            )
        return self.model.states.index(state)

    def shows(self, row: object) -> bool:
        """Tell whether an overlay has a row of a diagram: its points are where the displacement may turn."""
        if self.section == STOPS:
            return row in ROWS
        model = self.model
        walls = {reset.surface for reset in model.resets} - {TICK}
        turning = {RELEASES, model.stop_surface, *walls} if model.stop_surface else set()
        return row == "stops" and self.section in turning

    def quantity(self, row: str) -> Iterator[tuple[str, FloatArray, FloatArray]]:
        """Yield (direction, parameter, what a diagram shows in one of its rows), for an overlay.

        Raises
        ------
        ParameterError
            If the section does not have it: extrema need the stops.
        """
        if row not in ROWS:
            raise ParameterError(f"a row is one of {', '.join(ROWS)}, got {shown(row)}")
        if not self.shows(row):
            if not self.model.stop_surface:
                raise ParameterError(
                    f"'{row}' is known at the stops, and '{self.model.name}' names no surface v = 0 "
                    "for them: draw the sweep by itself, sweep.plot()"
                )
            other = ", or draw row='stops'" if self.shows("stops") else ""
            raise ParameterError(
                f"'{row}' is known at the stops, and the sweep has section {self.section!r}: "
                f"sweep(..., section='stops'){other}"
            )
        for name in self.runs:
            x, y = self.points(name)
            if row == "stops":
                yield name, x, y
            elif len(x):
                yield name, *self._extrema(name, row)

    def _extrema(self, direction: str, row: str) -> tuple[FloatArray, FloatArray]:
        run = self.runs[direction]
        first = np.flatnonzero(np.diff(run.index, prepend=-1))  # points of a value stand together
        high = np.maximum.reduceat(run.states[:, 0], first)
        low = np.minimum.reduceat(run.states[:, 0], first)
        x = self.values[run.index[first]]
        if row == "psi":
            with np.errstate(invalid="ignore", divide="ignore"):
                return x, np.abs(high + low) / np.abs(high - low)
        return x, high if row == "x_max" else low

    @cached_property
    def periods(self) -> dict[str, NDArray[np.int32]]:
        """Periods after which the solution repeats itself, for each direction."""
        return Named({name: run.periods for name, run in self.runs.items()})

    def columns(self) -> Columns:
        """Return one row for each point: direction, parameter, outcome, period, mode, phase, state."""
        modes, runs = np.array([mode.name for mode in self.model.modes]), self.runs.values()
        states = np.concatenate([run.states for run in runs])
        return {
            "direction": np.repeat(list(self.runs), [len(run) for run in runs]),
            self.parameter: np.concatenate([self.values[run.index] for run in runs]),
            "outcome": np.concatenate([Outcome.words()[run.outcomes[run.index]] for run in runs]),
            "period": np.concatenate([run.periods[run.index] for run in runs]),
            "mode": modes[np.concatenate([run.modes for run in runs])],
            "t": np.concatenate([run.times for run in runs]),
            **dict(zip(self.model.states, states.T, strict=True)),
        }

    def to_xarray(self) -> xr.Dataset:
        """Return outcomes and periods over direction and parameter, and all points, as a dataset (xarray)."""
        need_xarray()
        import xarray as xr

        grid, runs = ("direction", self.parameter), self.runs.values()
        points = {
            f"point_{name}" if name in grid else name: ("point", values)
            for name, values in self.columns().items()
            if name not in ("outcome", "period")
        }
        return xr.Dataset(
            {
                "outcome": (grid, np.array([Outcome.words()[run.outcomes] for run in runs])),
                "period": (grid, np.array([run.periods for run in runs])),
                **points,
            },
            coords={"direction": list(self.runs), self.parameter: self.values},
            attrs={"model": self.model.name, "section": self.section, **self.params},
        )

    def plot(self, ax: Axes | None = None, state: str | None = None) -> Axes:
        """Draw one state of all points, the displacement by default, against the parameter."""
        from contfric.plot.response import plot_sweep

        return plot_sweep(self, ax=ax, state=state)

    def __repr__(self) -> str:
        found = ", ".join(f"{count} {o.name.lower()}" for o, count in self.counts().items())
        low, high = self.values[0], self.values[-1]
        return (
            f"<Sweep of {self.model.name}: {len(self.values)} values, {self.parameter} in "
            f"[{low:g}, {high:g}], {' and '.join(self.runs)}; {found}>"
        )
