"""Whether a value with the same sign at both ends of a step may change it twice in between, compiled.

By the interpolation that what is known of it allows; :mod:`contfric.continuation.core.pairs` says where each
is used.
"""

from __future__ import annotations

import math

from contfric.bvp.stationary_values import HERE
from contfric.compiled import helper
from contfric.continuation.core.steps import EXTRA

#: Share of the smaller end value above which the minimum of an interpolation is believed to stay positive.
_SURE = 0.2
#: Slopes are computed where a value is smaller than this times its change over two steps (see above).
_NEAR = 1.0


@helper
def changes_much(near, f0, f1, f2):  # type: ignore[no-untyped-def]
    """Tell whether a value changes by so much over two steps that it may be zero within the second one."""
    return near < _NEAR * (abs(f1 - f0) + abs(f2 - f1))


@helper
def earlier_of(at, share):  # type: ignore[no-untyped-def]
    """Return the smaller of two shares of a step; 0 stands for none."""
    return share if share > 0.0 and (at == 0.0 or share < at) else at


@helper
def dips(way, tests, k, arc, value, step):  # type: ignore[no-untyped-def]
    """Tell whether some test, positive at both ends of a step, is likely to be negative within.

    By the parabola through the last two points and the new one. What a label changes at has slopes, and is
    the least of many distances: no parabola.
    """
    back = arc[k] - arc[k - 1]
    followed, interior = way.workspace.followed, way.layout.interior.shape[0]
    here = followed.slots[HERE]
    last = value.shape[0] - EXTRA
    first = last - way.layout.labels.shape[0]
    for j in range(value.shape[0]):
        if first <= j < last and followed.counts[here, interior + j - first] >= 0:
            continue
        f0, f1, f2 = tests[k - 1, j], tests[k, j], value[j]
        if not (f0 * f1 > 0.0 and f1 * f2 > 0.0) or not math.isfinite(f0 * f1 * f2):
            continue
        slope0 = (f1 - f0) / back
        slope1 = (f2 - f1) / step
        bend = (slope1 - slope0) / (back + step)
        slope = slope1 - bend * step  # at the start of the step
        if bend * f1 <= 0.0 or slope * f1 >= 0.0:
            continue
        at = -slope / (2.0 * bend)
        if at < step and abs(f1) + 0.5 * slope * at * math.copysign(1.0, f1) < _SURE * min(
            abs(f1), abs(f2)
        ):
            return True
    return False


@helper
def cubic_dip(f1, g1, f2, g2, length):  # type: ignore[no-untyped-def]
    """Return the share of a step at which the cubic through two ends comes near zero; 0 if nowhere.

    Its values f1 and f2 there have one sign; g1 and g2 are its slopes.
    """
    sign = math.copysign(1.0, f1)
    start, end, rise = sign * g1 * length, sign * g2 * length, sign * (f2 - f1)
    square, cube = 3.0 * rise - 2.0 * start - end, start + end - 2.0 * rise
    root = square * square - 3.0 * start * cube  # of start + 2 square x + 3 cube x^2
    if root <= 0.0:
        return 0.0
    both = -(square + math.copysign(math.sqrt(root), square))
    least, at = _SURE * min(abs(f1), abs(f2)), 0.0
    for k in range(2):
        above, below = (both, 3.0 * cube) if k == 0 else (start, both)
        if below == 0.0:
            continue
        x = above / below
        value = abs(f1) + x * (start + x * (square + x * cube))
        if 0.0 < x < 1.0 and value < least:
            least, at = value, x
    return at


@helper
def mean_dip(s1, s2, mean):  # type: ignore[no-untyped-def]
    """Return the share of a step at which the parabola with two end values and a mean comes near zero."""
    if not s1 * s2 > 0.0:
        return 0.0
    sign = math.copysign(1.0, s1)
    slope, bend = sign * (6.0 * mean - 4.0 * s1 - 2.0 * s2), 3.0 * sign * (s1 + s2 - 2.0 * mean)
    if bend <= 0.0 or not 0.0 < -slope < 2.0 * bend:
        return 0.0
    x = -0.5 * slope / bend
    return x if abs(s1) + 0.5 * slope * x < _SURE * min(abs(s1), abs(s2)) else 0.0
