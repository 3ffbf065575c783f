"""A tile of a release map: some releases, which any process follows to the next one, to the same bits."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from contfric.chaos.work import TileTask
from contfric.models.definition import FloatArray, Model
from contfric.orbit.system import IntArray
from contfric.response.collecting import collect, repeats_of
from contfric.response.cuts import Following
from contfric.response.sections import RELEASES, section_of


@dataclass(frozen=True, eq=False)
class ReleaseRows:
    """The next release after each.

    Attributes
    ----------
    found : whether there is one, shape (k,)
    cycles, times : periods completed until then, and the phase
    states : state there, shape (k, n)
    itineraries : a number for the sequence of segments until then
    """

    found: NDArray[np.bool_]
    cycles: IntArray
    times: FloatArray
    states: FloatArray
    itineraries: IntArray

    @staticmethod
    def empty(count: int, n: int) -> ReleaseRows:
        """Return rows of so many releases without a next one."""
        found, numbers = np.zeros(count, dtype=bool), np.zeros(count, dtype=np.int64)
        return ReleaseRows(
            found, numbers, np.full(count, np.nan), np.full((count, n), np.nan), numbers.copy()
        )

    def put(self, part: slice, rows: ReleaseRows) -> None:
        """Write the rows of a tile to their place."""
        for field in fields(self):
            getattr(self, field.name)[part] = getattr(rows, field.name)


@dataclass(frozen=True, eq=False)
class ReleaseTile(TileTask):
    """A task: some releases at the same parameters.

    Attributes
    ----------
    model : Model
    vector : parameters
    joints : joints that are a release, by mode and exit surface, shape (modes, surfaces)
    following, on : mode after a release, and the surfaces that it starts on, as bits
    times, states : the releases, shapes (k,) and (k, n)
    periods : periods within which the next one has to come
    """

    model: Model
    vector: FloatArray
    joints: IntArray
    following: int
    on: int
    times: FloatArray
    states: FloatArray
    periods: float

    def part(self, part: slice) -> ReleaseTile:
        """Return some of the releases."""
        return replace(self, times=self.times[part].copy(), states=self.states[part].copy())


def compute_release_tile(task: ReleaseTile, stop: IntArray | None = None) -> ReleaseRows:
    """Compute a tile; what it returns depends on nothing but the task."""
    count = len(task.times)
    rows = ReleaseRows.empty(count, len(task.model.states))
    cut = section_of(task.model, RELEASES)
    cut.joints[:] = task.joints
    modes, ons = (np.full(count, number, dtype=np.int64) for number in (task.following, task.on))
    # what repeats itself before it is at rest for the first time never will be: nothing is waited for
    how = Following(0.0, float(task.periods), repeats_of(task.model), 1, 0)
    starts = task.times, task.states, modes, ons
    points, ends = collect(task.model, cut, how, np.tile(task.vector, (count, 1)), starts, stop)
    found = np.diff(ends.upto, prepend=0) > 0
    rows.found[:] = found
    rows.cycles[found], rows.times[found] = points.cycles, points.times
    rows.states[found] = points.states
    rows.itineraries[:] = ends.itineraries
    return rows
