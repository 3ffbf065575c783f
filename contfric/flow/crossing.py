"""First hits and stationary points along an integrated segment.

The observable goes with the state as one more component, so that the steps resolve it. At the ends of a step
q, q' and q'' are known (the second derivative from the gradient of the rate), which is enough to certify almost
every step as free of roots, or to isolate one (:mod:`contfric.flow.panels`). Where it is not, the step is bisected with
a node of the motion itself: a *probe* steps from the start of the step to the place. The dense output is
thus as accurate as the integration, and a root that it finds is a root of the motion: it is refined by Newton's method
with probes until rounding.

A motion that starts on the level leaves it with the first power of time whose coefficient is not rounding.
"""

from __future__ import annotations

import math

from contfric.compiled import helper
from contfric.flow.panels import error_of, scan_slopes, scan_values, zero_of_slope
from contfric.flow.pieces import FREE, ISOLATED, coefficients, root_of
from contfric.flow.stepping import first_step, next_step, settle
from contfric.flow.variations import DEPTH, begin

#: Rates at the start below this, relative to 1 + the next one, are rounding.
AT_START = 1e-13
#: A panel of less than this share of its step is not divided further: a double root differs from a near miss by
#: its square, which is rounding.
_SHORTEST = 1e-7
#: Newton's correction, as a share of the step, that may be made along the tangent: its square is rounding.
_LAST = 1e-9
#: The same for a stationary point, whose value has an error of the square of that.
_LAST_STATIONARY = 1e-5
#: Error of a stationary time, relative to 1 + the time: one within it of a joint is at the joint.
_AT_JOINT = 4e-10
#: Part of the first step over which a start with two vanishing rates shows its side.
_FLAT = 0.125
#: Most probes in a step: a regular one needs none to ten, each double root about 25 more.
_MOST_PROBES = 2000


@helper
def node(motion, mode, c, target, t, y, f, p, room):  # type: ignore[no-untyped-def]
    """Return q less the target, q' and q'' at a state with its slope f."""
    grad, n = room.grad, room.scales.shape[0]
    q = motion.observe(c, t, y[:n], p, room.none, room.empty) - target
    q1 = motion.rate(mode, c, t, y[:n], p, room.none, grad)
    q2 = grad[0]
    for j in range(n):
        q2 += grad[1 + j] * f[j]
    return q, q1, q2


@helper
def probed(motion, mode, c, target, t, at, p, room):  # type: ignore[no-untyped-def]
    """Return q less the target, q' and q'' within the last step, which started at time t.

    The state and its slope are left in ``room.trial`` and ``room.stage``.
    """
    n = room.scales.shape[0]
    if not motion.probe(motion, mode, c, t, at, p, room.none, room):
        return math.nan, math.nan, math.nan
    motion.field(mode, t + at, room.trial[:n], p, room.none, room.stage[:n], room.nothing)
    return node(motion, mode, c, target, t + at, room.trial, room.stage, p, room)


@helper
def refine_hit(motion, mode, c, target, sign, t, h, low, high, at, p, room):  # type: ignore[no-untyped-def]
    """Return the root in a bracket behind which the observable changes sign; the state is in ``room.trial``."""
    n = room.scales.shape[0]
    for _ in range(100):  # bisection alone needs 60
        q, q1, _ = probed(motion, mode, c, target, t, at, p, room)
        if math.isnan(q):
            return math.nan
        if sign * q > 0.0:
            low = at
        else:
            high = at
        shift = -q / q1 if q1 != 0.0 else math.inf
        following = at + shift
        if abs(shift) <= _LAST * h or high - low <= 2e-16 * abs(t):
            if abs(shift) > _LAST * h:
                return at
            for k in range(n):
                room.trial[k] += shift * room.stage[k]
            return following
        at = following if low < following < high else 0.5 * (low + high)
    return at


