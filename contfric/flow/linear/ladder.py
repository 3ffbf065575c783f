"""Powers of the exponential of a step, by doubling, in twice as many digits.

Of a matrix A and a length h, a power of two that is a sixteenth to an eighth of 1 / rate, are kept

    F_j = exp(A h 2^j) - I,    F_{j+1} = 2 F_j + F_j F_j,

and ``exp(A k h)`` is the product of those of the bits of k. A matrix of a contact of stiffness 1e8 moves two
masses together: entries of F_j cancel in that motion, and what is left of their rounding is a force that acts
in each of a thousand steps. So F_j is a sum of two numbers, as in a compensated sum (Ogita, Rump, Oishi, SIAM
J. Sci. Comput. 26, 2005), until it is rounded for use. What a series for F_0 leaves out is a power series in
A, in which no forces arise.

All matrices are transposed: rows times a matrix are vectors of the processor. Nothing depends on what was
asked before: F_j is a function of A, h and j alone.
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from contfric.compiled import helper, inlined_helper
from contfric.compiling.vectors import (
    add_pairs_1,
    add_pairs_4,
    add_pairs_8,
    add_product_1,
    add_product_4,
    add_product_8,
)
from contfric.flow.linear.system import TERMS, FloatArray, terms_for

#: Doublings: 2^27 steps of a sixteenth of 1 / rate or more are longer than any solution, 6e6 / rate.
LEVELS = 27
#: Where things are in the head: h, a number that no other matrix has, powers that are there, first
#: coefficient of a wave, rows with waves, rate of the matrix and spread of its units.
H, STAMP, KNOWN, FIRST, ROWS, RATE, SPREAD, HEAD = range(8)
#: Powers whose place is used for other things before the first one is there.
_LEFT, _ZERO, _SUM, _SUM_LOW = 2, 3, 4, 5
#: Further terms of a series: those of F_0 are smaller than those of the state.
_MORE = 2
#: One over each whole number, in two parts.
_INVERSE = np.array([[0.0]] + [[1.0 / m] for m in range(1, TERMS + _MORE + 1)])
_INVERSE_LOW = np.array(
    [[0.0]] + [[float(Fraction(1, m) - Fraction(1.0 / m))] for m in range(1, TERMS + _MORE + 1)]
)


class Ladder(NamedTuple):
    """The powers of one matrix.

    Attributes
    ----------
    head : h, a number that no other matrix has, powers that are there, and what waves there are
    co : the coefficients that it belongs to
    harmonics : of the rows with waves
    matrix : A
    powers, low : F_0, F_1 ..., transposed, (LEVELS, n, n); lower halves of the last two, (2, n, n)
    """

    head: FloatArray
    co: FloatArray
    harmonics: FloatArray
    matrix: FloatArray
    powers: FloatArray
    low: FloatArray


@inlined_helper
def ladder_length(n, entries):  # type: ignore[no-untyped-def]
    """Return the numbers that the powers of a matrix need."""
    return HEAD + entries + n + (LEVELS + 3) * n * n


@inlined_helper
def ladder_in(memory, at, n, entries):  # type: ignore[no-untyped-def]
    """Return the powers of a matrix at a place of the memory."""
    a, b = at + HEAD + entries, at + HEAD + entries + n
    c, d = b + n * n, b + (1 + LEVELS) * n * n
    return Ladder(
        memory[at : at + HEAD],
        memory[at + HEAD : a],
        memory[a:b],
        memory[b:c].reshape((n, n)),
        memory[c:d].reshape((LEVELS, n, n)),
        memory[d : d + 2 * n * n].reshape((2, n, n)),
    )


@helper
def add_product(out, i, rows, r, matrix):  # type: ignore[no-untyped-def]
    """Add a row times a matrix to a row."""
    n, k = matrix.shape[1], 0
    while k + 8 <= n:
        add_product_8(out, i, rows, r, matrix, k)
        k += 8
    if k + 4 <= n:
        add_product_4(out, i, rows, r, matrix, k)
        k += 4
    while k < n:
        add_product_1(out, i, rows, r, matrix, k)
        k += 1


@helper
def add_pairs(out, low, i, rows, rows_low, r, matrix, matrix_low):  # type: ignore[no-untyped-def]
    """Add a row times a matrix to a row, each number a sum of two."""
    n, k = matrix.shape[1], 0
    while k + 8 <= n:
        add_pairs_8(out, low, i, rows, rows_low, r, matrix, matrix_low, k)
        k += 8
    if k + 4 <= n:
        add_pairs_4(out, low, i, rows, rows_low, r, matrix, matrix_low, k)
        k += 4
    while k < n:
        add_pairs_1(out, low, i, rows, rows_low, r, matrix, matrix_low, k)
        k += 1
    for k in range(n):
        total = out[i, k] + low[i, k]
        low[i, k] -= total - out[i, k]
        out[i, k] = total


@helper
def note_waves(motion, piece, unit, audible, ladder):  # type: ignore[no-untyped-def]
    """Write which coefficients are those of waves, and of which harmonic each row is."""
    head, entries, n = ladder.head, unit.shape[0], ladder.harmonics.shape[0]
    head[FIRST], head[ROWS] = entries, 0.0
    for q in range(entries):
        unit[q] = 0.0
    for q in range(entries):
        if q > head[FIRST] and (q - int(head[FIRST])) % 2 == 1:
            continue
        for j in range(audible.shape[0]):
            audible[j] = 0.0
        unit[q] = 1.0
        motion.audible(piece, unit, audible)
        unit[q] = 0.0
        for j in range(audible.shape[0]):
            if audible[j] != 0.0:
                row = int(head[ROWS])
                if row == 0:
                    head[FIRST] = q
                if row < n:
                    ladder.harmonics[row] = j
                head[ROWS] = row + 1.0


@helper
def begin(motion, piece, h, rate, spread, ladder, system):  # type: ignore[no-untyped-def]
    """Write A, and its first power by Horner's scheme: ``S = A h / m (I + S)``."""
    n, silence, unit, column = (
        system.work.shape[1],
        system.waves[4],
        system.work[0],
        system.work[1],
    )
    powers, low = ladder.powers, ladder.low
    left, zero = powers[_LEFT], powers[_ZERO]
    total, rest = powers[_SUM], powers[_SUM_LOW]
    for i in range(n):
        unit[i] = 0.0
    for j in range(n):
        unit[j] = 1.0
        motion.rates(piece, system.co, unit, silence, silence, column)
        unit[j] = 0.0
        for i in range(n):
            ladder.matrix[i, j], left[j, i], zero[i, j] = column[i], h * column[i], 0.0
    terms = terms_for(rate * h, spread) + _MORE
    for m in range(terms, 0, -1):
        new, old = (m - 1) % 2, m % 2
        for i in range(n):
            for j in range(n):
                total[i, j], rest[i, j] = left[i, j], 0.0
                powers[new, i, j] = low[new, i, j] = 0.0
            if m < terms:
                add_pairs(total, rest, i, left, zero, i, powers[old], low[old])
            add_pairs(
                powers[new],
                low[new],
                i,
                _INVERSE,
                _INVERSE_LOW,
                m,
                total[i : i + 1],
                rest[i : i + 1],
            )
    ladder.head[H], ladder.head[KNOWN] = h, 1.0


