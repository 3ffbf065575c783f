"""The state of an affine mode after a duration, with derivatives, by Taylor's series.

The series of ``y' = A y + b(t)`` needs products with A only, whose entries that are zero cost nothing::

    y_{k+1} = h / (k + 1) (A y_k + b_k),

and the terms of cosines and sines follow in the same way. Nothing happens at a resonance, at a defective
or a singular matrix. Within two units of ``rate * h`` 25 terms leave less than rounding, and rounding is not
amplified; a long duration is cut into such steps. The derivatives are columns of the same kind::

    by t0:  z' = A z + b'(t),      by y0:  z' = A z,      by p:  z' = A z + A_p y + b_p(t).
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.flow.folding import folded
from contfric.flow.linear.system import (
    make_system,
    next_waves,
    set_up,
    silenced,
    start_waves,
    terms_for,
)

#: Longest step, in units of 1 / rate: a longer one amplifies rounding, a shorter one costs more.
REACH = 2.0
#: Most steps of a segment, a second of computation: it takes one to a hundred. Iterates of Newton's method
#: on their way to nowhere ask for any number.
MOST_STEPS = 2_000_000


@helper
def next_terms(motion, piece, which, factor, columns, system):  # type: ignore[no-untyped-def]
    """Replace the Taylor terms of all columns by the next ones, and add them up."""
    term, now, waves, out = system.term, system.now, system.waves, system.work[4]
    n, free = out.shape[0], which.shape[0]
    cosine, sine = waves[0], waves[1]
    for column in range(columns - 1, -1, -1):
        motion.product(piece, system.co, term[column], out)
        if column == 0:
            motion.load(piece, system.co, cosine, sine, out)
        elif column == 1:
            a, b = waves[4], waves[5]
            for j in range(a.shape[0]):
                a[j], b[j] = -system.w[j] * sine[j], system.w[j] * cosine[j]
            motion.load(piece, system.co, a, b, out)
        elif column >= 2 + n:
            k, extra, a, b = column - 2 - n, system.work[3], waves[4], waves[5]
            motion.product(piece, system.slopes[k], term[0], extra)
            motion.load(piece, system.slopes[k], cosine, sine, extra)
            for j in range(a.shape[0]):
                a[j], b[j] = system.dw[k, j] * waves[2, j], system.dw[k, j] * waves[3, j]
            motion.load(piece, system.co, a, b, extra)
            for i in range(n):
                out[i] += extra[i]
        for i in range(n):
            term[column, i] = factor * out[i]
            now[column, i] += term[column, i]
    next_waves(system, factor, columns > 1 and free > 0)


@helper
def step(motion, piece, t, h, terms, which, columns, system):  # type: ignore[no-untyped-def]
    """Advance all columns by h from time t."""
    start_waves(system, t)
    for column in range(columns):
        for i in range(system.now.shape[1]):
            system.term[column, i] = system.now[column, i]
    for k in range(1, terms + 1):
        next_terms(motion, piece, which, h / k, columns, system)


@helper
def rates_at(motion, piece, t, y, system, out):  # type: ignore[no-untyped-def]
    """Write the field at a state."""
    start_waves(system, t)
    motion.product(piece, system.co, y, out)
    motion.load(piece, system.co, system.waves[0], system.waves[1], out)


@helper
def advance(motion, piece, t0, dt, p, which, columns, system):  # type: ignore[no-untyped-def]
    """Advance the columns by a duration of either sign; tell whether that is possible."""
    rate, spread = set_up(motion, piece, p, which, columns, system)
    rate = silenced(rate, system)
    reach = rate * abs(dt)
    if not reach < REACH * MOST_STEPS:
        return False
    steps = max(1, math.ceil(reach / REACH))
    h = dt / steps
    terms = terms_for(rate * abs(h), spread)
    for k in range(steps):
        step(motion, piece, t0 + k * h, h, terms, which, columns, system)
    return True


@allocating_helper
def linear_flow(motion, piece, t0, y0, dt, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Advance a state by ``dt``, with derivatives where ``jac`` has room (``flow_signature``).

    The phase is folded into one period; the fold depends on the parameters as the period does.
    """
    n, full = y0.shape[0], jac.shape[0] > 0
    free = which.shape[0] if full else 0
    columns = 2 + n + free if full else 1
    system = make_system(n, motion.entries_count, motion.waves_count, columns, free, 0)
    grad = np.empty(free)
    wanted = which[:free]
    period = motion.period(p, wanted, grad)
    cycles = folded(t0, period)
    t = t0 - cycles * period
    now = system.now
    for i in range(n):
        now[0, i] = y0[i]
        if full:
            now[2 + i, i] = 1.0
    fine = advance(motion, piece, t, dt, p, wanted, columns, system)
    for i in range(n):
        y1[i] = now[0, i] if fine else math.nan
    if not full:
        return
    slope = system.work[0]
    rates_at(motion, piece, t + dt, y1, system, slope)
    for i in range(n):
        jac[i, 0] = now[1, i] if fine else math.nan
        jac[i, 1 + n] = slope[i]
        for j in range(n):
            jac[i, 1 + j] = now[2 + j, i]
        for k in range(free):
            jac[i, 2 + n + k] = now[2 + n + k, i] - cycles * grad[k] * now[1, i]
