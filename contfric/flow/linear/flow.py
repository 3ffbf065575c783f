"""The state of an affine mode after a duration, with derivatives, by Taylor's series.

The series of ``y' = A y + b(t)`` needs products with A only, whose entries that are zero cost nothing::

    y_{k+1} = h / (k + 1) (A y_k + b_k),

and the terms of cosines and sines follow in the same way. Nothing happens at a resonance, at a defective
or a singular matrix. Within three units of ``rate * h`` 30 terms leave less than rounding, and rounding is
hardly amplified; a long duration is cut into steps of that kind, of the same length. The derivatives are::

    by y0: E = exp(A d),  by t0: z' = A z + b'(t),  by p: z' = A z + A_p y + b_p(t),  by d: y'(t0 + d).

Of many states most of a solution is kept from call to call (:mod:`contfric.flow.linear.kept`).
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import allocating_helper, inlined_helper
from contfric.compiling.shared import numbers_at, unlock
from contfric.flow.folding import folded
from contfric.flow.linear.kept import NUMBERS, advance_kept, growth_known, locked, space_of
from contfric.flow.linear.responses import pairs_space
from contfric.flow.linear.steps import SMALL, advance, exponential
from contfric.flow.linear.system import (
    REACH,
    WAVES,
    evaluate,
    growth,
    rows_of,
    silenced,
    start_waves,
    system_in,
)

#: Most steps of a segment, a second of computation: it takes one to a hundred. Iterates of Newton's method
#: on their way to nowhere ask for any number.
MOST_STEPS = 2_000_000


@inlined_helper
def flow_in(motion, piece, t, y0, dt, p, which, y1, jac, workspace):  # type: ignore[no-untyped-def]
    """Advance a state from a folded time, in a workspace that is given."""
    n, free = y0.shape[0], which.shape[0]
    system = system_in(workspace[0], workspace[1], workspace[2], free)
    memory = workspace[3]
    evaluate(motion, piece, p, which, system)
    if memory.shape[0] > 0:
        grown, spread = growth_known(motion, piece, memory, system)
    else:
        grown, spread = growth(motion, piece, system)
    rate = silenced(grown, system)
    fine = rate * abs(dt) < REACH * MOST_STEPS  # not so where it is no number
    for i in range(n):
        y1[i] = y0[i] if fine else math.nan
        for k in range(free):
            system.varied[k, i] = 0.0
    if fine:
        full = jac.shape[0] > 0
        if not (
            memory.shape[0] > 0
            and advance_kept(
                motion, piece, t, dt, rate, spread, grown, y1, memory, workspace[4], system
            )
        ):
            advance(motion, piece, t, dt, rate, spread, y1, system)
            if full:
                exponential(motion, piece, dt, rate, spread, system)
    if jac.shape[0] == 0:
        return
    slope = system.work[0]
    start_waves(system, t + dt)
    motion.rates(piece, system.co, y1, system.waves[0], system.waves[1], slope)
    for i in range(n):
        jac[i, 0], jac[i, 1 + n] = system.work[5, i], slope[i]
        for j in range(n):
            jac[i, 1 + j] = system.maps[i, j]
        for k in range(free):
            jac[i, 2 + n + k] = system.varied[k, i]


@allocating_helper
def linear_flow(motion, piece, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Advance a state by ``dt``, with derivatives where ``jac`` has space (``flow_signature``).

    The phase is folded into one period; the fold depends on the parameters as the period does.
    """
    n, full = y0.shape[0], jac.shape[0] > 0
    free = which.shape[0] if full else 0
    wanted = which[:free]
    coefficients = np.empty((2 + free, motion.entries_count))
    waves = np.empty((1 + free + WAVES, motion.waves_count))
    rows = np.empty((rows_of(free, 2 * n if full else 0), n))
    grad = np.empty(free)
    period = motion.period(p, wanted, grad)
    cycles = folded(t0, period)
    keeps = full and n > SMALL
    taken = keeps and locked(motion.memory)
    space = space_of(n, coefficients.shape[1], waves.shape[1]) if keeps and not taken else 0
    memory = numbers_at(motion.memory, NUMBERS) if taken else np.zeros(space)
    pairs = np.empty(pairs_space(n, motion.waves_count, free) if keeps else 0)
    workspace = (coefficients, waves, rows, memory, pairs)
    flow_in(motion, piece, t0 - cycles * period, y0, dt, p, wanted, y1, jac, workspace)
    if taken:
        unlock(motion.memory)
    if cycles != 0.0:
        for i in range(jac.shape[0]):
            for k in range(free):
                jac[i, 2 + n + k] -= cycles * grad[k] * jac[i, 0]
