"""Lyapunov exponents of many motions in one call, compiled.

Each cell is one motion: parameters and an initial state. It is followed from joint to joint with the
tangent map. It ends as soon as it has become periodic (:mod:`contfric.chaos.cycle`), is held or unbounded;
otherwise its growth is averaged (:mod:`contfric.chaos.averaging`) over the periods behind a transient,
until the error is below the tolerance or the periods are over.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import types

from contfric.chaos.averaging import Averages, clear, gather, new_averages
from contfric.chaos.cycle import (
    AT_A_POINT,
    CycleWorkspace,
    Memory,
    doubt,
    forget,
    new_cycle_workspace,
    new_memory,
    returned,
    shortest,
    solve_cycle,
)
from contfric.chaos.endings import (
    BROKEN,
    NO_MOTION,
    PERIODIC,
    TRANSIENT,
    averaged,
    starts_at_rest,
    write_end,
    write_equilibrium,
    write_nothing,
    write_quiet,
)
from contfric.chaos.rows import CellRows, Limits, Starting
from contfric.chaos.tangent import (
    ARRIVED,
    Walk,
    behind,
    differentiate,
    new_walk,
    orthonormalise,
    push,
    seed,
    state_workspace,
    to_joint,
)
from contfric.compiled import allocating_helper, f8, helper, i8, indices, kernel, matrix
from contfric.flow.layouts import FlowType
from contfric.models.definition import FloatArray
from contfric.orbit.trajectory import QUIET, StateWorkspace, TablesType, behind_event

#: A separation that grew by this factor has grown from rounding to the size of the motion: the motion
#: forgot where it started, which one that only converges never does.
_FORGOTTEN = -math.log(np.finfo(np.float64).eps)

StartingType = types.NamedTuple([indices, indices, indices], Starting)
LimitsType = types.NamedTuple([i8, i8, f8, i8], Limits)
CellRowsType = types.NamedTuple([matrix, matrix, indices, indices, indices], CellRows)


class CellWorkspaces(NamedTuple):
    """All workspace that the cells of one call share."""

    walk: Walk
    state: StateWorkspace
    frame: FloatArray
    growth: FloatArray
    memory: Memory
    averages: Averages
    cycle: CycleWorkspace


@allocating_helper
def new_cell_workspaces(n):  # type: ignore[no-untyped-def]
    """Return the workspace for motions of n states."""
    return CellWorkspaces(
        new_walk(n),
        state_workspace(n),
        np.empty((n, n + 1)),
        np.empty(n),
        new_memory(n),
        new_averages(n),
        new_cycle_workspace(n),
    )


@helper
def start_code(functions, observables, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return the row of an initial state in the table of starts: the signs as digits."""
    code, place = 0, 1
    for k in range(observables.shape[0]):
        value = functions.observe(observables[k], t, y, p, workspace.none, workspace.empty)
        value -= functions.level(k, p, workspace.none, workspace.empty)
        code += place * (1 if value == 0.0 else (2 if value > 0.0 else 0))
        place *= 3
    return code


