"""Stationary values that touch a surface twice within one step, compiled.

What is looked for, and why that is enough, is in :mod:`contfric.continuation.core.pairs`. Values of two
points of a branch belong together where each is the nearest to the other, in value and time.
"""

from __future__ import annotations

import math

from contfric.bvp.monitor import count_margins
from contfric.bvp.stationary_values import (
    BEFORE,
    EARLIER,
    HERE,
    segment_and_observable,
    stationary_slope,
)
from contfric.compiled import helper
from contfric.continuation.core.dips import changes_much, cubic_dip, earlier_of

#: Within a step nothing changes by more than this times its length: an observable of the motion changes a few
#: times as much as its joints, each of which changes by the root of their number times it at most.
_FAR = 30.0
#: A value this small at a point is zero there: a curve of tangencies is pinned to it.
PINNED = 1e-9
#: Changes of a label that are nearer to each other than this share of a step are one to rounding.
_TOGETHER = 1e-6


@helper
def set_parameters(way, points, row):  # type: ignore[no-untyped-def]
    """Set the parameters of a way to those of a point."""
    for k in range(way.which.shape[0]):
        way.p[way.which[k]] = points.w[row, k]


@helper
def slope_at(way, points, row, i, c, time, surface):  # type: ignore[no-untyped-def]
    """Return the slope of a stationary value less the level of a surface, at one row of the points."""
    set_parameters(way, points, row)
    equations, slopes = way.workspace.equations, points.directions[row]
    start, moves = points.joints[row, i], points.tangents[row, i]
    slope = stationary_slope(
        way.functions, way.layout, i, c, time, start, moves, way.p, way.which, slopes, equations
    )
    way.functions.level(surface, way.p, way.which, equations.level_grad)
    for k in range(way.which.shape[0]):
        slope -= equations.level_grad[k] * slopes[k]
    return slope


@helper
def nearest_of(followed, a, row, j, b):  # type: ignore[no-untyped-def]
    """Return the number of the value at point b that is nearest to value j of point a, in value and time."""
    best, least = -1, math.inf
    for i in range(followed.counts[b, row]):
        gap = abs(followed.values[a, row, j] - followed.values[b, row, i])
        gap += abs(followed.times[a, row, j] - followed.times[b, row, i])
        if gap < least:
            best, least = i, gap
    return best


@helper
def partner_of(followed, a, row, j, b):  # type: ignore[no-untyped-def]
    """Return the number that stationary value j of point a has at point b; -1 if it is gone.

    Over a step values come and go at the ends of the segment, or by twos anywhere. The others are nearest
    to each other, seen from either point.
    """
    found = nearest_of(followed, a, row, j, b)
    return found if found >= 0 and nearest_of(followed, b, row, found, a) == j else -1


@helper
def value_dip(way, points, k, row, j, surface, length):  # type: ignore[no-untyped-def]
    """Return the share of the step from row k at which a stationary value may touch a surface; 0 if nowhere.

    Parameters
    ----------
    row, j : row of the values that are followed, and number of the value at the last point
    """
    followed = way.workspace.followed
    earlier, before, here = followed.slots[EARLIER], followed.slots[BEFORE], followed.slots[HERE]
    values, times, levels = followed.values, followed.times, followed.levels
    new = partner_of(followed, before, row, j, here)
    if new < 0:
        return 0.0
    f1 = values[before, row, j] - levels[before, surface]
    f2 = values[here, row, new] - levels[here, surface]
    near = min(abs(f1), abs(f2))
    if not f1 * f2 > 0.0 or near < PINNED:
        return 0.0
    old = partner_of(followed, before, row, j, earlier) if k > 0 else -1
    if old >= 0:
        f0 = values[earlier, row, old] - levels[earlier, surface]
        if not changes_much(near, f0, f1, f2):
            return 0.0
    i, c = segment_and_observable(way.layout, row)
    g1 = slope_at(way, points, k, i, c, times[before, row, j], surface)
    g2 = slope_at(way, points, k + 1, i, c, times[here, row, new], surface)
    return cubic_dip(f1, g1, f2, g2, length)


@helper
def is_quiet(followed, row, j, surface):  # type: ignore[no-untyped-def]
    """Tell at once that a value does not come near a surface, where no value comes or goes."""
    earlier, before, here = followed.slots[EARLIER], followed.slots[BEFORE], followed.slots[HERE]
    values, levels = followed.values, followed.levels
    f0 = values[earlier, row, j] - levels[earlier, surface]
    f1 = values[before, row, j] - levels[before, surface]
    f2 = values[here, row, j] - levels[here, surface]
    return f1 * f2 > 0.0 and not changes_much(min(abs(f1), abs(f2)), f0, f1, f2)


@helper
def is_steady(followed, row):  # type: ignore[no-untyped-def]
    """Tell whether a row has as many values at all three points."""
    earlier, before, here = followed.slots[EARLIER], followed.slots[BEFORE], followed.slots[HERE]
    counts = followed.counts
    return counts[earlier, row] == counts[before, row] == counts[here, row]


