"""The margins and labels of a solved orbit, compiled.

Admissibility cannot miss a violation: between its stationary points an observable is monotone, so
the smallest distance to a bounding surface inside a segment is attained at a stationary point (or at
the joints, which the exit and joint margins watch). The flow delivers *all* stationary points.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.bvp.after_reset import apply_reset
from contfric.bvp.crossed_surfaces import TOUCH
from contfric.bvp.equations import LayoutType, close_chain, equation_workspace, segment_rows
from contfric.bvp.holds import NO_PIN, TOUCH_PIN
from contfric.bvp.newton import CHECKS
from contfric.bvp.stationary_points import find_after_reset, find_stationary, stationary_workspace
from contfric.bvp.stationary_values import followed_values, keep_end, keep_levels, keep_values
from contfric.compiled import helper, indices, kernel, matrix, vector
from contfric.compiling.references import by_reference
from contfric.flow.layouts import FlowType

#: Within this share of 1 + the duration from a joint that is pinned (a hold starts or ends there) a
#: stationary point is the joint itself: what it misses is the square of it, 1e-12.
_AT_PIN = 1e-6

#: Maxima of equal height of a load at rest (under an even excitation, or one period apart) differ by
#: rounding: by less than this, relative to 1 + the level.
_SAME_HEIGHT = 1e-13
#: Duration below which a hold comes to no later maximum; divided by its square the above is 1e-10.
_SOON = 0.03
#: In the place of a label that is not known yet.
_NO_LABEL = -2
#: Largest label to which a digit is added; it has 62 bits, so that no sum of a digit leaves 64.
_LONGEST = 2**62
#: A label of more crossings than fit is negative and lists none: it only tells one sequence from another.
_TOO_MANY = -3
#: Duration below which rounding hides what is left of a margin without its double zero: at this one it is
#: known to 1e-3, and a curvature of the load is larger.
_CLEAR = 1e-6


@helper
def least_distance(found, sign, target, stationary, first, last):  # type: ignore[no-untyped-def]
    """Return the smallest distance of the stationary points from first to last to a level; or inf."""
    if found < 0:
        return np.nan
    least = np.inf  # also of a segment that vanishes: the joint and exit margins watch it
    for k in range(found):
        if first <= stationary.times[k] <= last:
            least = min(least, sign * (stationary.values[k] - target))
    return least


@helper
def is_doubled(layout, column):  # type: ignore[no-untyped-def]
    """Tell whether a margin is watched without its double zero."""
    for k in range(layout.doubles.shape[0]):
        if layout.doubles[k, 0] == column:
            return True
    return False


@helper
def equal_heights(layout, i, column, level, lasts):  # type: ignore[no-untyped-def]
    """Return what a margin is allowed for equal maxima of the load that segment i may have touched already.

    Not one that is divided by the square of a short duration: there it would be no rounding.
    """
    if layout.pins[i] != TOUCH_PIN or (lasts < _SOON and is_doubled(layout, column)):
        return 0.0
    return _SAME_HEIGHT * (1.0 + abs(level))


@helper
def interior_margin(functions, layout, k, found, z, p, workspace, stationary):  # type: ignore[no-untyped-def]
    """Return interior margin k from the stationary points of its segment."""
    i, count = layout.interior[k, 0], z.shape[0]
    after = z[i + 1] if i + 1 < count else workspace.last
    duration = after[0] - z[i, 0]
    first, last = -np.inf, np.inf
    if layout.pins[i] != NO_PIN or layout.pins[i - 1] != NO_PIN:
        first = _AT_PIN * (1.0 + duration)
    if layout.returns[i] & 2 == 2:  # it leaves the wall without speed or acceleration
        first = _AT_PIN * (1.0 + duration)
    if layout.pins[i] != NO_PIN or layout.pins[(i + 1) % count] != NO_PIN:
        last = duration - _AT_PIN * (1.0 + duration)
    target = functions.level(layout.interior[k, 1], p, workspace.none, workspace.empty)
    least = least_distance(found, float(layout.interior[k, 2]), target, stationary, first, last)
    # what it touched at its start it may touch at the same height again
    least += equal_heights(layout, i, k, target, duration)
    if layout.pins[i] == layout.interior[k, 1]:  # its load falls from the limit on which it starts
        c = layout.observables[layout.interior[k, 1]]
        none, empty = workspace.none, workspace.empty
        rate = functions.rate(layout.modes[i], c, z[i, 0], z[i, 1:], p, none, empty)
        least = least if math.isnan(least) else min(least, float(layout.interior[k, 2]) * rate)
    return least


@helper
def start_value(functions, layout, i, c, z, p, workspace):  # type: ignore[no-untyped-def]
    """Return observable c where segment i begins, after its reset."""
    n = z.shape[1] - 1
    apply_reset(functions, layout, i, z[i], p, workspace.none, workspace)
    return functions.observe(
        c, z[i, 0], workspace.after_reset[n, :n], p, workspace.none, workspace.empty
    )


@helper
def joint_margin(functions, layout, k, z, p, workspace):  # type: ignore[no-untyped-def]
    """Return joint margin k."""
    i, surface = layout.joint[k, 0], layout.joint[k, 1]
    after = z[i + 1] if i + 1 < z.shape[0] else workspace.last
    c = layout.observables[surface]
    if layout.joint[k, 3] == 1:  # where the segment begins, after a reset
        value = start_value(functions, layout, i, c, z, p, workspace)
    else:
        value = functions.observe(c, after[0], after[1:], p, workspace.none, workspace.empty)
    level = functions.level(surface, p, workspace.none, workspace.empty)
    # a hold after a touch may be left where its load has the same height again: it does not end there
    column = layout.interior.shape[0] + layout.exits.shape[0] + k
    return layout.joint[k, 2] * (value - level) + equal_heights(
        layout, i, column, level, after[0] - z[i, 0]
    )


@helper
def margins(functions, layout, z, p, workspace, stationary, out, labels, followed):  # type: ignore[no-untyped-def]
    """Fill the margins in the order interior, exit, joint, entry, lasting, held.

    And those labels whose stationary points are found on the way.

    An interior margin is infinite without stationary points, that of a tangential exit always. The
    closure and the rates at the exits are in ``workspace``; stationary values are kept in ``followed``.
    """
    interior, observables = layout.interior, layout.observables
    segment, watched, found = -1, -1, 0
    for k in range(interior.shape[0]):
        i, c = interior[k, 0], observables[interior[k, 1]]
        if i != segment or c != watched:  # surfaces of one observable share its stationary points
            if layout.resets[i] >= 0:
                found = find_after_reset(functions, layout, i, c, z, p, workspace, stationary)
            else:
                found = find_stationary(functions, layout, i, c, z, p, workspace.last, stationary)
            segment, watched = i, c
            keep_values(followed, k, found, stationary)
            for row in range(layout.labels.shape[0]):
                if layout.labels[row, 0] == i and layout.labels[row, 1] == c:
                    write_label(
                        functions, layout, row, found, z, p, workspace, stationary, out, labels,
                        followed,
                    )  # fmt: skip
        out[k] = interior_margin(functions, layout, k, found, z, p, workspace, stationary)
    at = interior.shape[0]
    for i in range(z.shape[0]):
        sign = layout.exit_signs[i]
        out[at + i] = sign * workspace.rates[i] if sign != 0.0 else np.inf
    at += z.shape[0]
    for k in range(layout.joint.shape[0]):
        out[at + k] = joint_margin(functions, layout, k, z, p, workspace)
    at += layout.joint.shape[0]
    for k in range(layout.lasting.shape[0]):
        out[at + k] = lasting_margin(layout, k, z, workspace)
    at += layout.lasting.shape[0]
    for k in range(layout.held.shape[0]):
        out[at + k] = held_margin(functions, layout, k, z, p, workspace, stationary)
    for k in range(layout.doubles.shape[0]):
        out[layout.doubles[k, 0]] = regular_margin(
            layout, k, z, workspace, out[layout.doubles[k, 0]]
        )


@helper
def regular_margin(layout, k, z, workspace, value):  # type: ignore[no-untyped-def]
    """Return a margin without its double zero; infinite where the segment is too short to tell it."""
    i = layout.doubles[k, 1]
    after = z[i + 1] if i + 1 < z.shape[0] else workspace.last
    lasts = after[0] - z[i, 0]
    if abs(lasts) < _CLEAR:
        return np.inf
    return value / min(1.0, lasts * lasts)


@helper
def lasting_margin(layout, k, z, workspace):  # type: ignore[no-untyped-def]
    """Return the duration of segment k of those that must last."""
    i = layout.lasting[k]
    after = z[i + 1] if i + 1 < z.shape[0] else workspace.last
    return after[0] - z[i, 0]


@helper
def held_margin(functions, layout, k, z, p, workspace, stationary):  # type: ignore[no-untyped-def]
    """Return the least acceleration with which hold k could be left where an observable is stationary.

    And at its end if it goes on there in another mode: the acceleration may have a corner at such a change.
    """
    i = layout.held[k, 0]
    left, sign = layout.observables[layout.held[k, 1]], layout.held[k, 2]
    after = z[i + 1] if i + 1 < z.shape[0] else workspace.last
    duration = after[0] - z[i, 0]
    first = _AT_PIN * (1.0 + duration)
    state, least = workspace.state, np.inf
    watched = -1
    none, empty = workspace.none, workspace.empty
    if layout.departs[i] != layout.held[k, 3]:
        least = sign * functions.rate(layout.held[k, 3], left, after[0], after[1:], p, none, empty)
    for row in range(layout.interior.shape[0]):
        c = layout.observables[layout.interior[row, 1]]
        if layout.interior[row, 0] != i or c == watched:
            continue
        watched = c
        found = find_stationary(functions, layout, i, c, z, p, workspace.last, stationary)
        for j in range(found):
            time = stationary.times[j]
            if time < first or time > duration - first:
                continue
            functions.flow(
                layout.modes[i],
                z[i, 0],
                z[i, 1:],
                time,
                p,
                none,
                state,
                workspace.nothing,
            )
            rate = functions.rate(layout.held[k, 3], left, z[i, 0] + time, state, p, none, empty)
            least = min(least, sign * rate)
    return least


@helper
def count_margins(layout):  # type: ignore[no-untyped-def]
    """Return the number of margins of a layout."""
    return (
        layout.interior.shape[0]
        + layout.exits.shape[0]
        + layout.joint.shape[0]
        + layout.lasting.shape[0]
        + layout.held.shape[0]
    )


@helper
def ends_of(functions, layout, k, z, p, workspace):  # type: ignore[no-untyped-def]
    """Return the values of the observable of label row k at both joints of its segment."""
    i, c, on, to = (
        layout.labels[k, 0],
        layout.labels[k, 1],
        layout.labels[k, 2],
        layout.labels[k, 3],
    )
    after = z[i + 1] if i + 1 < z.shape[0] else workspace.last
    if on >= 0:
        first = functions.level(on, p, workspace.none, workspace.empty)
    else:
        first = functions.observe(c, z[i, 0], z[i, 1:], p, workspace.none, workspace.empty)
        if layout.resets[i] >= 0:
            first = start_value(functions, layout, i, c, z, p, workspace)
    if to >= 0:
        return first, functions.level(to, p, workspace.none, workspace.empty)
    return first, functions.observe(c, after[0], after[1:], p, workspace.none, workspace.empty)


@helper
def side_of(value, target):  # type: ignore[no-untyped-def]
    """Return 2 above a level, 1 below it, 0 where rounding cannot tell."""
    slack = TOUCH * (1.0 + abs(target))
    return 2 if value > target + slack else (1 if value < target - slack else 0)


@helper
def points_of_label(functions, layout, k, z, p, workspace, stationary):  # type: ignore[no-untyped-def]
    """Fill the stationary points of row k of the labels; return their number."""
    i, c = layout.labels[k, 0], layout.labels[k, 1]
    if layout.resets[i] >= 0:
        return find_after_reset(functions, layout, i, c, z, p, workspace, stationary)
    return find_stationary(functions, layout, i, c, z, p, workspace.last, stationary)


@helper
def crossings(functions, layout, k, z, p, workspace, stationary):  # type: ignore[no-untyped-def]
    """Return the surfaces that the segment of row k crosses, as digits of one integer.

    And the distance to the nearest change, of a stationary point or a joint from a surface, and the number
    of stationary points.
    """
    found = points_of_label(functions, layout, k, z, p, workspace, stationary)
    code, nearest, final = crossed(functions, layout, k, found, z, p, workspace, stationary)
    return code, nearest, found, final


@helper
def longer(code, base, digit):  # type: ignore[no-untyped-def]
    """Return a label with one crossing more; of too many, a negative number that differs with each."""
    if 0 <= code <= (_LONGEST - digit) // base:
        return code * base + digit
    return _TOO_MANY - ((abs(code) % _LONGEST * base + digit) % _LONGEST)


@helper
def crossed(functions, layout, k, found, z, p, workspace, stationary):  # type: ignore[no-untyped-def]
    """Return the crossings, the distance to the nearest change, and the value at the end."""
    c, on, to = layout.labels[k, 1], layout.labels[k, 2], layout.labels[k, 3]
    if found < 0:
        return -1, np.inf, np.nan
    value, final = ends_of(functions, layout, k, z, p, workspace)
    surfaces = layout.observables.shape[0]
    code, nearest, sides = 0, np.inf, 0  # two bits of ``sides`` a surface
    for piece in range(-1, found + 1):
        following = value
        if piece >= 0:
            following = stationary.values[piece] if piece < found else final
        for j in range(surfaces):
            # surfaces of an observable are listed from the highest level down
            surface = surfaces - 1 - j if following > value else j
            if layout.observables[surface] != c:
                continue
            target = functions.level(surface, p, workspace.none, workspace.empty)
            is_joint = (piece < 0 and surface == on) or (piece == found and surface == to)
            if not is_joint:
                nearest = min(nearest, abs(following - target))
            side = side_of(following, target)
            before = (sides >> (2 * surface)) & 3
            if side == 0 or side == before:
                continue
            sides ^= (side ^ before) << (2 * surface)
            if before != 0:
                code = longer(code, surfaces + 1, surface + 1)
        value = following
    return code, nearest, final


@helper
def write_label(  # type: ignore[no-untyped-def]
    functions, layout, k, found, z, p, workspace, stationary, out, labels, followed
):
    """Write label k, its distance after the margins, and what is kept of it."""
    labels[k], out[count_margins(layout) + k], end = crossed(
        functions, layout, k, found, z, p, workspace, stationary
    )
    keep_values(followed, layout.interior.shape[0] + k, found, stationary)
    keep_end(followed, layout.interior.shape[0] + k, end)


@helper
def watch(functions, layout, z, p, workspace, stationary, out, labels, followed):  # type: ignore[no-untyped-def]
    """Fill margins and labels of an orbit, and after the margins the distances of the labels.

    Stationary values are kept in ``followed``, if it has space for any. False if something is not finite.
    """
    keep_levels(functions, p, followed, workspace)
    for k in range(layout.labels.shape[0]):
        labels[k] = _NO_LABEL
    margins(functions, layout, z, p, workspace, stationary, out, labels, followed)
    for k in range(layout.labels.shape[0]):
        if labels[k] == _NO_LABEL:
            found = points_of_label(functions, layout, k, z, p, workspace, stationary)
            write_label(
                functions, layout, k, found, z, p, workspace, stationary, out, labels, followed
            )
    for k in range(count_margins(layout)):
        if math.isnan(out[k]):
            return False
    return True


@helper
def examined(functions, layout, z, p, workspace, rows, stationary, out, labels, followed):  # type: ignore[no-untyped-def]
    """Fill margins and labels of a solved orbit; what :func:`examine` returns."""
    layout, workspace = by_reference(layout), by_reference(workspace)
    count, m = z.shape
    close_chain(functions, layout, z, p, workspace.none, workspace)
    for i in range(count):  # for the rates at the exits
        after = z[i + 1] if i + 1 < count else workspace.last
        segment_rows(functions, layout, i, m, z[i], after, p, workspace.none, workspace, rows)
    stationary = by_reference(stationary)
    return watch(
        functions, layout, z, p, workspace, stationary, out, labels, by_reference(followed)
    )


@kernel(types.boolean(FlowType, LayoutType, matrix, vector, vector, indices, indices))
def examine(functions, layout, z, p, out, labels, counts):  # type: ignore[no-untyped-def]
    """Fill margins and labels of a solved orbit; False if something is not finite."""
    counts[CHECKS] += 1
    count, m = z.shape
    free = min(
        count, 0
    )  # no parameter, and no literal: the workspace would be compiled once for each
    workspace, rows = equation_workspace(count, m, free), np.empty((2 * m, 3 * m + 1))
    stationary, followed = stationary_workspace(), followed_values(free, free, m)
    return examined(functions, layout, z, p, workspace, rows, stationary, out, labels, followed)
