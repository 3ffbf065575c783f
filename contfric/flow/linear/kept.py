"""Exponentials that are kept: a motion in two parts, of which the longer one is known from before.

Along a branch, and from step to step of Newton's method, durations d change little, and a matrix A without
the free parameter does not change. So d is taken apart: ``d = k h + r``, with h a power of two that is a
sixteenth to an eighth of 1 / rate, and ``|r| <= h / 2``. Of the part k h are kept

    E_k = exp(A k h)   and, for a unit force in each row with waves, its response U_k from rest,

to ``cos(w t)`` and to ``sin(w t)``. A force ``a cos(w (t0 + t)) + b sin(w (t0 + t))`` is, with c and s the
cosine and sine of ``w t0``, ``(a c + b s) cos(w t) + (b c - a s) sin(w t)``. So the state at k h, and its
derivatives by t0 and by parameters that are factors of waves, are sums of kept columns. The part r is a
series of ten terms. Nothing depends on what was asked before: E_k is a function of A, h and k alone.

The memory belongs to the model. Two threads may ask at the same time: the second one computes anew.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contfric.compiled import inlined_helper
from contfric.flow.linear.steps import advance, carry_by_series, exponential, step_over, steps_of
from contfric.flow.linear.system import TERMS, FloatArray, start_waves, sum_of, terms_for

#: Numbers that a model's memory has, 8 MB: it is taken from the system as it is used.
NUMBERS = 2**20
#: Most motions that are kept.
_SLOTS = 64
#: h is at most this over the rate, and at least half of it; steps are those of the rate _SHARE / h.
_SHARE = 0.125
#: A longer motion adds up too much rounding: forces of a rigid body that cancel are kept one by one.
_LONGEST = 1024.0
#: Where things are in the memory: the lock, the length of a slot, the slot that is overwritten next; then
#: the number of the piece (from 1), and k, of each slot; then the slots.
_LOCK, _LENGTH, _NEXT, _KEYS = range(4)
#: Where things are in a slot: h, first coefficient of a wave, rows with waves, whether responses are there.
H, FIRST, ROWS, FORCED, _HEAD = range(5)


@inlined_helper
def cut(rate, dt):  # type: ignore[no-untyped-def]
    """Return (k, h) of a duration; k = 0 where nothing is to be kept of it."""
    if not 0.0 < rate * dt < math.inf:
        return 0.0, 0.0
    _, power = math.frexp(rate / _SHARE)
    h = math.ldexp(1.0, -power)
    k = math.floor(dt / h + 0.5)
    return (k, h) if k <= _LONGEST else (0.0, 0.0)


@inlined_helper
def acts_on_waves(system, first):  # type: ignore[no-untyped-def]
    """Tell whether all parameters are factors of waves: neither in the matrix nor in a frequency."""
    for k in range(system.slopes.shape[0]):
        for j in range(first):
            if system.slopes[k, j] != 0.0:
                return False
        for j in range(system.dw.shape[1]):
            if system.dw[k, j] != 0.0:
                return False
    return True


class Slot(NamedTuple):
    """What is kept of one motion.

    Attributes
    ----------
    head : h, first coefficient of a wave, number of rows with waves, and whether their responses are there
    co, w : the coefficients and frequencies that it belongs to
    harmonics : of the rows with waves
    exponential : E, (n, n)
    responses : U of each row with waves, to cosine and sine, (2 rows, n)
    """

    head: FloatArray
    co: FloatArray
    w: FloatArray
    harmonics: FloatArray
    exponential: FloatArray
    responses: FloatArray


@inlined_helper
def head_of(entries, waves, n):  # type: ignore[no-untyped-def]
    """Return the numbers of a slot before what is kept."""
    return _HEAD + entries + waves + n


@inlined_helper
def length_of(n, entries, waves):  # type: ignore[no-untyped-def]
    """Return the numbers that a slot needs."""
    return head_of(entries, waves, n) + entries + 3 * n * max(n, TERMS + 1)


@inlined_helper
def space_of(n, entries, waves):  # type: ignore[no-untyped-def]
    """Return the numbers of a memory of one call that finds the other one taken: two slots."""
    return min(NUMBERS, _KEYS + 2 * _SLOTS + 2 * length_of(n, entries, waves))


@inlined_helper
def slot_in(memory, at, n, entries, waves):  # type: ignore[no-untyped-def]
    """Return a slot; of rows with waves it has space for n."""
    a = at + _HEAD
    b, c = a + entries, a + entries + waves
    d, e = c + n, c + n + n * n
    return Slot(
        memory[at:a],
        memory[a:b],
        memory[b:c],
        memory[c:d],
        memory[d:e].reshape((n, n)),
        memory[e : e + 2 * n * n].reshape((2 * n, n)),
    )


@inlined_helper
def same(first, second, count):  # type: ignore[no-untyped-def]
    """Tell whether two vectors begin with the same numbers."""
    for j in range(count):
        if first[j] != second[j]:
            return False
    return True


@inlined_helper
def same_waves(slot, system):  # type: ignore[no-untyped-def]
    """Tell whether responses are those to the frequencies of a system, of what is heard of them."""
    first = int(slot.head[FIRST])
    for row in range(int(slot.head[ROWS])):
        j, at = int(slot.harmonics[row]), first + 2 * row
        heard = system.w[j] != 0.0 or system.co[at] != 0.0 or system.co[at + 1] != 0.0
        if heard and slot.w[j] != system.w[j]:
            return False
    return True


@inlined_helper
def find(memory, piece, k, h, n, spare, system):  # type: ignore[no-untyped-def]
    """Return where the slot of a motion is, and whether it is known; -1 without space.

    Parameters
    ----------
    spare : a slot that is not to be overwritten, or -1
    """
    entries, waves = system.co.shape[0], system.w.shape[0]
    length, begin = length_of(n, entries, waves), _KEYS + 2 * _SLOTS
    slots = min(_SLOTS, (memory.shape[0] - begin) // length)
    if slots < 2:
        return -1, False
    if memory[_LENGTH] != length:  # modes came that have more coefficients
        memory[_LENGTH], memory[_NEXT] = length, 0.0
        for j in range(2 * _SLOTS):
            memory[_KEYS + j] = 0.0
    for j in range(slots):
        if memory[_KEYS + 2 * j] == piece + 1 and memory[_KEYS + 2 * j + 1] == k:
            at = begin + j * length
            head, co = memory[at : at + _HEAD], memory[at + _HEAD : at + _HEAD + entries]
            # where it is of another matrix no other slot has this motion
            return at, head[H] == h and same(co, system.co, int(head[FIRST]))
    j = int(memory[_NEXT])
    if begin + j * length == spare:
        j = (j + 1) % slots
    memory[_NEXT] = (j + 1) % slots
    memory[_KEYS + 2 * j], memory[_KEYS + 2 * j + 1] = piece + 1, k
    return begin + j * length, False


@inlined_helper
def note_waves(motion, piece, unit, audible, slot):  # type: ignore[no-untyped-def]
    """Write which coefficients are those of waves, and of which harmonic each row is."""
    head, entries, n = slot.head, unit.shape[0], slot.harmonics.shape[0]
    head[FIRST], head[ROWS], head[FORCED] = entries, 0.0, 0.0
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
                    slot.harmonics[row] = j
                head[ROWS] = row + 1.0


@inlined_helper
def respond(motion, piece, k, h, spread, slot, system):  # type: ignore[no-untyped-def]
    """Write the responses from rest to a unit force in each row with waves."""
    first, rows, n = int(slot.head[FIRST]), int(slot.head[ROWS]), system.work.shape[1]
    unit = system.scratch
    steps, step, terms = steps_of(_SHARE / h, spread, k * h)
    for j in range(first):
        unit[j] = system.co[j]
    for j in range(first, unit.shape[0]):
        unit[j] = 0.0
    for q in range(2 * rows):
        unit[first + q] = 1.0
        y = slot.responses[q]
        for i in range(n):
            y[i] = 0.0
        for m in range(steps):
            start_waves(system, m * step)
            motion.expand(
                piece,
                unit,
                y,
                system.waves[0],
                system.waves[1],
                system.w,
                step,
                terms,
                system.other,
            )
            sum_of(system.other, terms, y)
        unit[first + q] = 0.0
    for j in range(system.w.shape[0]):
        slot.w[j] = system.w[j]
    slot.head[FORCED] = 1.0


@inlined_helper
def add_responses(slot, co, c, s, out):  # type: ignore[no-untyped-def]
    """Add the response to waves with some coefficients and phases."""
    first = int(slot.head[FIRST])
    for row in range(int(slot.head[ROWS])):
        j, a, b = int(slot.harmonics[row]), co[first + 2 * row], co[first + 2 * row + 1]
        cosine, sine = a * c[j] + b * s[j], b * c[j] - a * s[j]
        for i in range(out.shape[0]):
            out[i] += cosine * slot.responses[2 * row, i] + sine * slot.responses[2 * row + 1, i]


@inlined_helper
def advance_by_responses(slot, t, y, system):  # type: ignore[no-untyped-def]
    """Advance a state over the part that is kept, with its derivatives by time and by parameters."""
    n, old, by_start = y.shape[0], system.work[0], system.work[5]
    start_waves(system, t)
    waves = system.waves
    for i in range(n):
        old[i], by_start[i] = y[i], 0.0
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += slot.exponential[i, j] * old[j]
        y[i] = total
    add_responses(slot, system.co, waves[0], waves[1], y)
    add_responses(slot, system.co, waves[6], waves[7], by_start)
    for k in range(system.varied.shape[0]):  # they are zero at the start
        add_responses(slot, system.slopes[k], waves[0], waves[1], system.varied[k])


@inlined_helper
def respond_anew(motion, piece, k, h, spread, slot, system):  # type: ignore[no-untyped-def]
    """Write the responses where they are not there, or not those to these frequencies."""
    if slot.head[FORCED] == 0.0 or not same_waves(slot, system):
        respond(motion, piece, k, h, spread, slot, system)


@inlined_helper
def kept_slot(motion, piece, k, h, spread, spare, memory, system):  # type: ignore[no-untyped-def]
    """Return where a motion is kept, whose exponential is found where it has to be; -1 without space."""
    n = system.work.shape[1]
    at, known = find(memory, piece, k, h, n, spare, system)
    if at < 0 or known:
        return at
    slot = slot_in(memory, at, n, system.co.shape[0], system.w.shape[0])
    slot.head[H] = h
    note_waves(motion, piece, system.scratch, system.waves[5], slot)
    for j in range(system.co.shape[0]):
        slot.co[j] = system.co[j]
    exponential(motion, piece, k * h, _SHARE / h, spread, system)
    for i in range(n):
        for j in range(n):
            slot.exponential[i, j] = system.maps[i, j]
    return at


@inlined_helper
def advance_kept(motion, piece, t, dt, rate, spread, y, memory, system):  # type: ignore[no-untyped-def]
    """Advance a state, its derivatives and the exponential by what is kept; False if nothing is."""
    k, h = cut(rate, dt)
    if k == 0.0:
        return False
    n, long = y.shape[0], k * h
    at = kept_slot(motion, piece, k, h, spread, -1, memory, system)
    if at < 0:
        return False
    slot = slot_in(memory, at, n, system.co.shape[0], system.w.shape[0])
    forced = slot.head[ROWS] <= n and acts_on_waves(system, int(slot.head[FIRST]))
    for i in range(n):
        for j in range(n):
            system.maps[i, j] = slot.exponential[i, j]
    rest = dt - long
    terms = terms_for(rate * abs(rest), spread)
    if forced:
        respond_anew(motion, piece, k, h, spread, slot, system)
        advance_by_responses(slot, t, y, system)
        step_over(motion, piece, t + long, rest, terms, y, system)
    else:
        advance(motion, piece, t, dt, rate, spread, y, system)
    carry_by_series(motion, piece, rest, terms, system, system.maps[:n])
    return True
