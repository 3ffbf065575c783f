"""Motion through kinks: one mode of the engine, integrated piece by piece.

At a *kink* the field is continuous and its derivatives are not: ``|v|`` at v = 0. With f- and f+ the
fields before and after a surface with normal n, the derivatives of the flow are multiplied there by the
saltation matrix (Leine, Nijmeijer, "Dynamics and Bifurcations of Non-Smooth Mechanical Systems", 2004,
section 7.1)

    I + (f+ - f-) n^T / (n . f-) = I        as f+ = f-,

so that the variations pass a kink unchanged. A kink is therefore no joint of the boundary-value problem, and
the number of crossings may change along a branch without a bifurcation. But a step of an integrator over
a kink is of low order: each crossing is found as a certified first root
(:mod:`contfric.flow.integration.hits`), the step is taken again up to it, and the integration goes on in the
next piece. An error d of the place of a crossing changes the state by the second order of d, since the
slopes are the same.

Where v touches 0 from one side it does not cross, and nothing happens. The number of crossings changes
there by two; the state at the end of the solution is continuously differentiable by its start, with a
derivative that changes like the square root of the distance from the touch, on the side that crosses.

For K kinks the fields of the pieces are numbered ``mode * 2**K + bits``; bit k is set where the observable
``kink(k)`` is positive.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.flow.folding import folded
from contfric.flow.integration.dense import is_flat, node, probed, write
from contfric.flow.integration.dop853 import STAGES
from contfric.flow.integration.hits import _FLAT, first_hit, first_in_step, leaving
from contfric.flow.integration.stationary import all_stationary
from contfric.flow.integration.stepping import (
    FRESH,
    MOST_STEPS,
    REMEMBERED,
    TRIED,
    accept_step,
    first_step,
    next_step,
)
from contfric.flow.integration.variations import begin, integration_workspace, slope

#: Rates below this, relative to 1 + the next one, vanish at a crossing: the crossing is a stationary point.
_STATIONARY = 1e-9


@helper
def piece_at(motion, mode, t, y, on, p, workspace):  # type: ignore[no-untyped-def]
    """Return the piece that a state lies in, or enters if it lies on a kink (on kink ``on`` it does)."""
    bits = 0
    first = mode << motion.kinks
    n = workspace.scales.shape[0]
    for k in range(motion.kinks):
        side = motion.observe(motion.kink_of[k], t, y, p, workspace.none, workspace.empty)
        if side == 0.0 or k == on:  # the fields of both sides are the same here
            motion.field(first, t, y, p, workspace.none, workspace.stage[:n], workspace.nothing)
            c = motion.kink_of[k]
            _, side, second = node(motion, first, c, 0.0, t, y, workspace.stage, p, workspace)
            side = second if side == 0.0 else side
        bits |= (1 << k) if side > 0.0 else 0
    return first | bits


@helper
def first_crossing(motion, piece, t, h, on, p, workspace):  # type: ignore[no-untyped-def]
    """Return the first crossing of a kink in the last step and which one it is, or (-1, -1).

    ``on`` is the kink that the step starts on, -1 if none. No number if the search does not come to an end.
    """
    found, which = -1.0, -1
    for k in range(motion.kinks):
        c = motion.kink_of[k]
        left = node(motion, piece, c, 0.0, t, workspace.start, workspace.slopes[0], p, workspace)
        right = node(motion, piece, c, 0.0, t + h, workspace.end, workspace.last, p, workspace)
        if is_flat(left, right, h):
            continue
        starts_on = on == k or left[0] == 0.0  # as a state at rest is on the kink of abs(v)
        if starts_on:
            left = (0.0, left[1], left[2])
        sign, multiple = leaving(left, starts_on)
        begins = 0.0
        if sign == 0.0:
            begins = _FLAT * h
            left = probed(motion, piece, c, 0.0, t, begins, p, workspace)
            sign = 1.0 if left[0] > 0.0 else -1.0
        at = first_in_step(
            motion, piece, c, 0.0, sign, multiple, t, begins, h, left, right, p, workspace
        )
        if math.isnan(at):
            return math.nan, k
        if at >= 0.0 and (which < 0 or at < found):
            found, which = at, k
    return found, which


@helper
def hand_back(workspace, fine, y1, jac):  # type: ignore[no-untyped-def]
    """Write the state and its derivatives by (t0, y0, dt, parameters)."""
    n, columns = workspace.scales.shape[0], workspace.partial.shape[1]
    for i in range(n):
        y1[i] = workspace.start[i] if fine else math.nan
    for i in range(n if columns > 0 else 0):
        row = n + i * columns
        for j in range(columns):
            jac[i, j if j <= n else j + 1] = workspace.start[row + j] if fine else math.nan
        jac[i, 1 + n] = workspace.slopes[0, i] if fine else math.nan


@helper
def restart(motion, piece, t, p, which, workspace):  # type: ignore[no-untyped-def]
    """Start again from ``workspace.trial`` in another piece, with steps as long as they were."""
    for k in range(workspace.start.shape[0]):
        workspace.start[k] = workspace.trial[k]
    slope(motion, piece, -1, t, workspace.start, p, which, workspace, workspace.slopes[0])
    workspace.control[FRESH], workspace.control[REMEMBERED] = 0.0, 0.0


@helper
def advance_through(motion, mode, t0, dt, y0, p, which, workspace):  # type: ignore[no-untyped-def]
    """Integrate over ``dt`` through all kinks; return the number of crossings, -1 if that fails.

    Backwards in time (which only iterates of Newton's method far from a solution ask for) kinks are not
    looked for.
    """
    begin(motion, y0, p, which, workspace)
    piece = piece_at(motion, mode, t0, y0, -1, p, workspace)
    first_step(motion, piece, -1, t0, dt, p, which, workspace)
    if not math.isfinite(t0 + dt):
        return -1
    done, on, crossings = 0.0, -1, 0
    while done != dt:
        left, t = dt - done, t0 + done
        h = next_step(motion, piece, -1, t, left, p, which, workspace)
        if math.isnan(h):
            return -1
        at, k = (-1.0, -1) if h < 0.0 else first_crossing(motion, piece, t, h, on, p, workspace)
        if math.isnan(at):
            return -1
        on = k
        if k < 0:
            done = dt if h == left else done + h
            accept_step(workspace)
            continue
        if not motion.probe(motion, piece, -1, t, at, p, which, workspace):
            return -1
        done = dt if at >= left else done + at
        piece ^= 1 << k
        restart(motion, piece, t0 + done, p, which, workspace)
        crossings += 1
    return crossings


@allocating_helper
def kinked_flow(motion, mode, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Advance a state by ``dt`` through all kinks, with derivatives where ``jac`` has space."""
    n, free = y0.shape[0], which.shape[0]
    columns = 1 + n + free if jac.shape[0] > 0 else 0
    grad = np.empty(free)
    period = motion.period(p, which, grad)
    cycles = folded(t0, period)
    workspace = integration_workspace(n, 0, columns, STAGES, motion.stages)
    fine = advance_through(motion, mode, t0 - cycles * period, dt, y0, p, which, workspace) >= 0
    hand_back(workspace, fine, y1, jac)
    if columns > 0 and cycles != 0.0:
        for i in range(n):
            for k in range(free):
                jac[i, 2 + n + k] -= cycles * grad[k] * jac[i, 0]


@helper
def next_kink(motion, piece, t, y, on, left, p, workspace, reached):  # type: ignore[no-untyped-def]
    """Return the time to the next crossing and which kink it is, with the state there in ``reached``."""
    n = y.shape[0]
    found, which = -1.0, -1
    for k in range(motion.kinks):
        c = motion.kink_of[k]
        starts_on = on == k or motion.observe(c, t, y, p, workspace.none, workspace.empty) == 0.0
        at = first_hit(
            motion, piece, c, 0.0, starts_on, t, y, left, p, workspace, workspace.stage[:n]
        )
        if at >= 0.0 and (which < 0 or at < found):
            write(workspace.stage[:n], reached)
            found, which = at, k
    return found, which


@allocating_helper
def kinked_hit(motion, mode, c, target, on, t0, y0, dt_max, p, y1):  # type: ignore[no-untyped-def]
    """Return the first time at which an observable takes a value, through all kinks (``hit_signature``)."""
    if not dt_max > 0.0:
        return -1.0
    n = y0.shape[0]
    workspace = integration_workspace(n, 1, 0, STAGES, motion.stages)
    here, reached = y0.copy(), np.empty(n)
    period = motion.period(p, workspace.none, workspace.empty)
    phase = t0 - folded(t0, period) * period
    kink = -1
    for k in range(motion.kinks):
        if target != 0.0 or c != motion.kink_of[k]:
            continue
        if not on and motion.observe(c, phase, here, p, workspace.none, workspace.empty) == 0.0:
            write(here, y1)
            return 0.0
        kink = k if on else kink
    piece = piece_at(motion, mode, phase, here, kink, p, workspace)
    done = 0.0
    while done < dt_max:
        workspace.control[TRIED] += 1.0  # kinks that are met at once take no step
        if workspace.control[TRIED] > MOST_STEPS:
            for i in range(n):
                y1[i] = math.nan
            return done
        t, left = phase + done, dt_max - done
        until, k = next_kink(motion, piece, t, here, kink, left, p, workspace, reached)
        span = left if k < 0 else until
        itself = k >= 0 and c == motion.kink_of[k] and target == 0.0
        if not itself:
            at = first_hit(motion, piece, c, target, on, t, here, span, p, workspace, y1)
            if at >= 0.0:
                return done + at
        if k < 0:
            return -1.0
        if itself or not math.isfinite(reached[0]):
            write(reached, y1)
            return done + until
        write(reached, here)
        done, kink, piece, on = done + until, k, piece ^ (1 << k), False
    return -1.0


@allocating_helper
def kinked_stationary(motion, mode, c, t0, y0, dt, p, times, values):  # type: ignore[no-untyped-def]
    """Write the stationary points of an observable through all kinks (``stationary_signature``)."""
    if not dt > 0.0:
        return 0
    n = y0.shape[0]
    workspace = integration_workspace(n, 1, 0, STAGES, motion.stages)
    here, reached = y0.copy(), np.empty(n)
    period = motion.period(p, workspace.none, workspace.empty)
    phase = t0 - folded(t0, period) * period
    piece = piece_at(motion, mode, phase, here, -1, p, workspace)
    done, kink, count = 0.0, -1, 0
    while done < dt:
        workspace.control[TRIED] += 1.0  # kinks that are met at once take no step
        if workspace.control[TRIED] > MOST_STEPS:
            return -1
        t, left = phase + done, dt - done
        until, k = next_kink(motion, piece, t, here, kink, left, p, workspace, reached)
        span = left if k < 0 else until
        found = all_stationary(
            motion, piece, c, t, here, span, p, workspace, times[count:], values[count:]
        )
        if found < 0 or (k >= 0 and not math.isfinite(reached[0])):
            return -1
        for i in range(count, count + found):
            times[i] += done
        count += found
        if k < 0:
            return count
        write(reached, here)
        done, kink, piece = done + until, k, piece ^ (1 << k)
        motion.field(
            piece, phase + done, here, p, workspace.none, workspace.stage[:n], workspace.nothing
        )
        q, q1, q2 = node(motion, piece, c, 0.0, phase + done, here, workspace.stage, p, workspace)
        if abs(q1) <= _STATIONARY * (1.0 + abs(q2)) and done < dt:
            if count == times.shape[0]:
                return -1
            times[count], values[count] = done, q
            count += 1
    return count
