"""First hits along an affine mode: in steps of Taylor's polynomial, or in long ones where fast modes decay.

Few states take the steps of :mod:`~contfric.flow.linear.search`; structures take those of
:mod:`~contfric.flow.linear.decayed` as well, with kept powers of their matrix.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import allocating_helper, helper, inlined_helper
from contfric.compiling.shared import numbers_at, unlock
from contfric.flow.folding import folded
from contfric.flow.linear.decayed import (
    LAG,
    advance_long,
    advance_whole,
    begin_long,
    enter_level,
    rounded_up,
)
from contfric.flow.linear.kept import NUMBERS, locked, space_of
from contfric.flow.linear.responses import pairs_space
from contfric.flow.linear.search import (
    begin_search,
    first_root,
    leaving,
    next_length,
    sixth_of,
    state_at,
    value_at,
    write_series,
)
from contfric.flow.linear.sighted import write_seen
from contfric.flow.linear.steps import SMALL
from contfric.flow.linear.system import TERMS, WAVES, rows_of, system_in, terms_for

#: Largest correction of a root by the state there, in steps of the kept powers: that of its rounding.
_CORRECTED = 1e-3


@inlined_helper
def hit_in(motion, piece, c, target, on, t0, dt_max, reach, system, sight, poly, y1):  # type: ignore[no-untyped-def]
    """Return the first time at which an observable takes a value, with the state there in ``y1``."""
    rate, spread, _ = reach
    y, series = system.work[4], system.series
    done, sign = 0.0, 0.0
    while done < dt_max:
        h = next_length(rate, dt_max - done)
        terms, first = terms_for(rate * h, spread), 0
        write_series(motion, piece, sight, c, target, t0 + done, y, h, terms, system, poly)
        if on:
            first = leaving(poly, terms, h)
        elif done == 0.0:
            sign = math.copysign(1.0, poly[0])
        if not on and (poly[0] == 0.0 or sign * poly[0] < 0.0):
            state_at(series, terms, 0.0, y1)
            return done
        if first <= terms:
            sign = math.copysign(1.0, poly[first])
            at, _ = first_root(poly, first, terms, 0.0, sign, sixth_of(poly, first, terms))
            if math.isnan(at):
                for i in range(y1.shape[0]):
                    y1[i] = at
                return done
            if at >= 0.0:
                state_at(series, terms, at, y1)
                return min(done + at * h, dt_max)
            on = False
        state_at(series, terms, 1.0, y)
        done = dt_max if h == dt_max - done else done + h
    return -1.0


@helper
def hit_after_decay(motion, piece, c, target, t0, y0, at, reach, place, late, own, y1):  # type: ignore[no-untyped-def]
    """Write the state at a root that a long step has; return its time, corrected by that state."""
    system, sight, poly = own
    y, rate, spread = system.work[4], reach[0], reach[1]
    for i in range(y.shape[0]):
        y[i] = y0[i]
    done, h = advance_whole(motion, piece, place, t0, at, rate, spread, y, late, system)
    h *= 2.0  # the rest is less than h, and its correction less than another one
    terms, s = terms_for(rate * h, spread), (at - done) / h
    write_series(motion, piece, sight, c, target, t0 + done, y, h, terms, system, poly)
    q, q1, _ = value_at(poly, 0, terms, s)
    if abs(q) <= _CORRECTED * abs(q1):
        s = min(max(s - q / q1, 0.0), 1.0)
    state_at(system.series, terms, s, y1)
    return done + s * h


@helper
def long_hit(motion, piece, c, target, on, t0, y0, dt_max, reach, late, system, sight, poly, y1):  # type: ignore[no-untyped-def]
    """Do the same as :func:`hit_in`, in long steps where what is fast has decayed."""
    rate, spread, grown = reach
    y, series, memory = system.work[4], system.series, late[0]
    place, begin = begin_long(motion, piece, rate, spread, grown, dt_max, memory, system)
    level, at, step, count = -1, -1, 0.0, 0
    done, sign = 0.0, 0.0
    while done < dt_max:
        if done >= begin:
            following, length, count = enter_level(
                motion, piece, c, level + 1, count, rate, spread, place, sight, late, system
            )
            begin = 2.0 * done if following >= 0 else math.inf
            if following >= 0:
                level, at, step = level + 1, following, length
                for i in range(y.shape[0]):
                    y[i] = y0[i]
        if level < 0:
            h = next_length(rate, min(dt_max, begin) - done)
            terms = terms_for(rate * h, spread)
            write_series(motion, piece, sight, c, target, t0 + done, y, h, terms, system, poly)
        else:
            h, terms, lag = min(step, dt_max - done), TERMS, LAG * step
            before = t0 + done - lag
            write_seen(motion, c, memory, at, before, lag, y, h, step, terms, late[2], system, poly)
            poly[0] -= target
        first = 0
        if on:
            first = leaving(poly, terms, h)
        elif done == 0.0:
            sign = math.copysign(1.0, poly[0])
        found = -1.0
        if not on and (poly[0] == 0.0 or sign * poly[0] < 0.0):
            found = 0.0
        elif first <= terms:
            sign = math.copysign(1.0, poly[first])
            bound = rounded_up(sixth_of(poly, first, terms), level, rate, step)
            found, _ = first_root(poly, first, terms, 0.0, sign, bound)
            if math.isnan(found):
                for i in range(y1.shape[0]):
                    y1[i] = found
                return done
            on = False
        if found >= 0.0 and level < 0:
            state_at(series, terms, found, y1)
            return min(done + found * h, dt_max)
        if found >= 0.0:
            own, root = (system, sight, poly), done + found * h
            found = hit_after_decay(
                motion, piece, c, target, t0, y0, root, reach, place, late, own, y1
            )
            return min(found, dt_max)
        if level < 0:
            state_at(series, terms, 1.0, y)
        else:
            advance_long(place, level, count, t0 + done - LAG * step, y, late, system)
        done = dt_max if h == dt_max - done else done + h
    return -1.0


@allocating_helper
def linear_hit(motion, piece, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    """Return the first time at which an observable takes a value (``hit_signature``).

    No numbers as the state where nothing can be found: what is given is no motion, or the search too long.
    """
    if not dt_max > 0.0:
        return -1.0
    entries, n, none = motion.entries_count, y0.shape[0], np.empty(0, dtype=np.int64)
    keeps = n > SMALL
    coefficients, waves = np.zeros((3, entries)), np.empty((1 + WAVES, motion.waves_count))
    rows, poly = np.empty((rows_of(0, n if keeps else 0), n)), np.empty(TERMS + 2)
    period = motion.period(p, none, poly[:0])
    t = t0 - folded(t0, period) * period
    workspace = (coefficients, waves, rows, poly)
    if keeps:
        return hit_of_many(motion, piece, c, target, on, t, y0, dt_max, p, none, workspace, y1)
    return search_hit(motion, piece, c, target, on, t, y0, dt_max, p, none, workspace, y1)


@inlined_helper
def search_hit(motion, piece, c, target, on, t, y0, dt_max, p, none, workspace, y1):  # type: ignore[no-untyped-def]
    """Search the first hit, from a folded time, in a workspace that is given."""
    system, sight = system_in(workspace[0][1:], workspace[1], workspace[2], 0), workspace[0][0]
    reach = begin_search(motion, piece, c, t, y0, dt_max, p, none, workspace[3][:0], system, sight)
    if math.isnan(reach[0]):
        for i in range(y1.shape[0]):
            y1[i] = reach[0]
        return 0.0
    return hit_in(motion, piece, c, target, on, t, dt_max, reach, system, sight, workspace[3], y1)


@allocating_helper
def hit_of_many(motion, piece, c, target, on, t, y0, dt_max, p, none, workspace, y1):  # type: ignore[no-untyped-def]
    """Do the same for more than a few states, with the powers of their matrix that are kept."""
    entries, n, count = motion.entries_count, y0.shape[0], motion.waves_count
    taken = locked(motion.memory)
    space = 0 if taken else space_of(n, entries, count)
    memory = numbers_at(motion.memory, NUMBERS) if taken else np.zeros(space)
    pairs, seen = np.empty(pairs_space(n, count, 0)), np.empty((2 * count + 2, TERMS + 1))
    late = (memory, pairs, seen)
    found = search_long(motion, piece, c, target, on, t, y0, dt_max, p, none, workspace, late, y1)
    if taken:
        unlock(motion.memory)
    return found


@inlined_helper
def search_long(motion, piece, c, target, on, t, y0, dt_max, p, none, workspace, late, y1):  # type: ignore[no-untyped-def]
    """Search in workspaces that are given: parts of them are not counted as references."""
    system, sight = system_in(workspace[0][1:], workspace[1], workspace[2], 0), workspace[0][0]
    reach = begin_search(motion, piece, c, t, y0, dt_max, p, none, late[0], system, sight)
    if math.isnan(reach[0]):
        for i in range(y1.shape[0]):
            y1[i] = reach[0]
        return 0.0
    return long_hit(
        motion, piece, c, target, on, t, y0, dt_max, reach, late, system, sight, workspace[3], y1
    )