@helper
def refine_turning(motion, mode, c, t, h, low, high, at, p, room):  # type: ignore[no-untyped-def]
    """Return a stationary point in a bracket, and the observable there."""
    q, rising = 0.0, 0.0
    for _ in range(100):
        q, q1, q2 = probed(motion, mode, c, 0.0, t, at, p, room)
        if math.isnan(q):
            return math.nan, q
        shift = -q1 / q2 if q2 != 0.0 else math.inf
        if abs(shift) <= _LAST_STATIONARY * h or high - low <= _SHORTEST * h:
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
def first_in_step(motion, mode, c, target, sign, multiple, t, a, h, left, right, p, room):  # type: ignore[no-untyped-def]
    """Return the first root in the last step as time after its start; -1 if there is none.

    ``left`` and ``right`` are the nodes (q, q', q'') at ``a`` and at the end; the observable starts on the side
    ``sign``, or on a root of order ``multiple``. No number if the search does not come to an end.
    """
    nodes = room.nodes
    nodes[0, 0], nodes[0, 1], nodes[0, 2], nodes[0, 3] = h, right[0], right[1], right[2]
    q, q1, q2 = left
    depth, probes = 1, 0
    while depth > 0:
        b, r, r1, r2 = nodes[depth - 1, 0], nodes[depth - 1, 1], nodes[depth - 1, 2], nodes[depth - 1, 3]
        length = b - a
        ends = coefficients(sign * q, sign * q1, sign * q2, sign * r, sign * r1, sign * r2, length)
        outcome, low, high, here = scan_values(ends, error_of(ends), multiple)
        if outcome == ISOLATED:
            at = a + (low + (high - low) * root_of(here)) * length
            ends_at = a + high * length
            return refine_hit(
                motion, mode, c, target, sign, t, h, a + low * length, ends_at, at, p, room
            )
        if outcome != FREE and length > _SHORTEST * h and depth < DEPTH:
            probes += 1
            middle = 0.5 * (a + b)
            q_m, q1_m, q2_m = probed(motion, mode, c, target, t, middle, p, room)
            if math.isnan(q_m) or probes > _MOST_PROBES:
                return math.nan
            nodes[depth, 0], nodes[depth, 1], nodes[depth, 2], nodes[depth, 3] = (
                middle,
                q_m,
                q1_m,
                q2_m,
            )
            depth += 1
            continue
        if outcome != FREE and sign * r <= 0.0:
            return refine_hit(motion, mode, c, target, sign, t, h, a, b, 0.5 * (a + b), p, room)
        a, q, q1, q2, multiple = b, r, r1, r2, 0
        depth -= 1
    return -1.0


@helper
def is_flat(left, right, h):  # type: ignore[no-untyped-def]
    """Tell whether an observable keeps its value along a step: a motion on the surface itself."""
    size = _SHORTEST * _SHORTEST * (1.0 + abs(left[0]))
    return (
        abs(right[0] - left[0]) <= size
        and max(abs(left[1]), abs(right[1])) * h <= size
        and max(abs(left[2]), abs(right[2])) * h * h <= size
    )


@helper
def leaving(left, on):  # type: ignore[no-untyped-def]
    """Return the side that the motion starts to, and the order of the root that it starts on.

    Side 0: two rates vanish as well.
    """
    q, q1, q2 = left
    if not on:
        return (1.0 if q > 0.0 else -1.0), 0
    if abs(q1) > AT_START * (1.0 + abs(q2)):
        return (1.0 if q1 > 0.0 else -1.0), 1
    if abs(q2) > AT_START:
        return (1.0 if q2 > 0.0 else -1.0), 2
    return 0.0, 0


@helper
def first_hit(motion, mode, c, target, on, t0, y0, dt_max, p, room, y1):  # type: ignore[no-untyped-def]
    """Return the first time at which an observable takes a value, with the state there in ``y1``.

    Negative if there is none before ``dt_max``. Where the integration breaks down, the time it came to with a state
    that is no number.
    """
    n = y0.shape[0]
    left = start_search(motion, mode, c, target, t0, y0, dt_max, p, room)
    if on:
        left = (0.0, left[1], left[2])
    elif left[0] == 0.0:
        write(y0, y1)
        return 0.0
    sign, multiple = leaving(left, on)
    done = 0.0
    while done < dt_max:
        t = t0 + done
        h = next_step(motion, mode, c, t, dt_max - done, p, room.none, room)
        if math.isnan(h):
            break
        right = node(motion, mode, c, target, t + h, room.end, room.last, p, room)
        if not is_flat(left, right, h):
            begins = 0.0
            if sign == 0.0:
                begins = _FLAT * h
                left = probed(motion, mode, c, target, t, begins, p, room)
                sign = 1.0 if left[0] > 0.0 else -1.0
            at = first_in_step(
                motion, mode, c, target, sign, multiple, t, begins, h, left, right, p, room
            )
            if math.isnan(at):
                break
            if at >= 0.0:
                write(room.trial[:n], y1)
                return done + at
            left, multiple = right, 0
        done = dt_max if h == dt_max - done else done + h
        settle(room)
    if done >= dt_max:
        return -1.0
    for k in range(n):
        y1[k] = math.nan
    return done


