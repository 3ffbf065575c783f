"""The one-dimensional map from the phase of a release from rest to that of the next one.

A tile of a release map: some releases, which any process follows to the next one, to the same bits.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contfric.base.memory import must_fit
from contfric.chaos.running import Progress, check_executor
from contfric.chaos.work import TileTask, Work
from contfric.errors import (
    ParameterError,
    did_you_mean,
    function_of,
    shown,
    whole_number,
)
from contfric.models import ModelSource, Parameters
from contfric.models.definition import FloatArray, Model
from contfric.models.tied import tied
from contfric.orbit.structure import mirror_mode
from contfric.orbit.system import IntArray
from contfric.orbit.tables import tables
from contfric.remember.folder import kept_in
from contfric.response.collecting import collect, repeats_of
from contfric.response.cuts import Following
from contfric.response.returns import ReleaseMap
from contfric.response.sections import RELEASES, section_of
from contfric.response.sweeping import compiled, positive

#: A release counts if the surfaces are met to this (relative to 1 + state).
_MET = 1e-12
#: Bytes of a release: its parameters, its events, its results.
_BYTES = 512


class _WayOutOfRest(NamedTuple):
    """A way out of rest: mode, surface, mode that follows, surfaces that it starts on as bits."""

    mode: int
    surface: int
    following: int
    on: int


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
    release, rest = release_of(model, surface)
    period = model.view(vector).period
    times: FloatArray = np.arange(count, dtype=np.float64) * (period / count)
    states: FloatArray = np.array(
        [_state_at(model, vector, release, rest, float(t)) for t in times]
    )
    possible = np.flatnonzero(
        [_leaves(model, vector, release, float(t), y) for t, y in zip(times, states, strict=True)]
    )
    times, states = times[possible], states[possible]
    image = image_of(model, release)
    joints = np.zeros((len(model.modes), len(model.surfaces)), dtype=np.int64)
    for mode, k in ((release.mode, release.surface), *(() if image is None else (image,))):
        joints[mode, k] = 1
    whole = ReleaseTile(
        *(model, vector, joints, release.following, release.on),
        *(times.copy(), states.reshape(-1, len(model.states)).copy()),
        positive("periods", periods),
    )
    work: Work[ReleaseTile, ReleaseRows] = Work(
        *("release map", compute_release_tile, executor, progress),
        prepare=lambda: compiled(model),
    )
    parts = [slice(first, first + tile) for first in range(0, len(times), tile)]
    rows = ReleaseRows.empty(len(times), len(model.states))
    with kept_in(folder):
        work.finish([whole.part(part) for part in parts], lambda k, got: rows.put(parts[k], got))
    found = rows.found
    returns, images = np.full(len(times), np.nan), np.full(len(times), np.nan)
    returns[found] = (rows.times + rows.cycles * period - times)[found]
    shifts = _shifts(model, vector, release, period, rows.times[found], rows.states[found])
    images[found] = np.mod(rows.times[found] + shifts, period)
    branch = _branches(rows.itineraries, times, images, 1.5 * period / count, period)
    names = model.modes[release.mode].name, model.surfaces[release.surface].name
    return ReleaseMap(model, vector, *names, period, times, images, returns, branch, states)


def release_of(model: Model, surface: str | None) -> tuple[_WayOutOfRest, str]:
    """Return the way out of rest, and the surface that the mode rests on."""
    wanted = [m for m in model.modes if m.sliding]
    if model.autonomous or len(model.states) != 2 or not wanted:
        raise ParameterError(
            f"model '{model.name}' has no release map: that takes two states, a mode of rest and an "
            "excitation, so that a release is known by its phase; cf.poincare(..., section='releases') "
            "takes any model with a mode of rest"
        )
    surfaces = [s.name for s in model.surfaces]
    ways = {
        exit_: (domain, target)
        for (domain, exit_), target in model.transitions.items()
        if model.domain_by_name[domain].mode == wanted[0].name
    }
    surface = next((name for name in surfaces if name in ways), "") if surface is None else surface
    if surface not in [*ways]:
        raise ParameterError(
            f"surface is one that rest is left at, one of {', '.join(ways)}, got {shown(surface)}"
            f"{did_you_mean(surface, ways)}"
        )
    domain, target = (model.domain_by_name[name] for name in ways[surface])
    rests = next((n for n, sign in domain.signs.items() if sign == 0), surface)
    mode, k, found = model.mode_index[domain.mode], model.surface_index[surface], tables(model)
    on = int(found.landed[mode, k] | (found.lies_on[mode] & found.kept[mode, k]))
    return _WayOutOfRest(mode, k, model.mode_index[target.mode], on), rests


def image_of(model: Model, release: _WayOutOfRest) -> tuple[int, int] | None:
    """Return (mode, surface) of the image of a release under the symmetry; None if there is no other."""
    if model.symmetry is None:
        return None
    name = model.surfaces[release.surface].name
    image = model.symmetry.surfaces.get(name, name)
    mode = mirror_mode(model)[model.modes[release.mode].name]
    if image == name:
        return None
    return model.mode_index[mode], model.surface_index[image]


def _state_at(
    model: Model, vector: FloatArray, release: _WayOutOfRest, rests: str, t: float
) -> FloatArray:
    """Return the state at a release at a time: on both surfaces, by Newton's method, or nan."""
    names = model.surfaces[release.surface].name, rests
    found = model.view(vector).landed(names, t, np.zeros(len(model.states)), _MET)
    return np.full(len(model.states), np.nan) if found is None else found


def _leaves(
    model: Model, vector: FloatArray, release: _WayOutOfRest, t: float, y: FloatArray
) -> bool:
    """Tell whether rest comes to its limit there, from within."""
    if not np.all(np.isfinite(y)):
        return False
    surface = model.surfaces[release.surface]
    domain = next(d for d in model.domains if d.mode == model.modes[release.mode].name)
    rate = model.view(vector).rate(domain.mode, surface.observable, t, y)
    return -domain.signs[surface.name] * rate > 0.0


def _shifts(
    model: Model,
    vector: FloatArray,
    release: _WayOutOfRest,
    period: float,
    times: FloatArray,
    states: FloatArray,
) -> FloatArray:
    """Return the shift in time of each point: none at the surface itself, that of the symmetry elsewhere."""
    image = image_of(model, release)
    if model.symmetry is None or image is None:
        return np.zeros(len(times))
    view, names = model.view(vector), [model.surfaces[k].name for k in (release.surface, image[1])]
    rows = zip(times.tolist(), states, strict=True)
    apart = np.abs([[view.height(name, t, y) for name in names] for t, y in rows]).reshape(-1, 2)
    return np.where(apart[:, 0] <= apart[:, 1], 0.0, model.symmetry.fraction * period)


def _branches(
    itineraries: IntArray, phases: FloatArray, images: FloatArray, step: float, period: float
) -> IntArray:
    """Return the number of the branch of each release: it ends where the itinerary, or the grid, does."""
    branch = np.full(len(itineraries), -1, dtype=np.int64)
    number = -1
    for k in range(len(itineraries)):
        if not np.isfinite(images[k]):
            continue
        joined = (
            k > 0
            and branch[k - 1] >= 0
            and itineraries[k] == itineraries[k - 1]
            and phases[k] - phases[k - 1] <= step
            and abs(images[k] - images[k - 1]) <= 0.5 * period
        )
        number += 0 if joined else 1
        branch[k] = number
    return branch


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
