"""States of a simulated trajectory between its events: at given times, and as a table.

A trajectory keeps its events only. Between two of them the solution is the flow of one mode, from the state
at the first, after its reset if it has one. So a state at any time is as exact as the events are: nothing is
interpolated.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError, shown, whole_number

if TYPE_CHECKING:
    from contfric.models.view import FlowView
    from contfric.simulation.simulate import Trajectory

#: Samples of one trajectory: more are seen by nobody, and take minutes.
_MOST_SAMPLES = 10_000_000


class DenseSegment(NamedTuple):
    """A segment: its mode, time, phase and state at its start, duration, and exit (empty of the last)."""

    mode: str
    time: float
    phase: float
    state: FloatArray
    duration: float
    exit: str


def event_times(trajectory: Trajectory, view: FlowView) -> FloatArray:
    """Return the times of all events and of the end, shape (events + 1,)."""
    cycle, phase, _, _ = trajectory.last
    cycles = np.array([*trajectory.cycles, cycle], dtype=np.float64)
    return np.asarray(cycles * view.period + np.array([*trajectory.times, phase]))


def stretches(trajectory: Trajectory) -> list[DenseSegment]:
    """Cut a trajectory at its events."""
    model = trajectory.model
    view = model.view(model.vector(trajectory.params))
    times = event_times(trajectory, view)
    modes = [model.modes[m].name for m in trajectory.modes] + [trajectory.last[3]]
    time, state = trajectory.begin
    phase = float(time % view.period) if view.period > 0.0 else time
    found = []
    for k, end in enumerate(times):
        exits = model.surfaces[trajectory.exits[k]].name if k < len(trajectory) else ""
        if modes[k]:
            found.append(
                DenseSegment(modes[k], time, phase, state, max(0.0, float(end - time)), exits)
            )
        if k < len(trajectory):
            time, phase, state = float(end), float(trajectory.times[k]), trajectory.states[k]
            if model.reset_at(modes[k], exits) is not None:
                state = view.reset(exits, phase, state)
    return found


def sample(trajectory: Trajectory, times: ArrayLike) -> FloatArray:
    """Return the states at times, shape (k, n); the later one where two follow each other at one time.

    Raises
    ------
    ParameterError
        If a time is no number, or not within the trajectory.
    """
    wanted = _checked(times)
    parts = stretches(trajectory)
    starts = np.array([part.time for part in parts])
    low, high = starts[0], parts[-1].time + parts[-1].duration
    outside = wanted[(wanted < low) | (wanted > high)]
    if len(outside):
        raise ParameterError(
            f"the trajectory is known from t = {low:g} to {high:g}, not at {outside[0]:g}"
        )
    view = trajectory.model.view(trajectory.model.vector(trajectory.params))
    found = np.empty((len(wanted), len(trajectory.model.states)))
    for row, k in enumerate(np.searchsorted(starts, wanted, side="right") - 1):
        part = parts[k]
        lasts = min(float(wanted[row]) - part.time, part.duration)
        found[row] = view.state(part.mode, part.phase, part.state, lasts)
    return found


def table(trajectory: Trajectory, points: int) -> dict[str, Any]:
    """Return columns: time, states, mode, event. Rows: all events, and ``points`` between them."""
    points = whole_number("points", points, least=2, most=_MOST_SAMPLES)
    parts = stretches(trajectory)
    total = parts[-1].time + parts[-1].duration - parts[0].time
    view = trajectory.model.view(trajectory.model.vector(trajectory.params))
    times, states, modes, events = [], [], [], []
    for part in parts:
        count = 2 + (int(points * part.duration / total) if total > 0.0 else 0)
        for k, lasts in enumerate(np.linspace(0.0, part.duration, count)):
            times.append(part.time + float(lasts))
            states.append(view.state(part.mode, part.phase, part.state, float(lasts)))
            modes.append(part.mode)
            events.append(part.exit if k == count - 1 else "")
    columns: dict[str, Any] = {"t": np.array(times)}
    columns |= {name: np.array(states)[:, k] for k, name in enumerate(trajectory.model.states)}
    return {**columns, "mode": modes, "event": events}


def _checked(times: ArrayLike) -> FloatArray:
    try:
        wanted = np.atleast_1d(np.asarray(times, dtype=np.float64))
    except (TypeError, ValueError):
        wanted = np.array([np.nan])
    if wanted.ndim != 1 or not np.all(np.isfinite(wanted)):
        raise ParameterError(f"times are finite numbers, got {shown(times)}")
    return wanted
