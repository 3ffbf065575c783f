"""Simulation from an initial condition: a trajectory as the list of its events."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contfric.errors import real_number, whole_number
from contfric.models import ModelSource, Parameters
from contfric.models.definition import FloatArray, Model
from contfric.models.tied import tied
from contfric.orbit.counts import TALLY
from contfric.orbit.pace import Pace
from contfric.orbit.starts import checked_state, start_of
from contfric.orbit.structure import cut_bounds
from contfric.orbit.system import IntArray


class SimulationEnd(str, Enum):
    """How a simulation ended; the text says what it means."""

    EVENTS = "the number of events asked for was reached"
    TIME = "the time asked for was reached"
    HELD = "the mass stays at rest for ever: nothing releases it"
    IMPOSSIBLE = "events follow each other at once, and time does not go on"
    INFINITE = "the solution diverged"
    QUIET = "the motion meets no surface any more: it has come to an equilibrium, or never changes"
    CHATTER = (
        "impacts follow each other faster and faster (chatter): infinitely many in finite time"
    )


class Tables(NamedTuple):
    """The model's transitions in the form that the compiled simulation takes.

    Attributes
    ----------
    observables : observable of each surface
    bounds : whether a surface bounds a mode, shape (modes, surfaces); 2 if it has a reset
    following : mode after (mode, surface, signs of the other surfaces as bits); -1 if there is none
    sliding : whether a mode slides on a surface; 2 if it may do so for long, without excitation
    lies_on : surfaces that a mode moves on, as bits
    kept : surfaces that the state stays on where a surface is met, as bits: a reset takes it off others
    landed : surfaces that the state is on where motion goes on, as bits: the one met, but for a reset
    """

    observables: IntArray
    bounds: IntArray
    following: IntArray
    sliding: IntArray
    lies_on: IntArray
    kept: IntArray
    landed: IntArray


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

    def first(self, count: int) -> EventRows:
        """Return the first rows, as views."""
        return EventRows(
            self.joints[:count], self.cycles[:count], self.times[:count], self.states[:count]
        )


def joined(pieces: list[EventRows]) -> EventRows:
    """Return rows of events one after the other; a single piece, as almost always, is not copied."""
    if len(pieces) == 1:
        return pieces[0]
    return EventRows(
        np.concatenate([piece.joints for piece in pieces]),
        np.concatenate([piece.cycles for piece in pieces]),
        np.concatenate([piece.times for piece in pieces]),
        np.concatenate([piece.states for piece in pieces]),
    )


@dataclass(frozen=True)
class Trajectory:
    """The events of a trajectory.

    Attributes
    ----------
    modes, exits : mode that ends and surface met at each event, shape (events,)
    cycles, times : completed periods of the excitation and phase in the period, shape (events,)
    states : state at each event, shape (events, n)
    end : how the simulation ended
    last : (periods completed, phase, state, mode) where it ended
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

    def __len__(self) -> int:
        return len(self.modes)

    @property
    def word(self) -> tuple[tuple[str, str], ...]:
        """The (mode, exit surface) pairs of the segments that ended."""
        modes = [m.name for m in self.model.modes]
        surfaces = [s.name for s in self.model.surfaces]
        return tuple((modes[m], surfaces[k]) for m, k in zip(self.modes, self.exits, strict=True))


@cache
def tables(model: Model) -> Tables:
    """Return the transition tables of a model, in modes as they were declared: sections are events, too."""
    surfaces = [s.name for s in model.surfaces]
    modes = [m.name for m in model.modes]
    bounds = np.zeros((len(modes), len(surfaces)), dtype=np.int64)
    for mode, names in cut_bounds(model).items():
        for name in names:
            bounds[model.mode_index[mode], model.surface_index[name]] = 1 + (
                name in model.reset_by_surface
            )
    codes = 1 << len(surfaces)
    following = np.full(len(modes) * len(surfaces) * codes, -1, dtype=np.int64)
    for (name, surface), target in model.transitions.items():
        domain = model.domain_by_name[name]
        k = model.surface_index[surface]
        for code in range(codes):
            if code >> k & 1 or not _matches(domain.signs, surfaces, {surface}, code):
                continue
            row = (model.mode_index[domain.own_mode] * len(surfaces) + k) * codes + code
            following[row] = model.mode_index[model.domain_by_name[target].own_mode]
    for (name, surface), targets in model.targets.items():
        if surface not in model.reset_by_surface:
            continue
        k, source = (
            model.surface_index[surface],
            model.mode_index[model.domain_by_name[name].own_mode],
        )
        skipped = _landed(model, surface)
        for code in range(codes):
            for behind in map(model.domain_by_name.__getitem__, targets):
                # behind a reset the signs of the mapped state tell the domain
                if not code & _bits(model, skipped) and _matches(
                    behind.signs, surfaces, skipped, code
                ):
                    row = (source * len(surfaces) + k) * codes + code
                    following[row] = model.mode_index[behind.own_mode]
    return Tables(
        np.array([model.observable_index[s.observable] for s in model.surfaces], dtype=np.int64),
        bounds,
        following,
        np.array(
            [int(m.sliding) * (1 + int(model.autonomous)) for m in model.modes], dtype=np.int64
        ),
        np.array([_surfaces_under(model, m.name) for m in model.modes], dtype=np.int64),
        np.array([_surfaces_kept(model, s.name) for s in model.surfaces], dtype=np.int64),
        np.array([_bits(model, _landed(model, s.name)) for s in model.surfaces], dtype=np.int64),
    )


