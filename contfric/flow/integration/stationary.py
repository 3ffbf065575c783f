"""The stationary points of an observable along an integrated segment: all of them.

Zeros of the rate are isolated between nodes of the solution (:mod:`contfric.flow.integration.dense`) and
refined by probes.
"""

from __future__ import annotations

import math

from contfric.compiled import helper
from contfric.flow.integration.dense import (
    AT_START,
    MOST_PROBES,
    SHORTEST,
    is_flat,
    node,
    probed,
    push,
    start_search,
    top,
)
from contfric.flow.integration.panels import error_of, scan_slopes, zero_of_slope
from contfric.flow.integration.stepping import accept_step, next_step
from contfric.flow.integration.variations import DEPTH
from contfric.flow.pieces import FREE, ISOLATED, coefficients

#: Correction, as a share of the step, that a stationary point may be left with, whose value has an error
#: of the square of that.
_LAST_STATIONARY = 1e-5
#: Error of a stationary time, relative to 1 + the time: one within it of a joint is at the joint.
_AT_JOINT = 4e-10

#: Where the observable changes by less than this over a panel, relative to 1 + its size, the panel is not
#: divided further: two stationary points in it have one value to rounding. (At a double zero of the rate
#: thousands of panels would be too flat to tell its sign.)
_LEVEL = 1e-15


@helper
def refine_stationary(motion, mode, c, t, h, low, high, at, p, workspace):  # type: ignore[no-untyped-def]
    """Return a stationary point in a bracket, and the observable there."""
    q, rising = 0.0, 0.0
    for _ in range(100):
        q, q1, q2 = probed(motion, mode, c, 0.0, t, at, p, workspace)
        if math.isnan(q):
            return math.nan, q
        shift = -q1 / q2 if q2 != 0.0 else math.inf
        if abs(shift) <= _LAST_STATIONARY * h or high - low <= SHORTEST * h:
            shift = shift if abs(shift) <= _LAST_STATIONARY * h else 0.0
            return at + shift, q + 0.5 * shift * q1
        if rising == 0.0:
            rising = 1.0 if q2 > 0.0 else -1.0
        if rising * q1 < 0.0:
            low = at
        else:
            high = at
        following = at + shift
        at = following if low < following < high else 0.5 * (low + high)
    return at, q


@helper
def recorded(at, value, span, count, times, values):  # type: ignore[no-untyped-def]
    """Append a stationary point if it is inside; return their number, -1 if there is no space or no point."""
    if math.isnan(at):
        return -1
    if not span[0] < at < span[1]:
        return count
    if count == times.shape[0]:
        return -1
    times[count], values[count] = at, value
    return count + 1


@helper
def stationary_in_step(  # type: ignore[no-untyped-def]
    motion, mode, c, t, h, done, span, left, right, p, workspace, count, times, values
):
    """Append the stationary points in the last step; return their number, -1 if the search fails."""
    nodes, a = workspace.nodes, 0.0
    depth, probes = push(nodes, 0, h, right), 0
    while depth > 0:
        b, after = top(nodes, depth)
        length, next_node = b - a, b
        q, q1, q2 = left
        ends = coefficients(q, q1, q2, after[0], after[1], after[2], length)
        at_start = a == 0.0 and done == 0.0 and abs(q1) <= AT_START * (1.0 + abs(q2))
        outcome, low, high, here = scan_slopes(ends, error_of(ends), at_start)
        found, share = outcome == ISOLATED, 0.5
        if found:
            share = zero_of_slope(here)
        elif outcome != FREE:
            moves = max(abs(q1), abs(after[1])) * length > _LEVEL * (1.0 + abs(q))
            if moves and length > SHORTEST * h and depth < DEPTH and done + a < span[1]:
                next_node = 0.5 * (a + b)
            elif (q1 < 0.0) != (after[1] < 0.0) and not at_start:
                found, low, high = True, 0.0, 1.0
        if found:
            at = a + (low + (high - low) * share) * length
            low, high = a + low * length, b if high == 1.0 else a + high * length
            at, value = refine_stationary(motion, mode, c, t, h, low, high, at, p, workspace)
            count = recorded(done + at, value, span, count, times, values)
            if count < 0:
                return -1
            next_node = high
        if next_node == b:
            a, left = b, after
            depth -= 1
            continue
        probes += 1
        between = probed(motion, mode, c, 0.0, t, next_node, p, workspace)
        if math.isnan(between[0]) or probes > MOST_PROBES:
            return -1
        if found:
            a, left = next_node, between
        else:
            depth = push(nodes, depth, next_node, between)
    return count


@helper
def all_stationary(motion, mode, c, t0, y0, dt, p, workspace, times, values):  # type: ignore[no-untyped-def]
    """Write the interior stationary points of an observable; return their number, or -1."""
    left = start_search(motion, mode, c, 0.0, t0, y0, dt, p, workspace)
    near = _AT_JOINT * (1.0 + dt)
    span = (min(near, 0.5 * dt), max(dt - near, 0.5 * dt))
    done, count = 0.0, 0
    while done < dt:
        t = t0 + done
        h = next_step(motion, mode, c, t, dt - done, p, workspace.none, workspace)
        if math.isnan(h):
            return -1
        right = node(motion, mode, c, 0.0, t + h, workspace.end, workspace.last, p, workspace)
        if not is_flat(left, right, h):
            count = stationary_in_step(
                motion, mode, c, t, h, done, span, left, right, p, workspace, count, times, values
            )
            if count < 0:
                return -1
        done = dt if h == dt - done else done + h
        accept_step(workspace)
        left = right
    return count
