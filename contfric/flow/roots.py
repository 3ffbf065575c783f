"""Roots along a segment of the forced oscillator: where u, v or their rates take a value.

Pieces of two radians are settled by certificates (:mod:`contfric.flow.pieces`); where they leave it open
(beside a grazing) the march by Taylor's remainder (:mod:`contfric.flow.march`) goes on.
"""

from __future__ import annotations

import math

from contfric.compiled import helper
from contfric.flow.march import leaving_step, reached, safe_step, window_of
from contfric.flow.motion import natural_scale, quantity, scale_there, sixth_bound, third_bound
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
    """Return the sign that a function takes behind a root."""
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
    times, values : places for the interior roots of a rate, and for the observable there

    Returns
    -------
    tuple
        (number of roots, -1 if they do not fit or the search is too long; the last one found, -1 if none,
        no number if the search is too long; x there where c is the speed and it is known, else nan).
    """
    single = order == 0
    natural = natural_scale(mode, p)
    longest = PIECE * natural
    if not single:
        longest = end / math.ceil(end / longest)
    first, last = interior_of(end)
    x0, v0 = y0[0], y0[1]
    tau, leaving, count, pieces = 0.0, on, 0, 0
    q, q1, q2, _, size, value, fast = quantity(mode, c, order, p, phase, t0, x0, v0, 0.0)
    q -= target
    scale = scale_there(mode, p, natural, fast)
    length = min(longest, PIECE * scale)
    if not single:
        leaving = abs(q) <= AT_START * (1.0 + size)
    stop = end if single else last  # what lies behind the last place is at the joint
    while tau < stop:
        pieces += 1
        if pieces > MOST_PIECES:
            return -1, math.nan, math.nan
        if leaving and abs(q1) <= AT_START * (1.0 + size):
            q1 = 0.0  # the rate vanishes at the start (a release with S0 = S): rounding is no sign
        if sign == 0.0:
            sign = leaving_side(q1, q2) if leaving or q == 0.0 else math.copysign(1.0, q)
        root, slope, found = tau, q1, not leaving and sign * q <= 0.0
        if not found:
            after = min(end, tau + length)
            step = after - tau
            r, r1, r2, _, size_r, value_r, fast_r = quantity(
                mode, c, order, p, phase, t0, x0, v0, after
            )
            r -= target
            s2 = step * step
            error = sixth_bound(mode, c, order, p, size, fast, step) * s2 * s2 * s2
            before = 0.0 if leaving else sign * q
            ends = coefficients(before, sign * q1, sign * q2, sign * r, sign * r1, sign * r2, step)
            outcome, low, high, here = scan(ends, error, leaving)
            if outcome == ISOLATED:
                root, slope, at_root = refined(
                    mode,
                    c,
                    order,
                    target,
                    sign,
                    phase,
                    t0,
                    x0,
                    v0,
                    p,
                    tau + low * step,
                    (high - low) * step,
                    root_of(here),
                )
                if single:
                    return 1, root, at_root
                if first < root < last:
                    if count == times.shape[0]:
                        return -1, root, math.nan
                    times[count], values[count] = root, at_root
                    count += 1
                sign = -sign  # and behind the root, up to the end of the part, it falls further
                if high < 1.0:
                    after = tau + high * step
                    r, r1, r2, _, size_r, value_r, fast_r = quantity(
                        mode, c, order, p, phase, t0, x0, v0, after
                    )
                    r -= target
            if outcome != UNSURE:
                tau, leaving, length = after, False, min(longest, 2.0 * length)
                q, q1, q2, size, value, fast = r, r1, r2, size_r, value_r, fast_r
                continue
            scale = scale_there(mode, p, natural, fast)
            length = max(0.5 * step, SHORTEST * scale)
            if low > 0.0:
                step = low * step
            elif leaving and q1 == 0.0 and abs(q2) <= FLAT * (1.0 + size):
                # a third-order start, such as a release at the largest force: what the first two rates
                # leave is rounding, and the third decides on which side of the root the function is
                step = SHORTEST * scale
                beyond = quantity(mode, c, order, p, phase, t0, x0, v0, tau + step)[0] - target
                found = sign * beyond <= 0.0
                step = 0.0 if found else step
            elif leaving:
                bound = third_bound(mode, c, order, p, size, fast, scale)
                step = min(leaving_step(sign * q1, sign * q2, bound), scale)
                found = step <= 0.0
            else:
                step, found = taylor_step(
                    mode, c, order, sign, p, q, q1, q2, size, fast, scale, tau
                )
                root = tau + step
                value += step * (q + step * (0.5 * q1 + step * q2 / 6.0))
            moved = tau + step
            tau = moved if moved > tau or found else end  # a root at the end, to the last digit
        if found:
            if single:
                return 1, root, math.nan
            if root >= last:
                return count, root, math.nan
            if root > first:
                if count == times.shape[0]:
                    return -1, root, math.nan
                times[count], values[count] = root, value
                count += 1
            leaving = sign * slope < 0.0
            sign = -sign if leaving else 0.0
            if not leaving:  # a double root: the rate touches zero; go past its resolution
                tau += PAST * scale_there(mode, p, natural, fast)
        else:
            leaving = False
        q, q1, q2, _, size, value, fast = quantity(mode, c, order, p, phase, t0, x0, v0, tau)
        q -= target
    return count, -1.0, math.nan


@helper
def taylor_step(mode, c, order, sign, p, q, q1, q2, size, fast, natural, tau):  # type: ignore[no-untyped-def]
    """Return a step that passes no root, and whether it has come to one."""
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
def refined(mode, c, order, target, sign, phase, t0, x0, v0, p, start, width, share):  # type: ignore[no-untyped-def]
    """Return the only root of a falling function in a bracket, its rate and the observable there.

    By the inverse of Taylor's polynomial (of third order for an observable, of second for a rate)::

        t = -r - A r^2 - (2 A^2 - B) r^3,   r = q / q', A = q" / 2 q', B = q^(3) / 6 q',

    whose error is ``(5 A^3 - 5 A B + C) r^4``, C = q^(4) / 24 q', or ``(2 A^2 - B) r^3``.
    """
    low, high = start, start + width
    tau = start + share * width
    q1, value = 0.0, 0.0
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
                return tau, q1, value
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
                return following, q1 + q2 * shift, value
        else:
            value += shift * (q + shift * (0.5 * q1 + shift * q2 / 6.0))
            left = (2.0 * bend * bend + next_bound / abs(6.0 * q1)) * cube
            # what Taylor's formula leaves of the value must be rounding, too
            accurate = next_bound * cube * abs(shift) / 24.0 <= EPS * (1.0 + size)
            if accurate and left <= AT_STATIONARY * (1.0 + following):
                return following, q1 + q2 * shift, value
        if abs(shift) <= 4.0 * EPS * following:
            return following, q1, value
        tau = following
    return tau, q1, value
