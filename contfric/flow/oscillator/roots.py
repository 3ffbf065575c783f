"""Roots along a segment of the forced oscillator: where u, v or their rates take a value.

Pieces of two radians are decided by certificates (:mod:`contfric.flow.pieces`); where they leave it open
(near a grazing) the march by Taylor's remainder (:mod:`contfric.flow.oscillator.march`) goes on.
"""

from __future__ import annotations

import math

from contfric.compiled import helper, inlined_helper
from contfric.flow.oscillator.march import leaving_step, reached, safe_step, window_of
from contfric.flow.oscillator.motion import (
    natural_scale,
    quantity,
    scale_there,
    sixth_bound,
    third_bound,
)
from contfric.flow.pieces import ISOLATED, UNSURE, coefficients, root_of, scan

#: Below this fraction of the natural scale a stationary value at the start counts as being there.
AT_START = 1e-13
#: Error of a stationary time, relative to 1 + the time, at which its search ends: its square counts.
AT_STATIONARY = 2e-10
#: A second rate this small leaves less than the third does on the way to the end of a shortest piece.
FLAT = 1e-7
#: Shortest piece, in natural scales: below it Taylor's march alone goes on.
SHORTEST = 0.02
#: Step past a double root, in natural scales: the square root of rounding.
PAST = 1e-8
#: Length of a piece in natural scales: the interpolation error is about 1e-3 of the size there.
PIECE = 2.2
EPS = 2.220446049250313e-16
#: Most pieces of a search, a tenth of a second: a segment of an orbit has a few, a thousand at the slowest
#: excitations. Iterates of Newton's method on their way to nowhere ask for any number.
MOST_PIECES = 1_000_000


@helper
def leaving_side(q1, q2):  # type: ignore[no-untyped-def]
    """Return the sign that a function takes after a root."""
    return 1.0 if (q1 > 0.0 or (q1 == 0.0 and q2 > 0.0)) else -1.0


@helper
def interior_of(end):  # type: ignore[no-untyped-def]
    """Return where the interior of a segment begins and ends.

    A stationary point within its own error of a joint is at the joint.
    """
    near = 2.0 * AT_STATIONARY * (1.0 + end)
    return min(near, 0.5 * end), max(end - near, 0.5 * end)


@helper
def roots_along(mode, c, order, target, on, sign, phase, t0, y0, end, p, times, values):  # type: ignore[no-untyped-def]
    """Find the first root of an observable less a target, or (order 1) all roots of its rate.

    Parameters
    ----------
    on, sign : whether q takes the target at the start itself, which does not count, and the side to
        which it leaves (0: found from the derivatives)
    times, values : where the interior roots of a rate are written to, with the observable there

    Returns
    -------
    tuple
        (number of roots, -1 if they do not fit or the search is too long; the last one found, -1 if none,
        no number if the search is too long; x there where c is the speed and it is known, else nan).
    """
    what = mode, c, order, p, target, phase, t0, y0[0], y0[1]
    single, natural, (first, last) = order == 0, natural_scale(mode, p), interior_of(end)
    longest = PIECE * natural if single else end / math.ceil(end / (PIECE * natural))
    stop = end if single else last  # a root of a rate after the last place is at the joint
    tau, count, here = 0.0, 0, state_at(what, 0.0)
    length = min(longest, PIECE * scale_there(mode, p, natural, here[5]))
    leaving = on if single else abs(here[0]) <= AT_START * (1.0 + here[3])
    for _ in range(MOST_PIECES):
        if not tau < stop:
            return count, -1.0, math.nan
        here, sign = with_side(here, leaving, sign)
        q, q1, q2, _, value, fast = here
        root, found = tau, not leaving and sign * q <= 0.0
        if not found:
            after = min(end, tau + length)
            step = after - tau
            outcome, low, root, seen, after, there = certified(
                what, leaving, sign, here, tau, after
            )
            if outcome == ISOLATED:
                if single:
                    return 1, root, seen
                count = add_root(root, seen, first, last, count, times, values)
                if count < 0:
                    return -1, root, math.nan
                sign = -sign  # and after the root, up to the end of the part, it falls further
            if outcome != UNSURE:
                tau, leaving, length, here = after, False, min(longest, 2.0 * length), there
                continue
            scale = scale_there(mode, p, natural, fast)
            length = max(0.5 * step, SHORTEST * scale)
            step, found = open_step(what, leaving, sign, here, scale, tau, low * step)
            root = tau + step
            value += step * (q + step * (0.5 * q1 + step * q2 / 6.0))
            tau = root if root > tau or found else end  # a root at the end, to the last digit
        leaving = found and sign * q1 < 0.0
        if found:
            if single or root >= last:
                return (1 if single else count), root, math.nan
            count = add_root(root, value, first, last, count, times, values)
            if count < 0:
                return -1, root, math.nan
            sign = -sign if leaving else 0.0
            if not leaving:  # a double root: the rate touches zero; go past its resolution
                tau += PAST * scale_there(mode, p, natural, fast)
        here = state_at(what, tau)
    return -1, math.nan, math.nan


