"""Integrals over segments of an orbit: where each begins, its gradient by joints and parameters, compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray
from contfric.bvp.after_reset import apply_reset
from contfric.compiled import allocating_helper, helper, indices, table, vector
from contfric.orbit.functionals.integral_parts import integral_workspace
from contfric.orbit.functionals.peak import extreme_workspace, fill_cycle
from contfric.quantities.tape import Tape

TapeType = types.NamedTuple([table, vector, indices, indices], Tape)


class Turn(NamedTuple):
    """The whole orbit that is integrated over.

    Attributes
    ----------
    own : workspace
    cycle : joints of all segments, shape (segments, m)
    last : period of the equations, 0 where time 0 is the end of a cycle; with its derivatives
    """

    own: Any
    cycle: FloatArray
    last: float
    d_period: FloatArray


@allocating_helper
def whole_turn(functions, layout, extreme, tape, z, p, which, images, columns):  # type: ignore[no-untyped-def]
    """Return the whole orbit with joints z, and a workspace; of ``images`` segments others are images."""
    length, m = extreme.whole.modes.shape[0], z.shape[1]
    d_period, none, last = np.zeros(which.shape[0]), np.empty(0, dtype=np.int64), 0.0
    own = integral_workspace(tape, length, m, p.shape[0], which, none, images, columns)
    orbit = extreme_workspace(length, m, min(length, 0))
    fill_cycle(functions, layout, extreme, z, p, orbit)
    if layout.turn != 0.0:
        last = layout.turn * functions.period(p, none, own.equations.empty)
        functions.period(p, own.exact.which, d_period)
    return Turn(own, orbit.cycle, last, d_period)


@helper
def add_to_joints(layout, whole, i, row, reset, on_joints, on_parameters, d_period):  # type: ignore[no-untyped-def]
    """Add the gradient of an integral over segment i of the whole orbit to that by the joints of one turn.

    Parameters
    ----------
    row : by start time, start state, duration, parameters and the extra one, after the value
    reset : derivatives of the reset in which the segment begins
    """
    count, m = on_joints.shape
    n, base, free = m - 1, i % count, d_period.shape[0]
    if whole.resets[i] >= 0:
        for k in range(free):
            for j in range(n):
                row[3 + n + k] += row[2 + j] * reset[j, 1 + n + k]
        for j in range(n):
            row[1] += row[2 + j] * reset[j, 0]
    for k in range(n):
        value = row[2 + k]
        if whole.resets[i] >= 0:
            value = 0.0
            for j in range(n):
                value += row[2 + j] * reset[j, 1 + k]
        if i < count:
            on_joints[base, 1 + k] += value
            continue
        for j in range(n):
            on_joints[base, 1 + j] += value * layout.closure[k, j]
    by_start, by_duration, by_turn = row[1], row[2 + n], 0.0
    on_joints[base, 0] += by_start - by_duration
    if layout.turn == 0.0 and i < count < whole.modes.shape[0]:
        on_joints[0, 0] += by_start  # the end of the whole orbit is at time 0
    if i >= count:
        by_turn += by_start
    if base + 1 < count:
        on_joints[base + 1, 0] += by_duration
    elif layout.turn != 0.0:
        on_joints[0, 0] += by_duration
        by_turn += by_duration
    for k in range(free):
        on_parameters[k] += row[3 + n + k] + by_turn * layout.turn * d_period[k]
    on_parameters[free] += row[3 + n + free]


@helper
def enter_segment(functions, whole, i, z, turn, joint, p, own):  # type: ignore[no-untyped-def]
    """Write the state at the start of segment i, after a reset in which it begins; return its duration."""
    count, n, reset = z.shape[0], z.shape[1] - 1, whole.resets[i] >= 0
    base = i % count
    end = z[base + 1, 0] if base + 1 < count else 0.0 if turn == 0.0 else z[0, 0] + turn
    if reset:
        apply_reset(functions, whole, i, joint, p, own.exact.which, own.equations)
    for j in range(n):
        own.begin[j] = own.equations.after_reset[n, j] if reset else joint[1 + j]
    return end - z[base, 0]
