"""Many short trajectories from one section, compiled: where each comes from, and where it returns to.

A section is the set of states ``(t, y)`` at which a mode is left by one of its surfaces: there the
observables of the exit, and of the surfaces that the mode moves on, have their levels. A start is
given by a time and a rough state; the state is moved onto the section by Newton's method with the
smallest correction,

    y <- y - G^T (G G^T)^{-1} r,        G = d r / d y,

with r the observables less their levels (exact after one step where they are linear in y). It counts
if the exit is met from inside and the transitions lead on.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray, IntArray
from contfric.compiled import (
    allocating_helper,
    blocks,
    f8,
    helper,
    i8,
    kernel,
    matrix,
    table,
    vector,
)
from contfric.flow.layouts import FlowType
from contfric.simulation.march import (
    CARRIED,
    STARTED,
    StateWorkspace,
    TablesType,
    copy_state,
    follow,
)
from contfric.simulation.sides import mode_after, sign_code
from contfric.simulation.simulate import EventRows

#: Most surfaces that a trajectory meets for each of its events: one that is only touched is no event.
_MOST_MET = 64
#: Newton steps onto a section: one where it is flat, a few where it is curved.
_MOST_STEPS = 12
#: Distance from the section (relative to 1 + the level) that is rounding.
_ON = 1e-14
#: A pivot of ``G G^T`` this small, relative to its largest entry: the surfaces are tangent there.
_TANGENT = 1e-12


class SectionWorkspace(NamedTuple):
    """Workspace for the conditions of a section: their residuals, gradients and normal equations."""

    surfaces: IntArray
    residual: FloatArray
    gradients: FloatArray
    normal: FloatArray
    grad: FloatArray
    rate: FloatArray


@allocating_helper
def section_workspace(lies_on, exit_, surfaces, n):  # type: ignore[no-untyped-def]
    """Return the workspace for a section: the exit first, then the surfaces that the mode moves on."""
    count = 1
    for k in range(surfaces):
        if (lies_on >> k) & 1 == 1 and k != exit_:
            count += 1
    listed = np.empty(count, dtype=np.int64)
    listed[0] = exit_
    at = 1
    for k in range(surfaces):
        if (lies_on >> k) & 1 == 1 and k != exit_:
            listed[at] = k
            at += 1
    return SectionWorkspace(
        listed,
        np.empty(count),
        np.empty((count, n)),
        np.empty((count, count + 1)),
        np.empty(1 + n),
        np.empty((n, 2 + n)),
    )


@helper
def solve_normal(normal):  # type: ignore[no-untyped-def]
    """Solve the normal equations in place (the last column is their right-hand side)."""
    count = normal.shape[0]
    largest = 0.0
    for i in range(count):
        largest = max(largest, abs(normal[i, i]))
    for i in range(count):  # symmetric and positive definite: no pivoting is needed
        if not normal[i, i] > _TANGENT * largest:
            return False
        for j in range(i + 1, count):
            share = normal[j, i] / normal[i, i]
            for k in range(i, count + 1):
                normal[j, k] -= share * normal[i, k]
    for i in range(count - 1, -1, -1):
        for j in range(i + 1, count):
            normal[i, count] -= normal[i, j] * normal[j, count]
        normal[i, count] /= normal[i, i]
    return True


@helper
def place(functions, tables, t, y, p, none, empty, workspace):  # type: ignore[no-untyped-def]
    """Move a state onto a section; whether it could be."""
    residual, gradients, normal = workspace.residual, workspace.gradients, workspace.normal
    count, n = gradients.shape
    for _ in range(_MOST_STEPS):
        far = False
        for i in range(count):
            surface = workspace.surfaces[i]
            value = functions.observe(tables.observables[surface], t, y, p, none, workspace.grad)
            target = functions.level(surface, p, none, empty)
            residual[i] = value - target
            far = far or not abs(residual[i]) <= _ON * (1.0 + abs(target))
            for j in range(n):
                gradients[i, j] = workspace.grad[1 + j]
        if not far:
            return True
        for i in range(count):
            for k in range(count):
                value = 0.0
                for j in range(n):
                    value += gradients[i, j] * gradients[k, j]
                normal[i, k] = value
            normal[i, count] = residual[i]
        if not solve_normal(normal):
            return False
        for j in range(n):
            for i in range(count):
                y[j] -= gradients[i, j] * normal[i, count]
    return False


@helper
def exit_rate(functions, tables, mode, t, y, p, none, state, workspace):  # type: ignore[no-untyped-def]
    """Return the rate of the exit's observable along the mode that ends."""
    at_once = t - t
    functions.flow(mode, t, y, at_once, p, none, state, workspace.rate)
    functions.observe(tables.observables[workspace.surfaces[0]], t, y, p, none, workspace.grad)
    n = y.shape[0]
    rate = workspace.grad[0]
    for j in range(n):
        rate += workspace.grad[1 + j] * workspace.rate[j, 1 + n]
    return rate