# What is searched for is a tuple: (mode, observable, order, parameters, target, phase, t0, x0, v0). It goes
# by value, as each of its parts would. A state is (q less the target, q', q", E, value, G) of `quantity`.


@inlined_helper
def state_at(what, tau):  # type: ignore[no-untyped-def]
    """Return the state of a search at a time."""
    mode, c, order, p, target, phase, t0, x0, v0 = what
    q, q1, q2, _, size, value, fast = quantity(mode, c, order, p, phase, t0, x0, v0, tau)
    return q - target, q1, q2, size, value, fast


@inlined_helper
def with_side(here, leaving, sign):  # type: ignore[no-untyped-def]
    """Return the state at the start of a piece, and the side that the function is on or leaves to."""
    q, q1, q2, size, value, fast = here
    if leaving and abs(q1) <= AT_START * (1.0 + size):
        q1 = 0.0  # the rate vanishes at the start (a release with S0 = S): rounding is no sign
    if sign == 0.0:
        sign = leaving_side(q1, q2) if leaving or q == 0.0 else math.copysign(1.0, q)
    return (q, q1, q2, size, value, fast), sign


@inlined_helper
def certified(what, leaving, sign, here, tau, end):  # type: ignore[no-untyped-def]
    """Look for a root from ``tau`` to ``end`` by certificates.

    Returns
    -------
    tuple
        (outcome, share of the piece that has no root for sure, root, value there, end of the part that is
        decided, state there).
    """
    mode, c, order, p = what[:4]
    q, q1, q2, size, _, fast = here
    step, there = end - tau, state_at(what, end)
    r, r1, r2 = there[:3]
    s2 = step * step
    error = sixth_bound(mode, c, order, p, size, fast, step) * s2 * s2 * s2
    before = 0.0 if leaving else sign * q
    ends = coefficients(before, sign * q1, sign * q2, sign * r, sign * r1, sign * r2, step)
    outcome, low, high, part = scan(ends, error, leaving)
    root, value = end, 0.0
    if outcome == ISOLATED:
        root, value = refined(what, sign, tau + low * step, (high - low) * step, root_of(part))
        if order != 0 and high < 1.0:
            end = tau + high * step
            there = state_at(what, end)
    return outcome, low, root, value, end, there


@inlined_helper
def add_root(root, value, first, last, count, times, values):  # type: ignore[no-untyped-def]
    """Write a root in the interior of the segment; return how many there are, -1 if it does not fit."""
    if not first < root < last:
        return count
    if count == times.shape[0]:
        return -1
    times[count], values[count] = root, value
    return count + 1


