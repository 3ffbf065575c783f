"""One solution after a joint: whether it is periodic, its tangent vectors, how it ends; compiled."""

from __future__ import annotations

import math

import numpy as np

from contfric.chaos.cycle import AT_A_POINT, doubt, shortest, solve_cycle
from contfric.chaos.endings import (
    BROKEN,
    PERIODIC,
    TRANSIENT,
    write_end,
    write_equilibrium,
    write_quiet,
)
from contfric.chaos.tangent import (
    ARRIVED,
    any_time,
    carry_after_joint,
    differentiate,
    is_autonomous,
    orthonormalise,
    push,
    to_joint,
)
from contfric.compiled import helper
from contfric.simulation.march import QUIET

#: A separation that grew by this factor has grown from rounding to the size of the motion: the motion
#: forgot where it started, which one that only converges never does.
_FORGOTTEN = -math.log(np.finfo(np.float64).eps)


@helper
def try_cycle(  # type: ignore[no-untyped-def]
    functions, tables, ranks, at, back, p, period, rise, workspaces, rows, cell
):
    """Solve for the cycle that the last joint seems to be on, and write what the solution is if it is."""
    cycle, transit, state = workspaces.cycle, workspaces.transit, workspaces.state
    (mode, on, key, t), (joints, turns), n = at, back, transit.y.shape[0]
    cycle.z[0] = t
    for j in range(n):
        cycle.z[1 + j] = transit.y[j]
        for k in range(n + 1):
            cycle.frame[j, k] = workspaces.frame[j, k]
    error = solve_cycle(
        functions, tables, ranks, mode, on, key, joints, turns, p, period, cycle, state
    )
    if error == AT_A_POINT:
        for j in range(n):
            cycle.transit.y[j] = cycle.z[1 + j]
        if write_equilibrium(
            functions, tables, ranks, mode, t, p, cycle.transit, cycle, rows, cell
        ):
            return True
    if error < 0.0:
        doubt(workspaces.memory)
        return False
    rows.motions[cell] = TRANSIENT if rise > _FORGOTTEN else PERIODIC
    for k in range(n):
        rows.exponents[cell, k] = cycle.rates[k]
        rows.errors[cell, k] = error
    rows.turns[cell] = 1  # without excitation: a cycle
    if not any_time(transit):
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
    transit, workspace = workspaces.transit, workspaces.state
    outcome, surface, following, duration, turns, t = to_joint(
        functions, tables, mode, on, t, p, period, transit, workspace
    )
    if outcome == ARRIVED:
        observable = tables.observables[surface]
        rate = differentiate(functions, observable, mode, duration, t, p, transit, workspace.none)
        live = min(live, ranks[mode])
        push(workspaces.frame, live, rate, transit.jac, transit.grad, transit.image)
        if not orthonormalise(workspaces.frame, live, workspaces.growth):
            outcome = BROKEN
    return outcome, surface, following, duration, turns, t, live


@helper
def carry_through_reset(functions, tables, ranks, mode, on, t, p, period, live, workspaces):  # type: ignore[no-untyped-def]
    """Do the same where there are resets or no excitation (apart: it would cost all others a tenth)."""
    transit, workspace = workspaces.transit, workspaces.state
    outcome, surface, following, duration, turns, t = to_joint(
        functions, tables, mode, on, t, p, period, transit, workspace
    )
    if outcome == ARRIVED:
        observable = tables.observables[surface]
        rate = differentiate(functions, observable, mode, duration, t, p, transit, workspace.none)
        live = min(live, ranks[mode])
        push(workspaces.frame, live, rate, transit.jac, transit.grad, transit.image)
        reset = tables.bounds[mode, surface] == 2
        if reset or is_autonomous(transit):
            carry_after_joint(
                functions, surface, t, p, workspaces.frame, live, transit, workspace, reset
            )
        if not orthonormalise(workspaces.frame, live, workspaces.growth):
            outcome = BROKEN
    return outcome, surface, following, duration, turns, t, live


@helper
def write_last(functions, tables, outcome, ranks, mode, t, p, period, workspaces, rows, cell):  # type: ignore[no-untyped-def]
    """Write what a solution is that meets nothing any more, or breaks off."""
    transit, cycle = workspaces.transit, workspaces.cycle
    if outcome == QUIET:
        write_quiet(functions, tables, ranks, mode, t, p, period, transit, cycle, rows, cell)
    else:
        write_end(functions, outcome, ranks, mode, t, p, period, transit, cycle, rows, cell)
