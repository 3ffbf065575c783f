"""Roots along a step of an affine mode, on the Taylor polynomial itself.

Along a step the observable is its Taylor polynomial to rounding, and so are its derivatives. The step is
looked at piece by piece with the certificates of :mod:`contfric.flow.pieces`, whose bound of the sixth
derivative is the sum of the polynomial's own terms. A motion that starts on the level leaves it with the
first power of time whose factor is not rounding; what is searched then is the quotient by that power.
"""

from __future__ import annotations

import math

from contfric.compiled import helper, inlined_helper
from contfric.flow.linear.flow import MOST_STEPS
from contfric.flow.linear.kept import growth_known
from contfric.flow.linear.system import (
    REACH,
    evaluate,
    growth,
    silenced,
    start_waves,
)
from contfric.flow.pieces import FREE, ISOLATED, coefficients, root_of, scan

#: A rate at the start below this, relative to 1 + the next one, is rounding.
AT_START = 1e-13
#: A second rate at the start this small leaves less than the third does after the first moments.
FLAT = 1e-7
#: Shortest piece, as a share of a step: a double root differs from a near miss by its square, rounding.
SHORTEST = 1e-8
#: Rounding of a value, against the sum of the terms: a few units in the last place, in the unit of the
#: certificates' bound of values.
_ROUNDING = 1e-15 * 46080.0
#: A piece whose values are all below this, against the sum of the terms, is rounding whatever its length:
#: the level is touched there by a zero of high order.
ROUNDED = 2e-15
#: Most pieces of a step: a regular one has one to ten, each double root about 30 more.
MOST_PIECES = 3000


@inlined_helper
def write_series(motion, piece, sight, c, target, t, y, h, terms, system, poly):  # type: ignore[no-untyped-def]
    """Write the Taylor terms of the state along a step, and of an observable less a target."""
    series, waves, w = system.series, system.waves, system.w
    start_waves(system, t)
    motion.expand(piece, system.co, y, waves[0], waves[1], w, h, terms, series)
    motion.look(c, sight, waves[0], waves[1], w, h, terms, series, poly)
    poly[0] -= target


@inlined_helper
def value_at_end(poly, first, terms):  # type: ignore[no-untyped-def]
    """Return the same at s = 1."""
    q, q1, q2 = 0.0, 0.0, 0.0
    for k in range(terms, first - 1, -1):
        m, here = k - first, poly[k]
        q += here
        q1 += m * here
        q2 += m * (m - 1) * here
    return q, q1, q2


@helper
def value_at(poly, first, terms, s):  # type: ignore[no-untyped-def]
    """Return the polynomial from its term ``first`` on, with two derivatives."""
    q, q1, q2 = 0.0, 0.0, 0.0
    for k in range(terms, first - 1, -1):
        q2 = q2 * s + q1
        q1 = q1 * s + q
        q = q * s + poly[k]
    return q, q1, 2.0 * q2


@inlined_helper
def sixth_of(poly, first, terms):  # type: ignore[no-untyped-def]
    """Return a bound of the polynomial's sixth derivative over a step, and the sum of its terms."""
    bound, size = 0.0, 0.0
    for k in range(first, terms + 1):
        m, here = k - first, abs(poly[k])
        size += here
        if m >= 6:
            bound += here * (m * (m - 1) * (m - 2)) * ((m - 3) * (m - 4) * (m - 5))
    return bound, size


@inlined_helper
def leaving(poly, terms, h):  # type: ignore[no-untyped-def]
    """Return the power with which a solution leaves the level that it starts on; beyond the terms: never."""
    q1, q2, q3 = poly[1] / h, 2.0 * poly[2] / (h * h), 6.0 * poly[3] / (h * h * h)
    if abs(q1) > AT_START * (1.0 + abs(q2)):
        return 1
    if abs(q2) > FLAT * (1.0 + abs(q3)):
        return 2
    largest = 0.0
    for k in range(3, terms + 1):
        largest = max(largest, abs(poly[k]))
    if largest <= AT_START * AT_START:
        return terms + 1
    for k in range(3, terms):
        if abs(poly[k]) > FLAT * largest:
            return k
    return terms


