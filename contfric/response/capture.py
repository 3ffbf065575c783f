"""Decides which of some orbits a solution converges to, compiled.

A solution is followed from joint to joint. It has converged where a joint lies so near to one of an orbit
that nothing but that orbit attracts it: same mode, same surface, same phase, and a state within the radius
that the joint was given (:mod:`contfric.response.targets`).
"""

from __future__ import annotations

import math

from numba import types

from contfric.chaos.cells import StartingType
from contfric.chaos.starting import start_mode
from contfric.chaos.tangent import (
    ARRIVED,
    forget_events,
    new_transit,
    set_model,
    state_workspace,
    to_joint,
)
from contfric.compiled import f8, helper, i8, indices, kernel, matrix, vector
from contfric.flow.layouts import FlowType
from contfric.response.targets import Targets
from contfric.simulation.march import TablesType
from contfric.simulation.sides import surfaces_after

TargetsType = types.NamedTuple([indices, matrix, indices, vector], Targets)

#: What a solution is that starts in no domain, and that was not captured in time.
NO_START, NOT_YET = -1, -2


@helper
def caught(targets, key, t, y, period, timeless):  # type: ignore[no-untyped-def]
    """Return the orbit whose joint a joint lies at, or -1."""
    for i in range(targets.key.shape[0]):
        if targets.key[i] != key:
            continue
        within = targets.radius[i]
        slip = 0.0 if timeless else abs(t - targets.z[i, 0])
        if slip > 0.5 * period:
            slip = period - slip
        near = slip <= within
        for j in range(y.shape[0]):
            near = near and abs(y[j] - targets.z[i, 1 + j]) <= within
        if near:
            return targets.owner[i]
    return -1


@kernel(
    types.void(
        FlowType,
        TablesType,
        StartingType,
        TargetsType,
        f8,
        f8,
        vector,
        matrix,
        i8,
        indices,
        indices,
        indices,
    )
)
def capture(  # type: ignore[no-untyped-def]
    functions,
    tables,
    starting,
    targets,
    time,
    ticks,
    p,
    states,
    periods,
    stop,
    labels,
    ends,
):
    """Follow solutions from ``states`` at ``time`` until an orbit catches them, or the periods are over.

    Parameters
    ----------
    ticks : time from tick to tick of a clock, 0 of a model without
    stop : another thread writes a 1 to it when nobody waits for the result any more
    labels, ends : orbit, -1 if none; how a solution without one ended, as simulations do, ``NO_START`` or
        ``NOT_YET``; shape (k,)
    """
    n, surfaces = states.shape[1], tables.observables.shape[0]
    transit, workspace = new_transit(n), state_workspace(n)
    period = functions.period(p, workspace.none, workspace.empty)
    timeless = period <= 0.0
    if timeless:
        period = ticks if ticks > 0.0 else 1.0  # periods of the clock, or units of time
    set_model(transit, tables, timeless, ticks)
    phase = time if timeless else time - math.floor(time / period) * period
    for cell in range(states.shape[0]):
        if stop[0] != 0:
            break
        for j in range(n):
            transit.y[j] = states[cell, j]
        forget_events(transit)
        labels[cell], ends[cell], cycle, t = -1, NOT_YET, 0, phase
        mode, on = start_mode(functions, tables, starting, time, transit.y, p, workspace)
        if mode < 0:
            ends[cell] = NO_START
        while mode >= 0 and cycle < periods and stop[0] == 0:
            outcome, surface, following, _, turns, t = to_joint(
                functions, tables, mode, on, t, p, period, transit, workspace
            )
            if outcome != ARRIVED:
                ends[cell] = outcome
                break
            on = surfaces_after(tables, mode, surface)
            mode, cycle = following, cycle + turns
            label = caught(targets, mode * surfaces + surface, t, transit.y, period, timeless)
            if label >= 0:
                labels[cell] = label
                break
