"""The system of an affine mode at some parameters, in room that is allocated once a call.

With the cosines and sines of all frequencies as further states the system is linear and autonomous. Its
coefficients (:mod:`contfric.models.linear_code`) are evaluated once a call; the *rate* of the system, a bound
of how fast its Taylor terms grow, follows from a norm of the matrix in units of the states that make it small
(Osborne's iteration) and from the frequencies whose factors are not zero.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contfric.compiled import allocating_helper, helper

FloatArray = NDArray[np.float64]

#: Sweeps of Osborne's iteration: units need to be right to a factor only.
_SWEEPS = 3
#: Largest change of a unit in a sweep where nothing holds it on one side (a rigid body).
_FREE = 1e-2
#: Most terms of a series: two units of time over the rate need 25, their derivatives a few more.
TERMS = 40
#: Places of the waves: cosine, sine, their derivatives by the frequency, work.
_WAVES = 8


class System(NamedTuple):
    """An affine mode at some parameters, with room for its series.

    Attributes
    ----------
    co, slopes : coefficients of the mode, (entries,), and their derivatives, (parameters, entries)
    w, dw : frequencies, (waves,), and their derivatives, (parameters, waves)
    waves : Taylor terms of cosines and sines and of their derivatives by the frequencies, (8, waves)
    now, term : columns (state, and derivatives where they are wanted) and their Taylor terms
    work : room for n numbers, several times
    series : Taylor terms of the state in a search, (TERMS + 1, n)
    """

    co: FloatArray
    slopes: FloatArray
    w: FloatArray
    dw: FloatArray
    waves: FloatArray
    now: FloatArray
    term: FloatArray
    work: FloatArray
    series: FloatArray


@allocating_helper
def make_system(n, entries, waves, columns, free, terms):  # type: ignore[no-untyped-def]
    """Return the room for a system of n states, ``columns`` columns and ``free`` parameters."""
    sizes = entries * (1 + free) + waves * (1 + free + _WAVES) + n * (2 * columns + 5 + terms)
    flat = np.zeros(sizes)
    a = entries
    b = a + entries * free
    c = b + waves
    d = c + waves * free
    e = d + waves * _WAVES
    f = e + n * columns
    g = f + n * columns
    h = g + 5 * n
    return System(
        flat[:a],
        flat[a:b].reshape((free, entries)),
        flat[b:c],
        flat[c:d].reshape((free, waves)),
        flat[d:e].reshape((_WAVES, waves)),
        flat[e:f].reshape((columns, n)),
        flat[f:g].reshape((columns, n)),
        flat[g:h].reshape((5, n)),
        flat[h:].reshape((terms, n)),
    )


@helper
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
        if sweep == _SWEEPS:
            break
        settled = True
        for i in range(n):
            r, c = row[i] / units[i], column[i] * units[i]
            if not (r > 0.0 or c > 0.0):
                continue
            ratio = max(r, _FREE * c) / max(c, _FREE * r)
            if not 0.25 < ratio < 4.0:
                settled = False
                units[i] *= math.sqrt(ratio)
        if settled:
            break
    rows, columns, low, high = 0.0, 0.0, math.inf, 0.0
    for i in range(n):
        rows = max(rows, row[i] / units[i] + own[i])
        columns = max(columns, column[i] * units[i] + own[i])
        low, high = min(low, units[i]), max(high, units[i])
    return min(rows, columns), high / low


@helper
def set_up(motion, piece, p, which, columns, system):  # type: ignore[no-untyped-def]
    """Evaluate the coefficients; return the rate of the system and the spread of its units."""
    motion.entries(piece, p, which, system.co, system.slopes)
    motion.frequencies(p, which, system.w, system.dw)
    audible = system.waves[6]
    for j in range(audible.shape[0]):
        audible[j] = 0.0
    motion.audible(piece, system.co, audible)
    for k in range(which.shape[0] if columns > 1 else 0):
        motion.audible(piece, system.slopes[k], audible)
    return growth(motion, piece, system)


@helper
def silenced(rate, system):  # type: ignore[no-untyped-def]
    """Silence the harmonics whose factors are zero; return the rate with the others."""
    audible = system.waves[6]
    for j in range(audible.shape[0]):
        if audible[j] == 0.0:
            system.w[j] = 0.0
            for k in range(system.dw.shape[0]):
                system.dw[k, j] = 0.0
        rate = max(rate, abs(system.w[j]))
    return rate


@helper
def terms_for(reach, spread):  # type: ignore[no-untyped-def]
    """Return how many Taylor terms leave less than rounding, for rate times duration."""
    size, k = spread, 1
    while k < TERMS - 3 and size > 1e-17:
        size *= reach / k
        k += 1
    return (
        k + 2
    )  # one for a derivative by a frequency (a term more), one for the parity of oscillations


@helper
def start_waves(system, t):  # type: ignore[no-untyped-def]
    """Write the cosines and sines at a time, and their derivatives by the frequencies."""
    waves, w = system.waves, system.w
    for j in range(w.shape[0]):
        c, s = 1.0, 0.0
        if w[j] != 0.0:
            c, s = math.cos(w[j] * t), math.sin(w[j] * t)
        waves[0, j], waves[1, j] = c, s
        waves[2, j], waves[3, j] = -t * s, t * c


@helper
def next_waves(system, factor, varied):  # type: ignore[no-untyped-def]
    """Replace the Taylor terms of the waves by the next ones."""
    waves, w = system.waves, system.w
    for j in range(w.shape[0]):
        c, s = waves[0, j], waves[1, j]
        if varied:
            u, v = waves[2, j], waves[3, j]
            waves[2, j], waves[3, j] = factor * (-s - w[j] * v), factor * (c + w[j] * u)
        waves[0, j], waves[1, j] = -factor * w[j] * s, factor * w[j] * c
