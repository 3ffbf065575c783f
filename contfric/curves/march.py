"""Pseudo-arclength continuation of a condition in the plane of two parameters, compiled.

As :mod:`contfric.continuation.march` for a branch: cubic prediction, correction normal to the last
tangent, a step that follows the curvature, and a stop at the first step over which anything that is
watched changes. The unknowns are the joints and both parameters; the second border row is the
condition.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import (
    blocks,
    f8,
    helper,
    i8,
    indices,
    kernel,
    matrix,
    table,
    vector,
)
from contfric.continuation.march import (
    _ENDLESS,
    _GROWTH,
    _MOST_ANGLE,
    _MOST_MISS,
    _UNBOUNDED,
    _WANTED_ANGLE,
    BROKEN,
    CLOSED,
    ENDLESS,
    EVENT,
    FULL,
    MORE,
    OUTSIDE,
    STEP,
    UNBOUNDED,
)
from contfric.continuation.steps import changed, copy_to, dips, largest_state
from contfric.curves.conditions import SPECTRAL, ConditionType, curve_room
from contfric.curves.correct import (
    follow_border,
    observe_curve,
    plane_distance,
    plane_product,
    settle_curve,
)
from contfric.flow.layouts import FlowType, SecondType
from contfric.orbit.equations import LayoutType

#: The points of a curve as the march writes them, one a row: joints, parameters, both tangents,
#: arclength, tests, labels, multipliers.
RowsType = types.Tuple(
    (blocks, matrix, blocks, matrix, vector, matrix, table, types.complex128[:, ::1])
)


@helper
def predict_curve(zs, ws, tzs, tws, arc, k, step, w, tw):  # type: ignore[no-untyped-def]
    """Write the predicted point and the last tangent to row k + 1, parameters to ``w`` and ``tw``."""
    back = arc[k] - arc[k - 1] if k > 0 else 0.0
    square, cube = 0.0, 0.0
    if back > 0.0:
        square, cube = step * step / back, step**3 / (back * back)
    for i in range(zs.shape[1]):
        for j in range(zs.shape[2]):
            t = tzs[k, i, j]
            value = zs[k, i, j] + step * t
            if back > 0.0:
                chord = (zs[k, i, j] - zs[k - 1, i, j]) / back
                before = tzs[k - 1, i, j]
                value += square * (2.0 * t + before - 3.0 * chord)
                value += cube * (t + before - 2.0 * chord)
            zs[k + 1, i, j] = value
            tzs[k + 1, i, j] = t
    for j in range(ws.shape[1]):
        t = tws[k, j]
        value = ws[k, j] + step * t
        if back > 0.0:
            chord = (ws[k, j] - ws[k - 1, j]) / back
            value += square * (2.0 * t + tws[k - 1, j] - 3.0 * chord)
            value += cube * (t + tws[k - 1, j] - 2.0 * chord)
        w[j], tw[j] = value, t


@helper
def outside(w, box):  # type: ignore[no-untyped-def]
    """Tell whether a point has left the box (lower corner, upper corner)."""
    for k in range(w.shape[0]):
        if w[k] < box[0, k] or w[k] > box[1, k]:
            return True
    return False


@helper
def closes(z, w, last_z, last_w, start_z, start_w, scale, step):  # type: ignore[no-untyped-def]
    """Tell whether a step passes the start of the curve again in the same direction."""
    if plane_distance(z, w, start_z[0], start_w[0], scale) > 1.5 * step:
        return False
    tz, tw = start_z[1], start_w[1]
    start = plane_product(start_z[0], start_w[0], tz, tw, scale)
    behind = plane_product(last_z, last_w, tz, tw, scale)
    return behind < start <= plane_product(z, w, tz, tw, scale)


@kernel(
    types.Tuple((i8, i8, f8))(
        FlowType,
        SecondType,
        LayoutType,
        ConditionType,
        vector,
        indices,
        vector,
        matrix,
        i8,
        blocks,
        matrix,
        i8,
        blocks,
        RowsType,
        indices,
    )
)
def march_curve(  # type: ignore[no-untyped-def]
    functions,
    second,
    layout,
    condition,
    p,
    which,
    options,
    box,
    k,
    start_z,
    start_w,
    taken,
    border,
    points,
    counts,
):
    """Continue from the point in row k until something happens; with k = -1 solve row 0 alone.

    Ends with MORE when its budget is used up, as the march of a branch does.

    Parameters
    ----------
    options : (step, largest step, smallest step, accuracy, budget, whether the last trial was not finite)
    box : lower corner, upper corner, widths; shape (3, 2)
    start_z, start_w : first point of the curve and its tangent, shapes (2, N, m) and (2, 2)
    taken : points since then
    border : the vectors b and c, shape (2, N, m); they follow the null vectors
    points : rows that are filled from k + 1

    Returns
    -------
    tuple
        (why it stopped, index of the last row written, next step).
    """
    zs, ws, tzs, tws, arc, tests, labels, mu = points
    step, largest, smallest, accuracy, budget, lost = options
    trial, scale, w = p.copy(), 1.0 / box[2] ** 2, np.empty(2)
    tw = np.empty(2)
    guess, angle = np.empty((zs.shape[1], zs.shape[2])), 0.0
    room = curve_room(zs.shape[1], zs.shape[2], p.shape[0])
    solving_first, finite, solved = k < 0, lost == 0.0, 0.0
    while k + 1 < ws.shape[0]:
        row = k + 1
        if solved >= budget:
            options[5] = 0.0 if finite else 1.0
            return MORE, k, step
        solved += 1.0
        if solving_first:
            for j in range(2):
                w[j], tw[j] = ws[0, j], tws[0, j]
        elif step < smallest:
            return (STEP if finite else BROKEN), k, step
        else:
            predict_curve(zs, ws, tzs, tws, arc, k, step, w, tw)
            copy_to(guess, zs[row])
        for j in range(2):
            trial[which[j]] = w[j]
        fine = settle_curve(
            functions,
            second,
            layout,
            condition,
            zs[row],
            trial,
            which,
            border,
            tzs[row],
            tw,
            scale,
            accuracy,
            counts,
            room,
        )
        if fine and not solving_first:
            for j in range(2):
                ws[row, j] = trial[which[j]]
            miss = plane_distance(zs[row], ws[row], guess, w, scale)
            cosine = plane_product(tzs[row], tw, tzs[k], tws[k], scale)
            angle = math.acos(min(1.0, max(-1.0, cosine)))
            if angle > _MOST_ANGLE or miss > _MOST_MISS * step:  # never on another curve
                step *= 0.5
                continue
        if fine:
            finite = observe_curve(
                functions,
                second,
                layout,
                condition,
                zs[row],
                trial,
                which,
                tests[row],
                labels[row],
                mu[row],
                counts,
                room,
            )
        for j in range(2):
            ws[row, j], tws[row, j] = trial[which[j]], tw[j]
        if solving_first:
            if fine and condition.kind == SPECTRAL:
                follow_border(border, room)
            return FULL if fine else BROKEN, 0, step
        if not fine:
            step *= 0.5
            continue
        if not finite:
            if step <= 64.0 * smallest:
                return BROKEN, k, step
            step *= 0.25
            continue
        if k > 0 and step > 1e-4 * largest and dips(tests, k, arc, tests[row], step):
            step *= 0.25
            continue
        k, taken = row, taken + 1
        if condition.kind == SPECTRAL:
            follow_border(border, room)
        chord = plane_distance(zs[k], ws[k], zs[k - 1], ws[k - 1], scale)
        arc[k] = arc[k - 1] + chord * (1.0 + angle * angle / 24.0)
        factor = min(_GROWTH, max(0.4, _WANTED_ANGLE / max(angle, 1e-6)))
        following = min(largest * (1.0 + largest_state(zs[k])), step * factor)
        if changed(tests[k - 1], tests[k], labels[k - 1], labels[k]):
            return EVENT, k, following
        if outside(ws[k], box):
            return OUTSIDE, k, following
        if taken > 3 and closes(zs[k], ws[k], zs[k - 1], ws[k - 1], start_z, start_w, scale, step):
            return CLOSED, k, following
        if largest_state(zs[k]) > _UNBOUNDED:
            return UNBOUNDED, k, following
        if layout.turn == 0.0 and -zs[k, 0, 0] > _ENDLESS:
            return ENDLESS, k, following
        step = following
    return FULL, k, step
