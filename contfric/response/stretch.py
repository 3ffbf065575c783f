"""A stretch of a sweep: an independent task that any process can compute, to the same bits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contfric.chaos.work import TileTask
from contfric.models.definition import FloatArray, Model
from contfric.orbit.system import IntArray
from contfric.response.collecting import collect
from contfric.response.cuts import Cut, Following

#: Values in a stretch: some hundredths of a second, so that an interrupt loses little.
STRETCH = 64


@dataclass(frozen=True, eq=False)
class StretchRows:
    """Results of a stretch, value by value.

    Attributes
    ----------
    outcomes, periods, upto : what each solution came to, the periods after which it repeats itself, and the
        points up to it, shape (values,)
    cycles, modes, times, states : the points
    last : state to be carried over, shape (n,)
    """

    outcomes: IntArray
    periods: IntArray
    upto: IntArray
    cycles: IntArray
    modes: IntArray
    times: FloatArray
    states: FloatArray
    last: FloatArray


@dataclass(frozen=True, eq=False)
class Stretch(TileTask):
    """A task: some values of a sweep, one after the other.

    Attributes
    ----------
    model : Model
    cut, how : the section, and how solutions are followed
    vectors : parameters at each value, shape (values, parameters)
    state : where the first starts, shape (n,)
    """

    model: Model
    cut: Cut
    how: Following
    vectors: FloatArray
    state: FloatArray


def compute_stretch(task: Stretch, stop: IntArray | None = None) -> StretchRows:
    """Compute a stretch; what it returns depends on nothing but the task."""
    count = len(task.vectors)
    free = np.full(count, -1, dtype=np.int64)
    starts = np.zeros(count), task.state[None], free, np.zeros(count, dtype=np.int64)
    points, ends = collect(task.model, task.cut, task.how, task.vectors, starts, stop)
    return StretchRows(
        ends.outcomes,
        ends.turns,
        ends.upto,
        points.cycles,
        points.modes,
        points.times,
        points.states,
        ends.states[-1].copy(),
    )
