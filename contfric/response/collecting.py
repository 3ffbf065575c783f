"""Calls of the compiled sections: arrays that grow, and begin where nothing can be carried over."""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.chaos.rows import new_stop, starting, until_interrupted
from contfric.chaos.running import Progress
from contfric.errors import ParameterError
from contfric.models.definition import Model
from contfric.response.cuts import (
    BATCH,
    Cut,
    Ends,
    Following,
    SectionPoints,
    empty_ends,
    empty_points,
)
from contfric.response.outcome import Outcome
from contfric.simulation.simulate import EventRows
from contfric.simulation.starts import displaced
from contfric.simulation.tables import tables

#: Points that there is space for at first, for each solution.
_POINTS = 64
#: Factor by which the arrays grow.
_GROWTH = 4
#: A return that differs by this many units of the model's rounding is a return to the same point: what
#: is left of a thousand such steps is 1e-11.
_ROUNDINGS = 10.0
#: Points of one period and the next that differ by less (relative to 1 + their size) are the same, as
#: those of an orbit are (:mod:`contfric.orbit.canonical.repetition`).
_SAME = 1e-8


def repeats_of(model: Model) -> float:
    """Return the difference below which a return is to the same state."""
    return _ROUNDINGS * model.rounding


def collect(
    model: Model,
    cut: Cut,
    how: Following,
    vectors: FloatArray,
    starts: tuple[FloatArray, FloatArray, IntArray, IntArray],
    stop: IntArray | None = None,
    progress: Progress | None = None,
) -> tuple[SectionPoints, Ends]:
    """Follow solutions and return their points on a section, and what they came to.

    Parameters
    ----------
    vectors : parameters of each, shape (k, parameters)
    starts : initial times (k,) and states (k, n), modes (-1 where the state decides) and the surfaces
        that each lies on, as bits; of the states only the first counts if they are carried over
    stop : shape (1,); another thread writes a 1 to it to end the computation. Without it the solutions are
        followed in a thread, and Ctrl-C ends them.
    progress : called with the number of points whenever there is no more space for them
    """
    from contfric.response.section import cut_solutions

    times, states, modes, ons = starts
    count, n = len(vectors), states.shape[1]
    points, ends = empty_points(_POINTS * count, n), empty_ends(count, n)
    done, state = 0, np.ascontiguousarray(states)
    while done < count:
        flag = new_stop() if stop is None else stop  # a call in a thread uses it up
        part = slice(done, count)
        rest = ends.after(done)
        arguments = (
            model.flow.following(),
            tables(model),
            starting(model),
            cut,
            how,
            np.ascontiguousarray(vectors[part]),
            np.ascontiguousarray(times[part]),
            state if how.carried else state[part],
            modes[part].copy(),
            ons[part].copy(),
            flag,
            EventRows.empty(BATCH, n),
            points,
            rest,
        )
        more = until_interrupted(cut_solutions, arguments, flag if stop is None else None)
        done += int(more)
        if done == count or (stop is not None and stop[0] != 0):
            break
        carried = ends.states[done - 1 : done] if done else state[:1]
        if how.carried and more and not _goes_on(int(ends.outcomes[done - 1])):
            carried = _fresh(model, vectors[done], carried)
        else:
            if progress is not None:
                progress(f"{len(points.times)} points")
            points = _longer(points)
        state = carried.copy() if how.carried else state
    found = points.at(slice(int(ends.upto[-1]) if count else 0))
    return (found if model.autonomous else _shortest(model, vectors, found, ends)), ends


def _shortest(
    model: Model, vectors: FloatArray, points: SectionPoints, ends: Ends
) -> SectionPoints:
    """Return the points of the fewest periods after which each solution repeats itself; ``ends`` is set.

    One that spirals in, or comes from two sides in turn, is near to a state of several periods ago first.
    """
    kept, fewer = np.ones(len(points.times), dtype=bool), np.zeros_like(ends.upto)
    for row in np.flatnonzero(ends.turns > 1):
        first, last = int(ends.upto[row - 1]) if row else 0, int(ends.upto[row])
        part, turns = slice(first, last), int(ends.turns[row])
        period, states = model.view(vectors[row]).period, points.states[part]
        times, modes = points.cycles[part] * period + points.times[part], points.modes[part]
        for less in (d for d in range(1, turns) if turns % d == 0):
            step, rest = divmod((last - first) * less, turns)
            if rest or not step or not np.array_equal(modes[step:], modes[:-step]):
                continue
            late = np.abs(times[step:] - times[:-step] - less * period)
            off = np.abs(states[step:] - states[:-step])
            if late.max() < _SAME * (1.0 + period) and np.all(
                off < _SAME * (1.0 + np.abs(states[step:]))
            ):
                ends.turns[row], fewer[row] = less, last - first - step
                kept[first + step : last] = False
                break
    if not fewer.any():
        return points
    ends.upto[:] -= np.cumsum(fewer)
    return points.at(kept)


def _goes_on(outcome: int) -> bool:
    return outcome in (Outcome.PERIODIC.code, Outcome.APERIODIC.code, Outcome.HELD.code)


def _fresh(model: Model, vector: FloatArray, otherwise: FloatArray) -> FloatArray:
    """Return the start by default, where nothing can be carried over."""
    try:
        return displaced(model, vector)[None]
    except ParameterError:  # no state is in a domain: the kernel says so
        return otherwise


def _longer(points: SectionPoints) -> SectionPoints:
    longer = empty_points(_GROWTH * len(points.times), points.states.shape[1])
    count = int(points.number[0])
    longer.number[0] = count
    for new, old in zip(longer[1:], points[1:], strict=True):
        new[:count] = old[:count]
    return longer
