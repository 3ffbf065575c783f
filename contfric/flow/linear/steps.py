"""Steps along an affine mode by Taylor's series (:mod:`contfric.flow.linear.flow`)."""

from __future__ import annotations

import math

from contfric.compiled import inlined_helper
from contfric.flow.linear.system import REACH, start_waves, sum_of, terms_for

#: States up to which the exponential is carried on by its series, which errs less than products do: these
#: repeat the rounding of one step. Beyond it exponentials are kept.
SMALL = 6


@inlined_helper
def carry_by_series(motion, piece, h, terms, system, columns):  # type: ignore[no-untyped-def]
    """Multiply the columns of a matrix by exp(A h)."""
    if motion.carries != 0:
        motion.carry(piece, system.co, h, terms, columns)
        return
    silence, column = system.waves[4], system.work[0]
    for j in range(columns.shape[1]):
        for i in range(columns.shape[0]):
            column[i] = columns[i, j]
        motion.expand(piece, system.co, column, silence, silence, silence, h, terms, system.other)
        sum_of(system.other, terms, column)
        for i in range(columns.shape[0]):
            columns[i, j] = column[i]


@inlined_helper
def carry_by_product(step, matrix, work):  # type: ignore[no-untyped-def]
    """Multiply a matrix by another one that commutes with it."""
    n = work.shape[0]
    for row in range(n):
        for j in range(n):
            work[j] = 0.0
        for i in range(n):
            for j in range(n):
                work[j] += matrix[row, i] * step[i, j]
        for j in range(n):
            matrix[row, j] = work[j]


@inlined_helper
def identity(matrix):  # type: ignore[no-untyped-def]
    """Write the identity."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] = 1.0 if i == j else 0.0


@inlined_helper
def step_over(motion, piece, t, h, terms, y, system):  # type: ignore[no-untyped-def]
    """Advance a state by one step, with its derivatives by the time of the start and by parameters."""
    waves, varied, by_start = system.waves, system.varied, system.work[5]
    start_waves(system, t)
    motion.expand(piece, system.co, y, waves[0], waves[1], system.w, h, terms, system.series)
    for j in range(varied.shape[0]):
        motion.vary(
            piece, system.co, system.slopes[j], varied[j], waves, system.w, system.dw[j], h,
            terms, system.series, system.other,
        )  # fmt: skip
        sum_of(system.other, terms, varied[j])
    sum_of(system.series, terms, y)
    if system.maps.shape[0] > 0:
        motion.expand(
            piece, system.co, by_start, waves[6], waves[7], system.w, h, terms, system.other
        )
        sum_of(system.other, terms, by_start)


@inlined_helper
def step_by_forces(motion, piece, first, t, h, terms, y, system):  # type: ignore[no-untyped-def]
    """Do the same where no parameter is in the matrix, whose coefficients end before ``first``.

    A derivative by a parameter of forces is then a motion of its own, which takes half as many products.
    """
    waves, varied, by_start = system.waves, system.varied, system.work[5]
    force, other = system.scratch, system.other
    start_waves(system, t)
    motion.expand(piece, system.co, y, waves[0], waves[1], system.w, h, terms, system.series)
    for q in range(varied.shape[0]):
        moves = False
        for j in range(system.dw.shape[1]):
            moves = moves or system.dw[q, j] != 0.0
        if moves:
            motion.vary(
                piece, system.co, system.slopes[q], varied[q], waves, system.w, system.dw[q], h,
                terms, system.series, other,
            )  # fmt: skip
        else:
            for k in range(force.shape[0]):
                force[k] = system.co[k] if k < first else system.slopes[q, k]
            motion.expand(piece, force, varied[q], waves[0], waves[1], system.w, h, terms, other)
        sum_of(other, terms, varied[q])
    sum_of(system.series, terms, y)
    motion.expand(piece, system.co, by_start, waves[6], waves[7], system.w, h, terms, other)
    sum_of(other, terms, by_start)


@inlined_helper
def steps_of(rate, spread, dt):  # type: ignore[no-untyped-def]
    """Return the number of equal steps of a duration, their length and the terms of their series."""
    steps = max(1, math.ceil(rate * abs(dt) / REACH))
    h = dt / steps
    return steps, h, terms_for(rate * abs(h), spread)


@inlined_helper
def advance(motion, piece, t0, dt, rate, spread, y, system):  # type: ignore[no-untyped-def]
    """Advance a state, with its derivatives by the time of the start and by parameters."""
    steps, h, terms = steps_of(rate, spread, dt)
    for i in range(y.shape[0]):
        system.work[5, i] = 0.0
    for k in range(steps):
        step_over(motion, piece, t0 + k * h, h, terms, y, system)


@inlined_helper
def exponential(motion, piece, dt, rate, spread, system):  # type: ignore[no-untyped-def]
    """Write exp(A dt) to the first rows of ``system.maps``."""
    n = system.work.shape[1]
    steps, h, terms = steps_of(rate, spread, dt)
    identity(system.maps[:n])
    if n > SMALL and steps > 1:
        identity(system.maps[n:])
        carry_by_series(motion, piece, h, terms, system, system.maps[n:])
        for _ in range(steps):
            carry_by_product(system.maps[n:], system.maps[:n], system.work[0])
        return
    for _ in range(steps):
        carry_by_series(motion, piece, h, terms, system, system.maps[:n])
