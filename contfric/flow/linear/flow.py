"""The state of an affine mode after a duration, with derivatives, by Taylor's series.

The series of ``y' = A y + b(t)`` needs products with A only, whose entries that are zero cost nothing::

    y_{k+1} = h / (k + 1) (A y_k + b_k),

and the terms of cosines and sines follow in the same way. Nothing happens at a resonance, at a defective
or a singular matrix. Within three units of ``rate * h`` 30 terms leave less than rounding, and rounding is
hardly amplified; a long duration is cut into steps of that kind, of the same length. The derivatives are::

    by y0: E = exp(A d),  by t0: z' = A z + b'(t),  by p: z' = A z + A_p y + b_p(t),  by d: y'(t0 + d).
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import allocating_helper, inlined_helper
from contfric.flow.folding import folded
from contfric.flow.linear.system import (
    REACH,
    WAVES,
    rows_of,
    set_up,
    silenced,
    start_waves,
    sum_of,
    system_in,
    terms_for,
)

#: States up to which the exponential is carried on by its series, which errs less than products do: these
#: repeat the rounding of one step.
_SMALL = 6
#: Most steps of a segment, a second of computation: it takes one to a hundred. Iterates of Newton's method
#: on their way to nowhere ask for any number.
MOST_STEPS = 2_000_000


@inlined_helper
def carry_by_series(motion, piece, h, terms, system, columns):  # type: ignore[no-untyped-def]
    """Multiply columns (rows of an array) by exp(A h)."""
    if motion.carries != 0:
        motion.carry(piece, system.co, h, terms, columns)
        return
    silence = system.waves[4]
    for j in range(columns.shape[0]):
        motion.expand(
            piece, system.co, columns[j], silence, silence, silence, h, terms, system.other
        )
        sum_of(system.other, terms, columns[j])


@inlined_helper
def carry_by_product(step, columns, work):  # type: ignore[no-untyped-def]
    """Multiply columns (rows of an array) by a matrix whose columns are the rows of ``step``."""
    n = work.shape[0]
    for row in range(columns.shape[0]):
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += step[j, i] * columns[row, j]
            work[i] = total
        for i in range(n):
            columns[row, i] = work[i]


@inlined_helper
def advance(motion, piece, t0, dt, rate, spread, y, system):  # type: ignore[no-untyped-def]
    """Advance a state, and its derivatives where there is space for the exponential."""
    waves, varied, by_start, n = system.waves, system.varied, system.work[5], y.shape[0]
    steps = max(1, math.ceil(rate * abs(dt) / REACH))
    h = dt / steps
    terms = terms_for(rate * abs(h), spread)
    maps = system.maps.shape[0] > 0
    products = n > _SMALL and steps > 1
    if maps:
        for i in range(n):
            by_start[i] = 0.0
            for j in range(n):
                system.maps[i, j] = 1.0 if i == j else 0.0
        if products:
            for i in range(n):
                for j in range(n):
                    system.maps[n + i, j] = 1.0 if i == j else 0.0
            carry_by_series(motion, piece, h, terms, system, system.maps[n:])
    for k in range(steps):
        start_waves(system, t0 + k * h)
        motion.expand(piece, system.co, y, waves[0], waves[1], system.w, h, terms, system.series)
        for j in range(varied.shape[0]):
            motion.vary(
                piece, system.co, system.slopes[j], varied[j], waves, system.w, system.dw[j], h,
                terms, system.series, system.other,
            )  # fmt: skip
            sum_of(system.other, terms, varied[j])
        sum_of(system.series, terms, y)
        if maps:
            motion.expand(
                piece, system.co, by_start, waves[6], waves[7], system.w, h, terms, system.other
            )
            sum_of(system.other, terms, by_start)
            if products:
                carry_by_product(system.maps[n:], system.maps[:n], system.work[0])
            else:
                carry_by_series(motion, piece, h, terms, system, system.maps[:n])


@inlined_helper
def flow_in(motion, piece, t, y0, dt, p, which, y1, jac, workspace):  # type: ignore[no-untyped-def]
    """Advance a state from a folded time, in a workspace that is given."""
    n, free = y0.shape[0], which.shape[0]
    system = system_in(workspace[0], workspace[1], workspace[2], free)
    rate, spread = set_up(motion, piece, p, which, system)
    rate = silenced(rate, system)
    fine = rate * abs(dt) < REACH * MOST_STEPS  # not so where it is no number
    for i in range(n):
        y1[i] = y0[i] if fine else math.nan
        for k in range(free):
            system.varied[k, i] = 0.0
    if fine:
        advance(motion, piece, t, dt, rate, spread, y1, system)
    if jac.shape[0] == 0:
        return
    slope = system.work[0]
    start_waves(system, t + dt)
    motion.rates(piece, system.co, y1, system.waves[0], system.waves[1], slope)
    for i in range(n):
        jac[i, 0], jac[i, 1 + n] = system.work[5, i], slope[i]
        for j in range(n):
            jac[i, 1 + j] = system.maps[j, i]
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
    coefficients = np.empty((1 + free, motion.entries_count))
    waves = np.empty((1 + free + WAVES, motion.waves_count))
    rows = np.empty((rows_of(free, 2 * n if full else 0), n))
    grad = np.empty(free)
    period = motion.period(p, wanted, grad)
    cycles = folded(t0, period)
    workspace = (coefficients, waves, rows)
    flow_in(motion, piece, t0 - cycles * period, y0, dt, p, wanted, y1, jac, workspace)
    if cycles != 0.0:
        for i in range(jac.shape[0]):
            for k in range(free):
                jac[i, 2 + n + k] -= cycles * grad[k] * jac[i, 0]
