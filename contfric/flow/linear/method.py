"""The closed form as a method of the integrator, for what its own search does not know.

An observable that is not affine, and a motion through kinks, are searched step by step as along an integrated
motion (:mod:`contfric.flow.integration.stepping`); the steps of an affine mode are then its closed form.
They have no error; their length is limited so that the certificates of the search hold. These bound the
error of the quintic between the ends of a step (:mod:`contfric.flow.integration.panels`), which is true of
steps that resolve the observable, ``w h <= 2``. How fast an observable such as sin(theta) changes does not
follow from the rates of the states: it is compared with the quintic inside of the step. The quotient of
error and bound falls with the square of the length.
"""

from __future__ import annotations

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.flow.integration.dense import node
from contfric.flow.integration.dop853 import POWER
from contfric.flow.integration.panels import error_of
from contfric.flow.integration.stepping import explicit, explicit_probe
from contfric.flow.linear.flow import MOST_STEPS
from contfric.flow.linear.steps import advance, exponential
from contfric.flow.linear.system import REACH, WAVES, rows_of, set_up, silenced, system_in
from contfric.flow.pieces import coefficients as quintic
from contfric.flow.pieces import left_part

#: Where an observable is compared within a step: at no place that is symmetric to another.
_INSIDE = (0.21, 0.5, 0.68)
#: Error of the quintic, as a share of its bound, that is allowed: a third is that at ``w h = 2``.
_ALLOWED = 0.5


@allocating_helper
def linear_step(motion, mode, c, t, h, p, which, workspace, end, any_length):  # type: ignore[no-untyped-def]
    """Write the vector after a step from ``workspace.start``; return its length against the longest one."""
    n, size = workspace.scales.shape[0], workspace.partial.shape[1]
    free = which.shape[0] if size > 0 else 0
    coefficients = np.empty((2 + free, motion.entries_count))
    waves = np.empty((1 + free + WAVES, motion.waves_count))
    rows = np.empty((rows_of(free, 2 * n if size > 0 else 0), n))
    own = (coefficients, waves, rows)
    return step_in(motion, mode, c, t, h, p, which[:free], workspace, end, any_length, own)


@helper
def step_in(motion, mode, c, t, h, p, which, workspace, end, any_length, own):  # type: ignore[no-untyped-def]
    """Step in a workspace that is given."""
    system = system_in(own[0], own[1], own[2], which.shape[0])
    rate, spread = set_up(motion, mode, p, which, system)
    rate = silenced(rate, system)
    length = rate * abs(h) / REACH
    if not (length <= 1.0 or (any_length and length < MOST_STEPS)):
        return length
    n, size, start, maps = (
        workspace.scales.shape[0],
        workspace.partial.shape[1],
        workspace.start,
        system.maps,
    )
    y, first = system.work[4], start.shape[0] - n * size
    for i in range(n):
        y[i] = start[i]
        for k in range(system.varied.shape[0]):
            system.varied[k, i] = 0.0
    advance(motion, mode, t, h, rate, spread, y, system)
    if size > 0:
        exponential(motion, mode, h, rate, spread, system)
    for i in range(n):
        end[i] = y[i]
    if first > n:
        end[n] = motion.observe(c, t + h, end[:n], p, workspace.none, workspace.empty)
    if size == 0:
        return length
    for i in range(n):
        for j in range(size):  # the derivatives so far, carried on, and what this step adds
            total = system.work[5, i] if j == 0 else system.varied[j - n - 1, i] if j > n else 0.0
            for k in range(n):
                total += maps[i, k] * start[first + k * size + j]
            end[first + i * size + j] = total
    return length


@helper
def linear_attempt(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Step from ``workspace.start`` to ``workspace.end``; return the error in units of what is allowed."""
    length = linear_step(motion, mode, c, t, h, p, which, workspace, workspace.end, False)
    error, n = length**POWER, workspace.scales.shape[0]
    if error > 1.0 or workspace.start.shape[0] == n * (1 + workspace.partial.shape[1]):
        return error  # too long, or without an observable
    return max(error, unresolved(motion, mode, c, t, h, p, which, workspace) ** (POWER // 2))


@helper
def unresolved(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Return the error of an observable's quintic over a step, in units of what is allowed of its bound."""
    n, empty, nothing = workspace.scales.shape[0], workspace.none, workspace.nothing
    motion.field(mode, t + h, workspace.end[:n], p, empty, workspace.stage[:n], nothing)
    q, q1, q2 = node(motion, mode, c, 0.0, t, workspace.start, workspace.slopes[0], p, workspace)
    r, r1, r2 = node(motion, mode, c, 0.0, t + h, workspace.end, workspace.stage, p, workspace)
    ends, missed = quintic(q, q1, q2, r, r1, r2, h), 0.0
    for share in _INSIDE:
        linear_step(motion, mode, c, t, share * h, p, which, workspace, workspace.trial, True)
        missed = max(missed, abs(workspace.trial[n] - left_part(ends, share)[5]))
    known = workspace.allowed[n] + motion.relative * max(abs(q), abs(r))
    return missed / (_ALLOWED * error_of(ends) + known)


@helper
def linear_probe(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Write the vector at t + h, within the last step, to ``workspace.trial``."""
    linear_step(motion, mode, c, t, h, p, which, workspace, workspace.trial, True)
    return True


@helper
def explicit_or_linear(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Step by the closed form where there is one (a method)."""
    if motion.closed[mode] != 0:
        return linear_attempt(motion, mode, c, t, h, p, which, workspace)
    return explicit(motion, mode, c, t, h, p, which, workspace)


@helper
def explicit_or_linear_probe(motion, mode, c, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Probe by the closed form where there is one."""
    if motion.closed[mode] != 0:
        return linear_probe(motion, mode, c, t, h, p, which, workspace)
    return explicit_probe(motion, mode, c, t, h, p, which, workspace)
