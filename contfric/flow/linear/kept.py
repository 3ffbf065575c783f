"""Exponentials that are kept: a solution in two parts, of which the longer one is known from before.

Along a branch, and from step to step of Newton's method, durations d change little, and a matrix A without
the free parameter does not change. So d is taken apart: ``d = k h + r``, with h a power of two that is a
sixteenth to an eighth of 1 / rate, and ``|r| <= h / 2``. Of the part k h are kept

    E_k = exp(A k h)   and, for a unit force in each row with waves, its responses from rest,

where E_k is a product of kept powers (:mod:`contfric.flow.linear.ladder`). So the state at k h, and its
derivatives by t0 and by parameters that are factors of waves, are sums of kept columns; where a frequency is
free, or the motion long, responses are found anew (:mod:`contfric.flow.linear.responses`). The part r is a
series of ten terms. Nothing depends on what was asked before: E_k is a function of A, h and k alone.

The memory belongs to the model. Two threads may ask at the same time: the second one computes anew.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contfric.compiled import helper, inlined_helper
from contfric.compiling.shared import try_lock
from contfric.flow.linear.ladder import (
    FIRST,
    LEVELS,
    RATE,
    ROWS,
    SPREAD,
    STAMP,
    H,
    add_product,
    begin,
    ladder_in,
    ladder_length,
    note_waves,
    power_of,
)
from contfric.flow.linear.responses import pairs_in, respond_to_forces, respond_to_units
from contfric.flow.linear.steps import advance, carry_by_series, step_by_forces
from contfric.flow.linear.system import TERMS, FloatArray, growth, start_waves, terms_for

#: Numbers that a model's memory has, 32 MB: it is taken from the system as it is used.
NUMBERS = 2**22
#: Most solutions and observables that are kept, and most matrices. Those of one orbit have to have space
#: together: twenty segments of ten contacts have twenty matrices, and two hundred observables.
_SLOTS, _LADDERS = 512, 64
#: Attempts to take the memory, about 50 microseconds: what is kept takes longer to find anew.
_PATIENCE = 3000
#: h is at most this over the rate, and at least half of it.
_SHARE = 0.125
#: Most steps of a solution whose responses to unit forces are kept.
_LONGEST = 1024
#: Where things are in the memory: the lock, the lengths of a slot and of the powers of a matrix, those that
#: are overwritten next, matrices so far; then the number of the piece (from 1), and k, of each slot; the
#: piece of each matrix; then the slots, and the powers.
_LOCK, _LENGTH, _HEIGHT, _NEXT, _NEXT_LADDER, _COUNT, _KEYS = range(7)
_BEGIN = _KEYS + 2 * _SLOTS + _LADDERS
#: Where things are in a slot: the matrix that it is of, whether what depends on frequencies is there.
OF, FORCED, HEAD = range(3)


@helper
def locked(place):  # type: ignore[no-untyped-def]
    """Take the lock of a memory; tell whether it was free within the time of some calls."""
    for _ in range(_PATIENCE):
        if try_lock(place) != 0:
            return True
    return False


@inlined_helper
def cut(rate, dt):  # type: ignore[no-untyped-def]
    """Return (k, h) of a duration; k = 0 where nothing is to be kept of it."""
    if not 0.0 < rate * dt < math.inf:
        return 0, 0.0
    _, power = math.frexp(rate / _SHARE)
    h = math.ldexp(1.0, -power)
    k = math.floor(dt / h + 0.5)
    return (int(k), h) if k < 2**LEVELS else (0, 0.0)


class Slot(NamedTuple):
    """What is kept of one motion.

    Attributes
    ----------
    head : the matrix that it is of, and whether responses are there
    w : the frequencies that these belong to
    exponential : E, transposed, (n, n)
    responses : to a unit force in each row with waves, at the phases 0 and a quarter, (2 rows, n)
    """

    head: FloatArray
    w: FloatArray
    exponential: FloatArray
    responses: FloatArray


@inlined_helper
def slot_length(n, entries, waves):  # type: ignore[no-untyped-def]
    """Return the numbers that a slot needs."""
    return HEAD + waves + entries + 3 * n * max(n, TERMS + 1)


@inlined_helper
def space_of(n, entries, waves):  # type: ignore[no-untyped-def]
    """Return the numbers of a memory of one call that finds the other one taken."""
    return min(NUMBERS, _BEGIN + 2 * slot_length(n, entries, waves) + ladder_length(n, entries))


@inlined_helper
def slot_in(memory, at, n, waves):  # type: ignore[no-untyped-def]
    """Return a slot; of rows with waves it has space for n."""
    a, b = at + HEAD, at + HEAD + waves
    c = b + n * n
    return Slot(
        memory[at:a],
        memory[a:b],
        memory[b:c].reshape((n, n)),
        memory[c : c + 2 * n * n].reshape((2 * n, n)),
    )


@inlined_helper
def same(first, second, count):  # type: ignore[no-untyped-def]
    """Tell whether two vectors begin with the same numbers."""
    for j in range(count):
        if first[j] != second[j]:
            return False
    return True


@helper
def places_in(memory, n, entries, waves):  # type: ignore[no-untyped-def]
    """Return how many slots there are, and how many matrices; none where there is no space."""
    length, height = slot_length(n, entries, waves), ladder_length(n, entries)
    space = memory.shape[0] - _BEGIN
    ladders = min(_LADDERS, max(1, space // (2 * height)))
    slots = min(_SLOTS, (space - ladders * height) // length)
    if memory[_LENGTH] != length:  # modes came that have more coefficients
        for j in range(_LENGTH, _BEGIN):
            if j != _COUNT:
                memory[j] = 0.0
        memory[_LENGTH], memory[_HEIGHT] = length, height
    return (slots, ladders) if slots >= 2 else (0, 0)


@helper
def place_of(memory, piece, ladders):  # type: ignore[no-untyped-def]
    """Return which of the matrices is that of a piece; -1: none."""
    for j in range(ladders):
        if memory[_KEYS + 2 * _SLOTS + j] == piece + 1:
            return j
    return -1


@helper
def growth_known(motion, piece, memory, system):  # type: ignore[no-untyped-def]
    """Return the rate of the matrix and the spread of its units, from what is kept where it is there."""
    n, entries = system.work.shape[1], system.co.shape[0]
    _, ladders = places_in(memory, n, entries, system.w.shape[0])
    place = place_of(memory, piece, ladders)
    if place >= 0:
        at = memory.shape[0] - (place + 1) * int(memory[_HEIGHT])
        ladder = ladder_in(memory, at, n, entries)
        if same(ladder.co, system.co, int(ladder.head[FIRST])):
            return ladder.head[RATE], ladder.head[SPREAD]
    return growth(motion, piece, system)


@helper
def ladder_of(motion, piece, h, rate, spread, grown, memory, system):  # type: ignore[no-untyped-def]
    """Return where the powers of a matrix are, the first of which is there; -1 without space.

    Parameters
    ----------
    grown : the rate of the matrix alone, of which and of frequencies ``rate`` is the largest
    """
    n, entries, waves = system.work.shape[1], system.co.shape[0], system.w.shape[0]
    slots, ladders = places_in(memory, n, entries, waves)
    if slots == 0:
        return -1
    keys, found = _KEYS + 2 * _SLOTS, place_of(memory, piece, ladders)
    place = found if found >= 0 else int(memory[_NEXT_LADDER])
    at = memory.shape[0] - (place + 1) * int(memory[_HEIGHT])
    ladder = ladder_in(memory, at, n, entries)
    if found < 0:
        memory[_NEXT_LADDER], memory[keys + place] = (place + 1) % ladders, piece + 1
        note_waves(motion, piece, system.scratch, system.waves[5], ladder)
    elif ladder.head[H] == h and same(ladder.co, system.co, int(ladder.head[FIRST])):
        return at
    memory[_COUNT] += 1.0
    ladder.head[STAMP], ladder.head[RATE], ladder.head[SPREAD] = memory[_COUNT], grown, spread
    for j in range(entries):
        ladder.co[j] = system.co[j]
    begin(motion, piece, h, rate, spread, ladder, system)
    return at


@helper
def find(memory, piece, k, stamp, spare, slots):  # type: ignore[no-untyped-def]
    """Return where the slot of a solution is, and whether it is of this matrix.

    Parameters
    ----------
    spare : a slot that is not to be overwritten, or -1
    """
    length = int(memory[_LENGTH])
    for j in range(slots):
        if memory[_KEYS + 2 * j] == piece + 1 and memory[_KEYS + 2 * j + 1] == k:
            at = _BEGIN + j * length
            # where it is of another matrix no other slot has this solution
            return at, memory[at + OF] == stamp
        if memory[_KEYS + 2 * j] == 0.0:  # slots are filled in their order: no other one has been
            break
    j = int(memory[_NEXT])
    if _BEGIN + j * length == spare:
        j = (j + 1) % slots
    memory[_NEXT] = (j + 1) % slots
    memory[_KEYS + 2 * j], memory[_KEYS + 2 * j + 1] = piece + 1, k
    return _BEGIN + j * length, False


@helper
def kept_slot(piece, k, ladder, spare, spare_matrix, memory, system):  # type: ignore[no-untyped-def]
    """Return where a solution is kept, whose exponential is found where it has to be."""
    n, waves = system.work.shape[1], system.w.shape[0]
    slots, _ = places_in(memory, n, system.co.shape[0], waves)
    at, known = find(memory, piece, k, ladder.head[STAMP], spare, slots)
    if not known:
        slot = slot_in(memory, at, n, waves)
        power_of(ladder, k, slot.exponential, spare_matrix)
        slot.head[OF], slot.head[FORCED] = ladder.head[STAMP], 0.0
    return at


@helper
def same_waves(slot, ladder, system):  # type: ignore[no-untyped-def]
    """Tell whether responses are those to the frequencies of a system, of what is heard of them."""
    first = int(ladder.head[FIRST])
    for row in range(int(ladder.head[ROWS])):
        j, at = int(ladder.harmonics[row]), first + 2 * row
        heard = system.w[j] != 0.0 or system.co[at] != 0.0 or system.co[at + 1] != 0.0
        if heard and slot.w[j] != system.w[j]:
            return False
    return True


@helper
def know_responses(motion, piece, k, rate, spread, ladder, space, slot, system):  # type: ignore[no-untyped-def]
    """Write the responses to unit forces where they are not there, or not those to these frequencies."""
    if slot.head[FORCED] != 0.0 and same_waves(slot, ladder, system):
        return
    n, rows, pairs = (
        system.work.shape[1],
        int(ladder.head[ROWS]),
        pairs_in(space, system.work.shape[1]),
    )
    respond_to_units(motion, piece, k, rate, spread, ladder, rows, pairs, system)
    for r in range(2 * rows):
        for i in range(n):
            slot.responses[r, i] = pairs.total[r, i]
    for j in range(system.w.shape[0]):
        slot.w[j] = system.w[j]
    slot.head[FORCED] = 1.0


@inlined_helper
def add_responses(slot, ladder, co, c, s, out):  # type: ignore[no-untyped-def]
    """Add the response to waves with some coefficients and phases."""
    first = int(ladder.head[FIRST])
    for row in range(int(ladder.head[ROWS])):
        j, a, b = int(ladder.harmonics[row]), co[first + 2 * row], co[first + 2 * row + 1]
        cosine, sine = a * c[j] + b * s[j], a * s[j] - b * c[j]
        if cosine == 0.0 and sine == 0.0:
            continue
        for i in range(out.shape[0]):
            out[i] += cosine * slot.responses[2 * row, i] + sine * slot.responses[2 * row + 1, i]


@helper
def move(slot, y, system):  # type: ignore[no-untyped-def]
    """Multiply a state by the exponential."""
    rows = system.work[:1]
    for i in range(y.shape[0]):
        rows[0, i] = y[i]
        system.work[1, i] = 0.0
    add_product(system.work, 1, rows, 0, slot.exponential)
    for i in range(y.shape[0]):
        y[i] = system.work[1, i]


@helper
def advance_by_responses(slot, ladder, t, y, system):  # type: ignore[no-untyped-def]
    """Advance a state over the part that is kept, with its derivatives by time and by parameters."""
    by_start, waves = system.work[5], system.waves
    start_waves(system, t)
    move(slot, y, system)
    add_responses(slot, ladder, system.co, waves[0], waves[1], y)
    add_responses(slot, ladder, system.co, waves[6], waves[7], by_start)
    for k in range(system.varied.shape[0]):  # they are zero at the start
        add_responses(slot, ladder, system.slopes[k], waves[0], waves[1], system.varied[k])


@helper
def in_matrix(system, first):  # type: ignore[no-untyped-def]
    """Tell whether a parameter is in the matrix."""
    for k in range(system.slopes.shape[0]):
        for j in range(first):
            if system.slopes[k, j] != 0.0:
                return True
    return False


@helper
def in_frequency(system):  # type: ignore[no-untyped-def]
    """Tell whether a parameter is in a frequency that is heard."""
    for k in range(system.dw.shape[0]):
        for j in range(system.dw.shape[1]):
            if system.dw[k, j] != 0.0:
                return True
    return False


@inlined_helper
def advance_kept(motion, piece, t, dt, rate, spread, grown, y, memory, space, system):  # type: ignore[no-untyped-def]
    """Advance a state, its derivatives and the exponential by what is kept; False if nothing is."""
    k, h = cut(rate, dt)
    if k == 0:
        return False
    n, long = y.shape[0], k * h
    at = ladder_of(motion, piece, h, rate, spread, grown, memory, system)
    if at < 0:
        return False
    ladder = ladder_in(memory, at, n, system.co.shape[0])
    place = kept_slot(piece, k, ladder, -1, system.maps[n:], memory, system)
    slot = slot_in(memory, place, n, system.w.shape[0])
    for i in range(n):
        for j in range(n):
            system.maps[i, j] = slot.exponential[j, i]
        system.work[5, i] = 0.0
    rest = dt - long
    terms = terms_for(rate * abs(rest), spread)
    if in_matrix(system, int(ladder.head[FIRST])):
        advance(motion, piece, t, dt, rate, spread, y, system)
    else:
        if k > _LONGEST or ladder.head[ROWS] > n or in_frequency(system):
            move(slot, y, system)
            respond_to_forces(
                motion, piece, k, rate, spread, t, ladder, pairs_in(space, n), y, system
            )
        else:
            know_responses(motion, piece, k, rate, spread, ladder, space, slot, system)
            advance_by_responses(slot, ladder, t, y, system)
        step_by_forces(motion, piece, int(ladder.head[FIRST]), t + long, rest, terms, y, system)
    carry_by_series(motion, piece, rest, terms, system, system.maps[:n])
    return True
