"""The computation of basins: arguments checked, orbits found, tiles spread, gathered, kept."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray, IntArray
from contfric.base.memory import must_fit
from contfric.chaos.running import Progress, check_executor, duration
from contfric.chaos.status import Motion
from contfric.chaos.work import Work, put_rows
from contfric.errors import (
    ParameterError,
    did_you_mean,
    function_of,
    mapping_of,
    real_number,
    shown,
    whole_number,
)
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.tied import tied
from contfric.remember.folder import kept_in
from contfric.response.attractors import Attractors, given_orbits
from contfric.response.basin_tile import BasinRows, BasinTile, compute_basin_tile
from contfric.response.basins import Basins
from contfric.response.sweeping import checked_values
from contfric.simulation.excitation import check_excitation
from contfric.simulation.starts import within_a_turn

#: Starts, spread over the grid, whose orbits are found before all others: any basin of a tenth of the grid
#: is hit by one of them with probability 0.999; those that are not are found when the grid is done.
_SEEDS = 64
#: Steps between seeds, as a share of the grid: the golden section spreads them evenly.
_GOLDEN = 0.6180339887498949
#: Bytes of a start beyond its state.
_BYTES = 32
#: What a periodic solution is called whose orbit is not known.
_UNKNOWN = (Motion.PERIODIC.code, Motion.TRANSIENT.code)
PHASE = "phase"


@dataclass(frozen=True, eq=False)
class _BasinJob:
    """Starts to be labelled, one after the other."""

    vector: FloatArray
    time: float
    states: FloatArray
    periods: int
    side: int
    executor: Executor | None
    progress: Progress | None

    def tile(self, attractors: Attractors, chosen: IntArray) -> BasinTile:
        targets, states = attractors.targets, self.states[chosen]
        return BasinTile(attractors.model, self.vector, targets, self.time, states, self.periods)

    def foretell(self, count: int, seconds: float) -> None:
        """Say how long all starts will take, by some that took so many seconds."""
        if self.progress is not None:
            total = len(self.states)
            self.progress(
                f"basins: {count} starts took {duration(seconds)}, all {total} take about "
                f"{duration(seconds * total / count)} of one processor"
            )

    def parts(self, chosen: IntArray) -> list[IntArray]:
        return [chosen[k : k + self.side] for k in range(0, len(chosen), self.side)]


def basins(
    model: ModelSource,
    grid: Mapping[str, ArrayLike] | None = None,
    params: Parameters | None = None,
    at: Mapping[str, float] | None = None,
    *,
    orbits: Any = None,
    periods: int = 600,
    executor: Executor | None = None,
    folder: str | Path | None = None,
    tile: int = 4096,
    progress: Progress | None = None,
) -> Basins:
    """Label starts on a grid of two states by the solved orbit that each converges to.

    A start is followed until one of its joints lies at a joint of a known stable orbit. What no orbit catches
    is told apart by its Lyapunov exponent: chaotic, unbounded, at rest; or periodic, and then its orbit is
    found, solved and known. The result is the same to the last bit for any number of workers. Ctrl-C
    ends the computation; what was found is returned.

    Parameters
    ----------
    model, params : the model (or its name) and its parameters; defaults fill in
    grid : mapping of two states to their values, each ascending
    at : values of the other states, and "phase", that of the start as a share of the period; 0 by default
    orbits : orbits that are known: a :class:`~contfric.Diagram` that contains the parameters, or a list of
        orbits; others are found all the same
    periods : periods of the excitation or of the clock (units of time without) that a start is followed
    executor : any :class:`concurrent.futures.Executor`: processes, loky, dask, MPI; by default threads
        of this process. What it loses is computed here.
    folder : where finished tiles are kept; the same call goes on from them
    tile : starts in a tile
    progress : called with one line of text now and then

    Returns
    -------
    Basins
        ``labels``, shape (len, len), the number of the orbit that each start converges to (-1: none);
        ``orbits``, and the ``shares`` of the grid with their confidence intervals.

    Raises
    ------
    ParameterError
        If an argument is not valid.
    ResultFileError
        If the folder cannot be written, or another version of contfric has written to it.

    Examples
    --------
    >>> import contfric as cf
    >>> grid = {"x": np.linspace(-2, 2, 10), "v": np.linspace(-1, 1, 10)}
    >>> found = cf.basins("coulomb", grid, {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> sum(share.count for share in found.shares)
    100
    """
    grid, params = _in_order(grid, params)
    model, params = tied(model, params)
    check_executor(executor)
    function_of("progress", progress)
    vector = model.vector(params)
    axes = _checked_grid(model, grid)
    fixed = _checked_at(model, axes, {} if at is None else at)
    periods, tile = whole_number("periods", periods, least=1), whole_number("tile", tile, least=1)
    shape = tuple(len(values) for values in axes.values())
    _check_size(model, axes)
    period = model.view(vector).period
    check_excitation(model, vector)
    states = within_a_turn(model, vector, _states(model, axes, fixed))
    job = _BasinJob(vector, fixed[PHASE] * period, states, periods, tile, executor, progress)
    attractors = Attractors(model, vector)
    for orbit in () if orbits is None else given_orbits(model, vector, orbits):
        attractors.add(orbit)
    rows = BasinRows(
        np.full(len(states), -1, dtype=np.int32),
        np.full(len(states), Motion.MISSING.code, dtype=np.uint8),
    )
    try:
        with kept_in(folder):
            _find_by_seeds(job, attractors)
            _label(job, attractors, np.arange(len(states)), rows)
            _resolve(job, attractors, rows)
    except KeyboardInterrupt:
        if progress is not None:
            progress("interrupted: what is labelled is kept")
    labels, motions = rows.labels.reshape(shape), rows.motions.reshape(shape)
    return Basins(attractors.model, axes, vector, fixed, tuple(attractors.orbits), labels, motions)


def _in_order(grid: Any, params: Any) -> tuple[Any, Any]:
    """Return grid and parameters, which came the other way round at first: a grid has sequences as values."""
    if isinstance(params, Mapping) and params and all(np.ndim(v) == 1 for v in params.values()):
        warnings.warn(
            "basins(model, grid, params): the grid stands before the parameters",
            DeprecationWarning,
            stacklevel=3,
        )
        return params, grid
    return grid, params


def check_starts(model: Model, grid: object, at: object) -> None:
    """Check the starts that a user gave.

    Raises
    ------
    ParameterError
        If they are no states of the model, or do not fit into the memory.
    """
    axes = _checked_grid(model, grid)
    _checked_at(model, axes, at)
    _check_size(model, axes)


def _check_size(model: Model, axes: Mapping[str, FloatArray]) -> None:
    rows, columns = (len(values) for values in axes.values())
    size = rows * columns * (_BYTES + 16 * len(model.states))
    must_fit(f"basins of {rows} x {columns} starts", size)


def _checked_grid(model: Model, grid: object) -> dict[str, FloatArray]:
    if not isinstance(grid, Mapping) or len(grid) != 2:
        raise ParameterError(
            f"grid is a mapping of two of the states {', '.join(model.states)} to their values, such as "
            f"{{'{model.states[0]}': [-1, 0, 1], ...}}; got {shown(grid)}"
        )
    for name in grid:
        if name not in model.states:
            raise ParameterError(
                f"'{name}' is no state of '{model.name}'{did_you_mean(name, model.states)}"
            )
    return {name: checked_values(model, name, values) for name, values in grid.items()}


def _checked_at(model: Model, axes: Mapping[str, FloatArray], at: object) -> dict[str, float]:
    given = mapping_of("at", at, "{'phase': 0.25}")
    allowed = [name for name in model.states if name not in axes] + [PHASE]
    for name in given:
        if name not in allowed:
            raise ParameterError(
                f"at has values of {', '.join(allowed)}, got {shown(name)}{did_you_mean(name, allowed)}"
            )
    if model.autonomous and given.get(PHASE):
        raise ParameterError(f"model '{model.name}' has no excitation, and no phase")
    return {name: real_number(f"at['{name}']", given.get(name, 0.0)) for name in allowed}


def _states(model: Model, axes: Mapping[str, FloatArray], at: Mapping[str, float]) -> FloatArray:
    """Return the initial states, row by row, shape (starts, n)."""
    (first, rows), (second, columns) = axes.items()
    states = np.empty((len(rows), len(columns), len(model.states)))
    for k, name in enumerate(model.states):
        states[..., k] = at.get(name, 0.0)
    states[..., model.states.index(first)] = rows[:, None]
    states[..., model.states.index(second)] = columns[None, :]
    return states.reshape(-1, len(model.states))


def _chattering(rows: BasinRows) -> IntArray:
    """Return the starts whose impacts follow each other faster and faster, and that do not go on."""
    return np.flatnonzero(rows.motions == Motion.CHATTER.code)


def _unknown(rows: BasinRows) -> IntArray:
    """Return the starts that are periodic, and whose orbit is not known."""
    return np.flatnonzero((rows.labels < 0) & np.isin(rows.motions, _UNKNOWN))


def _find_by_seeds(job: _BasinJob, attractors: Attractors) -> None:
    """Find the orbits of some starts, spread over the grid.

    What no orbit catches is followed to the end, and then for its exponent, which takes many times as long as
    to find the orbit. So the first one is found before any start is followed.
    """
    count = len(job.states)
    spread = np.floor(np.mod(_GOLDEN * np.arange(1, _SEEDS + 1), 1.0) * count).astype(np.int64)
    chosen = np.unique(spread)
    left, tries = chosen, 1
    while len(left):
        if attractors.orbits:
            began = monotonic()
            rows = compute_basin_tile(job.tile(attractors, left))
            job.foretell(len(left), monotonic() - began)
            if len(_chattering(rows)) and attractors.rest_at_walls():
                continue
            left = left[_unknown(rows)]
        left, tries = _search(job, attractors, left, tries)[0], 2 * tries


def _search(
    job: _BasinJob, attractors: Attractors, left: IntArray, tries: int
) -> tuple[IntArray, bool]:
    """Look for the orbits of the first of some starts, until there is a new one.

    To follow what no orbit catches takes long. Where every start has an orbit of its own, as on a continuum,
    each new one catches nothing else: so twice as many are looked for each time before what is left is
    followed again.

    Returns
    -------
    The starts that may be caught now; and whether there is a new orbit.
    """
    while len(left):
        found = [attractors.search(job.states[start], job.time) for start in left[:tries]]
        if any(found):
            return left[found.index(True) :], True
        left = left[tries:]
    return left, False


def _label(job: _BasinJob, attractors: Attractors, chosen: IntArray, rows: BasinRows) -> None:
    """Label some starts, tile by tile, as any executor computes them."""
    parts = job.parts(chosen)
    work: Work[BasinTile, BasinRows] = Work(
        "basins", compute_basin_tile, job.executor, job.progress
    )
    tiles = [job.tile(attractors, part) for part in parts]
    work.finish(tiles, lambda k, found: put_rows(rows, parts[k], found))


def _resolve(job: _BasinJob, attractors: Attractors, rows: BasinRows) -> None:
    """Find the orbits of what is periodic and unknown, until nothing is left that has one."""
    chattering = _chattering(rows)
    if len(chattering) and attractors.rest_at_walls():
        _label(job, attractors, chattering, rows)
    left, tries = _unknown(rows), 1
    while len(left):
        left, new = _search(job, attractors, left, tries)
        if new:
            _label(job, attractors, left, rows)
            left = np.intersect1d(left, _unknown(rows))
        tries *= 2
