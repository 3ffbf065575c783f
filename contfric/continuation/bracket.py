"""Location of an event on a branch, compiled: a bracket, each trial a solved point of the branch.

By Chandrupatla's method (Adv. Eng. Software 28 (1997) 145-149): inverse quadratic interpolation where
the values are monotone enough for it, bisection elsewhere; the bracket shrinks to the resolution of
the arithmetic.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import f8, helper, i8, indices, kernel, matrix, vector
from contfric.continuation.steps import copy_to, settle
from contfric.orbit.newton import FunctionsType, LayoutType

#: What locate() follows: a column of the tests, a label, or the parameter itself.
BY_TEST, BY_LABEL, BY_PARAMETER = range(3)


@helper
def next_trial(low, high, f_low, f_high, x_old, f_old, x):  # type: ignore[no-untyped-def]
    """Return Chandrupatla's next abscissa: inverse quadratic where it is monotone, else the middle."""
    a, fa = x, (f_low if x == low else f_high)
    b, fb = (high, f_high) if x == low else (low, f_low)
    c, fc = x_old, f_old
    share = 0.5
    if fb != fa and fc != fb and fc != fa and b != c:
        xi = (a - b) / (c - b)
        phi = (fa - fb) / (fc - fb)
        if phi * phi < xi and (1 - phi) * (1 - phi) < 1 - xi:
            share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (
                fc - fb
            )
    width = abs(b - a)
    least = min(0.5, 1e-16 / width if width > 0.0 else 0.5)
    share = min(1.0 - least, max(least, share))
    return a + share * (b - a)


@helper
def sign_value(kind, index, target, sign, tests, labels, w):  # type: ignore[no-untyped-def]
    """Return the function whose change of sign is sought, positive before it."""
    if kind == BY_TEST:
        value = sign * tests[index]
    elif kind == BY_LABEL:
        value = 1.0 if labels[index] == int(target) else -1.0
    else:
        value = sign * (w - target)
    if math.isnan(value):
        return -1.0
    return min(value, 1e3)  # a margin without stationary points is infinite


@kernel(
    f8(
        FunctionsType,
        LayoutType,
        vector,
        i8,
        f8,
        types.boolean,
        i8,
        i8,
        f8,
        f8,
        matrix,
        matrix,
        matrix,
        f8,
        f8,
        vector,
        vector,
        indices,
        types.complex128[::1],
        indices,
    )
)
def locate(  # type: ignore[no-untyped-def]
    functions,
    layout,
    p,
    active,
    scale,
    stability,
    kind,
    index,
    target,
    sign,
    za,
    zb,
    tz,
    wb,
    tw,
    tests,
    slope_out,
    labels,
    mu,
    counts,
):
    """Find where a watched value changes sign between two points of a branch.

    On entry ``za``, ``p`` and the tangent ``(tz, tw)`` are the first point, ``(zb, wb)`` the second.
    On return ``za``, ``p``, ``tz`` hold the located point with its tangent (``slope_out[0]`` its
    p'), and ``tests``, ``labels``, ``mu`` what is watched there.

    Returns
    -------
    float
        Position in the step, from 0 to 1; -1 if no trial point could be solved; -2 minus the
        position of the last good point if it is Newton that fails behind it.
    """
    which = np.array([active])
    count, m = za.shape
    wa = p[active]
    z, t = np.empty((count, m)), np.empty((count, m))
    best_z, best_t = za.copy(), tz.copy()
    low, high = 0.0, 1.0
    f_low, f_high, f_old, x_old = np.nan, np.nan, np.nan, 0.0
    x, stage = 0.0, 0
    best_x, best_w, best_slope = 0.0, wa, tw
    lost = False
    for _ in range(120):
        for i in range(count):
            for j in range(m):
                z[i, j] = za[i, j] + x * (zb[i, j] - za[i, j])
        p[active] = wa + x * (wb - wa)
        copy_to(t, tz)
        fine, slope, _ = settle(
            functions, layout, z, p, which, t, tw, scale, stability, tests, labels, mu, counts
        )
        if not fine:
            if stage < 2:
                return -1.0
            f = -1.0
        else:
            f = sign_value(kind, index, target, sign, tests, labels, p[active])
            if f >= 0.0 or stage == 1:
                best_x, best_w, best_slope = x, p[active], slope
                copy_to(best_z, z)
                copy_to(best_t, t)
        if stage == 0:
            f_low, stage, x = f, 1, 1.0
            if f <= 0.0:
                break
            continue
        if stage == 1:
            f_high, stage = f, 2
            if f > 0.0:
                break
            x_old, f_old = low, f_low
            x = 0.5
            continue
        if f > 0.0:
            x_old, f_old = (low, f_low)
            low, f_low = x, f
        else:
            x_old, f_old = (high, f_high)
            high, f_high = x, f
            lost = not fine
        width = high - low
        if f == 0.0 or width <= 4e-16:
            break
        x = next_trial(low, high, f_low, f_high, x_old, f_old, x)
    copy_to(za, best_z)
    copy_to(tz, best_t)
    p[active] = best_w
    copy_to(t, tz)
    _, slope, _ = settle(
        functions,
        layout,
        best_z,
        p,
        which,
        t,
        best_slope,
        scale,
        stability,
        tests,
        labels,
        mu,
        counts,
    )
    p[active] = best_w
    slope_out[0] = best_slope
    return -2.0 - best_x if lost else best_x
