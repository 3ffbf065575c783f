"""A tile of basins: an independent task that any process can compute, to the same bits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.chaos.rows import FollowingLimits, follow, new_stop, starting, until_interrupted
from contfric.chaos.status import Motion
from contfric.chaos.work import TileTask
from contfric.models.definition import Model
from contfric.response.targets import Targets
from contfric.simulation.tables import tables
from contfric.simulation.time_scale import ticks_of

#: Periods before the growth of a separation is averaged, and its relative error, for what no orbit has
#: caught: those of Lyapunov exponents.
_TRANSIENT, _TOLERANCE = 100, 0.01


@dataclass(frozen=True, eq=False)
class BasinRows:
    """Results of a tile, start by start.

    Attributes
    ----------
    labels : number of the orbit, -1 if none, shape (starts,)
    motions : code of the :class:`~contfric.chaos.status.Motion`, shape (starts,)
    """

    labels: NDArray[np.int32]
    motions: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class BasinTile(TileTask):
    """A task: some starts of the same parameters.

    Attributes
    ----------
    model : Model
    vector : parameters
    targets : joints of the orbits that are known
    time, states : initial time and states, shape (starts, n)
    periods : periods (of the excitation or of a clock; else units of time) that a solution is followed
    """

    model: Model
    vector: FloatArray
    targets: Targets
    time: float
    states: FloatArray
    periods: int


def compute_basin_tile(task: BasinTile, stop: IntArray | None = None) -> BasinRows:
    """Compute a tile; what it returns depends on nothing but the task."""
    from contfric.chaos import tangent
    from contfric.response.capture import capture
    from contfric.simulation import march as trajectory

    count = len(task.states)
    labels, ends = np.zeros((2, count), dtype=np.int64)
    flag = new_stop() if stop is None else stop
    arguments = (
        task.model.flow.following(),
        tables(task.model),
        starting(task.model),
        task.targets,
        float(task.time),
        ticks_of(task.model, task.vector),
        task.vector,
        np.ascontiguousarray(task.states),
        int(task.periods),
        flag,
        labels,
        ends,
    )
    until_interrupted(capture, arguments, flag if stop is None else None)
    motions = np.full(count, Motion.PERIODIC.code, dtype=np.uint8)
    known = {
        trajectory.HELD: Motion.HELD,
        trajectory.IMPOSSIBLE: Motion.NO_SOLUTION,
        trajectory.INFINITE: Motion.UNBOUNDED,
        trajectory.CHATTER: Motion.CHATTER,
        tangent.BROKEN: Motion.BROKEN,
    }
    free = labels < 0
    for end, motion in known.items():
        motions[free & (ends == end)] = motion.code
    open_ = np.flatnonzero(free & ~np.isin(ends, list(known)))
    if len(open_) and (stop is None or stop[0] == 0):
        vectors = np.tile(task.vector, (len(open_), 1))
        limits = FollowingLimits(_TRANSIENT, max(1, task.periods), _TOLERANCE)
        cells = follow(task.model, vectors, task.states[open_], task.time, limits, stop)
        motions[open_] = cells.motions
    return BasinRows(labels.astype(np.int32), motions)