@helper
def start_mode(functions, tables, starting, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Return (mode, surfaces that it leaves as bits) of an initial state; (-1, 0) if it is in no domain.

    A state on surfaces that the signs alone do not decide goes to the side that its rates lead to.
    """
    observables, bounds = tables.observables, tables.bounds
    code = start_code(functions, observables, t, y, p, workspace)
    if starting.mode[code] >= 0:
        return starting.mode[code], starting.on[code]
    count = observables.shape[0]
    for choice in range(1 << count):
        other, place, fits, rest = code, 1, True, code
        for k in range(count):
            side = 1 if (choice >> k) & 1 == 1 else -1
            if rest % 3 == 1:
                other += side * place
            elif side < 0:
                fits = False  # a sign that is given: counted once
            rest //= 3
            place *= 3
        mode = starting.mode[other] if fits else -1
        if mode < 0:
            continue
        on, rest = 0, code
        for k in range(count):
            if rest % 3 == 1 and bounds[mode, k] != 0:
                sense = 1.0 if (choice >> k) & 1 == 1 else -1.0
                rate = functions.rate(
                    mode, observables[k], t, y, p, workspace.none, workspace.empty
                )
                fits = fits and sense * rate > 0.0
                on |= 1 << k
            rest //= 3
        if fits:
            return mode, on
    return -1, 0


@helper
def try_cycle(  # type: ignore[no-untyped-def]
    functions, tables, ranks, at, back, p, period, rise, workspaces, rows, cell
):
    """Solve for the cycle that the last joint seems to be on, and write what the motion is if it is."""
    cycle, walk, state = workspaces.cycle, workspaces.walk, workspaces.state
    (mode, on, key, t), (joints, turns), n = at, back, walk.y.shape[0]
    cycle.z[0] = t
    for j in range(n):
        cycle.z[1 + j] = walk.y[j]
        for k in range(n + 1):
            cycle.frame[j, k] = workspaces.frame[j, k]
    error = solve_cycle(
        functions, tables, ranks, mode, on, key, joints, turns, p, period, cycle, state
    )
    if error == AT_A_POINT:
        for j in range(n):
            cycle.walk.y[j] = cycle.z[1 + j]
        if write_equilibrium(functions, tables, ranks, mode, t, p, cycle.walk, cycle, rows, cell):
            return True
    if error < 0.0:
        doubt(workspaces.memory)
        return False
    rows.motions[cell] = TRANSIENT if rise > _FORGOTTEN else PERIODIC
    for k in range(n):
        rows.exponents[cell, k] = cycle.rates[k]
        rows.errors[cell, k] = error
    rows.turns[cell] = 1  # without excitation: a cycle
    if walk.at_once[1] & 1 == 0:
        rows.turns[cell] = shortest(
            functions, tables, ranks, mode, on, key, joints, turns, p, period, cycle, state
        )
    return True


@helper
def carry_on(functions, tables, ranks, mode, on, t, p, period, live, workspaces):  # type: ignore[no-untyped-def]
    """Go on to the next joint, and carry the frame there.

    Returns
    -------
    tuple
        (outcome, surface, mode that follows, duration, periods completed, phase, directions left).
    """
    walk, workspace = workspaces.walk, workspaces.state
    outcome, surface, following, duration, turns, t = to_joint(
        functions, tables, mode, on, t, p, period, walk, workspace
    )
    if outcome == ARRIVED:
        observable = tables.observables[surface]
        rate = differentiate(functions, observable, mode, duration, t, p, walk, workspace.none)
        live = min(live, ranks[mode])
        push(workspaces.frame, live, rate, walk.jac, walk.grad, walk.image)
        if not orthonormalise(workspaces.frame, live, workspaces.growth):
            outcome = BROKEN
    return outcome, surface, following, duration, turns, t, live


@helper
def carry_behind(functions, tables, ranks, mode, on, t, p, period, live, workspaces):  # type: ignore[no-untyped-def]
    """Do the same where there are resets or no excitation (apart: it would cost all others a tenth)."""
    walk, workspace = workspaces.walk, workspaces.state
    outcome, surface, following, duration, turns, t = to_joint(
        functions, tables, mode, on, t, p, period, walk, workspace
    )
    if outcome == ARRIVED:
        observable = tables.observables[surface]
        rate = differentiate(functions, observable, mode, duration, t, p, walk, workspace.none)
        live = min(live, ranks[mode])
        push(workspaces.frame, live, rate, walk.jac, walk.grad, walk.image)
        reset = tables.bounds[mode, surface] == 2
        if reset or walk.at_once[1] & 1 != 0:
            behind(functions, surface, t, p, workspaces.frame, live, walk, workspace, reset)
        if not orthonormalise(workspaces.frame, live, workspaces.growth):
            outcome = BROKEN
    return outcome, surface, following, duration, turns, t, live


@helper
def write_last(functions, tables, outcome, ranks, mode, t, p, period, workspaces, rows, cell):  # type: ignore[no-untyped-def]
    """Write what a motion is that meets nothing any more, or breaks off."""
    walk, cycle = workspaces.walk, workspaces.cycle
    if outcome == QUIET:
        write_quiet(functions, tables, ranks, mode, t, p, period, walk, cycle, rows, cell)
    else:
        write_end(functions, outcome, ranks, mode, t, p, period, walk, cycle, rows, cell)


@helper
def follow_cell(  # type: ignore[no-untyped-def]
    functions, tables, ranks, mode, on, t, p, period, limits, stop, workspaces, rows, cell
):
    """Follow one motion from ``workspaces.walk.y`` and write what it is and its exponents."""
    walk, growth, averages = workspaces.walk, workspaces.growth, workspaces.averages
    surfaces, n = tables.observables.shape[0], growth.shape[0]
    live, cycle, joint, walk.at_once[0], walk.at_once[2] = n, 0, 0, 0, 0
    total, lowest, rise = 0.0, 0.0, 0.0
    averaging, done, end = limits.transient == 0, False, limits.periods
    seed(workspaces.frame, 0)
    forget(workspaces.memory)
    clear(averages)
    while not (done and cycle >= end):
        if stop[0] != 0:
            break
        if walk.at_once[1] == 0:
            outcome, surface, following, duration, turns, t, live = carry_on(
                functions, tables, ranks, mode, on, t, p, period, live, workspaces
            )
        else:
            outcome, surface, following, duration, turns, t, live = carry_behind(
                functions, tables, ranks, mode, on, t, p, period, live, workspaces
            )
        if outcome != ARRIVED:
            write_last(
                functions, tables, outcome, ranks, mode, t, p, period, workspaces, rows, cell
            )
            break
        total += growth[0] if live > 0 else 0.0
        lowest = min(lowest, total)
        rise = max(rise, total - lowest)
        on = behind_event(tables, mode, surface)
        mode, joint, cycle = following, joint + 1, cycle + turns
        key = mode * surfaces + surface
        timeless = walk.at_once[1] & 1 != 0
        at = mode, on, key, t
        back = returned(workspaces.memory, key, cycle, joint, t, walk.y, period, timeless)
        if back[0] > 0 and try_cycle(
            functions, tables, ranks, at, back, p, period, rise, workspaces, rows, cell
        ):
            break
        if averaging:
            gather(averages.pending, growth, live, duration, walk.y)
            if turns > 0 and averaged(
                averages, live, turns, cycle >= end, limits.tolerance, rows, cell
            ):
                averaging, done, end = False, True, cycle + limits.confirm
        elif not done and cycle >= limits.transient:
            averaging, end = True, cycle + limits.periods
            seed(workspaces.frame, live)  # what only the transient forgot counts again
            live = n
    rows.followed[cell] = cycle


@kernel(
    types.void(
        FlowType,
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
def follow_cells(functions, tables, starting, time, vectors, states, limits, stop, rows):  # type: ignore[no-untyped-def]
    """Follow motions from ``states`` at ``time``, and fill the rows.

    Parameters
    ----------
    vectors, states : parameters and initial states, shapes (cells, parameters) and (cells, n)
    stop : another thread writes a 1 to it when nobody waits for the rows any more
    """
    n = states.shape[1]
    workspaces = new_cell_workspaces(n)
    walls = 0
    for k in range(tables.observables.shape[0]):
        walls = 1 if tables.bounds[0, k] == 2 else walls
    for cell in range(states.shape[0]):
        if stop[0] != 0:
            break
        p = vectors[cell]
        for j in range(n):
            workspaces.walk.y[j] = states[cell, j]
        rows.turns[cell], rows.followed[cell] = 0, 0
        period = functions.period(p, workspaces.state.none, workspaces.state.empty)
        timeless = period <= 0.0
        workspaces.walk.at_once[1] = workspaces.cycle.walk.at_once[1] = 2 * walls + (
            1 if timeless else 0
        )
        if timeless:
            period = 1.0  # periods are units of time
        mode, on = start_mode(
            functions, tables, starting, time, workspaces.walk.y, p, workspaces.state
        )
        if mode < 0:
            ranks, cycle = starting.ranks, workspaces.cycle
            if not (
                timeless
                and starts_at_rest(
                    functions, tables, ranks, time, p, workspaces.walk, cycle, rows, cell
                )
            ):
                write_nothing(NO_MOTION, rows, cell)
            continue
        phase = time - math.floor(time / period) * period
        follow_cell(
            functions,
            tables,
            starting.ranks,
            mode,
            on,
            phase,
            p,
            period,
            limits,
            stop,
            workspaces,
            rows,
            cell,
        )
