"""The ways in which following a solution can end, and the results written for each; compiled.

A motion that becomes periodic, and one that is averaged, end in :mod:`contfric.chaos.cells`. Here are those
that come to rest, that no surface cuts any more, and that have no exponents.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.bvp.cyclic import dense_solve
from contfric.bvp.spectrum import spectrum
from contfric.chaos.averaging import close_periods, grows, mean_rate, sign_of
from contfric.chaos.tangent import is_autonomous
from contfric.compiled import helper
from contfric.simulation.march import HELD, IMPOSSIBLE, INFINITE, TOO_LARGE

#: The solutions, by their numbers in :class:`contfric.chaos.status.Motion`; 8 and 9 are given elsewhere.
PERIODIC, TRANSIENT, CHAOTIC, SETTLING, UNDECIDED, AT_REST, UNBOUNDED, NO_MOTION = range(8)
BROKEN, CHATTERS, UNCUT = range(10, 13)
#: Periods (units of time without excitation) after which a solution that meets no surface any more is
#: at rest, if it moves by less than this (relative) in one more.
_SETTLES, _STILL = 1e4, 1e-9
#: An equilibrium is corrected this often, by at most this (relative): the solution is near it.
_CORRECTIONS, _NEARBY = 4, 1e-3
#: An equilibrium that attracts, to the accuracy of its exponents.
_ATTRACTS = 1e-8
#: A multiplier of a mode's flow below this share of the largest is taken from a shorter time: the
#: integration leaves 1e-12. Most times tried, each a quarter of the one before: rates up to 1e11.
_LARGE_ENOUGH, _TIMES = 1e-2, 20
#: Exponents of two modes that differ by more than this (relative) are not those of one smooth field.
_SAME = 1e-6
#: Speed (relative to 1 + state) below which modes are compared at an equilibrium.
_SLOW = 1e-4


@helper
def write_nothing(motion, rows, cell):  # type: ignore[no-untyped-def]
    """Write that there are no exponents."""
    for k in range(rows.exponents.shape[1]):
        rows.exponents[cell, k], rows.errors[cell, k] = np.nan, np.nan
    rows.motions[cell] = motion


@helper
def write_means(averages, live, rows, cell):  # type: ignore[no-untyped-def]
    """Write the averaged exponents, their errors, and what they say of the motion."""
    for k in range(rows.exponents.shape[1]):
        rate, error = -np.inf, 0.0
        if k < live:
            rate, error = mean_rate(averages, k)
        rows.exponents[cell, k], rows.errors[cell, k] = rate, error
    sign = sign_of(averages, rows.exponents[cell, 0], rows.errors[cell, 0]) if live > 0 else 0
    rows.motions[cell] = CHAOTIC if sign > 0 else (SETTLING if sign < 0 else UNDECIDED)


@helper
def averaged(averages, live, turns, over, tolerance, rows, cell):  # type: ignore[no-untyped-def]
    """Close some periods; return whether the average is good enough, or over, and written."""
    filled = close_periods(averages, turns)
    if filled and not over:
        rate, error = mean_rate(averages, 0)
        # a solution whose exponent is negative may yet converge
        over = error <= tolerance * rate and sign_of(averages, rate, error) > 0
    if over:
        write_means(averages, live, rows, cell)
        if grows(averages):
            write_nothing(UNBOUNDED, rows, cell)
    return over


@helper
def flow_spectrum(functions, rank, mode, t, p, time, transit, cycle, rows):  # type: ignore[no-untyped-def]
    """Write the multipliers of a mode's flow over some time to ``cycle.mu``."""
    n = transit.y.shape[0]
    functions.flow(mode, t, transit.y, time, p, rows.turns[:0], transit.end, transit.jac)
    for i in range(n):
        for j in range(n):
            cycle.work[i, j] = transit.jac[i, 1 + j]
    spectrum(cycle.work[:n, :n], rank, cycle.mu, cycle.real, cycle.left, cycle.product)


@helper
def write_period(functions, rank, mode, t, p, period, transit, cycle, rows, cell):  # type: ignore[no-untyped-def]
    """Write the exponents of a mode that is never left: those of its flow over one period."""
    flow_spectrum(functions, rank, mode, t, p, period, transit, cycle, rows)
    for k in range(transit.y.shape[0]):
        size = abs(cycle.mu[k]) if k < rank else 0.0
        rows.exponents[cell, k] = math.log(size) / period if size > 0.0 else -np.inf
        rows.errors[cell, k] = 0.0


@helper
def write_rates(functions, rank, mode, t, p, transit, cycle, rows, cell):  # type: ignore[no-untyped-def]
    """Write the exponents of an equilibrium of a mode, each from a time in which it does not vanish."""
    for k in range(transit.y.shape[0]):
        rows.exponents[cell, k], rows.errors[cell, k] = -np.inf, 0.0
    known, time = 0, 1.0
    for _ in range(_TIMES):
        flow_spectrum(functions, rank, mode, t, p, time, transit, cycle, rows)
        while known < rank and abs(cycle.mu[known]) > _LARGE_ENOUGH * abs(cycle.mu[0]):
            rows.exponents[cell, known] = math.log(abs(cycle.mu[known])) / time
            known += 1
        if known == rank:
            return
        time *= 0.25


