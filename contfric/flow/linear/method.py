"""The closed form as a method of the integrator, for what its own search does not know.

An observable that is not affine, and a motion through kinks, are searched step by step as along an integrated
motion (:mod:`contfric.flow.stepping`); the steps of an affine mode are then its closed form. They have no
error; their length is limited so that the certificates of the search hold.
"""

from __future__ import annotations

from contfric.compiled import allocating_helper, helper
from contfric.flow.dop853 import POWER
from contfric.flow.linear.flow import REACH, advance
from contfric.flow.linear.system import make_system, set_up, silenced
from contfric.flow.stepping import explicit, explicit_probe
from contfric.flow.stiffness import automatic, automatic_probe


@allocating_helper
def linear_step(motion, mode, c, t, h, p, which, room, end, free_length):  # type: ignore[no-untyped-def]
    """Write the vector after a step from ``room.start``; return its length against the longest one."""
    n, size = room.scales.shape[0], room.partial.shape[1]
    columns = 1 + size if size > 0 else 1
    free = which.shape[0] if size > 0 else 0
    system = make_system(n, motion.entries_count, motion.waves_count, columns, free, 0)
    rate, _ = set_up(motion, mode, p, which, columns, system)
    length = silenced(rate, system) * abs(h) / REACH
    if length > 1.0 and not free_length:
        return length
    start = room.start
    first = start.shape[0] - n * size
    for i in range(n):
        system.now[0, i] = start[i]
        for j in range(size):
            system.now[1 + j, i] = start[first + i * size + j]
    if not advance(motion, mode, t, h, p, which, columns, system):
        return length
    for i in range(n):
        end[i] = system.now[0, i]
        for j in range(size):
            end[first + i * size + j] = system.now[1 + j, i]
    if first > n:
        end[n] = motion.observe(c, t + h, end[:n], p, room.none, room.empty)
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
