"""Cutting the segments of solutions at a section, compiled: at a phase, on a surface, at joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.compiled import allocating_helper, helper
from contfric.simulation.march import CARRIED, StateWorkspace, copy_state, whole_turns

#: Joints that are remembered: one for short cycles, one for long ones.
MEMORIES = 2
#: Most crossings inside of one segment: one with more never ends (as for stops of orbits).
_MOST_CROSSINGS = 1000


class Segment(NamedTuple):
    """Where the segment under way began: (mode, surfaces it is on as bits, period), time, state."""

    at: IntArray
    time: FloatArray
    y: FloatArray


class Remembered(NamedTuple):
    """Joints that are remembered: key, event, period, events until replaced; phase and state."""

    whole: IntArray
    z: FloatArray


class Workspace(NamedTuple):
    """All workspace that the solutions of one call share; ``strobe`` is the number of the next strobe."""

    state: StateWorkspace
    segment: Segment
    memory: Remembered
    y: FloatArray
    work: FloatArray
    found: FloatArray
    carry: FloatArray
    strobe: IntArray


@allocating_helper
def new_workspace(n):  # type: ignore[no-untyped-def]
    """Return workspace for solutions of n states."""
    none, empty, nothing = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    return Workspace(
        StateWorkspace(none, empty, nothing, np.empty(n), np.empty(n), np.empty(1 + n)),
        Segment(np.zeros(3, dtype=np.int64), np.zeros(1), np.empty(n)),
        Remembered(np.empty((MEMORIES, 4), dtype=np.int64), np.empty((MEMORIES, 1 + n))),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.zeros(CARRIED),
        np.zeros(1, dtype=np.int64),
    )


@helper
def put(points, cycle, t, y, mode):  # type: ignore[no-untyped-def]
    """Add a point; one that does not fit is counted only."""
    k = points.number[0]
    points.number[0] = k + 1
    if k < points.times.shape[0]:
        points.cycles[k], points.modes[k], points.times[k] = cycle, mode, t
        for j in range(y.shape[0]):
            points.states[k, j] = y[j]


@helper
def has_sense(functions, cut, mode, t, y, p, workspace):  # type: ignore[no-untyped-def]
    """Tell whether the section is crossed in the sense asked for."""
    if cut.sense == 0:
        return True
    return (
        cut.sense * functions.rate(mode, cut.observable, t, y, p, workspace.none, workspace.empty)
        > 0.0
    )


@helper
def set_strobe(cut, period, segment, strobe):  # type: ignore[no-untyped-def]
    """Set the number of the first strobe after the start of the segment."""
    strobe[0] = segment.at[2]
    if cut.phase * period <= segment.time[0]:
        strobe[0] += 1


@helper
def cut_inside(functions, cut, duration, p, period, ws, points):  # type: ignore[no-untyped-def]
    """Collect the points of the section inside of a segment."""
    segment, workspace = ws.segment, ws.state
    mode, cycle, t = segment.at[0], segment.at[2], segment.time[0]
    if cut.phase >= 0.0:
        while True:
            later = (ws.strobe[0] - cycle) * period + (cut.phase * period - t)
            if later > duration:
                break
            functions.flow(
                mode, t, segment.y, later, p, workspace.none, ws.found, workspace.nothing
            )
            put(points, ws.strobe[0], cut.phase * period, ws.found, mode)
            ws.strobe[0] += 1
    elif cut.inside[mode] != 0:
        level = (
            functions.level(cut.surface, p, workspace.none, workspace.empty)
            if cut.surface >= 0
            else 0.0
        )
        started = cut.surface >= 0 and (segment.at[1] >> cut.surface) & 1 == 1
        copy_state(segment.y, ws.work)
        left = duration
        for _ in range(_MOST_CROSSINGS):
            tau = functions.hit(mode, cut.observable, level, started, t, ws.work, left, p, ws.found)
            if tau < 0.0:
                break
            turns, t = whole_turns(t + tau, period)
            cycle, left, started = cycle + turns, left - tau, True
            if has_sense(functions, cut, mode, t, ws.found, p, workspace):
                put(points, cycle, t, ws.found, mode)
            copy_state(ws.found, ws.work)


@helper
def cut_joint(functions, cut, mode, surface, cycle, t, y, p, ws, points):  # type: ignore[no-untyped-def]
    """Collect a joint, if it counts."""
    if cut.phase < 0.0 and cut.joints[mode, surface] != 0:
        copy_state(y, ws.found)
        if has_sense(functions, cut, mode, t, ws.found, p, ws.state):
            put(points, cycle, t, ws.found, mode)
