"""Long steps along an affine mode, where what is fast has decayed.

A structure that is damped in proportion to its stiffness has rates of decay a of 1e4 where the load takes a
time of 1. What moves with them is over after some 1 / a; a step of 3 / a is as short afterwards as before.
So the terms of an observable ``u = c y`` along a step of length H are taken from the state at a time
``T = 5 H`` before the step begins (the terms of forces: :mod:`contfric.flow.linear.sighted`):

    u_m = V_m y + P_m cos(w t) + Q_m sin(w t),    V_m = c A^m H^m / m! exp(A T),

with y, and the phases, T before. What decays with a rate a has terms

    (a H)^m exp(-5 a H) / m!  <=  (m / (5 e))^m / m!  <  5^-m,

however large a is: none of them sets the length of the step. A solution that began at 0 takes 5 steps of
length H from 5 H to 10 H, then 5 of length 2 H, and so on, from states at 0, H, ... 4 H: their number grows
with the logarithm of its duration, until steps are as long as what does not decay allows. That is seen in the
rows themselves: the last V_m must be below 1e-25 of the first ones, which bounds the remainder of Taylor's
formula, V_41 exp(A s) y for some s <= H.

With ``E = exp(A H / 8)``, which is kept, ``V_m = c (A H E)^m E^(40 - m) / m!``. No factor is large: of what
decays A H E has at most 8 / e. The rounding of the terms is that of a product A E, eps times rate times H.
A root is corrected by the state there, which follows from kept powers without it.
"""

from __future__ import annotations

import math

from contfric.compiled import helper, inlined_helper
from contfric.flow.linear.kept import OF, cut, find, ladder_of, places_in, same
from contfric.flow.linear.ladder import (
    FIRST,
    LEVELS,
    STAMP,
    H,
    add_product,
    extend,
    ladder_in,
    levels_of,
)
from contfric.flow.linear.responses import (
    double_once,
    pairs_in,
    respond_to_forces,
    turn,
    write_pairs,
)
from contfric.flow.linear.sighted import STEP, observable_row, sight_in, write_waves
from contfric.flow.linear.system import TERMS, start_waves, terms_for

#: Shorter solutions take ordinary steps, in units of 1 / rate: rows of ten levels, 0.1 ms each, cost as much.
_LONG = 1000.0
#: T / H.
LAG = 5.0
#: The first length is 2^4 h, one to two units of 1 / rate; a factor E is of 2^3 less.
_FIRST_STEP, _FACTOR = 4, 3
#: Bits of the number of factors.
_BITS = 6
#: The last row against the largest one; the state may grow by 1e5 within a step until that is rounding.
_TAIL = 1e-25
#: What tells the keys of rows of different lengths apart: more than there are observables.
_APART = 2.0**20
#: Rounding of the terms, against ``rate H`` and a value's own: A E cancels to a few units in the last place.
_CANCELS = 0.25


@inlined_helper
def rounded_up(bound, level, rate, step):  # type: ignore[no-untyped-def]
    """Return the bounds of a step's polynomial, with the rounding of its terms at a level."""
    sixth, size = bound
    return sixth, size if level < 0 else size * (1.0 + _CANCELS * rate * step)


@helper
def begin_long(motion, piece, rate, spread, grown, dt, memory, system):  # type: ignore[no-untyped-def]
    """Return where the powers of the matrix are, and when long steps begin: -1 and never where none pays."""
    if memory.shape[0] == 0 or not rate * dt > _LONG:
        return -1, math.inf
    _, h = cut(rate, dt)
    place = ladder_of(motion, piece, h, rate, spread, grown, memory, system) if h > 0.0 else -1
    return place, math.ldexp(LAG * h, _FIRST_STEP) if place >= 0 else math.inf


