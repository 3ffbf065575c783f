"""At rest under one harmonic: where the load takes a value or is stationary, in closed form.

The load is ``u = x - cos(theta)``, ``theta = Omega t``. It takes the value L where
``theta = +-arccos(x - L)``, and is stationary at the multiples of pi, where it is ``x -+ 1``.
"""

from __future__ import annotations

import math

from contfric.compiled import helper

_TURN = 2.0 * math.pi


@helper
def rest_hit(x, target, w, phase):  # type: ignore[no-untyped-def]
    """Return the time until the load takes a value that it is not near to at first; -1 if never.

    ``phase`` holds sine and cosine of theta at the start.
    """
    return time_to_cosine(x - target, math.atan2(phase[0], phase[1]), w)


@helper
def time_to_cosine(cosine, start, w):  # type: ignore[no-untyped-def]
    """Return the time until cos(theta) takes a value, from an angle in (-pi, pi]; -1 if never."""
    if abs(cosine) > 1.0:
        return -1.0
    angle = math.acos(cosine)
    first = angle - start
    second = -angle - start
    if first <= 0.0:
        first += _TURN
    if second <= 0.0:
        second += _TURN
    return min(first, second if second > 0.0 else second + _TURN) / w


@helper
def rest_stationary(x, w, phase, first, last, times, values):  # type: ignore[no-untyped-def]
    """Write the stationary points of the load between two times; return their number.

    It is -1 if they are too many, or what is given is no solution at rest under an excitation.
    """
    start = math.atan2(phase[0], phase[1])
    if not (w > 0.0 and math.isfinite(start + last)):
        return -1
    count = 0
    turn = (
        math.ceil((start + w * max(first, 0.0)) / math.pi) - 1
    )  # one earlier: the quotient is rounded
    for _ in range(times.shape[0] + 3):
        time = (turn * math.pi - start) / w
        if time >= last:
            return count
        if time > first:
            if count == times.shape[0]:
                return -1
            times[count] = time
            values[count] = x - 1.0 if turn % 2 == 0 else x + 1.0
            count += 1
        turn += 1
    return -1