@helper
def refine(functions, mode, t, p, transit, cycle, rows):  # type: ignore[no-untyped-def]
    """Move ``transit.y`` to the equilibrium of a mode near it, where there is one and no continuum."""
    n = transit.y.shape[0]
    for _ in range(_CORRECTIONS):
        functions.flow(mode, t, transit.y, 1.0, p, rows.turns[:0], transit.end, transit.jac)
        for i in range(n):
            for j in range(n):
                cycle.left[i, j] = (1.0 if i == j else 0.0) - transit.jac[i, 1 + j]
            cycle.right[i, 0] = transit.end[i] - transit.y[i]
        if not dense_solve(cycle.left[:n, :n], cycle.right[:n]):
            return
        for i in range(n):
            if not abs(cycle.right[i, 0]) <= _NEARBY * (1.0 + abs(transit.y[i])):
                return
        for i in range(n):
            transit.y[i] += cycle.right[i, 0]


@helper
def write_equilibrium(functions, tables, ranks, mode, t, p, transit, cycle, rows, cell):  # type: ignore[no-untyped-def]
    """Write the exponents of the equilibrium near ``transit.y``; tell whether it attracts.

    It may lie on a surface. If the fields of two modes vanish there, but their derivatives differ, no
    matrix has its exponents, and none are written.
    """
    n = transit.y.shape[0]
    refine(functions, mode, t, p, transit, cycle, rows)
    write_rates(functions, ranks[mode] + 1, mode, t, p, transit, cycle, rows, cell)
    if not rows.exponents[cell, 0] <= _ATTRACTS:
        return False
    rows.motions[cell] = AT_REST
    for k in range(n):  # kept, as the workspace of the other modes is the row itself
        cycle.rates[k] = rows.exponents[cell, k]
    smooth = True
    for other in range(ranks.shape[0]):
        if other == mode or tables.sliding[other] != 0:
            continue
        if speed(functions, other, t, p, transit, rows) > _SLOW:
            continue
        write_rates(functions, ranks[other] + 1, other, t, p, transit, cycle, rows, cell)
        for k in range(n):
            apart = abs(rows.exponents[cell, k] - cycle.rates[k])
            smooth = smooth and apart <= _SAME * (1.0 + abs(cycle.rates[k]))
    for k in range(n):
        rows.exponents[cell, k] = cycle.rates[k]
    if not smooth:
        write_nothing(AT_REST, rows, cell)
    return True


@helper
def speed(functions, mode, t, p, transit, rows):  # type: ignore[no-untyped-def]
    """Return how fast a state changes in a mode, relative to 1 + its size."""
    n, fastest = transit.y.shape[0], 0.0
    functions.flow(mode, t, transit.y, 0.0, p, rows.turns[:0], transit.end, transit.jac)
    for j in range(n):
        share = abs(transit.jac[j, 1 + n]) / (1.0 + abs(transit.y[j]))
        fastest = share if not share <= fastest else fastest
    return fastest


@helper
def starts_at_rest(functions, tables, ranks, mode, t, p, transit, cycle, rows, cell):  # type: ignore[no-untyped-def]
    """Write the exponents of an equilibrium that a solution starts on; tell whether it is one.

    In a mode, or in any where none is known (-1): on a surface that nothing leaves. What slides is held.
    """
    for k in range(ranks.shape[0]):
        own = tables.sliding[k] == 0 and mode in (k, -1)
        if own and speed(functions, k, t, p, transit, rows) == 0.0:
            write_equilibrium(functions, tables, ranks, k, t, p, transit, cycle, rows, cell)
            rows.motions[cell] = AT_REST  # even if it repels
            return True
    return False


@helper
def write_quiet(functions, tables, ranks, mode, t, p, period, transit, cycle, rows, cell):  # type: ignore[no-untyped-def]
    """Write what a solution is that no surface cuts any more: at rest, of one period, or nothing."""
    n, excited = transit.y.shape[0], not is_autonomous(transit)
    functions.flow(
        mode, t, transit.y, _SETTLES * period, p, rows.turns[:0], transit.image, transit.jac[:0]
    )
    for j in range(n):
        transit.y[j] = transit.image[j]
    functions.flow(mode, t, transit.y, period, p, rows.turns[:0], transit.end, transit.jac)
    still, large = True, False
    for j in range(n):
        still = still and abs(transit.end[j] - transit.y[j]) <= _STILL * (1.0 + abs(transit.y[j]))
        large = large or abs(transit.y[j]) > TOO_LARGE
    if not still:
        broken = math.isnan(transit.end[0])
        write_nothing(UNBOUNDED if large else (BROKEN if broken else UNCUT), rows, cell)
    elif excited:
        write_period(functions, ranks[mode], mode, t, p, period, transit, cycle, rows, cell)
        rows.motions[cell], rows.turns[cell] = PERIODIC, 1
    elif not write_equilibrium(functions, tables, ranks, mode, t, p, transit, cycle, rows, cell):
        write_nothing(UNCUT, rows, cell)


@helper
def write_end(functions, outcome, ranks, mode, t, p, period, transit, cycle, rows, cell):  # type: ignore[no-untyped-def]
    """Write what a solution is that did not come to another joint."""
    if outcome == HELD:  # in an autonomous model a rank counts no shift in time
        rank = ranks[mode] + (1 if is_autonomous(transit) else 0)
        write_period(functions, rank, mode, t, p, period, transit, cycle, rows, cell)
        rows.motions[cell] = AT_REST
        return
    motion = CHATTERS
    if outcome == IMPOSSIBLE:
        motion = NO_MOTION
    elif outcome == INFINITE:
        motion = UNBOUNDED
    elif outcome == BROKEN:
        motion = BROKEN
    write_nothing(motion, rows, cell)
