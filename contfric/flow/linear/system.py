"""The system of an affine mode at some parameters, in a workspace that is allocated once a call.

With the cosines and sines of all frequencies as further states the system is linear and autonomous. Its
coefficients (:mod:`contfric.models.generated.linear_code`) are evaluated once a call; the *rate* of the
system, a bound of how fast its Taylor terms grow, follows from a norm of the matrix in units of the states
that make it small (Osborne's iteration) and from the frequencies whose factors are not zero.

A sweep changes all units at once: each by the fourth root of the ratio of its row to its column. By the
square root, as where one unit is changed at a time, both units of a pair such as a position and its velocity
would take the whole step, and miss by as much as before: a beam took four times as many steps as it needs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contfric.compiled import inlined_helper

FloatArray = NDArray[np.float64]

#: Sweeps of Osborne's iteration: units need to be right to a factor only.
_SWEEPS = 3
#: What stands for a row or a column without entries, against the other (a rigid body): a unit changes by ten.
_FREE = 1e-4
#: Largest ratio that a sweep takes: three of them spread units by 1e12, what the terms of a series allow for.
_FARTHEST = 1e8
#: Most terms of a series: three units of time over the rate need 30, derivatives by parameters more.
TERMS = 40
#: One over each whole number.
INVERSE = np.array([0.0] + [1.0 / k for k in range(1, TERMS + 3)])
#: What a series may leave out, relative to its largest value.
_LEFT_OUT = 1e-17
#: Terms beyond these: one for the derivative by a frequency, one for the parity of oscillations.
_MORE = 2
#: Longest step, in units of 1 / rate: a longer one amplifies rounding, a shorter one costs more.
REACH = 3.0
#: Lengths that the numbers of terms are tabulated for.
_PARTS = 16


def _terms(reach: float) -> int:
    size, k = 1.0, 1
    while size > _LEFT_OUT:
        size *= reach / k
        k += 1
    return k + _MORE


#: Numbers of terms for the lengths 0, 1/16, 2/16 ...
_TABLE = np.array([_terms(j / _PARTS) for j in range(int(1.1 * REACH * _PARTS) + 2)])


class LinearSystem(NamedTuple):
    """An affine mode at some parameters, with space for its series.

    Attributes
    ----------
    co, slopes : coefficients of the mode, (entries,), and their derivatives, (parameters, entries)
    w, dw : frequencies, (waves,), and their derivatives, (parameters, waves)
    waves : cosines and sines at the start of a step, their derivatives by the frequencies, zeros, whether
        their factors differ from zero, and the derivatives by time, (8, waves)
    work : workspace for n numbers, and the derivative by the time of the start, (6, n)
    series, other : Taylor terms of the state, and of another column, (TERMS + 1, n)
    varied : derivatives by the parameters, (parameters, n)
    maps : exp(A d) of a solution, and of a step, (2 n, n); (0, n) where no derivatives are wanted
    scratch : space for the coefficients of a unit force, (entries,)
    """

    co: FloatArray
    slopes: FloatArray
    w: FloatArray
    dw: FloatArray
    waves: FloatArray
    work: FloatArray
    series: FloatArray
    other: FloatArray
    varied: FloatArray
    maps: FloatArray
    scratch: FloatArray


#: Rows of waves, and of work.
WAVES, _WORK = 8, 6


@inlined_helper
def rows_of(free, maps):  # type: ignore[no-untyped-def]
    """Return how many rows of n numbers a system needs, with columns of derivatives and further rows."""
    return _WORK + 2 * (TERMS + 1) + free + maps


@inlined_helper
def system_in(coefficients, waves, rows, free):  # type: ignore[no-untyped-def]
    """Return the workspace for a system with ``free`` parameters, within three arrays.

    Parameters
    ----------
    coefficients, waves, rows : shapes (2 + free, entries), (1 + free + WAVES, waves) and (rows, n)
    """
    for k in range(1 + free):
        for j in range(coefficients.shape[1]):
            coefficients[k, j] = 0.0
    for k in range(waves.shape[0]):
        for j in range(waves.shape[1]):
            waves[k, j] = 0.0
    a = _WORK + TERMS + 1
    return LinearSystem(
        coefficients[0],
        coefficients[1 : 1 + free],
        waves[0],
        waves[1 : 1 + free],
        waves[1 + free :],
        rows[:_WORK],
        rows[_WORK:a],
        rows[a : a + TERMS + 1],
        rows[a + TERMS + 1 : a + TERMS + 1 + free],
        rows[a + TERMS + 1 + free :],
        coefficients[coefficients.shape[0] - 1],
    )


@inlined_helper
def growth(motion, piece, system):  # type: ignore[no-untyped-def]
    """Return a norm of the matrix in balanced units, and the largest ratio of these units."""
    units, row, column, own = system.work[0], system.work[1], system.work[2], system.work[3]
    n = units.shape[0]
    for i in range(n):
        units[i] = 1.0
    for sweep in range(_SWEEPS + 1):
        for i in range(n):
            row[i] = column[i] = own[i] = 0.0
        motion.sums(piece, system.co, units, row, column, own)
        if n == 2 and row[0] > 0.0 and row[1] > 0.0:
            ratio = math.sqrt(row[0] / row[1])
            return max(own[0], own[1]) + ratio * row[1], max(ratio, 1.0 / ratio)
        if sweep == _SWEEPS:
            break
        unchanged = True
        for i in range(n):
            r, c = row[i] / units[i], column[i] * units[i]
            if not (r > 0.0 or c > 0.0):
                continue
            ratio = (r if r > 0.0 else _FREE * c) / (c if c > 0.0 else _FREE * r)
            if not 0.25 < ratio < 4.0:
                unchanged = False
                units[i] *= math.sqrt(math.sqrt(min(max(ratio, 1.0 / _FARTHEST), _FARTHEST)))
        if unchanged:
            break
    rows, columns, low, high = 0.0, 0.0, math.inf, 0.0
    for i in range(n):
        rows = max(rows, row[i] / units[i] + own[i])
        columns = max(columns, column[i] * units[i] + own[i])
        low, high = min(low, units[i]), max(high, units[i])
    return min(rows, columns), high / low


@inlined_helper
def evaluate(motion, piece, p, which, system):  # type: ignore[no-untyped-def]
    """Evaluate the coefficients and the frequencies."""
    motion.entries(piece, p, which, system.co, system.slopes)
    motion.frequencies(p, which, system.w, system.dw)
    audible = system.waves[5]
    motion.audible(piece, system.co, audible)
    for k in range(system.slopes.shape[0]):
        motion.audible(piece, system.slopes[k], audible)


@inlined_helper
def set_up(motion, piece, p, which, system):  # type: ignore[no-untyped-def]
    """Evaluate the coefficients; return the rate of the matrix and the spread of its units."""
    evaluate(motion, piece, p, which, system)
    return growth(motion, piece, system)


@inlined_helper
def silenced(rate, system):  # type: ignore[no-untyped-def]
    """Silence the harmonics whose factors are zero; return the rate with the others."""
    audible = system.waves[5]
    for j in range(audible.shape[0]):
        if audible[j] == 0.0:
            system.w[j] = 0.0
            for k in range(system.dw.shape[0]):
                system.dw[k, j] = 0.0
        rate = max(rate, abs(system.w[j]))
    return rate


@inlined_helper
def terms_for(reach, spread):  # type: ignore[no-untyped-def]
    """Return how many Taylor terms leave less than rounding, for rate times duration."""
    k = _TABLE[min(int(reach * _PARTS) + 1, _TABLE.shape[0] - 1)]
    while spread > 1.0 and k < TERMS:  # a smaller unit than the largest asks for more
        spread *= reach / k
        k += 1
    return k


@inlined_helper
def start_waves(system, t):  # type: ignore[no-untyped-def]
    """Write the cosines and sines at a time, and their derivatives by the frequencies and by time."""
    waves, w = system.waves, system.w
    for j in range(w.shape[0]):
        c, s = 1.0, 0.0
        if w[j] != 0.0:
            c, s = math.cos(w[j] * t), math.sin(w[j] * t)
        waves[0, j], waves[1, j] = c, s
        waves[2, j], waves[3, j] = -t * s, t * c
        waves[6, j], waves[7, j] = -w[j] * s, w[j] * c


@inlined_helper
def sum_of(series, terms, out):  # type: ignore[no-untyped-def]
    """Write the sum of a series, its smallest terms first."""
    for i in range(out.shape[0]):
        out[i] = series[terms, i]
    for k in range(terms - 1, -1, -1):
        row = series[k]
        for i in range(out.shape[0]):  # neighbours in memory are added together
            out[i] += row[i]