@helper
def start_search(motion, mode, c, target, t0, y0, left, p, room):  # type: ignore[no-untyped-def]
    """Begin the integration of state and observable; return the node at the start."""
    n = y0.shape[0]
    begin(motion, y0, p, room.none, room)
    room.start[n] = motion.observe(c, t0, y0, p, room.none, room.empty)
    first_step(motion, mode, c, t0, left, p, room.none, room)
    return node(motion, mode, c, target, t0, room.start, room.slopes[0], p, room)


@helper
def write(source, target):  # type: ignore[no-untyped-def]
    """Copy a state."""
    for k in range(target.shape[0]):
        target[k] = source[k]


@helper
def turnings_in_step(motion, mode, c, t, h, done, span, left, right, p, room, count, times, values):  # type: ignore[no-untyped-def]
    """Append the stationary points in the last step; return their number, -1 if the search fails."""
    nodes = room.nodes
    nodes[0, 0], nodes[0, 1], nodes[0, 2], nodes[0, 3] = h, right[0], right[1], right[2]
    a, q, q1, q2 = 0.0, left[0], left[1], left[2]
    depth, probes = 1, 0
    while depth > 0:
        b, r, r1, r2 = nodes[depth - 1, 0], nodes[depth - 1, 1], nodes[depth - 1, 2], nodes[depth - 1, 3]
        length = b - a
        ends = coefficients(q, q1, q2, r, r1, r2, length)
        at_start = a == 0.0 and done == 0.0 and abs(q1) <= AT_START * (1.0 + abs(q2))
        outcome, low, high, here = scan_slopes(ends, error_of(ends), at_start)
        found = outcome == ISOLATED
        next_node = b
        if not found and outcome != FREE:
            if length > _SHORTEST * h and depth < DEPTH and done + a < span[1]:
                next_node = 0.5 * (a + b)
            elif (q1 < 0.0) != (r1 < 0.0) and not at_start:
                found, low, high = True, 0.0, 1.0
        if found:
            share = zero_of_slope(here) if outcome == ISOLATED else 0.5
            at, value = refine_turning(
                motion,
                mode,
                c,
                t,
                h,
                a + low * length,
                a + high * length,
                a + (low + (high - low) * share) * length,
                p,
                room,
            )
            if math.isnan(at):
                return -1
            if span[0] < done + at < span[1]:
                if count == times.shape[0]:
                    return -1
                times[count], values[count] = done + at, value
                count += 1
            if high < 1.0:
                next_node = a + high * length
        if next_node == b:
            a, q, q1, q2 = b, r, r1, r2
            depth -= 1
            continue
        probes += 1
        q_m, q1_m, q2_m = probed(motion, mode, c, 0.0, t, next_node, p, room)
        if math.isnan(q_m) or probes > _MOST_PROBES:
            return -1
        if found:
            a, q, q1, q2 = next_node, q_m, q1_m, q2_m
        else:
            nodes[depth, 0], nodes[depth, 1], nodes[depth, 2], nodes[depth, 3] = (
                next_node,
                q_m,
                q1_m,
                q2_m,
            )
            depth += 1
    return count


@helper
def all_turnings(motion, mode, c, t0, y0, dt, p, room, times, values):  # type: ignore[no-untyped-def]
    """Write the interior stationary points of an observable; return their number, or -1."""
    left = start_search(motion, mode, c, 0.0, t0, y0, dt, p, room)
    near = _AT_JOINT * (1.0 + dt)
    span = (min(near, 0.5 * dt), max(dt - near, 0.5 * dt))
    done, count = 0.0, 0
    while done < dt:
        t = t0 + done
        h = next_step(motion, mode, c, t, dt - done, p, room.none, room)
        if math.isnan(h):
            return -1
        right = node(motion, mode, c, 0.0, t + h, room.end, room.last, p, room)
        if not is_flat(left, right, h):
            count = turnings_in_step(
                motion, mode, c, t, h, done, span, left, right, p, room, count, times, values
            )
            if count < 0:
                return -1
        done = dt if h == dt - done else done + h
        settle(room)
        left = right
    return count
