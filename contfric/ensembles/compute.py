"""The computation of an ensemble: arguments checked, samples drawn, tiles spread, gathered, kept."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray
from contfric.base.memory import must_fit
from contfric.chaos.compute import ascending
from contfric.chaos.running import Progress, check_executor
from contfric.chaos.work import Work
from contfric.ensembles.drawing import Varied, checked_distributions
from contfric.ensembles.ensemble import Ensemble
from contfric.ensembles.rows import Rows, joined
from contfric.ensembles.tile import EnsembleTile, compute_ensemble_tile
from contfric.errors import (
    ParameterError,
    checked_range,
    function_of,
    real_number,
    truth,
    whole_number,
)
from contfric.models import ModelSource, Parameters
from contfric.models.definition import Model
from contfric.models.tied import tied
from contfric.quantities.registry import QuantityLike, number_quantity
from contfric.remember.folder import kept_in

if TYPE_CHECKING:
    from contfric.study.read import Study

#: Bytes that a sample takes at each of the values, for ten branches: 41 of a row with a name of five letters.
_BYTES = 410
#: Most branches of a diagram: Fig. 5 has 8, with mirror images; one that reaches this has a cascade.
_MAX_BRANCHES = 100


def ensemble(
    model: ModelSource | Study,
    parameter: str | int | None = None,
    range: tuple[float, float] | None = None,
    distributions: Mapping[str, Any] | None = None,
    params: Parameters | None = None,
    *,
    samples: int | None = None,
    seed: int = 0,
    row: QuantityLike = "x_max",
    values: int | ArrayLike = 101,
    max_step: float | None = None,
    bridges: bool = True,
    max_periods: int | None = None,
    copies: int | None = None,
    max_branches: int = _MAX_BRANCHES,
    max_points: int | None = None,
    executor: Executor | None = None,
    folder: str | Path | None = None,
    tile: int = 20,
    progress: Progress | None = None,
) -> Ensemble:
    """Explore the diagrams of random parameters.

    ``ensemble(study, samples)`` computes the one that a study asks for (a path, a bundled name, or a study
    that was read), with ``executor``, ``folder`` and ``progress``.

    Each sample is an exploration, as by :func:`contfric.explore`, from an orbit that a simulation finds at
    ``params[parameter]``, or elsewhere in the range. Sample i depends on ``seed`` and i only: the result is
    the same to the last bit for any number of workers. Ctrl-C ends the computation; the samples that are
    finished are returned, but not those of tiles that an executor has begun.

    Parameters
    ----------
    model, params : the model (or its name) and the parameters that do not vary; defaults fill in
    parameter, range : the parameter of the diagrams, and where it is followed
    distributions : of the parameters that vary: (low, high) is uniform; or a frozen one of scipy.stats
    samples : number of diagrams, 1000 by default; Sobol indices of d parameters use (d + 2) times a power of
        2 of them
    seed : whole number that the samples are drawn from
    row : a quantity, of which bands are made
    values : number of values of the parameter for bands, or the values, ascending
    max_step, bridges, max_periods, copies, max_branches, max_points : as for :func:`contfric.explore`;
        a sample that a limit cuts is counted, and is in bands but not in classes
    executor : any :class:`concurrent.futures.Executor` of processes: loky, dask, MPI; by default one
        sample after the other in this process. What it loses is computed here.
    folder : where finished tiles are kept; the same call goes on from them
    tile : samples in a tile
    progress : called with one line of text now and then

    Returns
    -------
    Ensemble
        Events, bands of a quantity and classes of the diagrams, one diagram a sample.

    Raises
    ------
    ParameterError
        If an argument is not valid.
    ResultFileError
        If the folder cannot be written, or another version of contfric has written to it.

    Examples
    --------
    >>> import contfric as cf
    >>> box = {"S": (0.30, 0.34)}
    >>> found = cf.ensemble("coulomb", "Omega", (0.5, 0.55), box, {"Omega": 0.5, "S0": 0.4}, samples=6)
    >>> found.event("SN 1a").count
    6
    """
    if parameter is None or isinstance(parameter, int):
        from contfric.study.tasks.ensemble import ensemble_of

        asked = {"executor": executor, "folder": folder, "progress": progress}
        given = parameter if samples is None else samples
        return ensemble_of(cast("Study | str | Path", model), given, **asked)
    if range is None or distributions is None:
        raise ParameterError(
            "an ensemble of a model takes parameter, range and distributions: ensemble(model, 'Omega', "
            "(0.4, 0.6), {'S': (0.3, 0.34)}); one of a study takes ensemble('study.yaml', samples)"
        )
    model, fixed = tied(cast(ModelSource, model), params)
    check_executor(executor)
    function_of("progress", progress)
    model.index_of(parameter)
    bounds = checked_range(parameter, range)
    varied = checked_distributions(model, distributions, parameter)
    quantity = number_quantity(row, model, "an ensemble")
    count = whole_number("samples", 1000 if samples is None else samples, least=1)
    grid = _values(parameter, bounds, values)
    must_fit(f"an ensemble of {count} diagrams at {len(grid)} values", count * len(grid) * _BYTES)
    limits = {"max_periods": max_periods, "copies": copies}
    limits |= {"max_branches": max_branches, "max_points": max_points}
    options = _options(bridges, limits, max_step)
    vector = _vector(model, fixed, parameter, bounds, varied)
    drawn = varied.draw(whole_number("seed", seed, least=0), count)
    vectors = np.tile(vector, (count, 1))
    vectors[:, [model.index_of(name) for name in varied.names]] = drawn
    side = whole_number("tile", tile, least=1)
    kept = quantity.function or quantity.name  # not a function's name: tiles depend on its code
    whole = EnsembleTile(model, vectors, parameter, bounds, kept, grid, options)
    with kept_in(folder):
        rows = _computed(whole, side, executor, progress)
    texts = dict(zip(varied.names, varied.texts, strict=True))
    return Ensemble(
        model, parameter, bounds, vector, quantity.asked, grid, texts, seed, drawn, rows
    )


def _options(
    bridges: bool, limits: Mapping[str, int | None], max_step: float | None
) -> dict[str, Any]:
    """Return arguments of the explorations, those that were given."""
    options: dict[str, Any] = {"bridges": truth("bridges", bridges)}
    options |= {k: whole_number(k, v, least=1) for k, v in limits.items() if v is not None}
    if max_step is not None:
        options["max_step"] = real_number("max_step", max_step)
    return options


def _values(parameter: str, bounds: tuple[float, float], given: Any) -> FloatArray:
    if isinstance(given, int | np.integer) and not isinstance(given, bool):
        return np.linspace(*bounds, whole_number("values", given, least=2))
    values = ascending(parameter, given)
    if values[0] < bounds[0] or values[-1] > bounds[1]:
        raise ParameterError(
            f"the values of '{parameter}' lie within its range, {bounds[0]:g} to {bounds[1]:g}; got "
            f"{values[0]:g} to {values[-1]:g}"
        )
    return values


def _vector(
    model: Model,
    params: Mapping[str, float],
    parameter: str,
    bounds: tuple[float, float],
    varied: Varied,
) -> FloatArray:
    """Return the parameters, those that vary at their medians."""
    fixed = {parameter: 0.5 * (bounds[0] + bounds[1]), **params}
    for name in varied.names:
        if name in params:
            raise ParameterError(f"'{name}' has a value in params, and a distribution: give one")
    half = np.array([0.5])
    medians = (float(x.ppf(half)[0]) for x in varied.distributions)
    vector = model.vector({**fixed, **dict(zip(varied.names, medians, strict=True))})
    start = vector[model.index_of(parameter)]
    if not bounds[0] <= start <= bounds[1]:
        raise ParameterError(
            f"an orbit to begin with is looked for at {parameter} = {start:g}, which is not between "
            f"{bounds[0]:g} and {bounds[1]:g}"
        )
    return vector


def _computed(
    whole: EnsembleTile,
    side: int,
    executor: Executor | None,
    progress: Progress | None,
) -> Rows:
    vectors = np.split(whole.vectors, range(side, len(whole.vectors), side))
    rows = [Rows.empty(len(part)) for part in vectors]
    tiles = [replace(whole, vectors=part) for part in vectors]

    def keep(tile: EnsembleTile, finished: Rows) -> None:
        rows[tiles.index(tile)] = finished

    # a tile is Python, which holds the lock
    work: Work[EnsembleTile, Rows] = Work(
        *("ensemble", compute_ensemble_tile, executor, progress),
        threads=1,
        here=partial(compute_ensemble_tile, begun=keep),
    )
    with suppress(KeyboardInterrupt):
        work.finish(tiles, rows.__setitem__)
    return joined(rows)