@inlined_helper
def levels_of(k):  # type: ignore[no-untyped-def]
    """Return the number of bits of a whole number."""
    found = 0
    while k > 0:
        k >>= 1
        found += 1
    return found


@helper
def extend(ladder, levels):  # type: ignore[no-untyped-def]
    """Write powers up to a number of them."""
    powers, low, n = ladder.powers, ladder.low, ladder.matrix.shape[0]
    for level in range(int(ladder.head[KNOWN]), levels):
        old, new, rest = powers[level - 1], powers[level], low[level % 2]
        old_rest = low[(level - 1) % 2]
        for i in range(n):
            for j in range(n):
                new[i, j], rest[i, j] = 2.0 * old[i, j], 2.0 * old_rest[i, j]
            add_pairs(new, rest, i, old, old_rest, i, old, old_rest)
        ladder.head[KNOWN] = level + 1.0


@helper
def power_of(ladder, k, out, spare):  # type: ignore[no-untyped-def]
    """Write ``exp(A k h)``, transposed."""
    n, begun = out.shape[0], False
    extend(ladder, levels_of(k))
    for level in range(levels_of(k)):
        if (k >> level) & 1 == 0:
            continue
        step = ladder.powers[level]
        for i in range(n):
            for j in range(n):
                spare[i, j] = out[i, j]
                out[i, j] = out[i, j] + step[i, j] if begun else step[i, j]
        for i in range(n if begun else 0):
            add_product(out, i, spare, i, step)
        begun = True
    for i in range(n):
        out[i, i] += 1.0
