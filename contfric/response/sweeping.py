"""The computation of a sweep: arguments checked, stretches computed one after the other, gathered, kept.

A stretch of a sweep is an independent task that any process can compute, to the same bits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from contfric.base.arrays import FloatArray, IntArray
from contfric.base.memory import must_fit
from contfric.chaos.compute import ascending
from contfric.chaos.running import Progress, Timer, check_executor, compute_all
from contfric.chaos.tiles import inside
from contfric.chaos.work import TileTask
from contfric.errors import ParameterError, function_of, real_number, shown, truth
from contfric.models import ModelSource
from contfric.models.definition import Model
from contfric.models.tied import tied
from contfric.remember.folder import kept_in
from contfric.remember.journal import Parts
from contfric.response.collecting import collect, repeats_of
from contfric.response.cuts import Cut, Ends, Following, SectionPoints, empty_points
from contfric.response.outcome import Outcome
from contfric.response.sections import SectionLike, section_of, usual_section
from contfric.response.sweep import Sweep, SweepRun
from contfric.simulation.starts import checked_state
from contfric.simulation.time_scale import clock_period

_DIRECTIONS = {"both": ("up", "down"), "up": ("up",), "down": ("down",)}
#: Bytes of a value: its parameters, its result, and a few points.
_BYTES = 1024
#: Values in a stretch: some hundredths of a second, so that an interrupt loses little.
STRETCH = 64


@dataclass(frozen=True, eq=False)
class _SweepJob:
    """A sweep to be computed; ``defined`` are the numbers of the values at which the model is."""

    model: Model
    parameter: str
    values: FloatArray
    vector: FloatArray
    defined: IntArray
    directions: Sequence[str]
    cut: Cut
    how: Following
    starts: Mapping[str, FloatArray]

    def numbers(self, direction: str, part: int) -> IntArray:
        """Return the numbers of the values of a stretch, in the order in which they are computed."""
        order = self.defined if direction == "up" else self.defined[::-1]
        return order[part * STRETCH : (part + 1) * STRETCH]

    def stretch(self, direction: str, part: int, state: FloatArray) -> Stretch | None:
        """Return a stretch; None after the last one."""
        numbers = self.numbers(direction, part)
        if not len(numbers):
            return None
        vectors = np.tile(self.vector, (len(numbers), 1))
        vectors[:, self.model.index_of(self.parameter)] = self.values[numbers]
        return Stretch(self.model, self.cut, self.how, vectors, state)


def sweep(
    model: ModelSource,
    parameter: str,
    values: ArrayLike,
    params: Mapping[str, float] | None = None,
    *,
    both: bool | None = None,
    direction: str = "both",
    periods: float = 100.0,
    transient: float = 100.0,
    section: SectionLike | None = None,
    sense: str = "either",
    state: ArrayLike | None = None,
    executor: Executor | None = None,
    folder: str | Path | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """Compute a brute-force bifurcation diagram: simulate along a parameter, the state carried over.

    At each value the solution goes on from the state at the value before. Its points on the section are
    collected after a transient. One that repeats itself to rounding is left at once, and has the points
    of one period. Where nothing can be carried over (the solution diverged, or no solution starts there) the
    next value begins with the model's start. Ctrl-C ends the computation; what was found is returned.

    Parameters
    ----------
    model, params : the model (or its name) and the other parameters; defaults fill in
    parameter, values : the parameter that varies, and its values, ascending
    both : True for up and down, False for up alone: ``direction`` in one word
    direction : "both", "up" or "down"; each begins with ``state`` at its own end
    periods, transient : periods of the excitation or of the clock, the longest where it varies (units of time
        without), of which points are collected, and before that
    section : "stops", "releases", a surface of the model by its name, or a phase of the excitation as a share
        of its period; by default the stops, or phase 0 where an excited model has none, such as a structure
    sense : of a surface: "either", "rising" or "falling"
    state : initial state, shape (n,); by default displaced from rest
    executor : any :class:`concurrent.futures.Executor`; the two directions are independent of each other
    folder : where finished parts are kept; the same call goes on from them
    progress : called with one line of text now and then

    Returns
    -------
    Sweep
        ``up`` and ``down`` hold the points of each value of the parameter, its period and its outcome.

    Raises
    ------
    ParameterError
        If an argument is not valid, or the model is defined at none of the values.
    ResultFileError
        If the folder cannot be written, or another version of contfric has written to it.

    Examples
    --------
    >>> import contfric as cf
    >>> found = cf.sweep("coulomb", "Omega", np.linspace(0.4, 0.6, 21), section=0.0)
    >>> sum(found.counts().values())
    42
    """
    model, params = tied(model, params)
    check_executor(executor)
    function_of("progress", progress)
    section = usual_section(model) if section is None else section
    cut = section_of(model, section, sense)
    skipped = real_number("transient", transient, least=0.0)
    span = skipped + positive("periods", periods)
    if both is not None:
        direction = "both" if truth("both", both) else "up"
    if direction not in [*_DIRECTIONS]:
        raise ParameterError(
            f"direction is one of {', '.join(_DIRECTIONS)}, got {shown(direction)}"
        )
    grid = checked_values(model, parameter, values)
    must_fit(f"a sweep of {len(grid)} values", _BYTES * len(grid))
    defined = _defined(model, parameter, grid, params)
    example = model.check_params({**params, parameter: float(grid[defined[0]])})
    vector, starts = model.vector(example), {}
    at = np.tile(vector, (len(defined), 1))
    at[:, model.index_of(parameter)] = grid[defined]
    for name in _DIRECTIONS[direction]:
        starts[name] = checked_state(model, at[0 if name == "up" else -1].copy(), state)
    clock = max(clock_period(model, one) for one in at)
    how = Following(clock * skipped, clock * span, repeats_of(model), np.iinfo(np.int64).max, 1)
    job = _SweepJob(
        model, parameter, grid, vector, defined, _DIRECTIONS[direction], cut, how, starts
    )
    with kept_in(folder):
        runs = _computed(job, executor, progress)
    return Sweep(model, parameter, grid, vector, section, runs)


def positive(name: str, value: object) -> float:
    """Return a positive finite number that a user gave.

    Raises
    ------
    ParameterError
        If it is not such a number.
    """
    number = real_number(name, value, least=0.0)
    if number == 0.0:
        raise ParameterError(f"{name} is a number > 0, got 0")
    return number


def checked_values(model: Model, name: str, given: ArrayLike) -> FloatArray:
    """Return the values of a parameter, or of a state, that a user gave: finite and ascending.

    Raises
    ------
    ParameterError
        If they are not.
    """
    given_name: object = name  # whatever the user gave
    if not isinstance(given_name, str) or name not in model.states:
        model.index_of(name)
    return ascending(name, given)


def _defined(
    model: Model, parameter: str, grid: FloatArray, fixed: Mapping[str, float]
) -> IntArray:
    """Return the numbers of the values at which the model is defined; all where none is, for the message."""
    named = {**model.defaults, **fixed, parameter: grid}
    found = np.flatnonzero(inside(model, named, grid.shape))
    return np.asarray(found if len(found) else np.arange(len(grid)), dtype=np.int64)


def _computed(
    job: _SweepJob, executor: Executor | None, progress: Progress | None
) -> dict[str, SweepRun]:
    done: dict[str, list[StretchRows]] = {name: [] for name in job.directions}
    tasks: dict[str, Stretch] = {}
    kept = Parts("sweep")

    def following(name: str, rows: StretchRows) -> Stretch | None:
        return job.stretch(name, len(done[name]), rows.last)

    for name in job.directions:
        task = job.stretch(name, 0, job.starts[name])
        while task is not None and (rows := kept.get(task)) is not None:
            done[name].append(rows)
            task = following(name, rows)
        if task is not None:
            tasks[name] = task
    parts = -(-len(job.defined) // STRETCH)
    finished = sum(map(len, done.values()))
    timer = Timer(parts * len(job.directions), finished, progress, "sweep")
    try:
        if tasks:
            compiled(job.model)
        found = compute_all(tasks, executor, timer.say, compute_stretch, following=following)
        for name, rows in found:
            state = done[name][-1].last if done[name] else job.starts[name]
            kept.put(job.stretch(name, len(done[name]), state), rows)
            done[name].append(rows)
            timer.tick()
    except KeyboardInterrupt:
        timer.say(f"interrupted: {timer.done} of {timer.total} tiles are finished")
    return {name: _run(job, name, rows) for name, rows in done.items()}


def compiled(model: Model) -> None:
    """Compile before tasks are spread, so that it is done once and found in the cache."""
    from contfric.response.section import cut_solutions

    model.flow.following()
    assert cut_solutions.dispatcher is not None


def _run(job: _SweepJob, direction: str, stretches: Sequence[StretchRows]) -> SweepRun:
    """Return the stretches of a direction as one, from the lowest value up."""
    outcomes = np.full(len(job.values), Outcome.OUTSIDE.code, dtype=np.uint8)
    outcomes[job.defined] = Outcome.MISSING.code
    periods = np.zeros(len(job.values), dtype=np.int32)
    index = [np.empty(0, dtype=np.int64)]
    for part, rows in enumerate(stretches):
        numbers = job.numbers(direction, part)
        outcomes[numbers], periods[numbers] = rows.ends.outcomes, rows.ends.turns
        index.append(np.repeat(numbers, np.diff(rows.ends.upto, prepend=0)))
    found = np.concatenate(index)
    order = np.argsort(found, kind="stable")
    parts = [empty_points(0, len(job.model.states)), *(rows.points for rows in stretches)]
    pieces = zip(*(points[1:] for points in parts), strict=True)
    cycles, modes, times, states = (np.concatenate(rows)[order] for rows in pieces)
    return SweepRun(
        outcomes,
        periods,
        found[order].astype(np.int32),
        cycles.astype(np.int32),
        modes.astype(np.uint8),
        times,
        states,
    )


@dataclass(frozen=True, eq=False)
class StretchRows:
    """Results of a stretch: the points of all values, and what each solution came to."""

    points: SectionPoints
    ends: Ends

    @property
    def last(self) -> FloatArray:
        """State to be carried over, shape (n,)."""
        return np.asarray(self.ends.states[-1])


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
    return StretchRows(*collect(task.model, task.cut, task.how, task.vectors, starts, stop))