@inlined_helper
def refine(poly, first, terms, sign, low, high, s):  # type: ignore[no-untyped-def]
    """Return the only root in a bracket, on the way from positive to negative."""
    for _ in range(100):  # bisection alone needs 60
        q, q1, _ = value_at(poly, first, terms, s)
        if sign * q > 0.0:
            low = s
        else:
            high = s
        shift = -q / q1 if q1 != 0.0 else math.inf
        following = s + shift
        if not low <= following <= high:
            if high - low <= 4e-16 * high:
                return s
            following = 0.5 * (low + high)
        elif abs(shift) <= 1e-9 * s:  # the square of that is rounding
            return following
        s = following
    return s


@helper
def first_root(poly, first, terms, begin, sign, bound):  # type: ignore[no-untyped-def]
    """Return the first root in (begin, 1] of a polynomial that starts on the side ``sign``.

    Returns
    -------
    tuple
        (the root; -1 without one, no number if the search is too long; a place after it up to which
        there is no other one).
    """
    sixth, rounding = bound[0], _ROUNDING * bound[1]
    a, width = begin, 1.0 - begin
    q, q1, q2 = poly[first], poly[first + 1], 2.0 * poly[first + 2]
    if a > 0.0:
        q, q1, q2 = value_at(poly, first, terms, a)
    for _ in range(MOST_PIECES):
        b = min(1.0, a + width)
        if 1.0 - b < SHORTEST:
            b = 1.0
        length = b - a
        r, r1, r2 = (
            value_at_end(poly, first, terms) if b == 1.0 else value_at(poly, first, terms, b)
        )
        ends = coefficients(sign * q, sign * q1, sign * q2, sign * r, sign * r1, sign * r2, length)
        cube = length * length * length
        outcome, low, high, here = scan(ends, sixth * cube * cube + rounding, False)
        if outcome == ISOLATED:
            low, high = a + low * length, a + high * length
            return refine(
                poly, first, terms, sign, low, high, low + (high - low) * root_of(here)
            ), high
        size = max(
            abs(ends[0]), abs(ends[1]), abs(ends[2]), abs(ends[3]), abs(ends[4]), abs(ends[5])
        )
        if outcome != FREE and (length <= SHORTEST or size <= ROUNDED * bound[1]):
            if sign * r <= 0.0:
                return refine(poly, first, terms, sign, a, b, 0.5 * (a + b)), b
            outcome = FREE
        if outcome == FREE:
            if b == 1.0:
                return -1.0, 1.0
            a, q, q1, q2, width = b, r, r1, r2, 2.0 * length
            continue
        width = 0.5 * length
        if low > 0.0:
            a += low * length
            q, q1, q2 = value_at(poly, first, terms, a)
    return math.nan, 1.0


@inlined_helper
def state_at(series, terms, s, out):  # type: ignore[no-untyped-def]
    """Write the state within a step."""
    for i in range(out.shape[0]):
        y = 0.0
        for k in range(terms, -1, -1):
            y = y * s + series[k, i]
        out[i] = y


@inlined_helper
def begin_search(motion, piece, c, t0, y0, dt, p, none, memory, system, sight):  # type: ignore[no-untyped-def]
    """Evaluate the system and the observable; return the rate (no number: no solution) and the spread.

    And the rate of the matrix alone.
    """
    evaluate(motion, piece, p, none, system)
    if memory.shape[0] > 0:
        grown, spread = growth_known(motion, piece, memory, system)
    else:
        grown, spread = growth(motion, piece, system)
    motion.entries_seen(c, p, none, sight, system.slopes)
    motion.audible_seen(c, sight, system.waves[5])
    rate = silenced(grown, system)
    size = t0 + dt
    for i in range(y0.shape[0]):
        size += y0[i]
        system.work[4, i] = y0[i]
    if not (math.isfinite(size) and rate * dt < REACH * MOST_STEPS):
        return math.nan, spread, grown
    return rate, spread, grown


@inlined_helper
def next_length(rate, left):  # type: ignore[no-untyped-def]
    """Return the length of the next step: no tiny last one."""
    h = REACH / rate if rate > 0.0 else left
    return left if left <= 1.05 * h else h
