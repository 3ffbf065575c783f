"""Responses from rest to waves, by doubling.

A force ``a c + b s``, with c and s the cosine and the sine of ``w (t0 + t)``, moves a state at rest by
``G_c c + G_s s`` with those at the start. After twice the time, with R the turn of the phase in between,

    G(2 h) = exp(A h) G(h) + G(h) R,    G'(2 h) = exp(A h) G'(h) + G'(h) R + G(h) R',

where the dash is the derivative by the frequency. A response over k steps h follows from the bits of k.
What is doubled is the response to the force itself where frequencies vary or motions are long: forces that
cancel in the motion of a rigid body do so in each doubling. Else it is that to a unit force in each row with
waves, which is kept.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contfric.compiled import helper, inlined_helper
from contfric.flow.linear.ladder import FIRST, H, add_product, extend, levels_of
from contfric.flow.linear.system import FloatArray, start_waves, sum_of, terms_for

#: What a pair of responses is for: the state, its derivative by a frequency, by the first parameter ...
_STATE, _FREQUENCY, _PARAMETER = range(3)


class Pairs(NamedTuple):
    """Responses to waves, two rows each.

    Attributes
    ----------
    harmonics, kinds : of each pair
    once, other, total : over 2^j steps, space for the next ones, and over the bits so far, (2 pairs, n)
    """

    harmonics: FloatArray
    kinds: FloatArray
    once: FloatArray
    other: FloatArray
    total: FloatArray


@inlined_helper
def pairs_space(n, waves, free):  # type: ignore[no-untyped-def]
    """Return the numbers that pairs need: for rows with waves, or for harmonics and parameters."""
    count = max(n, waves * (2 + free))
    return count * (2 + 6 * n)


@inlined_helper
def pairs_in(space, n):  # type: ignore[no-untyped-def]
    """Return as many pairs as there is space for."""
    count = space.shape[0] // (2 + 6 * n)
    a, size = 2 * count, 2 * count * n
    return Pairs(
        space[:count],
        space[count:a],
        space[a : a + size].reshape((2 * count, n)),
        space[a + size : a + 2 * size].reshape((2 * count, n)),
        space[a + 2 * size : a + 3 * size].reshape((2 * count, n)),
    )


@helper
def write_pair(motion, piece, co, j, kind, h, terms, pairs, count, system):  # type: ignore[no-untyped-def]
    """Append the responses to one harmonic over a step; of the derivative by its frequency as well."""
    waves, rest = system.waves, system.work[0]
    first = count + 1 if kind == _FREQUENCY else count
    for i in range(rest.shape[0]):
        rest[i] = 0.0
    for phase in range(2):
        for i in range(waves.shape[1]):
            for row in range(4):
                waves[row, i] = 0.0
            waves[5, i] = 0.0
        waves[phase, j] = waves[5, j] = 1.0
        motion.expand(piece, co, rest, waves[0], waves[1], system.w, h, terms, system.series)
        if kind == _FREQUENCY:
            motion.vary(
                piece, co, system.scratch, rest, waves, system.w, waves[5], h, terms, system.series,
                system.other,
            )  # fmt: skip
            sum_of(system.other, terms, pairs.once[2 * first + phase])
        sum_of(system.series, terms, pairs.once[2 * count + phase])
    pairs.harmonics[count], pairs.kinds[count] = j, _STATE if kind == _FREQUENCY else kind
    if kind == _FREQUENCY:
        pairs.harmonics[first], pairs.kinds[first] = j, _FREQUENCY
    return first + 1


@helper
def turn(pairs, count, time, w, into):  # type: ignore[no-untyped-def]
    """Add the responses of a step that begins after a time."""
    for q in range(count):
        j = int(pairs.harmonics[q])
        angle = w[j] * time
        c, s = math.cos(angle), math.sin(angle)
        a, b = pairs.once[2 * q], pairs.once[2 * q + 1]
        out, sines = into[2 * q], into[2 * q + 1]
        for i in range(a.shape[0]):
            out[i] += a[i] * c + b[i] * s
            sines[i] += b[i] * c - a[i] * s
        if pairs.kinds[q] == _FREQUENCY:  # the pair before is that of the state
            a, b = pairs.once[2 * q - 2], pairs.once[2 * q - 1]
            for i in range(a.shape[0]):
                out[i] += time * (b[i] * c - a[i] * s)
                sines[i] -= time * (a[i] * c + b[i] * s)


@helper
def double_once(ladder, level, pairs, count, system):  # type: ignore[no-untyped-def]
    """Write the responses over twice as many steps, 2^(level + 1), to ``pairs.once``."""
    once, other, n = pairs.once, pairs.other, pairs.once.shape[1]
    for r in range(2 * count):
        for i in range(n):
            other[r, i] = once[r, i]
        add_product(other, r, once, r, ladder.powers[level])
    turn(pairs, count, math.ldexp(ladder.head[H], level), system.w, other)
    for r in range(2 * count):
        for i in range(n):
            once[r, i] = other[r, i]


@helper
def double(ladder, k, pairs, count, system):  # type: ignore[no-untyped-def]
    """Write the responses over k steps to ``pairs.total``."""
    h, done, levels = ladder.head[H], 0.0, levels_of(k)
    extend(ladder, levels)
    other, total, n = pairs.other, pairs.total, pairs.once.shape[1]
    for r in range(2 * count):
        for i in range(n):
            total[r, i] = 0.0
    for level in range(levels):
        step, length = ladder.powers[level], math.ldexp(h, level)
        if (k >> level) & 1 == 1:
            for r in range(2 * count if done > 0.0 else 0):
                for i in range(n):
                    other[r, i] = total[r, i]
                add_product(total, r, other, r, step)
            turn(pairs, count, done, system.w, total)
            done += length
        if level + 1 == levels:
            break
        double_once(ladder, level, pairs, count, system)


@helper
def respond_to_units(motion, piece, k, rate, spread, ladder, rows, pairs, system):  # type: ignore[no-untyped-def]
    """Write the responses to a unit force in each row with waves to ``pairs.total``."""
    first, h, unit = int(ladder.head[FIRST]), ladder.head[H], system.scratch
    terms = terms_for(rate * h, spread)
    for j in range(unit.shape[0]):
        unit[j] = system.co[j] if j < first else 0.0
    for row in range(rows):
        unit[first + 2 * row] = 1.0
        write_pair(
            motion, piece, unit, int(ladder.harmonics[row]), _STATE, h, terms, pairs, row, system
        )
        unit[first + 2 * row] = 0.0
    double(ladder, k, pairs, rows, system)


@inlined_helper
def sounds(motion, piece, co, audible, j):  # type: ignore[no-untyped-def]
    """Tell whether some coefficients have a factor of a harmonic."""
    for i in range(audible.shape[0]):
        audible[i] = 0.0
    motion.audible(piece, co, audible)
    return audible[j] != 0.0


@helper
def write_pairs(motion, piece, h, terms, first, pairs, system):  # type: ignore[no-untyped-def]
    """Write the responses to the forces, and their derivatives, over a step; return their number."""
    count, entries, audible = 0, system.co.shape[0], system.waves[5]
    for j in range(system.w.shape[0]):
        moves = False
        for q in range(system.varied.shape[0]):
            moves = moves or system.dw[q, j] != 0.0
        if sounds(motion, piece, system.co, audible, j):
            for i in range(entries):
                system.scratch[i] = 0.0
            kind = _FREQUENCY if moves else _STATE
            count = write_pair(motion, piece, system.co, j, kind, h, terms, pairs, count, system)
        for q in range(system.varied.shape[0]):
            if sounds(motion, piece, system.slopes[q], audible, j):
                for i in range(entries):
                    system.scratch[i] = system.co[i] if i < first else system.slopes[q, i]
                count = write_pair(
                    motion, piece, system.scratch, j, _PARAMETER + q, h, terms, pairs, count, system
                )
    return count


@helper
def add_pair(pairs, q, c, s, out):  # type: ignore[no-untyped-def]
    """Add a pair's responses to a wave."""
    for i in range(out.shape[0]):
        out[i] += pairs.total[2 * q, i] * c + pairs.total[2 * q + 1, i] * s


@helper
def respond_to_forces(motion, piece, k, rate, spread, t, ladder, pairs, y, system):  # type: ignore[no-untyped-def]
    """Add the responses to the forces to a state and to its derivatives, which are zero before."""
    h, waves = ladder.head[H], system.waves
    terms = terms_for(rate * h, spread)
    count = write_pairs(motion, piece, h, terms, int(ladder.head[FIRST]), pairs, system)
    double(ladder, k, pairs, count, system)
    start_waves(system, t)
    for p in range(count):
        j, kind = int(pairs.harmonics[p]), int(pairs.kinds[p])
        c, s = waves[0, j], waves[1, j]
        if kind == _STATE:
            add_pair(pairs, p, c, s, y)
            add_pair(pairs, p, waves[6, j], waves[7, j], system.work[5])
        for q in range(system.varied.shape[0]):
            turns = system.dw[q, j]
            if kind == _STATE and turns != 0.0:
                add_pair(pairs, p, turns * waves[2, j], turns * waves[3, j], system.varied[q])
            elif kind == _FREQUENCY and turns != 0.0:
                add_pair(pairs, p, turns * c, turns * s, system.varied[q])
            elif kind == _PARAMETER + q:
                add_pair(pairs, p, c, s, system.varied[q])