@helper
def open_step(what, leaving, sign, here, scale, tau, free):  # type: ignore[no-untyped-def]
    """Return a step that passes no root, and whether it ends at one; certificates have none in ``free``."""
    if free > 0.0:
        return free, False
    mode, c, order, p = what[:4]
    _, q1, q2, size, _, fast = here
    if leaving and q1 == 0.0 and abs(q2) <= FLAT * (1.0 + size):
        # a third-order start, such as a release at the largest force: what the first two rates
        # leave is rounding, and the third decides on which side of the root the function is
        step = SHORTEST * scale
        return (0.0, True) if sign * state_at(what, tau + step)[0] <= 0.0 else (step, False)
    if leaving:
        bound = third_bound(mode, c, order, p, size, fast, scale)
        step = min(leaving_step(sign * q1, sign * q2, bound), scale)
        return step, step <= 0.0
    return taylor_step(what, sign, here, scale, tau)


@helper
def taylor_step(what, sign, here, natural, tau):  # type: ignore[no-untyped-def]
    """Return a step that passes no root, and whether it has come to one."""
    mode, c, order, p = what[:4]
    q, q1, q2, size, _, fast = here
    w = sign * q
    window = window_of(w, sign * q1, natural)
    bound = third_bound(mode, c, order, p, size, fast, window)
    step = safe_step(w, sign * q1, sign * q2, bound, window)
    if step >= window:
        return step, False
    # the remainder of Taylor's formula against the slope that is left at the root
    resolution = 0.0 if order == 0 else AT_STATIONARY  # a root goes to the resolution of time
    slope = -sign * (q1 + q2 * step) - bound * step * step
    error = bound * step * step * (window + step) / 6.0
    return step, reached(step, tau + step) or error < slope * resolution * (1.0 + tau + step)


@helper
def refined(what, sign, start, width, share):  # type: ignore[no-untyped-def]
    """Return the only root of a falling function in a bracket, and the observable there.

    By the inverse of Taylor's polynomial (of third order for an observable, of second for a rate)::

        t = -r - A r^2 - (2 A^2 - B) r^3,   r = q / q', A = q" / 2 q', B = q^(3) / 6 q',

    whose error is ``(5 A^3 - 5 A B + C) r^4``, C = q^(4) / 24 q', or ``(2 A^2 - B) r^3``.
    """
    mode, c, order, p, target, phase, t0, x0, v0 = what
    low, high = start, start + width
    tau, value = start + share * width, 0.0
    for _ in range(100):  # bisection alone needs 60
        q, q1, q2, q3, size, value, fast = quantity(mode, c, order, p, phase, t0, x0, v0, tau)
        q -= target
        if sign * q > 0.0:
            low = tau
        else:
            high = tau
        ratio, bend, third = q / q1, 0.5 * q2 / q1, q3 / (6.0 * q1)
        shift = -ratio * (1.0 + ratio * bend)
        if order == 0:
            shift -= ratio**3 * (2.0 * bend * bend - third)
        following = tau + shift
        if not low <= following <= high:
            if high - low <= 4.0 * EPS * high:
                return tau, value
            tau = 0.5 * (low + high)
            continue
        # a rate's third derivative is the fourth one of its observable
        next_bound = third_bound(mode, c, 1, p, size, fast, abs(shift))
        cube = abs(ratio) ** 3
        if order == 0:
            value += shift * (
                q + target + shift * (0.5 * q1 + shift * (q2 + 0.25 * shift * q3) / 6.0)
            )
            fourth = 5.0 * abs(bend) * (bend * bend + abs(third)) + next_bound / abs(24.0 * q1)
            if fourth * cube * abs(ratio) <= 0.5 * EPS * following:
                return following, value
        else:
            value += shift * (q + shift * (0.5 * q1 + shift * q2 / 6.0))
            left = (2.0 * bend * bend + next_bound / abs(6.0 * q1)) * cube
            # what Taylor's formula leaves of the value must be rounding, too
            accurate = next_bound * cube * abs(shift) / 24.0 <= EPS * (1.0 + size)
            if accurate and left <= AT_STATIONARY * (1.0 + following):
                return following, value
        if abs(shift) <= 4.0 * EPS * following:
            return following, value
        tau = following
    return tau, value
