"""The points of solutions on a section, compiled.

Solutions are followed by the simulation of :mod:`contfric.simulation.march`, a few events at a time, and
every segment is cut: at a phase of the excitation by the flow itself, on a surface by its first roots, at
joints by their surface. No time step enters.

A solution that returns to an earlier joint to within rounding repeats itself from there on. It is left when
one more cycle is complete, and the points of that cycle are kept.
"""

from __future__ import annotations

import math

from numba import types

from contfric.chaos.cells import StartingType
from contfric.chaos.cycle import nearest_turn
from contfric.chaos.starting import start_mode
from contfric.compiled import f8, helper, i8, indices, kernel, matrix, table, vector
from contfric.flow.layouts import FlowType
from contfric.response.cuts import BATCH, Cut, Ends, Following, SectionPoints
from contfric.response.cutting import MEMORIES, cut_inside, cut_joint, new_workspace, set_strobe
from contfric.simulation.march import (
    ALL_EVENTS,
    ALL_TIME,
    CARRIED,
    HELD,
    INFINITE,
    QUIET,
    RowsType,
    TablesType,
    copy_state,
    follow,
)
from contfric.simulation.sides import surfaces_after

CutType = types.NamedTuple([table, indices, i8, i8, f8, i8], Cut)
FollowingType = types.NamedTuple([f8, f8, f8, i8, i8], Following)
PointsType = types.NamedTuple([indices, indices, indices, vector, matrix], SectionPoints)
EndsType = types.NamedTuple([indices, indices, indices, indices, matrix], Ends)

#: Numbers of what a solution came to, in the order of :class:`contfric.response.outcome.Outcome`.
PERIODIC, APERIODIC, AT_REST, UNBOUNDED, NO_MOTION, CHATTERING, MEETS_NOTHING = range(7)
#: A joint is remembered for so many events at first, then for twice as many: Brent's cycle detection
#: (BIT 20 (1980) 176-184).
_SPANS = (8, 64)
#: Share of a cycle that a solution without excitation is followed beyond its last joint, so that it
#: ends inside of a segment: the golden section, which no symmetry makes a joint.
_BEYOND = 0.6180339887498949
#: Factor and offset by which a sequence of segments becomes a number (a linear congruential hash).
_FACTOR, _OFFSET = 6364136223846793005, 1442695040888963407


@helper
def step_past(functions, tables, mode, surface, following, cycle, t, y, p, ws):  # type: ignore[no-untyped-def]
    """Begin the next segment after a joint."""
    segment, workspace = ws.segment, ws.state
    copy_state(y, ws.found)
    if tables.bounds[mode, surface] == 2:
        functions.reset(surface, t, ws.found, p, workspace.none, segment.y, workspace.nothing)
    else:
        copy_state(ws.found, segment.y)
    segment.at[0], segment.at[2] = following, cycle
    segment.at[1] = surfaces_after(tables, mode, surface)
    segment.time[0] = t


@helper
def forget(memory):  # type: ignore[no-untyped-def]
    """Remember nothing."""
    for i in range(MEMORIES):
        memory.whole[i, 0] = -1
        memory.whole[i, 3] = _SPANS[i]


@helper
def repeats(memory, key, event, segment, period, timeless, within):  # type: ignore[no-untyped-def]
    """Return (events, periods) since a joint that this one repeats to within rounding; zeros if none."""
    cycle, t, y = segment.at[2], segment.time[0], segment.y
    for i in range(MEMORIES):
        if memory.whole[i, 0] == key:
            turns, slip = cycle - memory.whole[i, 2], t - memory.z[i, 0]
            turns, slip = nearest_turn(turns, slip, period, timeless)
            same = turns > 0 and abs(slip) <= within * (1.0 + period)
            for j in range(y.shape[0]):
                same = same and abs(y[j] - memory.z[i, 1 + j]) <= within * (1.0 + abs(y[j]))
            if same:
                return event - memory.whole[i, 1], turns
        if memory.whole[i, 0] < 0 or event - memory.whole[i, 1] > memory.whole[i, 3]:
            if memory.whole[i, 0] >= 0:
                memory.whole[i, 3] *= 2
            memory.whole[i, 0], memory.whole[i, 1], memory.whole[i, 2] = key, event, cycle
            memory.z[i, 0] = t
            for j in range(y.shape[0]):
                memory.z[i, 1 + j] = y[j]
    return 0, 0


