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

from contfric.compiled import blocks, f8, i8, indices, kernel, matrix, table, vector
from contfric.continuation.steps import (
    apart,
    changed,
    copy_to,
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
    count, m = zs.shape[1], zs.shape[2]
    z, tz, guess = np.empty((count, m)), np.empty((count, m)), np.empty((count, m))
    trial = p.copy()
    value = np.empty(tests.shape[1])
    label = np.empty(labels.shape[1], dtype=np.int64)
    k = 0
    if step == 0.0:
        trial[active] = ws[0]
        fine, tws[0], _ = settle(
            functions,
            layout,
            zs[0],
            trial,
            which,
            tzs[0],
            tws[0],
            scale,
            stability,
            tests[0],
            labels[0],
            mu[0],
            counts,
        )
        ws[0] = trial[active]
        return FULL if fine else BROKEN, 0, step
    while k + 1 < ws.shape[0]:
        if step < smallest:
            return STEP, k, step
        for i in range(count):
            for j in range(m):
                z[i, j] = zs[k, i, j] + step * tzs[k, i, j]
                guess[i, j] = z[i, j]
                tz[i, j] = tzs[k, i, j]
        trial[active] = ws[k] + step * tws[k]
        guess_w = trial[active]
        fine, slope, finite = settle(
            functions,
            layout,
            z,
            trial,
            which,
            tz,
            tws[k],
            scale,
            stability,
            value,
            label,
            mu[k + 1],
            counts,
        )
        if not fine:
            step *= 0.5
            continue
        if not finite:
            if step > 64.0 * smallest:
                step *= 0.25
                continue
            return BROKEN, k, step
        miss = apart(z, trial[active], guess, guess_w, scale)
        cosine = product(tz, slope, tzs[k], tws[k], scale)
        angle = math.acos(min(1.0, max(-1.0, cosine)))
        if (angle > _MOST_ANGLE or miss > _MOST_MISS * step) and step > 4.0 * smallest:
            step *= 0.5
            continue
        if k > 0 and step > 1e-4 * largest and dips(tests, k, arc, value, step):
            step *= 0.25
            continue
        k += 1
        copy_to(zs[k], z)
        copy_to(tzs[k], tz)
        ws[k], tws[k] = trial[active], slope
        arc[k] = arc[k - 1] + step
        for j in range(value.shape[0]):
            tests[k, j] = value[j]
        for j in range(label.shape[0]):
            labels[k, j] = label[j]
        factor = min(1.6, max(0.4, _WANTED_ANGLE / max(angle, 1e-6)))
        size = largest_state(z)
        following = min(largest * (1.0 + size), step * factor)
        if changed(tests[k - 1], value, labels[k - 1], label):
            return EVENT, k, following
        if ws[k] < low or ws[k] > high:
            return OUTSIDE, k, following
        if k > 3 and returned(
            z, ws[k], zs[0], ws[0], tzs[0], tws[0], zs[k - 1], ws[k - 1], scale, step
        ):
            return CLOSED, k, following
        if size > _UNBOUNDED:
            return UNBOUNDED, k, following
        step = following
    return FULL, k, step