@kernel(
    types.i8(
        FlowType,
        TablesType,
        i8,
        i8,
        i8,
        f8,
        vector,
        matrix,
        vector,
        f8,
        types.int64[:, :, ::1],
        table,
        matrix,
        blocks,
        table,
    )
)
def sweep(  # type: ignore[no-untyped-def]
    functions,
    tables,
    mode,
    exit_,
    after,
    sense,
    times,
    starts,
    p,
    periods,
    joints,
    cycles,
    clocks,
    states,
    outcome,
):
    """Follow one trajectory from each start on a section; return the number of events.

    Parameters
    ----------
    mode, exit_, after, sense : the section: the mode that ends, its exit, the mode that follows, the
        sign of the rate at which the exit is met
    times, starts : time and rough state of each start, shapes (K,), (K, n); the states are moved
        onto the section in place
    periods : time to follow, in periods of the excitation
    joints, cycles, clocks, states : events of each trajectory, shapes (K, E, 2), (K, E), (K, E) and
        (K, E, n), as in :class:`contfric.simulation.simulate.EventRows`
    outcome : number of events (-1: no start), mode after the last one and how the simulation ended
        (as in :mod:`contfric.simulation.march`) of each, shape (K, 3)
    """
    count, n = starts.shape
    surfaces = tables.observables.shape[0]
    none, empty, nothing = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    state_workspace = StateWorkspace(
        none, empty, nothing, np.empty(n), np.empty(n), np.empty(1 + n)
    )
    workspace = section_workspace(tables.lies_on[mode], exit_, surfaces, n)
    y, carry = np.empty(n), np.zeros(CARRIED)
    budget = _MOST_MET * (1 + joints.shape[1])
    total = 0
    for i in range(count):
        outcome[i, 0], outcome[i, 1], outcome[i, 2] = -1, -1, -1
        copy_state(starts[i], y)
        if not place(functions, tables, times[i], y, p, none, empty, workspace):
            continue
        copy_state(y, starts[i])
        rate = exit_rate(
            functions, tables, mode, times[i], y, p, none, state_workspace.after, workspace
        )
        if not sense * rate > 0.0 or not math.isfinite(rate):
            continue
        code = sign_code(functions, tables.observables, 1 << exit_, times[i], y, p, none, empty)
        if mode_after(tables, mode, exit_, code) != after:
            continue
        rows = EventRows(joints[i], cycles[i], clocks[i], states[i])
        on = (1 << exit_) | tables.lies_on[mode]
        carry[STARTED] = 0.0
        found = follow(
            functions,
            tables,
            after,
            on,
            times[i],
            y,
            p,
            periods,
            rows,
            carry,
            budget,
            state_workspace,
        )
        outcome[i, 0], outcome[i, 1], outcome[i, 2] = found[1], found[2], found[0]
        total += found[1]
    return total