@helper
def transpose(matrix, out):  # type: ignore[no-untyped-def]
    """Write the transposed matrix to the first rows."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[0]):
            out[j, i] = matrix[i, j]


@helper
def multiply(rows, m, matrix, copy):  # type: ignore[no-untyped-def]
    """Multiply a row by ``I + matrix``."""
    for i in range(rows.shape[1]):
        copy[0, i] = rows[m, i]
    add_product(rows, m, copy, 0, matrix)


@helper
def write_rows(motion, c, level, step, ladder, sight, system):  # type: ignore[no-untyped-def]
    """Write V of a step; its length is kept as 0 where they do not become small."""
    n, rows, power, copy = (
        system.work.shape[1],
        system.series,
        system.maps[: system.work.shape[1]],
        system.work[:1],
    )
    first = level + _FIRST_STEP - _FACTOR
    extend(ladder, first + _BITS)
    observable_row(motion, c, sight.co, step, system, rows[0])
    transpose(ladder.powers[first], power)
    for m in range(TERMS):
        for i in range(n):
            system.work[1, i], rows[m + 1, i] = rows[m, i], 0.0
        multiply(system.work, 1, power, copy)
        for i in range(n):
            system.work[1, i] *= step / (m + 1.0)
        add_product(rows, m + 1, system.work, 1, ladder.matrix)
    for bit in range(_BITS):
        if bit > 0:
            transpose(ladder.powers[first + bit], power)
        for m in range(TERMS):
            if ((TERMS - m) >> bit) & 1 == 1:
                multiply(rows, m, power, copy)
    small = True
    for i in range(n):
        largest = 0.0
        for m in range(TERMS + 1):
            sight.rows[i, m] = rows[m, i]
            largest = max(largest, abs(rows[m, i]))
        small = small and abs(rows[TERMS, i]) <= _TAIL * largest
    sight.head[OF], sight.head[STEP] = ladder.head[STAMP], step if small else 0.0


@helper
def write_lag(motion, piece, c, level, step, count, ladder, sight, pairs, seen, system):  # type: ignore[no-untyped-def]
    """Write P and Q, which begin with the observable of the responses over T."""
    n, once, other, total = system.work.shape[1], pairs.once, pairs.other, pairs.total
    power = ladder.powers[level + _FIRST_STEP]
    for r in range(2 * count):
        for i in range(n):
            total[r, i] = once[r, i]
    for k in range(1, int(LAG)):
        for r in range(2 * count):
            for i in range(n):
                other[r, i] = total[r, i]
            add_product(total, r, other, r, power)
        turn(pairs, count, k * step, system.w, total)
    for i in range(n):
        system.other[0, i] = 0.0
    row = system.work[3]
    observable_row(motion, c, sight.co, step, system, row)
    for r in range(2 * system.w.shape[0]):
        seen[r, 0] = 0.0
    for q in range(count):
        j = int(pairs.harmonics[q])
        for phase in range(2):
            for i in range(n):
                seen[2 * j + phase, 0] += row[i] * total[2 * q + phase, i]
    write_waves(motion, piece, step, sight, seen, system)


@helper
def enter_level(motion, piece, c, level, count, rate, spread, place, used, co, late, system):  # type: ignore[no-untyped-def]
    """Prepare steps of the next length; return (where their rows are, the length, the number of forces).

    -1 as the place where the rows do not become small, or there is no power for them: the search goes on with
    those that it uses, which are not overwritten.
    """
    memory, space, seen = late
    n, entries = system.work.shape[1], system.co.shape[0]
    ladder, pairs = ladder_in(memory, place, n, entries), pairs_in(space, n)
    if level + _FIRST_STEP - _FACTOR + _BITS > LEVELS:
        return -1, 0.0, count
    step = math.ldexp(ladder.head[H], level + _FIRST_STEP)
    slots, _ = places_in(memory, n, entries, system.w.shape[0])
    key, stamp = -1.0 - c - _APART * (level + 1.0), ladder.head[STAMP]
    at, known = find(memory, piece, key, stamp, used, slots)
    sight = sight_in(memory, at, n, entries)
    if not (known and same(sight.co, co, entries)):
        for j in range(entries):
            sight.co[j] = co[j]
        for i in range(n):
            system.other[0, i] = 0.0
        write_rows(motion, c, level, step, ladder, sight, system)
    if sight.head[STEP] == 0.0:
        return -1, 0.0, count
    if level == 0:
        h = ladder.head[H]
        terms = terms_for(rate * h, spread)
        count = write_pairs(motion, piece, h, terms, int(ladder.head[FIRST]), pairs, system)
    for j in range(0 if level == 0 else level + _FIRST_STEP - 1, level + _FIRST_STEP):
        double_once(ladder, j, pairs, count, system)
    write_lag(motion, piece, c, level, step, count, ladder, sight, pairs, seen, system)
    for m in range(TERMS + 1):
        for i in range(n):
            system.other[m, i] = 0.0
    return at, step, count


@helper
def advance_long(place, level, count, t, y, late, system):  # type: ignore[no-untyped-def]
    """Advance the earlier state by a long step."""
    memory, space, _ = late
    n, waves, rows = y.shape[0], system.waves, system.work
    ladder, pairs = ladder_in(memory, place, n, system.co.shape[0]), pairs_in(space, n)
    for i in range(n):
        rows[1, i] = y[i]
    multiply(rows, 1, ladder.powers[level + _FIRST_STEP], rows[:1])
    start_waves(system, t)
    for q in range(count):
        j = int(pairs.harmonics[q])
        for i in range(n):
            rows[1, i] += (
                pairs.once[2 * q, i] * waves[0, j] + pairs.once[2 * q + 1, i] * waves[1, j]
            )
    for i in range(n):
        y[i] = rows[1, i]


@helper
def advance_whole(motion, piece, place, t, duration, rate, spread, y, late, system):  # type: ignore[no-untyped-def]
    """Advance a state by as many steps h as a duration has; return (the time that they take, h)."""
    memory, space, _ = late
    n, rows = y.shape[0], system.work
    ladder, pairs = ladder_in(memory, place, n, system.co.shape[0]), pairs_in(space, n)
    h = ladder.head[H]
    k = int(math.floor(duration / h))
    levels = levels_of(k)
    extend(ladder, levels)
    for i in range(n):
        rows[1, i] = y[i]
    for level in range(levels):
        if (k >> level) & 1 == 1:
            multiply(rows, 1, ladder.powers[level], rows[:1])
    for i in range(n):
        y[i] = rows[1, i]
    respond_to_forces(motion, piece, k, rate, spread, t, ladder, pairs, y, system)
    return k * h, h
