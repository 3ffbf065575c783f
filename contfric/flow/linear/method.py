"""The closed form as a method of the integrator, for what its own search does not know.

An observable that is not affine, and a motion through kinks, are searched step by step as along an integrated
motion (:mod:`contfric.flow.stepping`); the steps of an affine mode are then its closed form. They have no
error; their length is limited so that the certificates of the search hold.
"""

from __future__ import annotations

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.flow.dop853 import POWER
from contfric.flow.linear.flow import MOST_STEPS, advance
from contfric.flow.linear.system import (
    REACH,
    set_up,
    silenced,
    size_of_system,
    start_waves,
    system_in,
)
from contfric.flow.stepping import explicit, explicit_probe
from contfric.flow.stiffness import automatic, automatic_probe


@allocating_helper
def linear_step(motion, mode, c, t, h, p, which, room, end, any_length):  # type: ignore[no-untyped-def]
    """Write the vector after a step from ``room.start``; return its length against the longest one."""
    n, size = room.scales.shape[0], room.partial.shape[1]
    free = which.shape[0] if size > 0 else 0
    flat = np.empty(size_of_system(n, motion, free) + n * (2 * n + free))
    return linear_step_in(motion, mode, c, t, h, p, which[:free], room, end, any_length, flat)


@helper
def linear_step_in(motion, mode, c, t, h, p, which, room, end, any_length, flat):  # type: ignore[no-untyped-def]
    """Step in room that is given."""
    n, size, free = room.scales.shape[0], room.partial.shape[1], which.shape[0]
    system, start = system_in(flat, n, motion, free), room.start
    rest = flat[flat.shape[0] - n * (2 * n + free) :]
    varied, maps = rest[: free * n].reshape((free, n)), rest[free * n :].reshape((2, n, n))
    rate, spread = set_up(motion, mode, p, which, system)
    rate = silenced(rate, system)
    length = rate * abs(h) / REACH
    if not (length <= 1.0 or (any_length and length < MOST_STEPS)):
        return length
    y, first, after = system.work[4], start.shape[0] - n * size, system.work[1]
    for i in range(n):
        y[i] = start[i]
    for k in range(free):
        for i in range(n):
            varied[k, i] = 0.0
    wanted = maps[: 2 if size > 0 else 0]
    advance(motion, mode, t, h, rate, spread, y, varied, wanted, system)
    for i in range(n):
        end[i] = y[i]
    if first > n:
        end[n] = motion.observe(c, t + h, end[:n], p, room.none, room.empty)
    if size > 0:
        before = system.work[0]
        start_waves(system, t)
        motion.rates(mode, system.co, start[:n], system.waves[0], system.waves[1], before)
        start_waves(system, t + h)
        motion.rates(mode, system.co, y, system.waves[0], system.waves[1], after)
        for i in range(n):
            for j in range(size):  # the derivatives so far, carried on, and what this step adds
                total = 0.0
                if j == 0:
                    total = after[i]
                    for k in range(n):
                        total -= maps[0, k, i] * before[k]
                elif j > n:
                    total = varied[j - n - 1, i]
                for k in range(n):
                    total += maps[0, k, i] * start[first + k * size + j]
                end[first + i * size + j] = total
    return length


@helper
def linear_attempt(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Step from ``room.start`` to ``room.end``; return the error in units of what is allowed."""
    length = linear_step(motion, mode, c, t, h, p, which, room, room.end, False)
    return length**POWER


@helper
def linear_probe(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Write the vector at t + h, within the last step, to ``room.trial``."""
    linear_step(motion, mode, c, t, h, p, which, room, room.trial, True)
    return True


@helper
def explicit_or_linear(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Step by the closed form where there is one (a method)."""
    if motion.closed(mode):
        return linear_attempt(motion, mode, c, t, h, p, which, room)
    return explicit(motion, mode, c, t, h, p, which, room)


@helper
def explicit_or_linear_probe(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Probe by the closed form where there is one."""
    if motion.closed(mode):
        return linear_probe(motion, mode, c, t, h, p, which, room)
    return explicit_probe(motion, mode, c, t, h, p, which, room)


@helper
def automatic_or_linear(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Step by the closed form where there is one (a method)."""
    if motion.closed(mode):
        return linear_attempt(motion, mode, c, t, h, p, which, room)
    return automatic(motion, mode, c, t, h, p, which, room)


@helper
def automatic_or_linear_probe(motion, mode, c, t, h, p, which, room):  # type: ignore[no-untyped-def]
    """Probe by the closed form where there is one."""
    if motion.closed(mode):
        return linear_probe(motion, mode, c, t, h, p, which, room)
    return automatic_probe(motion, mode, c, t, h, p, which, room)