@helper
def go_to_start(functions, tables, p, unit, timeless, lasted, rows, ws):  # type: ignore[no-untyped-def]
    """Go on from the segment under way to a whole period, or to inside of a segment without excitation."""
    segment, carry = ws.segment, ws.carry
    left = _BEYOND * lasted if timeless else 1.0 - segment.time[0] / unit
    for k in range(CARRIED):
        carry[k] = 0.0
    copy_state(segment.y, ws.y)
    mode, t, end = segment.at[0], segment.time[0], ALL_EVENTS
    while end == ALL_EVENTS:
        end, _, mode, _, t = follow(
            functions, tables, mode, segment.at[1], t, ws.y, p, left, rows, carry, BATCH, ws.state
        )


@helper
def outcome_of(end):  # type: ignore[no-untyped-def]
    """Return what a solution came to, from how its simulation ended."""
    if end == ALL_TIME:
        return APERIODIC
    if end == HELD:
        return AT_REST
    if end == INFINITE:
        return UNBOUNDED
    if end == QUIET:
        return MEETS_NOTHING
    return NO_MOTION if end < INFINITE else CHATTERING


@helper
def finish(functions, cut, end, cycle, t, p, period, unit, first, collecting, ws, points):  # type: ignore[no-untyped-def]
    """Cut the last segment of a solution whose time is over, or that rests; return what it came to."""
    segment, outcome = ws.segment, outcome_of(end)
    if outcome == AT_REST and period > 0.0:
        points.number[0] = first  # it is the same in every period to come
        set_strobe(cut, period, segment, ws.strobe)
        if cut.phase >= 0.0:
            cut_inside(functions, cut, period, p, period, ws, points)
            points.number[0] = min(points.number[0], first + 1)
        left, workspace = period - segment.time[0], ws.state
        functions.flow(
            segment.at[0],
            segment.time[0],
            segment.y,
            left,
            p,
            workspace.none,
            ws.y,
            workspace.nothing,
        )
    elif outcome == APERIODIC and collecting:
        duration = (cycle - segment.at[2]) * unit + (t - segment.time[0])
        cut_inside(functions, cut, duration, p, period, ws, points)
    return outcome


