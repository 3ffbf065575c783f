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

from contfric.chaos.averaging import clear, gather
from contfric.chaos.cycle import (
    forget,
    returned,
)
from contfric.chaos.endings import (
    NO_MOTION,
    averaged,
    starts_at_rest,
    write_nothing,
)
from contfric.chaos.one_motion import carry_behind, carry_on, try_cycle, write_last
from contfric.chaos.rows import CellRows, Limits, Starting
from contfric.chaos.starting import start_mode
from contfric.chaos.tangent import (
    ARRIVED,
    seed,
)
from contfric.chaos.workspaces import new_cell_workspaces, place, words_for
from contfric.compiled import (
    allocating_helper,
    f8,
    helper,
    i8,
    indices,
    kernel,
    matrix,
)
from contfric.compiling.references import by_reference, reference_at, store_at
from contfric.flow.layouts import FlowType, TogetherType
from contfric.flow.without import SINGLY
from contfric.models.definition import FloatArray
from contfric.orbit.sides import (
    behind_event,
)
from contfric.orbit.system import IntArray
from contfric.orbit.trajectory import (
    HOLD_PERIODS,
    TablesType,
)

StartingType = types.NamedTuple([indices, indices, indices], Starting)
LimitsType = types.NamedTuple([i8, i8, f8, i8], Limits)
CellRowsType = types.NamedTuple([matrix, matrix, indices, indices, indices], CellRows)


#: Motions that are followed side by side: enough for the vectors of a processor, and few enough that what is
#: kept of each stays near it.
SIDE_BY_SIDE = 32
#: The mode of a place without a motion, and how far a motion is: before the averages, in them, or behind.
IDLE = -1
BEFORE, AVERAGING, BEHIND = range(3)


class Motions(NamedTuple):
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
def new_motions(width, n, parameters):  # type: ignore[no-untyped-def]
    """Return places for motions."""
    whole, real = np.empty((8, width), dtype=np.int64), np.empty((6, width))
    return Motions(
        *(whole[0], whole[1], whole[2], whole[3], whole[4], whole[5], whole[6], whole[7]),
        *(real[0], real[1], real[2], real[3], real[4], real[5]),
        np.empty((width, parameters)),
    )


@helper
def begin(motions, k, cell, start, y, p, limits, workspaces):  # type: ignore[no-untyped-def]
    """Put a cell into place k of the solutions; ``start`` is (mode, surfaces it is on, phase, period)."""
    mode, on, phase, period = start
    motions.cell[k], motions.mode[k], motions.on[k] = cell, mode, on
    motions.live[k], motions.cycle[k], motions.joint[k] = y.shape[0], 0, 0
    motions.stage[k] = AVERAGING if limits.transient == 0 else BEFORE
    motions.end[k], motions.time[k], motions.period[k] = limits.periods, phase, period
    motions.longest[k] = HOLD_PERIODS * period
    motions.total[k], motions.lowest[k], motions.rise[k] = 0.0, 0.0, 0.0
    for j in range(y.shape[0]):
        workspaces.walk.y[j] = y[j]
    for j in range(p.shape[0]):
        motions.p[k, j] = p[j]
    workspaces.walk.at_once[0], workspaces.walk.at_once[2] = 0, 0
    seed(workspaces.frame, 0)
    forget(workspaces.memory)
    clear(workspaces.averages)


@helper
def go_on(functions, tables, ranks, motions, k, limits, workspaces, rows):  # type: ignore[no-untyped-def]
    """Follow motion k to its next joint; where it ends, write what it is and its exponents, and say so."""
    walk, growth, averages = workspaces.walk, workspaces.growth, workspaces.averages
    surfaces, p, cell = tables.observables.shape[0], motions.p[k], motions.cell[k]
    mode, on, t, period = motions.mode[k], motions.on[k], motions.time[k], motions.period[k]
    live = motions.live[k]
    if walk.at_once[1] == 0:
        outcome, surface, following, duration, turns, t, live = carry_on(
            functions, tables, ranks, mode, on, t, p, period, live, workspaces
        )
    else:
        outcome, surface, following, duration, turns, t, live = carry_behind(
            functions, tables, ranks, mode, on, t, p, period, live, workspaces
        )
    if outcome != ARRIVED:
        write_last(functions, tables, outcome, ranks, mode, t, p, period, workspaces, rows, cell)
        return True
    total = motions.total[k] + (growth[0] if live > 0 else 0.0)
    lowest = min(motions.lowest[k], total)
    rise = max(motions.rise[k], total - lowest)
    on = behind_event(tables, mode, surface)
    mode, joint, cycle = following, motions.joint[k] + 1, motions.cycle[k] + turns
    key = mode * surfaces + surface
    timeless = walk.at_once[1] & 1 != 0
    at = mode, on, key, t
    motions.cycle[k] = cycle
    back = returned(workspaces.memory, key, cycle, joint, t, walk.y, period, timeless)
    if back[0] > 0 and try_cycle(
        functions, tables, ranks, at, back, p, period, rise, workspaces, rows, cell
    ):
        return True
    if motions.stage[k] == AVERAGING:
        gather(averages.pending, growth, live, duration, walk.y)
        if turns > 0 and averaged(
            averages, live, turns, cycle >= motions.end[k], limits.tolerance, rows, cell
        ):
            motions.stage[k], motions.end[k] = BEHIND, cycle + limits.confirm
    elif motions.stage[k] == BEFORE and cycle >= limits.transient:
        motions.stage[k], motions.end[k] = AVERAGING, cycle + limits.periods
        seed(workspaces.frame, live)  # what only the transient forgot counts again
        live = walk.y.shape[0]
    motions.mode[k], motions.on[k], motions.live[k], motions.joint[k] = mode, on, live, joint
    motions.time[k], motions.total[k], motions.lowest[k], motions.rise[k] = t, total, lowest, rise
    return motions.stage[k] == BEHIND and cycle >= motions.end[k]


