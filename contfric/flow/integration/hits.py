"""The first hit along an integrated segment.

Roots are isolated between nodes of the solution (:mod:`contfric.flow.integration.dense`) and refined by
Newton's method with probes until rounding. A solution that starts on the level leaves it with the first
power of time whose coefficient is not rounding.
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
    write,
)
from contfric.flow.integration.panels import error_of, scan_values
from contfric.flow.integration.stepping import accept_step, next_step
from contfric.flow.integration.variations import DEPTH
from contfric.flow.pieces import FREE, ISOLATED, coefficients, root_of

#: Newton's correction, as a share of the step, that may be made along the tangent: its square is
#: rounding.
_LAST = 1e-9
#: Part of the first step over which a start with two vanishing rates shows its side.
_FLAT = 0.125


@helper
def refine_hit(motion, mode, c, target, sign, t, h, low, high, at, p, workspace):  # type: ignore[no-untyped-def]
    """Return the root in a bracket; the state there is in ``workspace.trial``."""
    n = workspace.scales.shape[0]
    for _ in range(100):  # bisection alone needs 60
        q, q1, _ = probed(motion, mode, c, target, t, at, p, workspace)
        if math.isnan(q):
            return math.nan
        if sign * q > 0.0:
            low = at
        else:
            high = at
        shift = -q / q1 if q1 != 0.0 else math.inf
        following = at + shift
        # the bracket's rounding is that within the step, which may be below that of the time
        if abs(shift) <= _LAST * h or high - low <= 2e-16 * high:
            if abs(shift) > _LAST * h:
                return at
            for k in range(n):
                workspace.trial[k] += shift * workspace.stage[k]
            return following
        at = following if low < following < high else 0.5 * (low + high)
    return at


@helper
def first_in_step(motion, mode, c, target, sign, multiple, t, a, h, left, right, p, workspace):  # type: ignore[no-untyped-def]
    """Return the first root in the last step as time after its start, or -1.

    ``left`` and ``right`` are the nodes (q, q', q'') at ``a`` and at the end; the observable starts on
    the side ``sign``, or on a root of order ``multiple``. No number if the search does not come to an
    end.
    """
    nodes = workspace.nodes
    depth, probes = push(nodes, 0, h, right), 0
    while depth > 0:
        b, after = top(nodes, depth)
        length = b - a
        ends = signed_coefficients(sign, left, after, length)
        outcome, low, high, here = scan_values(ends, error_of(ends), multiple)
        if outcome == ISOLATED:
            at = a + (low + (high - low) * root_of(here)) * length
            low, high = a + low * length, a + high * length
            return refine_hit(motion, mode, c, target, sign, t, h, low, high, at, p, workspace)
        if outcome != FREE and length > SHORTEST * h and depth < DEPTH:
            probes += 1
            middle = 0.5 * (a + b)
            between = probed(motion, mode, c, target, t, middle, p, workspace)
            if math.isnan(between[0]) or probes > MOST_PROBES:
                return math.nan
            depth = push(nodes, depth, middle, between)
            continue
        if outcome != FREE and sign * after[0] <= 0.0:
            return refine_hit(
                motion, mode, c, target, sign, t, h, a, b, 0.5 * (a + b), p, workspace
            )
        a, left, multiple = b, after, 0
        depth -= 1
    return -1.0


@helper
def signed_coefficients(sign, left, right, length):  # type: ignore[no-untyped-def]
    """Return the quintic between two nodes, times a sign."""
    q, q1, q2 = left
    r, r1, r2 = right
    return coefficients(sign * q, sign * q1, sign * q2, sign * r, sign * r1, sign * r2, length)


@helper
def leaving(left, on):  # type: ignore[no-untyped-def]
    """Return the side that the solution starts to, and the order of the root that it starts on.

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
def first_hit(motion, mode, c, target, on, t0, y0, dt_max, p, workspace, y1):  # type: ignore[no-untyped-def]
    """Return the first time at which an observable takes a value, with the state there in ``y1``.

    Negative without one before ``dt_max``. Where the integration breaks down, the time it came to
    with a state that is no number.
    """
    n = y0.shape[0]
    left = start_search(motion, mode, c, target, t0, y0, dt_max, p, workspace)
    if on:
        left = (0.0, left[1], left[2])
    elif left[0] == 0.0:
        write(y0, y1)
        return 0.0
    sign, multiple = leaving(left, on)
    side = motion.sides[(mode >> motion.kinks) * motion.observables + c] if on else 0.0
    if sign * side < 0.0:  # it leaves the level to where the mode does not live
        write(y0, y1)
        return 0.0
    done = 0.0
    while done < dt_max:
        t = t0 + done
        h = next_step(motion, mode, c, t, dt_max - done, p, workspace.none, workspace)
        if math.isnan(h):
            break
        right = node(motion, mode, c, target, t + h, workspace.end, workspace.last, p, workspace)
        if not is_flat(left, right, h):
            begins = 0.0
            if sign == 0.0:
                begins = _FLAT * h
                left = probed(motion, mode, c, target, t, begins, p, workspace)
                sign = 1.0 if left[0] > 0.0 else -1.0
                if sign * side < 0.0:
                    write(y0, y1)
                    return 0.0
            at = first_in_step(
                motion, mode, c, target, sign, multiple, t, begins, h, left, right, p, workspace
            )
            if math.isnan(at):
                break
            if at >= 0.0:
                write(workspace.trial[:n], y1)
                return done + at
            left, multiple = right, 0
        done = dt_max if h == dt_max - done else done + h
        accept_step(workspace)
    if done >= dt_max:
        return -1.0
    for k in range(n):
        y1[k] = math.nan
    return done
