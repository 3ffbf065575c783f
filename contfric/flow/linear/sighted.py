"""An observable along an affine mode without its states: rows that are kept.

The Taylor terms of an observable ``u = c y`` along a step of length h are linear in the state and the phases
at its start. With ``W_m = c A^m h^m / m!`` they are, for forces ``a cos(w t) + b sin(w t)``,

    u_m = W_m y + P_m cos(w t) + Q_m sin(w t),
    P_{m+1} = h / (m + 1) (W_m a + w Q_m),    Q_{m+1} = h / (m + 1) (W_m b - w P_m),    P_0 = Q_0 = 0.

The rows W_m of a step of a fixed length are kept; terms of a shorter one are multiplied by powers of its
share. The state itself is only needed where the next step begins, and is moved there by what is kept of
that step.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from contfric.compiled import helper, inlined_helper
from contfric.flow.linear.kept import (
    FORCED,
    HEAD,
    OF,
    advance_by_responses,
    cut,
    find,
    kept_slot,
    know_responses,
    ladder_of,
    move,
    places_in,
    same,
    slot_in,
)
from contfric.flow.linear.ladder import FIRST, ROWS, STAMP, add_product, ladder_in
from contfric.flow.linear.responses import add_pair, double, pairs_in, write_pairs
from contfric.flow.linear.system import REACH, TERMS, FloatArray, start_waves, terms_for

#: A solution that is no longer than this, in steps, takes one step: the search allows a little more.
_ONE_STEP = 1.04
#: Where the length of the step is in a slot of an observable: it has no responses.
STEP = FORCED
#: Rows with waves, against the number of frequencies, up to which responses to unit forces are kept.
_FEW = 4


class Sight(NamedTuple):
    """What is kept of an observable along a mode.

    Attributes
    ----------
    head : the matrix that it is of, and the length of the step
    co : coefficients of the observable
    rows : W_m in columns, (n, TERMS + 1)
    """

    head: FloatArray
    co: FloatArray
    rows: FloatArray


@inlined_helper
def sight_in(memory, at, n, entries):  # type: ignore[no-untyped-def]
    """Return what is kept of an observable in a slot."""
    a, b = at + HEAD, at + HEAD + entries
    return Sight(
        memory[at:a],
        memory[a:b],
        memory[b : b + (TERMS + 1) * n].reshape((n, TERMS + 1)),
    )


@helper
def observable_row(motion, c, co, h, system, out):  # type: ignore[no-untyped-def]
    """Write the factors of the states in an observable."""
    silence, unit, value = system.waves[4], system.other, system.work[0]
    for i in range(out.shape[0]):
        unit[0, i] = 0.0
    for i in range(out.shape[0]):
        unit[0, i] = 1.0
        motion.look(c, co, silence, silence, silence, h, 0, unit, value)
        unit[0, i] = 0.0
        out[i] = value[0]


@helper
def write_rows(motion, c, h, ladder, sight, system):  # type: ignore[no-untyped-def]
    """Write W of a step."""
    n, row, following = system.work.shape[1], 1, 2
    observable_row(motion, c, sight.co, h, system, system.work[row])
    for m in range(TERMS + 1):
        for i in range(n):
            sight.rows[i, m] = system.work[row, i]
            system.work[following, i] = 0.0
        add_product(system.work, following, system.work, row, ladder.matrix)
        row, following = following, row
        for i in range(n):
            system.work[row, i] *= h / (m + 1.0)
    sight.head[OF], sight.head[STEP] = ladder.head[STAMP], h


@helper
def write_waves(motion, piece, h, sight, seen, system):  # type: ignore[no-untyped-def]
    """Write P and Q of each harmonic for a step, two rows each, from their first terms on."""
    n, silence, phase, work = system.work.shape[1], system.waves[4], system.waves[5], system.work
    scratch = seen.shape[0] - 2
    for i in range(n):
        work[0, i] = 0.0
    for j in range(phase.shape[0]):
        phase[j] = 0.0
    for j in range(phase.shape[0]):
        phase[j] = 1.0
        motion.rates(piece, system.co, work[0], phase, silence, work[1])
        motion.rates(piece, system.co, work[0], silence, phase, work[2])
        phase[j] = 0.0
        for q in range(2):
            for m in range(TERMS + 1):
                seen[scratch + q, m] = 0.0
            add_product(seen, scratch + q, work, 1 + q, sight.rows)
        p, q = seen[2 * j], seen[2 * j + 1]
        for m in range(TERMS):
            f, a, b = h / (m + 1.0), seen[scratch, m], seen[scratch + 1, m]
            p[m + 1], q[m + 1] = f * (a + system.w[j] * q[m]), f * (b - system.w[j] * p[m])


@helper
def sight_of(motion, piece, c, rate, spread, grown, dt, co, memory, space, seen, system):  # type: ignore[no-untyped-def]
    """Return where powers, an observable and its step are kept, -1 for nowhere; and the step's length.

    And the number of forces whose responses are in ``space``: those to unit forces are kept instead (-1)
    where few rows have waves.
    """
    n, entries, waves = system.work.shape[1], system.co.shape[0], system.w.shape[0]
    k, h = cut(rate, dt)
    place = ladder_of(motion, piece, h, rate, spread, grown, memory, system) if k > 0 else -1
    if place < 0:
        return -1, -1, -1, 0.0, -1
    ladder, pairs = ladder_in(memory, place, n, entries), pairs_in(space, n)
    k = math.floor(REACH / (rate * h))
    step = k * h
    slots, _ = places_in(memory, n, entries, waves)
    at, known = find(memory, piece, -1.0 - c, ladder.head[STAMP], -1, slots)
    sight = sight_in(memory, at, n, entries)
    # frequencies may set the step: of one matrix there are steps of several lengths
    if not (known and sight.head[STEP] == step and same(sight.co, co, entries)):
        for j in range(entries):
            sight.co[j] = co[j]
        write_rows(motion, c, step, ladder, sight, system)
    for r in range(2 * waves):
        seen[r, 0] = 0.0
    write_waves(motion, piece, step, sight, seen, system)
    by, count = -1, -1
    if dt > _ONE_STEP * step:
        by = kept_slot(piece, k, ladder, at, system.maps[n:], memory, system)
        slot = slot_in(memory, by, n, waves)
        if ladder.head[ROWS] > min(n, _FEW * waves):
            terms = terms_for(rate * h, spread)
            count = write_pairs(motion, piece, h, terms, int(ladder.head[FIRST]), pairs, system)
            double(ladder, k, pairs, count, system)
        else:
            know_responses(motion, piece, k, rate, spread, ladder, space, slot, system)
    for m in range(TERMS + 1):
        for i in range(n):
            system.other[m, i] = 0.0
    return place, at, by, step, count


@helper
def write_seen(motion, c, memory, at, t, lag, y, h, step, terms, seen, system, poly):  # type: ignore[no-untyped-def]
    """Write the Taylor terms of an observable along a step that begins ``lag`` after the time of a state.

    ``system.other`` has the terms of rest.
    """
    n, waves, w = y.shape[0], system.waves, system.w
    sight = sight_in(memory, at, n, system.co.shape[0])
    start_waves(system, t + lag)
    motion.look(c, sight.co, waves[0], waves[1], w, h, terms, system.other, poly)
    if lag != 0.0:
        start_waves(system, t)
    total, rows = seen.shape[0] - 1, system.work[:1]
    for i in range(n):
        rows[0, i] = y[i]
    for m in range(terms + 1):
        seen[total, m] = 0.0
    for j in range(w.shape[0]):
        for m in range(terms + 1):
            seen[total, m] += seen[2 * j, m] * waves[0, j] + seen[2 * j + 1, m] * waves[1, j]
    add_product(seen, total, rows, 0, sight.rows)
    share, factor = h / step, 1.0
    for m in range(terms + 1):
        poly[m] += factor * seen[total, m]
        factor *= share


@helper
def advance_seen(memory, place, by, t, y, count, space, system):  # type: ignore[no-untyped-def]
    """Advance the state over a step."""
    n, waves = y.shape[0], system.waves
    ladder = ladder_in(memory, place, n, system.co.shape[0])
    slot = slot_in(memory, by, n, system.w.shape[0])
    if count < 0:
        advance_by_responses(slot, ladder, t, y, system)
        return
    start_waves(system, t)
    move(slot, y, system)
    pairs = pairs_in(space, n)
    for q in range(count):
        j = int(pairs.harmonics[q])
        add_pair(pairs, q, waves[0, j], waves[1, j], y)