@helper
def row_dip(way, points, k, row, surface, length):  # type: ignore[no-untyped-def]
    """Return the first share of the step at which a value of a row may touch a surface; 0 if nowhere."""
    followed, at = way.workspace.followed, 0.0
    steady = k > 0 and is_steady(followed, row)
    for j in range(followed.counts[followed.slots[BEFORE], row]):
        if not steady or not is_quiet(followed, row, j, surface):
            at = earlier_of(at, value_dip(way, points, k, row, j, surface, length))
    return at


@helper
def share_of_change(way, points, k, row, j, here, surface, length):  # type: ignore[no-untyped-def]
    """Return the share of the step from row k at which a stationary value passes a surface; 1 if it does not.

    One that is at one end of the step only (two are born, or meet) by its slope there.

    Parameters
    ----------
    row, j : row of the values that are followed, and number of the value at the last point, or (``here``)
        at the new one
    """
    followed = way.workspace.followed
    this, other = followed.slots[BEFORE], followed.slots[HERE]
    if here:
        this, other = other, this
    partner = partner_of(followed, this, row, j, other)
    f = followed.values[this, row, j] - followed.levels[this, surface]
    share = 1.0
    if partner >= 0 and not here:
        g = followed.values[other, row, partner] - followed.levels[other, surface]
        if f * g < 0.0 and min(abs(f), abs(g)) > PINNED:
            share = f / (f - g)
    elif partner < 0:
        i, c = segment_and_observable(way.layout, row)
        time = followed.times[this, row, j]
        slope = slope_at(way, points, k + 1 if here else k, i, c, time, surface)
        change = -slope * length if here else slope * length
        if f * change < 0.0 and abs(f) < abs(change):
            share = 1.0 + f / change if here else -f / change
    return share


@helper
def second_change(way, points, k, row, length):  # type: ignore[no-untyped-def]
    """Return a share of the step from row k between the first two changes of a label; 0 if it has not two.

    Each stationary value that passes a surface changes it. Two that pass one after the other may change it
    back.
    """
    followed = way.workspace.followed
    _, c = segment_and_observable(way.layout, row)
    first, second = 1.0, 1.0
    for surface in range(way.layout.observables.shape[0]):
        if way.layout.observables[surface] != c:
            continue
        for end in range(2):
            for j in range(followed.counts[followed.slots[BEFORE + end], row]):
                share = share_of_change(way, points, k, row, j, end == 1, surface, length)
                second = min(second, max(share, first))
                first = min(first, share)
    return 0.5 * (first + second) if second < 1.0 and second - first > _TOGETHER else 0.0


@helper
def keeps_sides(way, row, c):  # type: ignore[no-untyped-def]
    """Tell at once that there are as many stationary values as before, each on its side of every surface."""
    followed = way.workspace.followed
    before, here = followed.slots[BEFORE], followed.slots[HERE]
    values, levels = followed.values, followed.levels
    if followed.counts[before, row] != followed.counts[here, row]:
        return False
    for surface in range(way.layout.observables.shape[0]):
        if way.layout.observables[surface] != c:
            continue
        for j in range(followed.counts[here, row]):
            f1 = values[before, row, j] - levels[before, surface]
            if f1 * (values[here, row, j] - levels[here, surface]) <= 0.0:
                return False
    return True


@helper
def is_far(points, k, column, length):  # type: ignore[no-untyped-def]
    """Tell whether nothing that a column is the least distance of can come to its surface within a step."""
    return min(points.tests[k, column], points.tests[k + 1, column]) > _FAR * length


@helper
def margins_dip(way, points, k, length):  # type: ignore[no-untyped-def]
    """Return the first share of the step at which an interior margin may vanish; 0 if nowhere."""
    layout, kept, at = way.layout, 0, 0.0
    for row in range(layout.interior.shape[0]):
        # margins of one segment and observable follow each other, and share their values
        if segment_and_observable(layout, row) != segment_and_observable(layout, kept):
            kept = row
        if not is_far(points, k, row, length):
            at = earlier_of(at, row_dip(way, points, k, kept, layout.interior[row, 1], length))
    return at


@helper
def labels_dip(way, points, k, length):  # type: ignore[no-untyped-def]
    """Return the first share of the step at which a label may change and change back; 0 if nowhere."""
    layout, at = way.layout, 0.0
    first, margins = layout.interior.shape[0], count_margins(layout)
    for label in range(layout.labels.shape[0]):
        row, c = first + label, layout.labels[label, 1]
        if is_far(points, k, margins + label, length):
            continue
        if not keeps_sides(way, row, c):
            at = earlier_of(at, second_change(way, points, k, row, length))
        for surface in range(layout.observables.shape[0]):
            if layout.observables[surface] != c:
                continue
            at = earlier_of(at, row_dip(way, points, k, row, surface, length))
    return at
