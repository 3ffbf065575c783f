"""Pairs of events within one step of a branch or curve, which change no sign at its ends; compiled.

A value f that has one sign at both ends of a step may have the other one in between: two events, and none
of them is seen at the points. Four signs of it are looked for before a point is accepted.

* **By slopes.** Stationary values of observables (less the level of a surface), values at joints and rates
  at exits have exact slopes f' along the branch (:mod:`contfric.bvp.stationary_values`). The cubic with both
  values and slopes of a step of length h (Hermite) is off by h^4 max|f''''| / 384 at most. If its minimum is
  below a share of the end values the step is taken again, up to that minimum: the new point lies between
  the two events, or before both, and the cubic of the next step is that much better.
* **By their number.** Two stationary values of a segment that pass a surface within one step, one after the
  other, may leave its label as it was. Such a step is taken again, up to between both.
* **By the chord.** The parameter p of a branch is known together with its slope p', so that the mean of p'
  over a step is. The parabola with both end values of p' and that mean tells whether p' is zero in between.
* **By three points.** Of all other values (multipliers, and what has no slope here) the parabola through
  the last three points is taken.

*When slopes are computed.* Each costs as much as the equations of its segment. Let f be a parabola over
the last two steps with its vertex, and a change of sign, in the second one, which is at most 2.5 times the
first. Then f changes over both by more than twice the smaller end value. Slopes are computed where it
changes by more than half of that.
"""

from __future__ import annotations

import math

from contfric.bvp.equations import close_chain
from contfric.bvp.holds import NO_PIN
from contfric.bvp.monitor import count_margins, is_doubled
from contfric.bvp.stationary_points import find_after_reset, find_stationary
from contfric.bvp.stationary_values import (
    BEFORE,
    EARLIER,
    HERE,
    end_rates,
    forget,
    keep_end,
    keep_levels,
    keep_values,
    remember,
    segment_and_observable,
)
from contfric.compiled import helper
from contfric.continuation.core.dips import changes_much, cubic_dip, earlier_of, mean_dip
from contfric.continuation.core.touches import (
    PINNED,
    is_far,
    labels_dip,
    margins_dip,
    set_parameters,
)

#: A parameter that changes more slowly than this (in ranges, by arclength) is constant: the sign of its slope
#: is rounding.
_CONSTANT = 1e-6
#: A step is not taken again up to less than this share of it: the march would come to a stand.
_INSIDE = 0.05


@helper
def rate_of_end(way, points, row, i, surface, is_exit):  # type: ignore[no-untyped-def]
    """Return the slope of an observable less its level at the end of segment i, or (exit) of its rate."""
    set_parameters(way, points, row)
    c = way.layout.observables[surface]
    return end_rates(
        way.functions,
        way.layout,
        i,
        c,
        surface,
        is_exit,
        points.joints[row],
        points.tangents[row],
        way.p,
        way.which,
        points.directions[row],
        way.workspace,
    )


@helper
def end_dip(way, points, k, values, i, surface, is_exit, length):  # type: ignore[no-untyped-def]
    """Return the share of the step at which what is watched at the end of segment i may vanish; 0 if nowhere.

    Parameters
    ----------
    values : at the last point but one (NaN without one), at the last one and at the new one
    """
    f0, f1, f2 = values
    near = min(abs(f1), abs(f2))
    if not f1 * f2 > 0.0 or not math.isfinite(f1 * f2) or near < PINNED:
        return 0.0
    if not math.isnan(f0) and not changes_much(near, f0, f1, f2):
        return 0.0
    g1 = rate_of_end(way, points, k, i, surface, is_exit)
    g2 = rate_of_end(way, points, k + 1, i, surface, is_exit)
    return cubic_dip(f1, g1, f2, g2, length)


@helper
def margin_values(way, points, k, column, sign):  # type: ignore[no-untyped-def]
    """Return a margin at the last three points, with the sign of its observable; 0 where it is not smooth."""
    tests = points.tests
    if is_doubled(way.layout, column):
        return 0.0, 0.0, 0.0
    f0 = sign * tests[k - 1, column] if k > 0 else math.nan
    return f0, sign * tests[k, column], sign * tests[k + 1, column]


