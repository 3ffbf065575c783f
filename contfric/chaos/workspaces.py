"""Workspaces of several solutions side by side, and that of one of them, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.chaos.averaging import Averages, new_averages
from contfric.chaos.cycle import CycleWorkspace, Memory, new_cycle_workspace, new_memory
from contfric.chaos.tangent import EVENTS, Transit, new_transit, state_workspace
from contfric.compiled import allocating_helper, helper, inlined_helper
from contfric.compiling.references import by_reference, words_of
from contfric.flow.without import SINGLY
from contfric.simulation.march import StateWorkspace


class CellWorkspaces(NamedTuple):
    """All workspace of some solutions, with one more axis before the others; or of one of them."""

    transit: Transit
    state: StateWorkspace
    frame: FloatArray
    growth: FloatArray
    memory: Memory
    averages: Averages
    cycle: CycleWorkspace


@allocating_helper
def new_cell_workspaces(width, n):  # type: ignore[no-untyped-def]
    """Return the workspace for so many solutions of n states."""
    transit, state, memory, averages = (
        new_transit(n),
        state_workspace(n),
        new_memory(n),
        new_averages(n),
    )
    return CellWorkspaces(
        Transit(
            as_many(width, transit.y),
            transit.start,
            as_many(width, transit.jac),
            transit.grad,
            transit.end,
            transit.image,
            np.zeros((width, EVENTS), dtype=np.int64),
            np.zeros(width),
            np.full(width, SINGLY),
        ),
        StateWorkspace(
            state.none,
            state.empty,
            state.nothing,
            as_many(width, state.after),
            state.trial,
            state.slopes,
        ),
        np.empty((width, n, n + 1)),
        np.empty(n),
        Memory(
            as_many(width, memory.key),
            as_many(width, memory.cycle),
            as_many(width, memory.event),
            as_many(width, memory.span),
            as_many(width, memory.z),
            as_many(width, memory.near),
        ),
        Averages(
            as_many(width, averages.growth),
            as_many(width, averages.time),
            as_many(width, averages.size),
            as_many(width, averages.pending),
            as_many(width, averages.place),
        ),
        new_cycle_workspace(n),
    )


@allocating_helper
def as_many(width, array):  # type: ignore[no-untyped-def]
    """Return space for as many arrays like one."""
    return np.empty((width, *array.shape), array.dtype)


@inlined_helper
def place(space, k):  # type: ignore[no-untyped-def]
    """Return the workspace of the solution in place k."""
    transit, state, memory, averages = space.transit, space.state, space.memory, space.averages
    return CellWorkspaces(
        Transit(
            transit.y[k],
            transit.start,
            transit.jac[k],
            transit.grad,
            transit.end,
            transit.image,
            transit.events[k],
            transit.ahead[k : k + 1],
            transit.meets[k : k + 1],
        ),
        StateWorkspace(
            state.none, state.empty, state.nothing, state.after[k], state.trial, state.slopes
        ),
        space.frame[k],
        space.growth,
        Memory(
            memory.key[k],
            memory.cycle[k],
            memory.event[k],
            memory.span[k],
            memory.z[k],
            memory.near[k],
        ),
        Averages(
            averages.growth[k],
            averages.time[k],
            averages.size[k],
            averages.pending[k],
            averages.place[k],
        ),
        space.cycle,
    )


@helper
def words_for(space):  # type: ignore[no-untyped-def]
    """Return how many whole numbers the references to the workspace of one solution take."""
    return words_of(place(by_reference(space), 0))