def _surfaces_under(model: Model, mode: str) -> int:
    """Return the surfaces that a mode moves on, as bits."""
    own = [d for d in model.domains if d.own_mode == mode]
    return _bits(model, (s.name for s in model.surfaces if any(d.signs[s.name] == 0 for d in own)))


def _surfaces_kept(model: Model, met: str) -> int:
    """Return the surfaces that the state stays on where one is met, as bits."""
    reset = model.reset_by_surface.get(met)
    kept = [s.name for s in model.surfaces if reset is None or not model.changed_by(reset, s.name)]
    return _bits(model, kept)


def _landed(model: Model, met: str) -> Collection[str]:
    """Return the surfaces that the state is on behind one that is met."""
    reset = model.reset_by_surface.get(met)
    return {met} if reset is None else reset.lands


def _bits(model: Model, surfaces: Iterable[str]) -> int:
    return sum(1 << model.surface_index[name] for name in surfaces)


def _matches(
    signs: Mapping[str, int], surfaces: list[str], skipped: Collection[str], code: int
) -> bool:
    return all(
        signs[name] == 0 or (signs[name] > 0) == bool(code >> j & 1)
        for j, name in enumerate(surfaces)
        if name not in skipped
    )


def simulate(
    model: ModelSource,
    params: Parameters | None = None,
    *,
    state: ArrayLike | None = None,
    time: float = 0.0,
    periods: float = 100.0,
    events: int = 1_000_000,
    domain: str | None = None,
) -> Trajectory:
    """Follow a trajectory, event by event.

    Parameters
    ----------
    model, params : the model (or its name) and its parameters; defaults fill in
    state : initial state, shape (n,); by default the model's rest position shifted by its spread
    time : initial time, nondimensional
    periods : time to follow, in periods of the excitation (units of time if there is none)
    events : most events to follow
    domain : initial domain, where the state alone does not decide

    Raises
    ------
    ParameterError
        If parameters, state or domain are not valid.

    Examples
    --------
    >>> import contfric as cf
    >>> cf.simulate("coulomb", {"Omega": 0.5}, state=[1.3, 0.0], periods=2).word[0]
    ('stick', 'F+')
    """
    model, params = tied(model, params)
    vector = model.vector({} if params is None else params)
    y = checked_state(model, vector, state)
    time, periods = real_number("time", time), real_number("periods", periods, least=0.0)
    events = whole_number("events", events, least=1)
    mode, on = start_of(model, time, y, vector, domain)
    return run(model, vector, mode, on, time, y, periods, events)


def go_on(trajectory: Trajectory, periods: float) -> Trajectory:
    """Follow a trajectory from where it ended, in the mode that it was in."""
    model, (_, time, y, mode) = trajectory.model, trajectory.last
    on = _surfaces_under(model, mode)
    return run(
        model,
        model.vector(trajectory.params),
        model.mode_index[mode],
        on,
        time,
        y,
        periods,
        _MOST_EVENTS,
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
) -> Trajectory:
    """Run the compiled simulation; the state is copied. Rows are grown as they are needed."""
    from contfric.orbit.trajectory import ALL_EVENTS, CARRIED
    from contfric.orbit.trajectory import simulate as kernel

    model_tables = tables(model)
    y = y.copy()
    pieces: list[EventRows] = []
    done, carry, pace = 0, np.zeros(CARRIED), Pace(_FIRST_EVENTS)
    while True:  # between the calls Ctrl-C is heard
        rows, began = min(pace.budget, events - done), perf_counter()
        written = EventRows(
            np.empty((rows, 2), dtype=np.int64),
            np.empty(rows, dtype=np.int64),
            np.empty(rows),
            np.empty((rows, y.shape[0])),
        )
        end, count, mode, cycle, phase = kernel(
            model.flow.following(),
            model_tables,
            mode,
            on,
            time,
            y,
            vector,
            float(periods),
            written,
            carry,
            pace.budget,
        )
        TALLY[3] += count
        pieces.append(written.first(count))
        done += count
        if end != ALL_EVENTS or done >= events:
            break
        time = phase
        pace.took(pace.budget, perf_counter() - began)
    found = joined(pieces)
    last_mode = model.modes[mode].name if mode >= 0 else ""
    return Trajectory(
        model,
        model.mapping(vector),
        found.joints[:, 0],
        found.joints[:, 1],
        found.cycles,
        found.times,
        found.states,
        list(SimulationEnd)[end],
        (cycle, float(phase), y, last_mode),
    )


#: Events that a trajectory goes on for.
_MOST_EVENTS = 10_000_000
#: Events that the first call of the simulation may follow: milliseconds, or half a second of a stiff one.
_FIRST_EVENTS = 256
