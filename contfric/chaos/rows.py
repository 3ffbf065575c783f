"""Input and output of the compiled cells: tables of a model, limits, and the rows of results."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.models.definition import Model
from contfric.models.mode_domains import cut_bounds
from contfric.simulation.tables import tables
from contfric.simulation.time_scale import clock_period, ticks_of, time_scale


class Starting(NamedTuple):
    """Where a solution starts, and how much its modes pass on.

    Attributes
    ----------
    mode, on : mode of an initial state, -1 if it is in no domain, and the surfaces that it leaves as
        bits; by the signs of (observable - level), shape (3 ** surfaces,), surface k counting 3 ** k
        for zero and twice that for plus
    ranks : directions that survive a mode, shape (modes,)
    first : domain that the signs say, as a row of ``sides``, -1 if none, shape (3 ** surfaces,)
    own, sides : mode of each domain but chatter, shape (domains,), and its sides of all surfaces, shape
        (domains, surfaces); those first that lie on most
    fixed_sides : side of surfaces that a state is always on one side of, 0 of others, shape (surfaces,)
    cuts : whether motion is cut at a surface in all modes, shape (surfaces,)
    widths, unit : what the sizes of states and the unit of time are told by, as in
        :mod:`contfric.simulation.entered_domain`, at the default parameters; shape (n,), and a number
    """

    mode: IntArray
    on: IntArray
    ranks: IntArray
    first: IntArray
    own: IntArray
    sides: IntArray
    fixed_sides: IntArray
    cuts: IntArray
    widths: FloatArray
    unit: float


class FollowingLimits(NamedTuple):
    """How long solutions are followed.

    Attributes
    ----------
    transient, periods : periods before the growth is averaged, and most periods that it is averaged over
    tolerance : relative error of the largest exponent at which averaging ends
    confirm : periods that a solution is followed further afterwards, whether it converges
    """

    transient: int
    periods: int
    tolerance: float
    confirm: int = 0


class CellRows(NamedTuple):
    """Results of a call, one row a cell.

    Attributes
    ----------
    exponents, errors : shape (cells, n), largest exponent first
    motions, turns, followed : number of the motion, its period (0 if none) and the periods that it was
        followed, shape (cells,)
    """

    exponents: FloatArray
    errors: FloatArray
    motions: IntArray
    turns: IntArray
    followed: IntArray


def empty_rows(cells: int, n: int) -> CellRows:
    """Return empty rows for the results of some cells."""
    numbers = (np.empty(cells, dtype=np.int64) for _ in range(3))
    return CellRows(np.empty((cells, n)), np.empty((cells, n)), *numbers)


@cache
def starting(model: Model) -> Starting:
    """Return the table of starts of a model."""
    surfaces = [s.name for s in model.surfaces]
    bounds = cut_bounds(model)
    mode = np.full(3 ** len(surfaces), -1, dtype=np.int64)
    on = np.zeros(3 ** len(surfaces), dtype=np.int64)
    first = np.full(3 ** len(surfaces), -1, dtype=np.int64)
    domains = [d for d in model.domains if d.own_mode not in model.chatter_by_mode]
    domains.sort(key=lambda d: -sum(side == 0 for side in d.signs.values()))
    rows = {d.name: row for row, d in enumerate(domains)}
    for signs in product((-1, 0, 1), repeat=len(surfaces)):
        code = sum((sign + 1) * 3**k for k, sign in enumerate(signs))
        named = dict(zip(surfaces, signs, strict=True))
        domain = model.domain_at({**named, **model.fixed_sides})
        if domain is None:
            continue
        first[code] = rows.get(domain, -1)
        name = model.domain_by_name[domain].own_mode
        mode[code] = model.mode_index[name]
        on[code] = sum(1 << model.surface_index[k] for k in bounds[name] if named[k] == 0)
    # a shift in time is no disturbance of an autonomous motion
    ranks = [m.rank - int(model.autonomous) for m in model.modes]
    own = [model.mode_index[d.own_mode] for d in domains]
    sides = [[d.signs[k] for k in surfaces] for d in domains]
    fixed_sides, cuts = (
        np.array(list(map(of, surfaces)), dtype=np.int64)
        for of in (lambda k: model.fixed_sides.get(k, 0), model.cuts)
    )
    defaults = model.vector({})
    return Starting(
        mode,
        on,
        np.array(ranks, dtype=np.int64),
        first,
        np.array(own, dtype=np.int64),
        np.array(sides, dtype=np.int64).reshape(len(own), len(surfaces)),
        fixed_sides,
        cuts,
        np.abs(np.asarray(model.spread(model.mapping(defaults)), dtype=np.float64)),
        max(clock_period(model, defaults), time_scale(model)),
    )


def follow(
    model: Model,
    vectors: FloatArray,
    states: FloatArray,
    time: float,
    limits: FollowingLimits,
    stop: IntArray | None = None,
) -> CellRows:
    """Follow motions, compiled and without Python's lock, and return their rows.

    Parameters
    ----------
    vectors, states : parameters and initial states, shapes (cells, parameters) and (cells, n)
    time : initial time
    stop : shape (1,); another thread writes a 1 to it to end the computation, whose rows are then of no
        use. Without it the solutions are followed in a thread, and Ctrl-C ends them.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> model = load_model("coulomb")
    >>> vectors = model.vector({"Omega": 0.5, "S": 0.32, "S0": 0.4})[None]
    >>> rows = follow(model, vectors, np.array([[1.3, 0.0]]), 0.0, FollowingLimits(100, 600, 0.0))
    >>> rows.turns
    array([1])
    """
    from contfric.chaos.cells import follow_cells

    rows = empty_rows(len(vectors), len(model.states))
    flag = new_stop() if stop is None else stop
    arguments = (
        model.flow.following(),
        model.flow.hits_together(),
        tables(model),
        starting(model),
        float(time),
        np.array([ticks_of(model, vector) for vector in vectors]),
        np.ascontiguousarray(vectors),
        np.ascontiguousarray(states),
        limits,
        flag,
        rows,
    )
    until_interrupted(follow_cells, arguments, flag if stop is None else None)
    return rows


def until_interrupted(kernel: Any, arguments: tuple[Any, ...], flag: IntArray | None) -> Any:
    """Call a kernel; with a flag, in a thread, and Ctrl-C writes a 1 to the flag to end it."""
    if flag is None:
        return kernel(*arguments)
    assert kernel.dispatcher is not None  # compiled here, not where nobody could interrupt it
    with ThreadPoolExecutor(1) as pool:  # a kernel hears no Ctrl-C, but who waits for it does
        try:
            return pool.submit(kernel, *arguments).result()
        finally:
            flag[0] = 1


def new_stop() -> IntArray:
    """Return what :func:`follow` is told to end by."""
    return np.zeros(1, dtype=np.int64)
