"""Pseudo-arclength continuation, compiled.

A branch is a curve ``(z(s), p(s))`` of the chain of segments. From a point with unit tangent the next
one is predicted along the tangent and corrected in the plane normal to it (H. B. Keller, 1977). The
step follows the curvature: the angle between consecutive tangents is kept near a target.

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
    dips,
    largest_state,
    product,
    returned,
    settle,
)
from contfric.orbit.newton import FunctionsType, LayoutType

#: Why a march stopped.
FULL, EVENT, OUTSIDE, STEP, CLOSED, BROKEN, UNBOUNDED = range(7)

#: Angle between consecutive tangents (rad): wanted, and the most that is accepted. At the wanted
#: angle a branch is smooth to the eye; beyond the other one, the step may change branches.
_WANTED_ANGLE, _MOST_ANGLE = 0.12, 0.35
#: Distance from predictor to orbit in units of the step: beyond it the step may change branches.
_MOST_MISS = 0.3
#: A state this large (nondimensional) is on its way to infinity: resonance without damping.
_UNBOUNDED = 1e6


@helper
def predict(zs, ws, tzs, tws, k, step, guess):  # type: ignore[no-untyped-def]
    """Write the predicted point and the last tangent to row k + 1; return the predicted parameter."""
    for i in range(zs.shape[1]):
        for j in range(zs.shape[2]):
            guess[i, j] = zs[k, i, j] + step * tzs[k, i, j]
            zs[k + 1, i, j] = guess[i, j]
            tzs[k + 1, i, j] = tzs[k, i, j]
    return ws[k] + step * tws[k]


@helper
def arrival(zs, ws, tzs, tws, tests, labels, k, step, low, high, scale):  # type: ignore[no-untyped-def]
    """Return why the march stops at row k, or FULL if it goes on."""
    if changed(tests[k - 1], tests[k], labels[k - 1], labels[k]):
        return EVENT
    if ws[k] < low or ws[k] > high:
        return OUTSIDE
    if k > 3 and returned(
        zs[k], ws[k], zs[0], ws[0], tzs[0], tws[0], zs[k - 1], ws[k - 1], scale, step
    ):
        return CLOSED
    if largest_state(zs[k]) > _UNBOUNDED:
        return UNBOUNDED
    return FULL


@kernel(
    types.Tuple((i8, i8, f8))(
        FunctionsType,
        LayoutType,
        vector,
        i8,
        vector,
        types.boolean,
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
    stability,
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
    """Continue from the point in row 0 (with its tangent and watched values) until something happens.

    A first step of 0 asks for row 0 alone: it is solved, normal to the tangent given there.

    Parameters
    ----------
    options : (first step, largest step, smallest step, lower limit, upper limit, 1/width^2)
    zs, ws, tzs, tws, arc, tests, labels, mu : points of the branch, one a row; filled from row 1

    Returns
    -------
    tuple
        (why it stopped, index of the last row written, next step).
    """
    step, largest, smallest, low, high, scale = options
    which = np.array([active])
    guess = np.empty(zs.shape[1:])
    trial = p.copy()
    solving_first = step == 0.0
    k = -1 if solving_first else 0
    while k + 1 < ws.shape[0]:
        if solving_first:
            trial[active], slope = ws[0], tws[0]
        elif step < smallest:
            return STEP, k, step
        else:
            trial[active], slope = predict(zs, ws, tzs, tws, k, step, guess), tws[k]
        guess_w = trial[active]
        row = k + 1
        fine, slope, finite = settle(
            functions,
            layout,
            zs[row],
            trial,
            which,
            tzs[row],
            slope,
            scale,
            stability,
            tests[row],
            labels[row],
            mu[row],
            counts,
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
        miss = apart(zs[row], ws[row], guess, guess_w, scale)
        cosine = product(tzs[row], slope, tzs[k], tws[k], scale)
        angle = math.acos(min(1.0, max(-1.0, cosine)))
        if (angle > _MOST_ANGLE or miss > _MOST_MISS * step) and step > 4.0 * smallest:
            step *= 0.5
            continue
        if k > 0 and step > 1e-4 * largest and dips(tests, k, arc, tests[row], step):
            step *= 0.25
            continue
        k = row
        arc[k] = arc[k - 1] + step
        factor = min(1.6, max(0.4, _WANTED_ANGLE / max(angle, 1e-6)))
        following = min(largest * (1.0 + largest_state(zs[k])), step * factor)
        why = arrival(zs, ws, tzs, tws, tests, labels, k, step, low, high, scale)
        if why != FULL:
            return why, k, following
        step = following
    return FULL, k, step
