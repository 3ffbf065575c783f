"""An observable along an affine mode without its states: rows that are kept.

The Taylor terms of an observable ``u = c y`` along a step are linear in state and phases at its start::

    u_m = W_m y + sum (a c + b s) P_m + (b c - a s) Q_m,    W_m = c A^m h^m / m!,

with P and Q the terms of c U, the responses to unit forces (:mod:`contfric.flow.linear.kept`). W, P and Q
of a step of a fixed length are kept; those of a shorter one are powers of its share. The state itself is
only needed where the next step begins, and is moved there by the kept exponential. Rows cost as much as ten
searches: they are made when the same matrix and frequencies have been asked for some times.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contfric.compiled import inlined_helper
from contfric.flow.linear.kept import (
    FIRST,
    FORCED,
    ROWS,
    H,
    Slot,
    advance_by_responses,
    cut,
    find,
    head_of,
    kept_slot,
    note_waves,
    respond_anew,
    same,
    same_waves,
    slot_in,
)
from contfric.flow.linear.system import REACH, TERMS, FloatArray, start_waves, terms_for

#: How often an observable is asked for before its rows are made: along a branch in a frequency, or in a
#: parameter of the matrix, they would serve one point.
_ASKED = 8.0
#: Longest step that the kept terms are enough for, in steps.
_LONGER = 1.06


class Sight(NamedTuple):
    """What is kept of an observable along a mode.

    Attributes
    ----------
    slot : whose head, coefficients, frequencies and harmonics it has
    co : coefficients of the observable
    rows : W of each state, then P and Q of each row with waves, (n + 2 rows, TERMS + 1)
    """

    slot: Slot
    co: FloatArray
    rows: FloatArray


@inlined_helper
def sight_in(memory, at, n, entries, waves):  # type: ignore[no-untyped-def]
    """Return what is kept of an observable in a slot."""
    a = at + head_of(entries, waves, n)
    b = a + entries
    return Sight(
        slot_in(memory, at, n, entries, waves),
        memory[a:b],
        memory[b : b + 3 * n * (TERMS + 1)].reshape((3 * n, TERMS + 1)),
    )


@inlined_helper
def write_rows(motion, piece, c, h, terms, target, system):  # type: ignore[no-untyped-def]
    """Write W, P and Q of a step."""
    n, unit, silence, y = system.work.shape[1], system.scratch, system.waves[4], system.work[0]
    head = target.slot.head
    first, waves, w = int(head[FIRST]), system.waves, system.w
    for j in range(unit.shape[0]):
        unit[j] = system.co[j] if j < first else 0.0
    start_waves(system, 0.0)
    for q in range(n + 2 * int(head[ROWS])):
        for i in range(n):
            y[i] = 1.0 if i == q else 0.0
        if q >= n:
            unit[first + q - n] = 1.0
        motion.expand(piece, unit, y, waves[0], waves[1], w, h, terms, system.other)
        if q >= n:
            unit[first + q - n] = 0.0
        motion.look(c, target.co, silence, silence, w, h, terms, system.other, target.rows[q])


@inlined_helper
def sight_of(motion, piece, c, rate, spread, dt, sight, memory, system):  # type: ignore[no-untyped-def]
    """Return where an observable is kept, and where the exponential of its step is; -1: nowhere.

    And the length of a step.
    """
    n, entries, waves = system.work.shape[1], system.co.shape[0], system.w.shape[0]
    k, h = cut(rate, dt)
    if k == 0.0:
        return -1, -1, 0.0
    k = math.floor(REACH / (rate * h))
    step = k * h
    at, known = find(memory, piece, -1.0 - c, step, n, -1, system)
    if at < 0:
        return -1, -1, 0.0
    target = sight_in(memory, at, n, entries, waves)
    slot, head = target.slot, target.slot.head
    if not (known and same(target.co, sight, entries) and same_waves(slot, system)):
        head[H] = step
        note_waves(motion, piece, system.scratch, system.waves[5], slot)
        for j in range(entries):
            slot.co[j], target.co[j] = system.co[j], sight[j]
        for j in range(waves):
            slot.w[j] = system.w[j]
        head[FORCED] = -_ASKED
    if head[ROWS] > n:
        return -1, -1, 0.0
    if head[FORCED] < 0.0:
        head[FORCED] += 1.0
        if head[FORCED] < 0.0:
            return -1, -1, 0.0
        write_rows(motion, piece, c, step, terms_for(_LONGER * rate * step, spread), target, system)
        head[FORCED] = 1.0
    by = kept_slot(motion, piece, k, h, spread, at, memory, system)
    if by < 0:
        return -1, -1, 0.0
    moved = slot_in(memory, by, n, entries, waves)
    respond_anew(motion, piece, k, h, spread, moved, system)
    for m in range(TERMS + 1):
        for i in range(n):
            system.other[m, i] = 0.0
    return at, by, step


@inlined_helper
def write_seen(motion, c, memory, at, t, y, h, terms, system, poly):  # type: ignore[no-untyped-def]
    """Write the Taylor terms of an observable along a step; ``system.other`` has those of rest."""
    n, waves, w = y.shape[0], system.waves, system.w
    target = sight_in(memory, at, n, system.co.shape[0], w.shape[0])
    slot = target.slot
    start_waves(system, t)
    motion.look(c, target.co, waves[0], waves[1], w, h, terms, system.other, poly)
    first, share = int(slot.head[FIRST]), h / slot.head[H]
    for row in range(n + 2 * int(slot.head[ROWS])):
        factor = 0.0
        if row < n:
            factor = y[row]
        else:
            place = (row - n) // 2
            j, a, b = int(slot.harmonics[place]), first + 2 * place, first + 2 * place + 1
            factor = system.co[a] * waves[0, j] + system.co[b] * waves[1, j]
            if (row - n) % 2 == 1:
                factor = system.co[b] * waves[0, j] - system.co[a] * waves[1, j]
        if factor == 0.0:
            continue
        for m in range(terms + 1):
            poly[m] += factor * target.rows[row, m]
            factor *= share


@inlined_helper
def advance_seen(memory, by, t, y, system):  # type: ignore[no-untyped-def]
    """Advance the state over a step."""
    slot = slot_in(memory, by, y.shape[0], system.co.shape[0], system.w.shape[0])
    advance_by_responses(slot, t, y, system)
