"""Lyapunov exponents of many solutions in one call, compiled.

Each cell is one solution: parameters and an initial state. It is followed from joint to joint with the
tangent map. It ends as soon as it has become periodic (:mod:`contfric.chaos.cycle`), is held or unbounded;
otherwise its growth is averaged (:mod:`contfric.chaos.averaging`) over the periods after a transient,
until the error is below the tolerance or the periods are over.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray, IntArray
from contfric.chaos.averaging import clear, gather
from contfric.chaos.cycle import forget, returned
from contfric.chaos.endings import NO_MOTION, averaged, starts_at_rest, write_nothing
from contfric.chaos.one_motion import carry_on, carry_through_reset, try_cycle, write_last
from contfric.chaos.rows import CellRows, FollowingLimits, Starting
from contfric.chaos.starting import start_mode
from contfric.chaos.tangent import ARRIVED, MODEL, any_time, forget_events, seed, set_model
from contfric.chaos.workspaces import new_cell_workspaces, place, words_for
from contfric.compiled import (
    allocating_helper,
    f8,
    helper,
    i8,
    indices,
    kernel,
    matrix,
    table,
    vector,
)
from contfric.compiling.references import by_reference, reference_at, store_at
from contfric.flow.layouts import FlowType, TogetherType
from contfric.flow.without import SINGLY
from contfric.simulation.march import HOLD_PERIODS, TablesType
from contfric.simulation.sides import surfaces_after
from contfric.simulation.walls import walls_of

StartingType = types.NamedTuple(
    [indices, indices, indices, indices, indices, table, indices, indices, vector, f8], Starting
)
LimitsType = types.NamedTuple([i8, i8, f8, i8], FollowingLimits)
CellRowsType = types.NamedTuple([matrix, matrix, indices, indices, indices], CellRows)


#: Solutions that are followed side by side: enough for the vectors of a processor, and few enough that what
#: is kept of each stays near it.
SIDE_BY_SIDE = 32
#: The mode of a place without a solution; the stages of a solution: before its exponents are averaged, while
#: they are, and the periods after that in which it may still prove periodic.
IDLE = -1
BEFORE, AVERAGING, CONFIRMING = range(3)


class Solutions(NamedTuple):
    """Where some solutions are, one in each place.

    Attributes
    ----------
    cell, mode, on : which motion it is, its mode, the surfaces it is on as bits
    live, cycle, joint : directions that are left, periods and joints so far
    stage, end : whether growth is averaged, and the period at which that ends
    time, period, longest : phase, period of the excitation, longest segment that is looked ahead
    total, lowest, rise : growth of the first direction, its least value, and the most it rose since then
    p : parameters
    """

    cell: IntArray
    mode: IntArray
    on: IntArray
    live: IntArray
    cycle: IntArray
    joint: IntArray
    stage: IntArray
    end: IntArray
    time: FloatArray
    period: FloatArray
    longest: FloatArray
    total: FloatArray
    lowest: FloatArray
    rise: FloatArray
    p: FloatArray


@allocating_helper
def new_solutions(width, n, parameters):  # type: ignore[no-untyped-def]
    """Return places for solutions."""
    whole, real = np.empty((8, width), dtype=np.int64), np.empty((6, width))
    return Solutions(
        *(whole[0], whole[1], whole[2], whole[3], whole[4], whole[5], whole[6], whole[7]),
        *(real[0], real[1], real[2], real[3], real[4], real[5]),
        np.empty((width, parameters)),
    )


@helper
def begin(solutions, k, cell, start, y, p, limits, workspaces):  # type: ignore[no-untyped-def]
    """Put a cell into place k of the solutions; ``start`` is (mode, surfaces it is on, phase, period)."""
    mode, on, phase, period = start
    solutions.cell[k], solutions.mode[k], solutions.on[k] = cell, mode, on
    solutions.live[k], solutions.cycle[k], solutions.joint[k] = y.shape[0], 0, 0
    solutions.stage[k] = AVERAGING if limits.transient == 0 else BEFORE
    solutions.end[k], solutions.time[k], solutions.period[k] = limits.periods, phase, period
    solutions.longest[k] = HOLD_PERIODS * period
    solutions.total[k], solutions.lowest[k], solutions.rise[k] = 0.0, 0.0, 0.0
    for j in range(y.shape[0]):
        workspaces.transit.y[j] = y[j]
    for j in range(p.shape[0]):
        solutions.p[k, j] = p[j]
    forget_events(workspaces.transit)
    seed(workspaces.frame, 0)
    forget(workspaces.memory)
    clear(workspaces.averages)


@helper
def go_on(functions, tables, ranks, solutions, k, limits, workspaces, rows):  # type: ignore[no-untyped-def]
    """Follow motion k to its next joint; where it ends, write what it is and its exponents, and say so."""
    transit, growth, averages = workspaces.transit, workspaces.growth, workspaces.averages
    surfaces, p, cell = tables.observables.shape[0], solutions.p[k], solutions.cell[k]
    mode, on, t, period = solutions.mode[k], solutions.on[k], solutions.time[k], solutions.period[k]
    live = solutions.live[k]
    if transit.events[MODEL] == 0:
        outcome, surface, following, duration, turns, t, live = carry_on(
            functions, tables, ranks, mode, on, t, p, period, live, workspaces
        )
    else:
        outcome, surface, following, duration, turns, t, live = carry_through_reset(
            functions, tables, ranks, mode, on, t, p, period, live, workspaces
        )
    if outcome != ARRIVED:
        write_last(functions, tables, outcome, ranks, mode, t, p, period, workspaces, rows, cell)
        return True
    total = solutions.total[k] + (growth[0] if live > 0 else 0.0)
    lowest = min(solutions.lowest[k], total)
    rise = max(solutions.rise[k], total - lowest)
    on = surfaces_after(tables, mode, surface)
    mode, joint, cycle = following, solutions.joint[k] + 1, solutions.cycle[k] + turns
    key = mode * surfaces + surface
    timeless = any_time(transit)
    at = mode, on, key, t
    solutions.cycle[k] = cycle
    back = returned(workspaces.memory, key, cycle, joint, t, transit.y, period, timeless)
    if back[0] > 0 and try_cycle(
        functions, tables, ranks, at, back, p, period, rise, workspaces, rows, cell
    ):
        return True
    if solutions.stage[k] == AVERAGING:
        gather(averages.pending, growth, live, duration, transit.y)
        if turns > 0 and averaged(
            averages, live, turns, cycle >= solutions.end[k], limits.tolerance, rows, cell
        ):
            solutions.stage[k], solutions.end[k] = CONFIRMING, cycle + limits.confirm
    elif solutions.stage[k] == BEFORE and cycle >= limits.transient:
        solutions.stage[k], solutions.end[k] = AVERAGING, cycle + limits.periods
        seed(workspaces.frame, live)  # what only the transient forgot counts again
        live = transit.y.shape[0]
    solutions.mode[k], solutions.on[k], solutions.live[k], solutions.joint[k] = (
        mode,
        on,
        live,
        joint,
    )
    solutions.time[k], solutions.total[k], solutions.lowest[k], solutions.rise[k] = (
        t,
        total,
        lowest,
        rise,
    )
    return solutions.stage[k] == CONFIRMING and cycle >= solutions.end[k]


@helper
def begun(  # type: ignore[no-untyped-def]
    functions, tables, starting, time, ticks, p, y, solutions, k, cell, limits, workspaces, rows
):
    """Put a cell into place k; or write what it is, if there is nothing to follow, and return False.

    ``ticks`` is the time from tick to tick of a model with a clock, 0 of others.
    """
    transit, state = workspaces.transit, workspaces.state
    rows.turns[cell], rows.followed[cell] = 0, 0
    period = functions.period(p, state.none, state.empty)
    timeless = period <= 0.0
    set_model(transit, tables, timeless, ticks)
    set_model(workspaces.cycle.transit, tables, timeless, ticks)
    if timeless:
        period = ticks if ticks > 0.0 else 1.0  # periods of the clock, or units of time
    mode, on = start_mode(functions, tables, starting, time, y, p, state)
    ranks, cycle = starting.ranks, workspaces.cycle
    for j in range(y.shape[0]):
        transit.y[j] = y[j]
    if timeless and starts_at_rest(
        functions, tables, ranks, mode, time, p, transit, cycle, rows, cell
    ):
        return False
    if mode < 0:
        write_nothing(NO_MOTION, rows, cell)
        return False
    start = mode, on, time - math.floor(time / period) * period, period
    begin(solutions, k, cell, start, y, p, limits, workspaces)
    return True


@helper
def follow_all(  # type: ignore[no-untyped-def]
    functions,
    flow,
    tables,
    starting,
    time,
    ticks,
    vectors,
    states,
    limits,
    stop,
    rows,
    solutions,
    space,
    memory,
):
    """Follow the solutions of all cells; see :func:`follow_cells`."""
    tables, starting, rows = by_reference(tables), by_reference(starting), by_reference(rows)
    solutions, space, limits = by_reference(solutions), by_reference(space), by_reference(limits)
    cells, width = states.shape[0], solutions.mode.shape[0]
    following, alone, like = 0, walls_of(tables) != 0, by_reference(place(space, 0))
    for k in range(width):
        solutions.mode[k] = IDLE
        store_at(memory, k, place(space, k))
    while stop[0] == 0:
        active = 0
        for k in range(width):
            while solutions.mode[k] == IDLE and following < cells:
                begun(
                    functions,
                    tables,
                    starting,
                    time,
                    ticks[following],
                    vectors[following],
                    states[following],
                    solutions,
                    k,
                    following,
                    limits,
                    reference_at(memory, k, like),
                    rows,
                )
                following += 1
            active += 1 if solutions.mode[k] != IDLE else 0
        if active == 0:
            break
        if not alone:
            flow.together(
                width,
                solutions.mode,
                solutions.on,
                solutions.time,
                space.transit.y,
                solutions.p,
                solutions.longest,
                space.transit.ahead,
                space.transit.meets,
                space.state.after,
                space.transit.jac,
            )
        for k in range(width):
            if solutions.mode[k] == IDLE:
                continue
            workspaces = reference_at(memory, k, like)
            if go_on(functions, tables, starting.ranks, solutions, k, limits, workspaces, rows):
                rows.followed[solutions.cell[k]] = solutions.cycle[k]
                solutions.mode[k] = IDLE
            space.transit.meets[k] = SINGLY


@kernel(
    types.void(
        FlowType,
        TogetherType,
        TablesType,
        StartingType,
        f8,
        vector,
        matrix,
        matrix,
        LimitsType,
        indices,
        CellRowsType,
    )
)
def follow_cells(  # type: ignore[no-untyped-def]
    functions, flow, tables, starting, time, ticks, vectors, states, limits, stop, rows
):
    """Follow solutions from ``states`` at ``time``, and fill the rows.

    Some are followed side by side, segment by segment; where one ends the next cell takes its place. What a
    cell comes to does not depend on the others.

    Parameters
    ----------
    flow : first hits of many solutions at once
    ticks : time from tick to tick of a clock, 0 of a model without, shape (cells,)
    vectors, states : parameters and initial states, shapes (cells, parameters) and (cells, n)
    stop : another thread writes a 1 to it when nobody waits for the rows any more
    """
    cells, n = states.shape
    width = min(SIDE_BY_SIDE, cells)
    solutions, space = new_solutions(width, n, vectors.shape[1]), new_cell_workspaces(width, n)
    memory = np.empty(width * words_for(space), dtype=np.int64)
    follow_all(
        functions,
        flow,
        tables,
        starting,
        time,
        ticks,
        vectors,
        states,
        limits,
        stop,
        rows,
        solutions,
        space,
        memory,
    )