@helper
def cut_solution(  # type: ignore[no-untyped-def]
    functions, tables, cut, how, p, period, stop, rows, ws, points, ends, row
):
    """Follow one solution from ``ws.segment`` and collect its points; return what it came to."""
    segment, timeless = ws.segment, period <= 0.0
    unit = 1.0 if timeless else period
    surfaces, event, closing, turns, itinerary, lasted = (
        tables.observables.shape[0],
        0,
        0,
        0,
        0,
        0.0,
    )
    first, collecting = points.number[0], how.transient <= 0.0
    forget(ws.memory)
    set_strobe(cut, period, segment, ws.strobe)
    copy_state(segment.y, ws.y)
    for k in range(CARRIED):
        ws.carry[k] = 0.0
    mode, on, t, end, cycle = segment.at[0], segment.at[1], segment.time[0], ALL_EVENTS, 0
    while end == ALL_EVENTS and stop[0] == 0:
        end, count, mode, cycle, t = follow(
            functions, tables, mode, on, t, ws.y, p, how.span, rows, ws.carry, BATCH, ws.state
        )
        for e in range(count):
            before, surface = rows.joints[e, 0], rows.joints[e, 1]
            duration = (rows.cycles[e] - segment.at[2]) * unit + (rows.times[e] - segment.time[0])
            if timeless:
                duration = rows.times[e] - segment.time[0]
            y, at, phase = rows.states[e], rows.cycles[e], rows.times[e]
            if collecting:
                cut_inside(functions, cut, duration, p, period, ws, points)
                cut_joint(functions, cut, before, surface, at, phase, y, p, ws, points)
            following = rows.joints[e + 1, 0] if e + 1 < count else mode
            step_past(functions, tables, before, surface, following, at, phase, y, p, ws)
            event += 1
            itinerary = (itinerary + before * surfaces + surface + 1) * _FACTOR + _OFFSET
            if points.number[0] - first >= how.most:
                ends.itineraries[row] = itinerary
                return APERIODIC
            if closing > 0:
                closing, lasted = closing - 1, lasted + duration
                if closing == 0:
                    ends.turns[row] = turns
                    go_to_start(functions, tables, p, unit, timeless, lasted, rows, ws)
                    return PERIODIC
                continue
            if how.repeats > 0.0:
                key = following * surfaces + surface
                closing, turns = repeats(
                    ws.memory, key, event, segment, unit, timeless, how.repeats
                )
            if closing > 0 or (not collecting and at + phase / unit >= how.transient):
                collecting, points.number[0] = True, first
                set_strobe(cut, period, segment, ws.strobe)
    return finish(functions, cut, end, cycle, t, p, period, unit, first, collecting, ws, points)


@kernel(
    i8(
        FlowType,
        TablesType,
        StartingType,
        CutType,
        FollowingType,
        matrix,
        vector,
        matrix,
        indices,
        indices,
        indices,
        RowsType,
        PointsType,
        EndsType,
    )
)
def cut_solutions(  # type: ignore[no-untyped-def]
    functions,
    tables,
    starting,
    cut,
    how,
    vectors,
    times,
    states,
    modes,
    ons,
    stop,
    rows,
    points,
    ends,
):
    """Follow solutions and collect their points on a section.

    Parameters
    ----------
    vectors, times, states : parameters, initial times and states of each; of ``states`` only the first
        row counts if each starts where the one before has ended
    modes, ons : mode and surfaces that each lies on, as bits; the mode is -1 where the state decides
    stop : another thread writes a 1 to it to end the call
    rows, points, ends : workspace for events, points and what solutions came to

    Returns
    -------
    int
        Solutions that are done: fewer than all if points do not fit, or nothing is left to carry over.
    """
    n = states.shape[1]
    ws = new_workspace(n)
    segment, workspace = ws.segment, ws.state
    for row in range(vectors.shape[0]):
        p, first = vectors[row], points.number[0]
        period = functions.period(p, workspace.none, workspace.empty)
        t = times[row]
        for j in range(n):
            carried = how.carried != 0 and row > 0
            segment.y[j] = ends.states[row - 1, j] if carried else states[row, j]
        mode, on = modes[row], ons[row]
        if mode < 0:
            mode, on = start_mode(functions, tables, starting, t, segment.y, p, workspace)
        if period > 0.0:
            t -= math.floor(t / period) * period
        segment.at[0], segment.at[1], segment.at[2], segment.time[0] = mode, on, 0, t
        ends.turns[row], ends.itineraries[row] = 0, 0
        outcome = NO_MOTION
        if mode >= 0:
            outcome = cut_solution(
                functions, tables, cut, how, p, period, stop, rows, ws, points, ends, row
            )
        if stop[0] != 0 or points.number[0] > points.times.shape[0]:
            points.number[0] = first
            return row
        ends.outcomes[row], ends.upto[row] = outcome, points.number[0]
        for j in range(n):
            ends.states[row, j] = ws.y[j]
        goes_on = outcome <= AT_REST
        if how.carried != 0 and not goes_on:
            return row + 1
    return vectors.shape[0]
