"""Event-exact simulation, compiled: from one event to the next, no time step.

A trajectory is a sequence of segments. In each mode the first root over all surfaces that bound it
ends the segment (the flow guarantees that none is missed), and the model's transitions say which mode
follows. Time is kept as (number of periods, phase in the period), so that the phase loses nothing over
any number of periods.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray, IntArray
from contfric.compiled import f8, helper, i8, indices, kernel, matrix, table, vector
from contfric.flow.layouts import FlowType
from contfric.models.parts import MOST_SURFACES
from contfric.simulation.coming_to_rest import impacts_ahead, is_left, still_bounced
from contfric.simulation.leaving_side import begun_on
from contfric.simulation.met_together import mode_together
from contfric.simulation.sides import flight_of, leads_to, mode_after, sign_code, surfaces_after
from contfric.simulation.simulate import EventRows
from contfric.simulation.tables import Tables
from contfric.simulation.walls import (
    MOST_AT_ONCE,
    NO_FLIGHT,
    NO_TIME,
    in_flight,
    is_crossed,
    is_pressed,
    lying_on,
)

#: Types of the model's tables and of the rows of events, as kernels take them.
TablesType = types.NamedTuple(
    [indices, table, table, indices, table, indices, indices, table, table, i8, table, indices],
    Tables,
)
RowsType = types.NamedTuple([table, indices, vector, matrix], EventRows)


class StateWorkspace(NamedTuple):
    """Workspace for a state at a hit and on trial, and what is handed over where nothing is wanted.

    ``slopes`` is for the derivatives of an observable by time and states.
    """

    none: IntArray
    empty: FloatArray
    nothing: FloatArray
    after: FloatArray
    trial: FloatArray
    slopes: FloatArray


#: How a simulation ended.
ALL_EVENTS, ALL_TIME, HELD, IMPOSSIBLE, INFINITE, QUIET, CHATTER = range(7)
#: A sliding mode that is not left within this many periods of the excitation is never left; a slide, and
#: any mode of an autonomous model, gets far more (periods, or units of time).
HOLD_PERIODS, SLIDE_PERIODS = 1.001, 1e4
#: A motion that meets nothing is followed in stretches of this many periods (or units of time): the steps of
#: one search have a limit.
_STRETCH = 256.0
#: Factor by which the search of a hit is extended: what was searched in vain costs a third more.
_WIDER = 4.0
#: More surfaces than this are searched for over one part in so many of a period first: most are not met next.
_FEW, _SHORTER = 3, 16.0
#: A mass that a wall lets go moves off it with the third power of time: at this share of a period by far more
#: than rounding, and less than anything else does.
_AHEAD = 1e-3
#: Numbers that a simulation hands over to the call that goes on with it: whether there are any, the period
#: and phase it began in, the period it is in, events at once, whether one was an impact, surfaces it is on,
#: 1 + the wall that was met last if impacts go on alike since, how many impacts to come are known not to lead
#: to rest, and the unit of time of a model without excitation (1 if less).
STARTED, FIRST_CYCLE, FIRST_TIME, CYCLE, AT_ONCE, STRUCK, ON, BOUNCED, LEFT, UNIT = range(10)
CARRIED = 10

#: A state this large grows for ever (negative damping, or resonance without any): its square is still
#: far from overflow, and its events are still exact.
TOO_LARGE = 1e100


@helper
def copy_state(source, target):  # type: ignore[no-untyped-def]
    """Copy a state."""
    for j in range(source.shape[0]):
        target[j] = source[j]


@helper
def first_hit(functions, tables, mode, on, t, y, p, longest, unit, workspace):  # type: ignore[no-untyped-def]
    """Return (time, surface) of the first bounding surface that is met; (-1, -1) if none.

    The state there is written to ``workspace.after``. The search covers a period (``unit``) at first, then
    longer and longer times: a surface that is never met is searched for no further than another one is.
    """
    within, bounding = HOLD_PERIODS * unit, 0
    for k in range(tables.observables.shape[0]):
        bounding += 1 if tables.bounds[mode, k] != 0 else 0
    if bounding > _FEW:
        within /= _SHORTER
    while within < longest:
        tau, surface = hit_within(functions, tables, mode, on, t, y, p, within, workspace)
        if surface >= 0:
            return tau, surface
        within *= _WIDER
    return hit_within(functions, tables, mode, on, t, y, p, longest, workspace)


@helper
def first_met(functions, tables, mode, on, t, y, p, longest, unit, workspace):  # type: ignore[no-untyped-def]
    """Do the same where a mode begins, which may be on more surfaces than are known."""
    kept, crossed = begun_on(functions, tables, mode, on, t, y, p, unit, workspace)
    if crossed >= 0:
        copy_state(y, workspace.after)
        return 0.0, crossed
    return first_hit(functions, tables, mode, on | kept, t, y, p, longest, unit, workspace)


@helper
def hit_within(functions, tables, mode, on, t, y, p, longest, workspace):  # type: ignore[no-untyped-def]
    """Do the same over one time."""
    observables, bounds = tables.observables, tables.bounds
    none, empty = workspace.none, workspace.empty
    best, which = longest, -1
    for k in range(observables.shape[0]):
        if bounds[mode, k] == 0:
            continue
        target = functions.level(k, p, none, empty)
        started = k < MOST_SURFACES and (on >> k) & 1 == 1
        tau = functions.hit(mode, observables[k], target, started, t, y, best, p, workspace.trial)
        if tau >= 0.0 and (which < 0 or tau < best):
            best, which = tau, k
            copy_state(workspace.trial, workspace.after)
    return (best, which) if which >= 0 else (-1.0, -1)


@helper
def never_left(tables, mode):  # type: ignore[no-untyped-def]
    """Return how a solution ends in a mode that it never leaves."""
    return HELD if tables.sliding[mode] != 0 else QUIET


@helper
def whole_turns(t, period):  # type: ignore[no-untyped-def]
    """Return the number of periods that a time has completed, and the phase."""
    if not (period > 0.0 and t >= period):
        return 0, t
    t -= period
    if t < period:
        return 1, t
    turns = math.floor(t / period)
    return 1 + int(turns), max(0.0, t - turns * period)


@helper
def begin(carry, on, t, period):  # type: ignore[no-untyped-def]
    """Return (period, phase, surfaces) of a start, or where the last call ended."""
    if carry[STARTED] != 0.0:
        return int(carry[CYCLE]), t, int(carry[ON])
    cycle = int(math.floor(t / period)) if period > 0.0 else 0
    t -= cycle * period
    carry[STARTED], carry[FIRST_CYCLE], carry[FIRST_TIME] = 1.0, float(cycle), t
    carry[AT_ONCE] = carry[STRUCK] = carry[BOUNCED] = 0.0
    return cycle, t, on


@helper
def time_left(carry, cycle, t, period, periods):  # type: ignore[no-untyped-def]
    """Return how much of the time asked for is left."""
    if period <= 0.0:
        return periods - (t - carry[FIRST_TIME])
    return (periods - (cycle - int(carry[FIRST_CYCLE]))) * period - (t - carry[FIRST_TIME])


@helper
def shortest_flight(tables, mode):  # type: ignore[no-untyped-def]
    """Return the share of a period within which events follow each other at once."""
    for k in range(tables.observables.shape[0]):
        if tables.bounds[mode, k] == 2:  # a wall bounds every mode
            return NO_FLIGHT
    return NO_TIME


@helper
def code_ahead(functions, tables, mode, surface, t, y, p, unit, workspace):  # type: ignore[no-untyped-def]
    """Return the sides of all surfaces a little after a wall has let go: at once rounding decides."""
    none, ahead, flight = workspace.none, _AHEAD * unit, tables.flights[mode]
    below = tables.flights[tables.flights.shape[0] // 2 + mode]
    if below >= 0 and leads_to(tables, mode, surface, below):
        flight = below
    functions.flow(flight, t, y, ahead, p, none, workspace.trial, workspace.nothing)
    return sign_code(
        functions, tables.observables, 0, t + ahead, workspace.trial, p, none, workspace.empty
    )


@helper
def leads_to_rest(functions, tables, chatter, surface, t, y, p, unit, workspace):  # type: ignore[no-untyped-def]
    """Return 0 if infinitely many impacts follow, with nothing else between, until the wall is left.

    Otherwise after how many impacts, counted from this one, that is to be asked again.
    ``workspace.after`` is written over.
    """
    count, slow = impacts_ahead(functions, tables, chatter, surface, t, y, p, unit, workspace)
    if not slow:
        return count
    on = tables.landed[chatter, surface]
    longest = SLIDE_PERIODS * unit
    _, met = first_hit(functions, tables, chatter, on, t, y, p, longest, unit, workspace)
    return 0 if is_left(tables, chatter, met) else count


@helper
def too_large(y):  # type: ignore[no-untyped-def]
    """Tell whether a state has grown beyond all bounds, or is no number."""
    for j in range(y.shape[0]):
        if not abs(y[j]) < TOO_LARGE:
            return True
    return False


@helper
def impacts_left(functions, tables, chatter, surface, t, y, p, unit, known, workspace):  # type: ignore[no-untyped-def]
    """Return how many impacts, this one among them, are known not to lead to rest; 0 if this one does.

    ``known`` is (1 + the wall that was met last if impacts go on alike since, that number then).
    ``workspace.after`` is written over.
    """
    bounced, left = known
    if bounced == 1 + surface and left > 1:
        return left - 1
    return leads_to_rest(functions, tables, chatter, surface, t, y, p, unit, workspace)


@helper
def write_event(rows, event, mode, surface, cycle, t):  # type: ignore[no-untyped-def]
    """Write an event, but for its state."""
    rows.joints[event, 0] = mode
    rows.joints[event, 1] = surface
    rows.cycles[event] = cycle
    rows.times[event] = t


@helper
def sides_after(functions, tables, mode, surface, t, y, p, unit, workspace):  # type: ignore[no-untyped-def]
    """Return the sides of all surfaces after an event, by which the mode that follows is known."""
    if tables.flights[mode] >= 0:
        return code_ahead(functions, tables, mode, surface, t, y, p, unit, workspace)
    landed, none, empty = tables.landed[mode, surface], workspace.none, workspace.empty
    return sign_code(functions, tables.observables, landed, t, y, p, none, empty)


@helper
def after_impact(  # type: ignore[no-untyped-def]
    functions, tables, mode, surface, target, t, struck_at, y, p, unit, carry, workspace
):
    """Return (whether the wall is pressed from now on, mode of the chatter that begins; -1 if none does).

    All impacts that go on alike are one chatter, or none is. ``struck_at`` is the state before the impact, y
    that after it.
    """
    pressed = is_pressed(
        functions, tables, mode, surface, target, t, struck_at, y, p, unit, workspace
    )
    chatter = tables.chatters[target, surface] if target >= 0 else -1
    if chatter < 0:
        return pressed, -1
    left = 0
    if not pressed:
        bounced = 0 if carry[AT_ONCE] > MOST_AT_ONCE else int(carry[BOUNCED])
        known = bounced, int(carry[LEFT])
        left = impacts_left(functions, tables, chatter, surface, t, y, p, unit, known, workspace)
    carry[LEFT] = float(left)
    return pressed, chatter if left == 0 else -1


@helper
def after_stretch(functions, tables, mode, t, y, p, carry, workspace):  # type: ignore[no-untyped-def]
    """Return the mode after some time in which nothing was met: in a chatter, which flight it is in.

    The impacts that follow are another segment: a mode of chatter begins after an impact.
    """
    wall = int(carry[BOUNCED]) - 1
    chatters = tables.flights[mode] >= 0 and wall >= 0
    if not (chatters and in_flight(functions, tables, mode, wall, t, y, p, workspace)):
        return mode
    carry[BOUNCED] = 0.0
    return flight_of(functions, tables, mode, wall, t, y, p, workspace)


@helper
def follow(functions, tables, mode, on, t, y, p, periods, rows, carry, budget, workspace):  # type: ignore[no-untyped-def]
    """Follow a trajectory; see :func:`simulate`."""
    none, nothing, after = workspace.none, workspace.nothing, workspace.after
    period = functions.period(p, none, workspace.empty)
    unit = period if period > 0.0 else max(1.0, carry[UNIT])
    cycle, t, on = begin(carry, on, t, period)
    event, waited, at_most = 0, 0.0, shortest_flight(tables, mode)
    for _ in range(budget):
        if event == rows.joints.shape[0]:
            break
        left = time_left(carry, cycle, t, period, periods)
        allowance = (HOLD_PERIODS if tables.sliding[mode] == 1 else SLIDE_PERIODS) * unit
        stretch = min(left, allowance - waited, _STRETCH * unit)
        tau, surface = first_met(functions, tables, mode, on, t, y, p, stretch, unit, workspace)
        if surface < 0:
            waited += stretch
            if left > stretch and not waited < allowance:
                return never_left(tables, mode), event, mode, cycle, t
            functions.flow(mode, t, y, stretch, p, none, after, nothing)
            tau, on = stretch, 0
        copy_state(after, y)
        turns, t = whole_turns(t + tau, period)
        cycle += turns
        if surface < 0:
            mode = after_stretch(functions, tables, mode, t, y, p, carry, workspace)
            if left > stretch:
                continue
            return ALL_TIME, event, mode, cycle, t
        waited = 0.0
        if too_large(y):  # or, where flights were short, they are too short to be resolved
            chatters = carry[STRUCK] != 0.0 and carry[AT_ONCE] > 0.0
            return (CHATTER if chatters else INFINITE), event, mode, cycle, t
        reset = tables.bounds[mode, surface] == 2
        if reset:  # rows keep the state before it, as the joints of orbits do
            copy_state(y, rows.states[event])
            functions.reset(surface, t, rows.states[event], p, none, y, nothing)
        on = tables.landed[mode, surface]
        code = sides_after(functions, tables, mode, surface, t, y, p, unit, workspace)
        target = mode_after(tables, mode, surface, code)
        if target == -1 and not reset:
            target = mode_together(functions, tables, mode, surface, code, t, y, p, workspace)
        carry[AT_ONCE] = carry[AT_ONCE] + 1.0 if tau <= at_most * unit else 0.0
        struck = reset or (carry[STRUCK] != 0.0 and carry[AT_ONCE] > 0.0)
        carry[STRUCK] = 1.0 if struck else 0.0
        pressed, chatter = False, -1
        if reset:
            if target == -1:
                return IMPOSSIBLE, event, mode, cycle, t
            struck_at = rows.states[event]
            pressed, chatter = after_impact(
                functions, tables, mode, surface, target, t, struck_at, y, p, unit, carry, workspace
            )
        if chatter >= 0:
            target, carry[AT_ONCE] = chatter, 0.0
        elif pressed or carry[AT_ONCE] > MOST_AT_ONCE:
            return (CHATTER if struck else IMPOSSIBLE), event, mode, cycle, t
        if target == -1 and is_crossed(functions, tables, mode, surface, t, y, p, unit, workspace):
            return IMPOSSIBLE, event, mode, cycle, t
        if target == -1:
            continue  # nothing leads there: the surface is touched and left to the same side
        alike = still_bounced(tables, mode, target, int(carry[BOUNCED]))
        carry[BOUNCED] = float(1 + surface if reset else alike)
        write_event(rows, event, mode, surface, cycle, t)
        if not reset:
            copy_state(y, rows.states[event])
        on = surfaces_after(tables, mode, surface)
        if tables.flights[mode] >= 0:  # at rest on a wall it may be at rest on a section, too
            on |= lying_on(functions, tables, t, y, p, workspace)
        mode = target
        event += 1
        if mode < 0:  # not visited yet: the tables are to be extended
            break
    carry[CYCLE], carry[ON] = float(cycle), float(on)
    return ALL_EVENTS, event, mode, cycle, t


@kernel(
    types.Tuple((i8, i8, i8, i8, f8))(
        FlowType, TablesType, i8, i8, f8, vector, vector, f8, RowsType, vector, i8
    )
)
def simulate(functions, tables, mode, on, t, y, p, periods, rows, carry, budget):  # type: ignore[no-untyped-def]
    """Follow a trajectory from ``(t, y)`` in a mode until all rows or the budget are full, or time is over.

    Parameters
    ----------
    carry : zeros at first; a further call goes on exactly where this one ended
    budget : most surfaces to be met
    on : surfaces that the start lies on and leaves, as bits
    periods : time allowed, in periods of the excitation (in units of time if it has none)

    ``y`` is advanced in place to the state after the last event, or at the end of the time.

    Returns
    -------
    tuple
        (how it ended, events written, mode, periods completed, phase). A mode below 0 was not visited yet.
    """
    count = y.shape[0]
    none, empty, nothing = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    workspace = StateWorkspace(
        none, empty, nothing, np.empty(count), np.empty(count), np.empty(1 + count)
    )
    return follow(functions, tables, mode, on, t, y, p, periods, rows, carry, budget, workspace)
