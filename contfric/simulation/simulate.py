"""Simulation from an initial condition: a trajectory as the list of its events."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray, IntArray
from contfric.base.pace import Pace
from contfric.base.renamed import renamed
from contfric.base.shown import Shown
from contfric.base.tabled import as_table
from contfric.base.tally import tally
from contfric.errors import function_of, real_number, whole_number
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.tied import tied
from contfric.simulation.dense import sample, table
from contfric.simulation.starts import checked_state, left_through, start_of
from contfric.simulation.tables import SOLVED, surfaces_under, tables
from contfric.simulation.time_scale import clock_period, time_scale

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from contfric.simulation.growing_tables import GrowingTables

#: Hears one line of text now and then.
Progress = Callable[[str], None]


class SimulationEnd(str, Enum):
    """How a simulation ended; the text says what it means."""

    EVENTS = "the number of events asked for was reached"
    TIME = "the time asked for was reached"
    HELD = "the solution stays on a surface for ever (a mass at rest): nothing releases it"
    IMPOSSIBLE = (
        "no mode holds where the solution has come to, or events follow each other at once, so that time "
        "does not go on"
    )
    INFINITE = "the solution diverged"
    QUIET = (
        "the solution meets no surface any more: it has come to an equilibrium, or never changes"
    )
    CHATTER = (
        "impacts follow each other faster and faster (chatter): infinitely many in finite time, and the "
        "mass stays at the wall"
    )


class EventRows(NamedTuple):
    """Workspace for the events of a trajectory.

    Attributes
    ----------
    joints : mode that ends and surface it exits by, shape (events, 2)
    cycles, times, states : periods completed, phase and state, shapes (events,), (events,), (events, n)
    """

    joints: IntArray
    cycles: IntArray
    times: FloatArray
    states: FloatArray

    @classmethod
    def empty(cls, count: int, states: int) -> EventRows:
        """Return rows for so many events of so many states."""
        whole = np.empty((count, 2), dtype=np.int64), np.empty(count, dtype=np.int64)
        return cls(*whole, np.empty(count), np.empty((count, states)))

    def first(self, count: int) -> EventRows:
        """Return the first rows, as views."""
        j, c, t, y = self
        return EventRows(j[:count], c[:count], t[:count], y[:count])


def joined(pieces: list[EventRows]) -> EventRows:
    """Return rows of events one after the other; a single piece, as almost always, is not copied."""
    if len(pieces) == 1:
        return pieces[0]
    return EventRows(*map(np.concatenate, zip(*pieces, strict=True)))


@dataclass(frozen=True, repr=False)
class Trajectory(Shown):
    """The events of a trajectory.

    Attributes
    ----------
    modes, exits : mode that ends and surface met at each event, shape (events,)
    cycles, times : completed periods of the excitation and phase in the period, shape (events,)
    states : state at each event, shape (events, n)
    end : how the simulation ended
    last : (periods completed, phase, state, mode) where it ended
    begin : (time, state) where it began

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.simulate("coulomb", {"Omega": 0.5}, state=[1.3, 0.0], periods=2)
    >>> found.sample([0.0, 1.0]).shape
    (2, 2)
    """

    model: Model
    params: dict[str, float]
    modes: IntArray
    exits: IntArray
    cycles: IntArray
    times: FloatArray
    states: FloatArray
    end: SimulationEnd
    last: tuple[int, float, FloatArray, str]
    begin: tuple[float, FloatArray]

    def __len__(self) -> int:
        return len(self.modes)

    def __repr__(self) -> str:
        return f"<Trajectory of {self.model.name}: {len(self)} events, ended by {self.end.name}>"

    @property
    def itinerary(self) -> tuple[tuple[str, str], ...]:
        """The (mode, exit surface) pairs of the segments that ended."""
        return self.itinerary_from(0)

    def itinerary_from(self, first: int) -> tuple[tuple[str, str], ...]:
        """Return the pairs of :attr:`itinerary` from one on: of a long solution the last ones are wanted."""
        modes = [m.name for m in self.model.modes]
        surfaces = [s.name for s in self.model.surfaces]
        pairs = zip(self.modes[first:].tolist(), self.exits[first:].tolist(), strict=True)
        return tuple((modes[m], surfaces[k]) for m, k in pairs)

    word = renamed("word", "itinerary")

    def sample(self, times: ArrayLike) -> FloatArray:
        """Return the states at times between begin and end, shape (k, n): exact, nothing is interpolated.

        Raises
        ------
        ParameterError
            If a time is not within the trajectory.
        """
        return sample(self, times)

    def to_dataframe(self, points: int = 1000) -> pd.DataFrame:
        """Return t, states, mode and event, at all events and ``points`` times between (needs pandas)."""
        return as_table(self.columns(points), self.model.origins)

    def columns(self, points: int = 1000) -> dict[str, Any]:
        """Return the columns of :meth:`to_dataframe` without pandas."""
        return table(self, points)

    def plot(self, ax: Axes | None = None, points: int | None = None) -> Axes:
        """Draw the trajectory in the plane of the first two states, coloured by mode."""
        from contfric.plot.orbits.trajectory import plot_trajectory

        return plot_trajectory(self, ax=ax, points=points)


def simulate(
    model: ModelSource,
    params: Parameters | None = None,
    *,
    state: ArrayLike | None = None,
    time: float = 0.0,
    periods: float = 100.0,
    events: int = 1_000_000,
    domain: str | None = None,
    progress: Progress | None = None,
) -> Trajectory:
    """Follow a trajectory, event by event.

    Parameters
    ----------
    model, params : the model (or its name) and its parameters; defaults fill in
    state : initial state, shape (n,); by default the model's rest position shifted by its spread
    time : initial time, nondimensional
    periods : time to follow, in periods of the excitation or of the clock (units of time without either)
    events : most events to follow
    domain : initial domain, where the state alone does not decide
    progress : called with one line of text now and then

    Returns
    -------
    Trajectory
        Its events: ``times``, shape (k,), ``states``, shape (k, n), ``itinerary`` with mode and exit of each
        segment, and ``end``, the reason why it ended.

    Raises
    ------
    ParameterError
        If parameters, state or domain are not valid.

    Examples
    --------
    >>> import contfric as cf
    >>> cf.simulate("coulomb", {"Omega": 0.5}, state=[1.3, 0.0], periods=2).itinerary[0]
    ('stick', 'F+')
    """
    model, params = tied(model, params)
    vector = model.vector(params)
    y = checked_state(model, vector, state)
    time, periods = real_number("time", time), real_number("periods", periods, least=0.0)
    events = whole_number("events", events, least=1)
    function_of("progress", progress)
    mode, on = start_of(model, time, y, vector, domain)
    length = periods * clock_period(model, vector)
    return run(model, vector, mode, on, time, y, length, events, progress)


def go_on(trajectory: Trajectory, periods: float, progress: Progress | None = None) -> Trajectory:
    """Follow a trajectory from where it ended, in the mode that it was in."""
    model, (_, time, y, mode) = trajectory.model, trajectory.last
    on = surfaces_under(model, mode)
    return run(
        model,
        model.vector(trajectory.params),
        model.mode_index[mode],
        on,
        time,
        y,
        periods,
        _MOST_EVENTS,
        progress,
    )


def run(
    model: Model,
    vector: FloatArray,
    mode: int,
    on: int,
    time: float,
    y: FloatArray,
    periods: float,
    events: int,
    progress: Progress | None = None,
) -> Trajectory:
    """Run the compiled simulation; the state is copied. Rows are grown as they are needed.

    ``progress`` is told the number of events where that takes more than a tenth of a second.
    """
    from contfric.simulation.march import ALL_EVENTS, CARRIED, UNIT, simulate

    growing = _growing_tables(model)
    model_tables = tables(model) if growing is None else growing.tables()
    began_at, y = (time, y), y.copy()
    pieces: list[EventRows] = []
    done, carry, pace = 0, np.zeros(CARRIED), Pace(_FIRST_EVENTS)
    carry[UNIT] = time_scale(model)
    while True:  # between the calls Ctrl-C is heard
        began = perf_counter()
        written = EventRows.empty(min(pace.budget, events - done), len(y))
        start = model.flow.following(), model_tables, mode, on, time, y, vector, float(periods)
        end, count, mode, cycle, phase = simulate(*start, written, carry, pace.budget)
        tally()[3] += count
        pieces.append(written.first(count))
        done += count
        grown = mode <= SOLVED
        if grown and growing is not None:
            last = int(written.joints[count - 1, 0]), int(written.joints[count - 1, 1])
            mode = growing.visit(mode, last, phase, y, vector)
            model_tables = growing.tables()
        if end != ALL_EVENTS or done >= events:
            break
        if progress is not None:
            progress(f"{done} events")
        time = phase
        pace.took(count if grown else pace.budget, perf_counter() - began)
    found = joined(pieces)
    at_last = cycle, float(phase), y, model.modes[mode].name if mode >= 0 else ""
    modes, exits = found.joints.T
    columns = modes, exits, found.cycles, found.times, found.states
    how, params = list(SimulationEnd)[end], model.mapping(vector)
    if (
        how is SimulationEnd.TIME
        and growing is None
        and left_through(model, at_last[3], *at_last[1:3], vector)
    ):
        how = SimulationEnd.IMPOSSIBLE  # it has passed a surface at which no mode follows
    return Trajectory(model, params, *columns, how, at_last, began_at)


def _growing_tables(model: Model) -> GrowingTables | None:
    """Return the tables of a model whose modes come as solutions visit them; None for any other model."""
    if not isinstance(model, ComposedModel):
        return None
    from contfric.simulation.growing_tables import growing_tables  # with all that composes a model

    return growing_tables(model)


#: Events that a trajectory goes on for.
_MOST_EVENTS = 10_000_000
#: Events that the first call of the simulation may follow: milliseconds, or half a second of a stiff one.
_FIRST_EVENTS = 256
