"""Pseudo-arclength continuation, compiled.

A branch is a curve ``(z(s), p(s))`` of the chain of segments. From two points with unit tangents the
next one is predicted by the cubic through both (Hermite), and corrected in the plane normal to the
last tangent (H. B. Keller, 1977). The step follows the curvature: the angle between consecutive
tangents is kept near a target. Arclength between points is the chord c with the correction for its
arc, ``c (1 + angle^2 / 24)``.

Every accepted point is watched: margins, slope p', ``chi(1)``, ``chi(-1)``, the largest pair of
multipliers, and the labels of its segments. The march stops at the first step over which any of them
changes sign; :mod:`contfric.continuation.bracket` then locates the place. A parabola through the last
three values guards against a margin that dips below zero and returns within one step: such a step is
taken again, shorter.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import blocks, f8, helper, i8, indices, kernel, matrix, table, vector
from contfric.continuation.steps import (
    apart,
    changed,
    copy_to,
    dips,
    largest_state,
    observe_point,
    product,
    returned,
    settle,
    step_room,
)
from contfric.flow.layouts import FlowType
from contfric.orbit.equations import LayoutType
from contfric.orbit.newton import ALONG, INTEGRATED, ON_THE_WAY

#: Why a march stopped.
FULL, EVENT, OUTSIDE, STEP, CLOSED, BROKEN, UNBOUNDED, ENDLESS, MORE = range(9)

#: Angle between consecutive tangents (rad): wanted, and the most that is accepted. At the wanted
#: angle a branch is smooth to the eye; beyond the other one, the step may change branches.
_WANTED_ANGLE, _MOST_ANGLE = 0.12, 0.35
#: Most that a step grows by: the first steps are short, and the cubic holds this far beyond its base.
_GROWTH = 2.5
#: Distance from predictor to orbit in units of the step: beyond it the step may change branches.
_MOST_MISS = 0.3
#: A state this large (nondimensional) is on its way to infinity: resonance without damping.
_UNBOUNDED = 1e6
#: A turn this long (nondimensional) of an autonomous model is on its way to an infinite one.
_ENDLESS = 1e4


@helper
def predict(zs, ws, tzs, tws, arc, k, step):  # type: ignore[no-untyped-def]
    """Write the predicted point and the last tangent to row k + 1; return the predicted parameter.

    The cubic through the last two points and their tangents, ``z_k + t_k x + A x^2 + B x^3`` with
    ``A = (2 t_k + t_{k-1} - 3 D) / h`` and ``B = (t_k + t_{k-1} - 2 D) / h^2``, D the chord over h.
    """
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
    value = ws[k] + step * tws[k]
    if back > 0.0:
        chord = (ws[k] - ws[k - 1]) / back
        value += square * (2.0 * tws[k] + tws[k - 1] - 3.0 * chord)
        value += cube * (tws[k] + tws[k - 1] - 2.0 * chord)
    return value


@helper
def arrival(  # type: ignore[no-untyped-def]
    zs, ws, tzs, tws, tests, labels, k, start, taken, step, low, high, scale, autonomous
):
    """Return why the march stops at row k, or FULL if it goes on."""
    if changed(tests[k - 1], tests[k], labels[k - 1], labels[k]):
        return EVENT
    if ws[k] < low or ws[k] > high:
        return OUTSIDE
    if taken > 3 and returned(
        zs[k],
        ws[k],
        start[0],
        start[1][0, 0],
        start[2],
        start[3][0, 0],
        zs[k - 1],
        ws[k - 1],
        scale,
        step,
    ):
        return CLOSED
    if largest_state(zs[k]) > _UNBOUNDED:
        return UNBOUNDED
    if autonomous and -zs[k, 0, 0] > _ENDLESS:
        return ENDLESS
    return FULL


#: Start of a branch as the march knows it: joints, parameter (1, 1), tangent, slope (1, 1).
StartType = types.UniTuple(matrix, 4)


@kernel(
    types.Tuple((i8, i8, f8))(
        FlowType,
        LayoutType,
        vector,
        i8,
        vector,
        i8,
        types.boolean,
        StartType,
        i8,
        blocks,
        vector,
        blocks,
        vector,
        vector,
        matrix,
        table,
        types.complex128[:, ::1],
        indices,
    )
)
def march(  # type: ignore[no-untyped-def]
    functions,
    layout,
    p,
    active,
    options,
    k,
    stability,
    start,
    taken,
    zs,
    ws,
    tzs,
    tws,
    arc,
    tests,
    labels,
    mu,
    counts,
):
    """Continue from the point in row k (with its tangent and watched values) until something happens.

    With k = -1, row 0 alone is solved, normal to the tangent given there. A call that has used up its budget
    ends with MORE: called again with the last row, the next step and the same options, it goes on as if
    nothing had been.

    Parameters
    ----------
    options : (first step, largest step, smallest step, lower limit, upper limit, 1/width^2, budget: most
        points that are solved for, whether the last trial was not finite)
    k : last row that is given; an earlier one serves the prediction
    start, taken : where the branch began, and points since then
    zs, ws, tzs, tws, arc, tests, labels, mu : points of the branch, one a row; filled from row k + 1

    Returns
    -------
    tuple
        (why it stopped, index of the last row written, next step).
    """
    step, largest, smallest, low, high, scale, budget, lost = options
    which, trial = np.empty(1, dtype=np.int64), np.empty(p.shape[0])
    which[0] = active
    for j in range(p.shape[0]):
        trial[j] = p[j]
    guess, angle = np.empty((zs.shape[1], zs.shape[2])), 0.0
    room = step_room(zs.shape[1], zs.shape[2], p.shape[0])
    solving_first, finite, solved = k < 0, lost == 0.0, 0.0
    integrated = layout.rounding > INTEGRATED
    accuracy = ON_THE_WAY if integrated and not solving_first else ALONG
    while k + 1 < ws.shape[0]:
        row = k + 1
        if solved >= budget:
            options[7] = 0.0 if finite else 1.0
            return MORE, k, step
        solved += 1.0
        if solving_first:
            trial[active], slope = ws[0], tws[0]
        elif step < smallest:
            return (STEP if finite else BROKEN), k, step
        else:
            trial[active], slope = predict(zs, ws, tzs, tws, arc, k, step), tws[k]
            copy_to(guess, zs[row])
        guess_w = trial[active]
        fine, slope, finite = settle(
            functions, layout, zs[row], trial, which, tzs[row], slope, scale, accuracy, counts, room
        )
        if fine and not solving_first:
            miss = apart(zs[row], trial[active], guess, guess_w, scale)
            cosine = product(tzs[row], slope, tzs[k], tws[k], scale)
            angle = math.acos(min(1.0, max(-1.0, cosine)))
            if (angle > _MOST_ANGLE or miss > _MOST_MISS * step) and step > 4.0 * smallest:
                step *= 0.5
                continue
        if fine:
            finite = observe_point(
                functions,
                layout,
                zs[row],
                trial,
                slope,
                stability,
                tests[row],
                labels[row],
                mu[row],
                counts,
                room,
            )
        ws[row], tws[row] = trial[active], slope
        if solving_first:
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
        chord = apart(zs[k], ws[k], zs[k - 1], ws[k - 1], scale)
        arc[k] = arc[k - 1] + chord * (1.0 + angle * angle / 24.0)
        factor = min(_GROWTH, max(0.4, _WANTED_ANGLE / max(angle, 1e-6)))
        size = largest_state(zs[k])
        if layout.turn == 0.0:  # the duration is one of the unknowns
            size = max(size, -zs[k, 0, 0])
        following = min(largest * (1.0 + size), step * factor)
        autonomous = layout.turn == 0.0
        why = arrival(
            zs, ws, tzs, tws, tests, labels, k, start, taken, step, low, high, scale, autonomous
        )
        if why != FULL:
            return why, k, following
        step = following
    return FULL, k, step