@helper
def walls_of(tables):  # type: ignore[no-untyped-def]
    """Return 1 if a model has resets: a wall bounds every mode."""
    walls = 0
    for k in range(tables.observables.shape[0]):
        walls = 1 if tables.bounds[0, k] == 2 else walls
    return walls


@helper
def begun(functions, tables, starting, time, p, y, motions, k, cell, limits, workspaces, rows):  # type: ignore[no-untyped-def]
    """Put a cell into place k; or write what it is, if there is nothing to follow, and return False."""
    walk, state = workspaces.walk, workspaces.state
    rows.turns[cell], rows.followed[cell] = 0, 0
    period = functions.period(p, state.none, state.empty)
    timeless = period <= 0.0
    walk.at_once[1] = 2 * walls_of(tables) + (1 if timeless else 0)
    workspaces.cycle.walk.at_once[1] = walk.at_once[1]
    if timeless:
        period = 1.0  # periods are units of time
    mode, on = start_mode(functions, tables, starting, time, y, p, state)
    if mode >= 0:
        start = mode, on, time - math.floor(time / period) * period, period
        begin(motions, k, cell, start, y, p, limits, workspaces)
        return True
    ranks, cycle = starting.ranks, workspaces.cycle
    for j in range(y.shape[0]):
        walk.y[j] = y[j]
    if not (
        timeless and starts_at_rest(functions, tables, ranks, time, p, walk, cycle, rows, cell)
    ):
        write_nothing(NO_MOTION, rows, cell)
    return False


@helper
def follow_all(  # type: ignore[no-untyped-def]
    functions,
    flow,
    tables,
    starting,
    time,
    vectors,
    states,
    limits,
    stop,
    rows,
    motions,
    space,
    memory,
):
    """Follow the solutions of all cells; see :func:`follow_cells`."""
    tables, starting, rows = by_reference(tables), by_reference(starting), by_reference(rows)
    motions, space, limits = by_reference(motions), by_reference(space), by_reference(limits)
    cells, width = states.shape[0], motions.mode.shape[0]
    following, alone, like = 0, walls_of(tables) != 0, by_reference(place(space, 0))
    for k in range(width):
        motions.mode[k] = IDLE
        store_at(memory, k, place(space, k))
    while stop[0] == 0:
        active = 0
        for k in range(width):
            while motions.mode[k] == IDLE and following < cells:
                begun(
                    functions,
                    tables,
                    starting,
                    time,
                    vectors[following],
                    states[following],
                    motions,
                    k,
                    following,
                    limits,
                    reference_at(memory, k, like),
                    rows,
                )
                following += 1
            active += 1 if motions.mode[k] != IDLE else 0
        if active == 0:
            break
        if not alone:
            flow.together(
                width,
                motions.mode,
                motions.on,
                motions.time,
                space.walk.y,
                motions.p,
                motions.longest,
                space.walk.ahead,
                space.walk.meets,
                space.state.after,
                space.walk.jac,
            )
        for k in range(width):
            if motions.mode[k] == IDLE:
                continue
            workspaces = reference_at(memory, k, like)
            if go_on(functions, tables, starting.ranks, motions, k, limits, workspaces, rows):
                rows.followed[motions.cell[k]] = motions.cycle[k]
                motions.mode[k] = IDLE
            space.walk.meets[k] = SINGLY


@kernel(
    types.void(
        FlowType,
        TogetherType,
        TablesType,
        StartingType,
        f8,
        matrix,
        matrix,
        LimitsType,
        indices,
        CellRowsType,
    )
)
def follow_cells(  # type: ignore[no-untyped-def]
    functions, flow, tables, starting, time, vectors, states, limits, stop, rows
):
    """Follow solutions from ``states`` at ``time``, and fill the rows.

    Some are followed side by side, segment by segment; where one ends the next cell takes its place. What a
    cell comes to does not depend on the others.

    Parameters
    ----------
    flow : first hits of many solutions at once
    vectors, states : parameters and initial states, shapes (cells, parameters) and (cells, n)
    stop : another thread writes a 1 to it when nobody waits for the rows any more
    """
    cells, n = states.shape
    width = min(SIDE_BY_SIDE, cells)
    motions, space = new_motions(width, n, vectors.shape[1]), new_cell_workspaces(width, n)
    memory = np.empty(width * words_for(space), dtype=np.int64)
    follow_all(
        functions,
        flow,
        tables,
        starting,
        time,
        vectors,
        states,
        limits,
        stop,
        rows,
        motions,
        space,
        memory,
    )
