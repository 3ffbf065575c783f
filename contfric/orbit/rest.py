"""Solutions that come to rest, which are no periodic orbits: in a mode, or where surfaces meet."""

from __future__ import annotations

import numpy as np

from contfric.errors import ConvergenceError
from contfric.models.definition import FloatArray, Model
from contfric.orbit.orbit import Orbit
from contfric.orbit.simulation import Trajectory

#: A motion of which all events of a period are at one state, to rounding, is at rest if it does not move
#: within a time either.
_RESTS, _SHORT = 1e-13, 1e-1
#: Turns smaller than this (relative to 1 + the states) do not count: the solution has come to rest.
_NO_SIZE = 1e-6
#: Turns about a point: the last half of all events lie this near to each other (relative to 1 + the states),
#: and the last quarter nearer than the one before it (by 2/3, where turns shrink like 1/n).
_WOUND, _SHRINKS = 1e-3, 0.8


def check_rest(trajectory: Trajectory) -> None:
    """Refuse a solution that has come to rest in a mode in which something could move.

    Its rates are rounding then, and so are the events that it meets: all of a period are at one state.
    """
    model, (cycle, time, state, mode) = trajectory.model, trajectory.last
    lately = trajectory.states[trajectory.cycles >= cycle - 1]
    if not mode or not len(lately) or not np.all(np.isfinite(state)):
        return
    vector = model.vector(trajectory.params)
    ahead = model.view(vector).state(mode, time, state, _SHORT)
    apart = np.max(np.abs(np.vstack([lately, ahead[None]]) - state))
    if apart < _RESTS * (1.0 + np.max(np.abs(state))):
        raise ConvergenceError(_stays_at(trajectory), trajectory)


def _stays_at(trajectory: Trajectory) -> str:
    return (
        f"no periodic orbit: the solution comes to rest at {_place(trajectory.model, trajectory.last[2])}, "
        "and nothing moves it from there. Choose other parameters or another start"
    )


def is_point(orbit: Orbit) -> bool:
    """Tell whether an orbit has no size: a solution that turns about the place where its surfaces meet."""
    states = np.concatenate([orbit.begins[:, 1:], orbit.ends[:, 1:]])
    return bool(np.max(np.ptp(states, axis=0)) < _NO_SIZE * (1.0 + np.max(np.abs(states))))


def winds(trajectory: Trajectory) -> bool:
    """Tell whether a solution with excitation winds into a point, in turns that shrink like 1/n.

    They take times like 1/n, too: within a time t the solution meets exp(t) events, and no period ends.
    """
    half, last = len(trajectory) // 2, 3 * len(trajectory) // 4
    before, lately = (
        np.max(np.ptp(part, axis=0))
        for part in (trajectory.states[half:last], trajectory.states[last:])
    )
    near = before < _WOUND * (1.0 + np.max(np.abs(trajectory.states[-1])))
    within = trajectory.cycles[-1] - trajectory.cycles[half] <= 1
    return bool(near and within and lately < _SHRINKS * before)


def comes_to_rest(trajectory: Trajectory) -> str:
    """Return what is said of a solution that turns about the place where its surfaces meet."""
    where = _place(trajectory.model, trajectory.states[-1])
    return (
        f"no periodic orbit: the solution comes to rest near {where}, where surfaces meet: it crosses them "
        "in smaller and smaller turns. Choose other parameters or another start"
    )


def _place(model: Model, state: FloatArray) -> str:
    return ", ".join(f"{s} = {v:.4g}" for s, v in zip(model.states, state, strict=True))
