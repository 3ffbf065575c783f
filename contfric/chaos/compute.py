"""The computation of a map: arguments checked, tiles cut, spread, gathered, kept."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray
from contfric.base.memory import must_fit
from contfric.chaos.exponents import limits_of
from contfric.chaos.map import LyapunovMap, points_of
from contfric.chaos.running import Progress, check_executor
from contfric.chaos.starts import StateLike, given_states, number_of_starts
from contfric.chaos.tiles import Tile, TileRows, compute_tile, empty_tile, inside, places
from contfric.chaos.work import Work, put_rows
from contfric.errors import ParameterError, function_of, real_number, shown, whole_number
from contfric.models import ModelSource
from contfric.models.definition import Model
from contfric.models.tied import tied
from contfric.remember.folder import kept_in
from contfric.simulation.excitation import check_excitation
from contfric.simulation.time_scale import has_clock

#: Bytes of a solution in a map beyond its exponents and its initial state.
_BYTES = 24


def lyapunov_map(
    model: ModelSource,
    axes: Mapping[str, ArrayLike],
    params: Mapping[str, float] | None = None,
    *,
    periods: int = 600,
    transient: int = 100,
    tolerance: float = 0.01,
    confirm: int = 0,
    state: StateLike | None = None,
    starts: int = 1,
    time: float = 0.0,
    executor: Executor | None = None,
    folder: str | Path | None = None,
    tile: int = 16,
    progress: Progress | None = None,
) -> LyapunovMap:
    """Compute Lyapunov exponents on a grid of two parameters.

    Every point is a motion from an initial state, as in :func:`contfric.lyapunov_exponent`. The grid is
    cut into tiles, and the result is the same to the last bit wherever they are computed. Ctrl-C ends
    the computation; the map that is returned has what was finished.

    Parameters
    ----------
    model, params : the model (or its name) and the parameters that do not vary; defaults fill in
    axes : mapping of two parameters to their values, each ascending
    periods : most periods (of the excitation or of a clock; else units of time) to average over
    transient : periods before averaging begins
    tolerance : relative error of the largest exponent at which averaging ends
    confirm : periods to follow a motion further, after averaging, to see whether it converges after all
    state : initial state, shape (n,), or several, shape (starts, n), or a function of the parameters
        that returns either; by default displaced from rest
    starts : number of initial states to draw at each point, the first displaced from rest
    time : initial time, nondimensional
    executor : any :class:`concurrent.futures.Executor`: processes, loky, dask, MPI; by default threads
        of this process. What it loses is computed here.
    folder : where finished tiles are kept; the same call goes on from them
    tile : points along the side of a tile
    progress : called with one line of text now and then

    Returns
    -------
    LyapunovMap
        ``values``, the largest exponent per unit of time at each point of the grid, shape (len, len);
        rows are the first parameter.

    Raises
    ------
    ParameterError
        If an argument is not valid, or the model is defined nowhere on the grid.
    ResultFileError
        If the folder cannot be written, or another version of contfric has written to it.

    Examples
    --------
    >>> import contfric as cf
    >>> grid = {"Omega": np.linspace(0.3, 0.6, 3), "S": np.linspace(0.1, 0.3, 2)}
    >>> cf.lyapunov_map("coulomb", grid, {"S0": 0.4}, periods=100).complete
    True
    """
    model, params = tied(model, params)
    limits = limits_of(transient, periods, tolerance, confirm)
    tile = whole_number("tile", tile, least=1)
    check_executor(executor)
    grid = _checked_axes(model, axes)
    shape = tuple(len(values) for values in grid.values())
    check_size(shape, whole_number("starts", starts, least=1), len(model.states))
    function_of("progress", progress)
    vector, example = _checked_params(model, grid, params)
    count = number_of_starts(model, state, starts, example)
    check_size(shape, count, len(model.states))
    states = None if state is None else _all_states(model, grid, vector, state, count)
    names, values = zip(*grid.items(), strict=True)
    varied = model.index_of(names[0]), model.index_of(names[1])
    at = real_number("time", time)
    whole = Tile(model, limits, vector, varied, (values[0], values[1]), count, states, at)
    with kept_in(folder):
        rows = _computed(whole, tile, executor, progress)
    return LyapunovMap(model, grid, vector, rows)


def check_size(shape: tuple[int, ...], starts: int, n: int) -> None:
    """Refuse a map that does not fit into the memory: its results, and its initial states.

    Raises
    ------
    ParameterError
        If it does not.
    """
    each = _BYTES + 16 * n
    points = " x ".join(str(length) for length in shape)
    must_fit(
        f"a map of {points} points with {starts} starts",
        int(np.prod(shape, dtype=object)) * starts * each,
    )


def _computed(
    whole: Tile,
    side: int,
    executor: Executor | None,
    progress: Progress | None,
) -> TileRows:
    rows, cut = empty_tile(whole.shape, len(whole.model.states)), list(places(whole.shape, side))
    work: Work[Tile, TileRows] = Work(
        "Lyapunov map",
        compute_tile,
        executor,
        progress,
        prepare=lambda: _compile(whole.model),
    )
    with suppress(KeyboardInterrupt):
        work.finish(
            [whole.part(place) for place in cut], lambda k, found: put_rows(rows, cut[k], found)
        )
    return rows


def _compile(model: Model) -> None:
    """Compile before tiles are spread, so that it is done once and found in the cache."""
    from contfric.chaos.cells import follow_cells

    model.flow.following()
    model.flow.hits_together()
    assert follow_cells.dispatcher is not None


def _checked_axes(model: Model, axes: object) -> dict[str, FloatArray]:
    if not isinstance(axes, Mapping) or len(axes) != 2:
        raise ParameterError(
            f"axes is a mapping of two parameters to their values, such as "
            f'{{"Omega": [0.4, 0.5], "S": [0.1, 0.2]}}; got {axes!r}'
        )
    grid: dict[str, FloatArray] = {}
    for name, given in axes.items():
        model.index_of(name)
        grid[name] = ascending(name, given)
    return grid


def ascending(name: str, given: object) -> FloatArray:
    """Return the values of a parameter, or of a state, that a user gave: finite and ascending.

    Raises
    ------
    ParameterError
        If they are not.
    """
    try:
        values = np.array(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        values = np.empty(0)
    fine = values.ndim == 1 and len(values) > 0 and bool(np.isfinite(values).all())
    if not fine or np.any(np.diff(values) <= 0.0):
        raise ParameterError(
            f"the values of '{name}' are a list of finite numbers in ascending order, got {shown(given)}"
        )
    if _is_range(given, values):
        low, high, count = *values[:2], values[2] if len(values) == 3 else 200
        raise ParameterError(
            f"the values of '{name}' are a list of all values, and {shown(given)} looks like a range: write "
            f"numpy.linspace({low:g}, {high:g}, {count:g}); or, if these are the values, a numpy.array"
        )
    return values


def _is_range(given: object, values: FloatArray) -> bool:
    """Tell whether values look like a range (low, high), or like [low, high, number] of a study."""
    if not isinstance(given, (tuple, list)) or len(given) not in (2, 3):
        return False
    if len(given) == 2:
        return isinstance(given, tuple)
    first, second = np.diff(values)
    whole = isinstance(given[2], int) and given[2] >= 2
    ends = isinstance(given, tuple) or not all(isinstance(x, int) for x in given)
    return whole and ends and not np.isclose(first, second)


def _checked_params(
    model: Model, grid: Mapping[str, FloatArray], params: Mapping[str, float]
) -> tuple[FloatArray, dict[str, float]]:
    """Return the fixed parameters as a vector, and all parameters of a point where the model is defined."""
    (first, rows), (second, columns) = grid.items()
    named = {**model.defaults, **params, first: rows[:, None], second: columns[None, :]}
    defined = np.argwhere(inside(model, named, (len(rows), len(columns))))
    i, j = defined[0] if len(defined) else (0, 0)
    example = model.check_params({**params, first: rows[i], second: columns[j]})
    vector = model.vector(example)
    check_excitation(model, vector)
    return vector, example


def _all_states(
    model: Model,
    grid: Mapping[str, FloatArray],
    vector: FloatArray,
    state: StateLike,
    count: int,
) -> FloatArray:
    """Return the initial states at each point, shape (len, len, starts, n)."""
    shape = (*(len(values) for values in grid.values()), count, len(model.states))
    if not callable(state) and not has_clock(model):
        return np.broadcast_to(given_states(model, state, {}), shape)
    base = model.mapping(vector)
    states = np.empty(shape)
    for place, point in zip(np.ndindex(*shape[:2]), points_of(grid), strict=True):
        found = given_states(model, state, {**base, **point})
        if len(found) != count:
            raise ParameterError(
                f"state returns {count} states at one point and {len(found)} at another"
            )
        states[place] = found
    return states
