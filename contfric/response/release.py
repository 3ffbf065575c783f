"""The one-dimensional map from the phase of a release from rest to that of the next one.

A tile of a release map: some releases, which any process follows to the next one, to the same bits.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.base.memory import must_fit
from contfric.chaos.running import Progress, check_executor
from contfric.chaos.work import TileTask, Work, put_rows
from contfric.errors import function_of, whole_number
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.tied import tied
from contfric.remember.folder import kept_in
from contfric.response.collecting import collect, repeats_of
from contfric.response.cuts import Following
from contfric.response.returns import ReleaseMap
from contfric.response.sections import RELEASES, section_of
from contfric.response.sweeping import compiled, positive
from contfric.response.ways_out_of_rest import WayOutOfRest, release_of

#: A change between two releases that is so many times the largest one next to it may be a jump (at the end of
#: a branch with a vertical tangent it is 2.4 times); it is one if this share of it stays when the gap has
#: been halved so often (of a vertical tangent of third order 1 % stays).
_STEEP, _STAYS, _HALVINGS = 3.0, 0.5, 20
#: Bytes of a release: its parameters, its events, its results.
_BYTES = 512


def release_map(
    model: ModelSource,
    params: Parameters | None = None,
    *,
    surface: str | None = None,
    count: int = 2000,
    periods: float = 1000.0,
    executor: Executor | None = None,
    folder: str | Path | None = None,
    tile: int = 100,
    progress: Progress | None = None,
) -> ReleaseMap:
    """Compute the one-dimensional map from the phase of a release to that of the next one.

    Where a model of two states rests on its switching surface, all that it remembers when it is released is
    the phase of the excitation: the motion between two releases is a map of the circle. With a symmetry
    that takes one surface of release to the other, the map is that of both, reduced by it.

    Parameters
    ----------
    model, params : the model (or its name) and its parameters; defaults fill in
    surface : the surface of the release; by default the first one
    count : phases at which releases are looked for
    periods : periods within which the next release has to come; a motion that repeats itself before that has
        none
    executor : concurrent.futures.Executor, optional
        Where tiles are computed; by default threads of this process. The map is the same, to the bit.
    folder : path, optional
        Where finished tiles are kept: the same call goes on from them.
    tile : releases of one tile
    progress : callable, optional
        Called with one line now and then.

    Returns
    -------
    ReleaseMap
        With k releases: their ``phases``, ``images`` (phase of the next release) and ``returns`` (time until
        then), all of shape (k,).

    Raises
    ------
    ParameterError
        If an argument is not valid, or releases of the model are not told by their phase.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.release_map("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}, count=200)
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> bool(len(found.fixed_points()) >= 1)
    True
    """
    model, params = tied(model, params)
    vector = model.vector(params)
    check_executor(executor)
    function_of("progress", progress)
    tile = whole_number("tile", tile, least=1)
    count = whole_number("count", count, least=2)
    must_fit(f"a map of {count} releases", _BYTES * count)
    way, view = release_of(model, surface), model.view(vector)
    grid = np.arange(count) * (view.period / count)
    begun = [(t, y) for t in grid.tolist() if (y := way.state_at(view, t)) is not None]
    times: FloatArray = np.array([t for t, _ in begun])
    states: FloatArray = np.array([y for _, y in begun]).reshape(-1, len(model.states))
    joints = np.zeros((len(model.modes), len(model.surfaces)), dtype=np.int64)
    for mode, k in filter(None, ((way.mode, way.surface), way.image)):
        joints[mode, k] = 1
    whole = ReleaseTile(
        *(model, vector, joints, way.following, way.on, times, states), positive("periods", periods)
    )
    work: Work[ReleaseTile, ReleaseRows] = Work(
        *("release map", compute_release_tile, executor, progress),
        prepare=lambda: compiled(model),
    )
    parts = [slice(first, first + tile) for first in range(0, len(times), tile)]
    rows = ReleaseRows.empty(len(times), len(model.states))
    with kept_in(folder):
        work.finish(
            [whole.part(part) for part in parts], lambda k, got: put_rows(rows, parts[k], got)
        )
    found, period = rows.found, view.period
    returns, images = rows.after(times, period), np.full(len(times), np.nan)
    shifts = way.shifts(view, rows.times[found], rows.states[found])
    images[found] = np.mod(rows.times[found] + shifts, period)
    near = _neighbours(rows, times, 1.5 * period / count)
    near &= np.abs(np.diff(images, prepend=np.nan)) <= 0.5 * period
    near &= ~_jumps(whole, way, rows, returns, near)
    branch = np.where(found, np.cumsum(found & ~near) - 1, -1)
    return ReleaseMap(model, vector, *way.names, period, times, images, returns, branch, states)


def _neighbours(rows: ReleaseRows, times: FloatArray, step: float) -> NDArray[np.bool_]:
    """Return for each release whether it has the segments of the one a step before it."""
    near = np.zeros(len(times), dtype=bool)
    near[1:] = rows.found[1:] & rows.found[:-1] & (np.diff(times) <= step)
    near[1:] &= rows.itineraries[1:] == rows.itineraries[:-1]
    return near


def _jumps(
    task: ReleaseTile,
    way: WayOutOfRest,
    rows: ReleaseRows,
    returns: FloatArray,
    near: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return for each release whether the map jumps between the one before it and itself.

    The segments may be the same on both sides: where rest just reaches its limit (AS), it ends there or
    later. The gap between two releases is halved, to the half over which the map changes more: over a jump
    the change stays, and where the map is continuous it vanishes.
    """
    jumps, view = np.zeros(len(near), dtype=bool), task.model.view(task.vector)
    change = np.where(near, np.abs(np.diff(returns, prepend=np.nan)), 0.0)
    usual = np.maximum(np.append(0.0, change[:-1]), np.append(change[1:], 0.0))
    tried = np.flatnonzero(near & (change > _STEEP * usual))
    ends = np.stack([task.times[tried - 1], task.times[tried]])
    values = np.stack([returns[tried - 1], returns[tried]])
    for _ in range(_HALVINGS):
        if not len(tried):
            break
        middle = ends.mean(axis=0)
        states = [way.state_at(view, t) for t in middle.tolist()]
        there = np.array([y is not None for y in states])
        at = [
            start if y is None else y for y, start in zip(states, task.states[tried], strict=True)
        ]
        half = compute_release_tile(replace(task, times=middle, states=np.array(at)))
        between = half.after(middle, view.period)
        same = there & half.found & (half.itineraries == rows.itineraries[tried])
        left = np.abs(between - values[0]) >= np.abs(values[1] - between)
        ends = np.where(left, [ends[0], middle], [middle, ends[1]])
        values = np.where(left, [values[0], between], [between, values[1]])
        jumps[tried[~same]] = True  # something else lies between
        kept = same & (np.abs(np.diff(values, axis=0)[0]) > _STAYS * change[tried])
        tried, ends, values = tried[kept], ends[:, kept], values[:, kept]
    jumps[tried] = True
    return jumps


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

    def after(self, times: FloatArray, period: float) -> FloatArray:
        """Return the times until the next release, nan if there is none; the releases are at ``times``."""
        return np.where(self.found, self.times + self.cycles * period - times, np.nan)

    @staticmethod
    def empty(count: int, n: int) -> ReleaseRows:
        """Return rows of so many releases without a next one."""
        found, numbers = np.zeros(count, dtype=bool), np.zeros(count, dtype=np.int64)
        return ReleaseRows(
            found, numbers, np.full(count, np.nan), np.full((count, n), np.nan), numbers.copy()
        )


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