@helper
def labelled_ends_dip(way, points, k, length):  # type: ignore[no-untyped-def]
    """Return the share of the step at which the end of a labelled segment may touch a surface."""
    layout, followed, at = way.layout, way.workspace.followed, 0.0
    earlier, before, here = followed.slots[EARLIER], followed.slots[BEFORE], followed.slots[HERE]
    ends, levels = followed.ends, followed.levels
    margins = count_margins(layout)
    for label in range(layout.labels.shape[0]):
        if is_far(points, k, margins + label, length):
            continue
        row = layout.interior.shape[0] + label
        i, c, to = layout.labels[label, 0], layout.labels[label, 1], layout.labels[label, 3]
        for surface in range(layout.observables.shape[0]):
            if to >= 0 or layout.observables[surface] != c:
                continue  # it ends on one of them
            f0 = ends[earlier, row] - levels[earlier, surface] if k > 0 else math.nan
            f1 = ends[before, row] - levels[before, surface]
            values = f0, f1, ends[here, row] - levels[here, surface]
            at = earlier_of(at, end_dip(way, points, k, values, i, surface, False, length))
    return at


@helper
def ends_dip(way, points, k, length):  # type: ignore[no-untyped-def]
    """Return the share of the step from row k at which an exit or joint margin may vanish; 0 if nowhere."""
    layout, at = way.layout, 0.0
    column, count = layout.interior.shape[0], layout.exits.shape[0]
    for i in range(count):
        sign = layout.exit_signs[i]
        if sign != 0.0 and layout.pins[i] == NO_PIN and not is_far(points, k, column + i, length):
            values = margin_values(way, points, k, column + i, sign)
            at = earlier_of(at, end_dip(way, points, k, values, i, layout.exits[i], True, length))
    column += count
    for j in range(layout.joint.shape[0]):
        i, surface, sign = layout.joint[j, 0], layout.joint[j, 1], float(layout.joint[j, 2])
        if layout.joint[j, 3] == 0 and not is_far(points, k, column + j, length):
            values = margin_values(way, points, k, column + j, sign)
            at = earlier_of(at, end_dip(way, points, k, values, i, surface, False, length))
    return at


@helper
def fold_dip(way, points, k, length):  # type: ignore[no-untyped-def]
    """Return the share of the step from row k at which the parameter of a branch may turn twice."""
    ws, slopes = points.w, points.directions
    if ws.shape[1] != 1 or length == 0.0:
        return 0.0
    least = min(abs(slopes[k, 0]), abs(slopes[k + 1, 0])) * math.sqrt(way.scale[0])
    if least < _CONSTANT:
        return 0.0
    return mean_dip(slopes[k, 0], slopes[k + 1, 0], (ws[k + 1, 0] - ws[k, 0]) / length)


@helper
def all_far(way, points, k, length):  # type: ignore[no-untyped-def]
    """Tell at once that no margin and no label can come to its surface within a step: most of short steps."""
    for column in range(count_margins(way.layout) + way.layout.labels.shape[0]):
        if not is_far(points, k, column, length):
            return False
    return True


@helper
def hidden_pair(way, points, k, length):  # type: ignore[no-untyped-def]
    """Return the share of the step from row k up to which it is to be taken again; 0 if it is accepted."""
    if all_far(way, points, k, length):
        at = fold_dip(way, points, k, length)
        return 0.0 if at == 0.0 else max(at, _INSIDE)
    at = earlier_of(margins_dip(way, points, k, length), labels_dip(way, points, k, length))
    at = earlier_of(at, ends_dip(way, points, k, length))
    at = earlier_of(at, labelled_ends_dip(way, points, k, length))
    at = earlier_of(at, fold_dip(way, points, k, length))
    set_parameters(way, points, k + 1)
    return 0.0 if at == 0.0 else max(at, _INSIDE)


@helper
def recall(way, points, row):  # type: ignore[no-untyped-def]
    """Make a point that was watched in an earlier call the last one that is remembered."""
    followed = way.workspace.followed
    if row < 0:
        forget(followed)
        return
    functions, layout, z = way.functions, way.layout, points.joints[row]
    equations, stationary = way.workspace.equations, way.workspace.stationary
    set_parameters(way, points, row)
    close_chain(functions, layout, z, way.p, equations.none, equations)
    keep_levels(functions, way.p, followed, equations)
    for r in range(followed.counts.shape[1]):
        i, c = segment_and_observable(layout, r)
        if 0 < r < layout.interior.shape[0] and segment_and_observable(layout, r - 1) == (i, c):
            continue
        if layout.resets[i] >= 0:
            found = find_after_reset(functions, layout, i, c, z, way.p, equations, stationary)
        else:
            found = find_stationary(functions, layout, i, c, z, way.p, equations.last, stationary)
        keep_values(followed, r, found, stationary)
        if r >= layout.interior.shape[0]:
            after = z[i + 1] if i + 1 < z.shape[0] else equations.last
            none, empty = equations.none, equations.empty
            keep_end(followed, r, functions.observe(c, after[0], after[1:], way.p, none, empty))
    remember(followed)
