"""Stationary points of observables of linear motion, compiled."""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import allocating_helper, inlined_helper
from contfric.compiling.shared import numbers_at, unlock
from contfric.flow.folding import folded
from contfric.flow.linear.decayed import LAG, advance_long, begin_long, enter_level, rounded_up
from contfric.flow.linear.kept import NUMBERS, locked, space_of
from contfric.flow.linear.responses import pairs_space
from contfric.flow.linear.search import (
    AT_START,
    FLAT,
    begin_search,
    first_root,
    leaving,
    next_length,
    sixth_of,
    state_at,
    value_at,
    write_series,
)
from contfric.flow.linear.sighted import advance_seen, sight_of, write_seen
from contfric.flow.linear.steps import SMALL
from contfric.flow.linear.system import REACH, TERMS, WAVES, rows_of, system_in, terms_for

#: Error of a stationary time, relative to 1 + the time: one within it of a joint is at the joint.
_AT_JOINT = 4e-10
#: By how much steps are shortened where a search fails: no ratio of small whole numbers.
_OTHER_STEPS = 1.0873


@inlined_helper
def stationary_in_step(poly, slope, first, terms, sign, done, h, bound, span, count, times, values):  # type: ignore[no-untyped-def]
    """Append the zeros of a slope in a step; return their number (-1: it failed) and the last sign."""
    passed = 0.0
    while passed < 1.0:
        at, passed = first_root(slope, first, terms, passed, sign, bound)
        if math.isnan(at):
            return -1, sign
        if at < 0.0:
            break
        sign = -sign
        if span[0] < done + at * h < span[1]:
            if count == times.shape[0]:
                return -1, sign
            times[count], values[count] = done + at * h, value_at(poly, 0, terms + 1, at)[0]
            count += 1
    return count, sign


@inlined_helper
def stationary_in(motion, piece, c, t0, dt, p, reach, system, sight, seen, polys, times, values):  # type: ignore[no-untyped-def]
    """Write the interior stationary points of an observable; return their number, or -1."""
    rate, spread, grown, y0 = reach
    y, near, poly, slope = system.work[4], _AT_JOINT * (1.0 + dt), polys[0], polys[1]
    span = (min(near, 0.5 * dt), max(dt - near, 0.5 * dt))
    done, sign, count = 0.0, 0.0, 0
    place, at, by, step, forces, memory, pairs, waves = seen
    late, level, lag = (memory, pairs, waves), -1, 0.0
    powers, begin = begin_long(motion, piece, rate, spread, grown, dt, memory, system)
    while done < dt:
        if done >= begin:
            following, length, count_of = enter_level(
                motion, piece, c, level + 1, forces, rate, spread, powers, at, sight, late, system
            )
            begin = 2.0 * done if following >= 0 else math.inf
            if following >= 0:
                level, at, step, forces, lag = level + 1, following, length, count_of, LAG * length
                for i in range(y.shape[0]):
                    y[i] = y0[i]
        left = min(dt, begin) - done
        h = min(step, left) if level >= 0 else next_length(rate if at < 0 else REACH / step, left)
        terms, first, size = TERMS if level >= 0 else terms_for(rate * h, spread), 0, 0.0
        if at < 0:
            write_series(motion, piece, sight, c, 0.0, t0 + done, y, h, terms, system, poly)
        else:
            write_seen(
                motion, c, memory, at, t0 + done - lag, lag, y, h, step, terms, waves, system, poly
            )
        for k in range(1, terms + 1):
            slope[k - 1] = k * poly[k]
            size += abs(poly[k])
        if size > FLAT * FLAT * (1.0 + abs(poly[0])):
            if sign == 0.0 and abs(slope[0]) <= AT_START * (h + abs(slope[1])):
                first = leaving(slope, terms - 1, h)
            if first < terms:
                sign = math.copysign(1.0, slope[first]) if sign == 0.0 else sign
                if first == 0 and sign * slope[0] < 0.0:  # rounding between two steps
                    sign = -sign
                    if span[0] < done < span[1]:
                        if count == times.shape[0]:
                            return -1
                        times[count], values[count] = done, poly[0]
                        count += 1
                bound = rounded_up(sixth_of(slope, first, terms - 1), level, rate, step)
                count, sign = stationary_in_step(
                    poly, slope, first, terms - 1, sign, done, h, bound, span, count, times, values
                )
                if count < 0:
                    return -1
        if at < 0:
            state_at(system.series, terms, 1.0, y)
        elif level >= 0:
            advance_long(powers, level, forces, t0 + done - lag, y, late, system)
        elif h != dt - done:
            advance_seen(memory, place, by, t0 + done, y, forces, pairs, system)
        done = dt if h == dt - done else done + h
    return count


@allocating_helper
def linear_stationary(motion, piece, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Write the stationary points of an observable and return their number (``stationary_signature``)."""
    if not dt > 0.0:
        return 0
    entries, none = motion.entries_count, np.empty(0, dtype=np.int64)
    n, keeps = y0.shape[0], y0.shape[0] > SMALL
    coefficients, waves = np.zeros((3, entries)), np.empty((1 + WAVES, motion.waves_count))
    rows, poly = np.empty((rows_of(0, 2 * n if keeps else 0), n)), np.empty((2, TERMS + 2))
    period = motion.period(p, none, poly[0, :0])
    t = t0 - folded(t0, period) * period
    taken = keeps and locked(motion.memory)
    space = space_of(n, entries, waves.shape[1]) if keeps and not taken else 0
    memory = numbers_at(motion.memory, NUMBERS) if taken else np.zeros(space)
    pairs = np.empty(pairs_space(n, motion.waves_count, 0) if keeps else 0)
    seen = np.empty((2 * motion.waves_count + 2 if keeps else 0, TERMS + 1))
    workspace = (coefficients, waves, rows, poly, memory, pairs, seen)
    found = search_stationary(motion, piece, c, t, y0, dt, p, none, workspace, times, values)
    if taken:
        unlock(motion.memory)
    return found


@inlined_helper
def search_stationary(motion, piece, c, t, y0, dt, p, none, workspace, times, values):  # type: ignore[no-untyped-def]
    """Search all stationary points, from a folded time, in a workspace that is given."""
    sight, memory, pairs, waves = workspace[0][0], workspace[4], workspace[5], workspace[6]
    system = system_in(workspace[0][1:], workspace[1], workspace[2], 0)
    found, shorter = -1, 1.0
    for _ in range(
        2
    ):  # a double zero at the very end of a step has no sign on either side: other steps
        rate, spread, grown = begin_search(
            motion, piece, c, t, y0, dt, p, none, memory, system, sight
        )
        if math.isnan(rate):
            return -1
        reach = (rate * shorter, spread, grown, y0)
        place, at, by, step, forces = -1, -1, -1, 0.0, -1
        if memory.shape[0] > 0 and shorter == 1.0:
            place, at, by, step, forces = sight_of(
                motion, piece, c, rate, spread, grown, dt, sight, memory, pairs, waves, system
            )
        kept = memory if shorter == 1.0 else memory[:0]  # and then neither long steps
        seen = (place, at, by, step, forces, kept, pairs, waves)
        found = stationary_in(
            motion, piece, c, t, dt, p, reach, system, sight, seen, workspace[3], times, values
        )
        if found >= 0:
            break
        shorter = _OTHER_STEPS
    return found
