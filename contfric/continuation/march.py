"""Pseudo-arclength continuation and the location of events on the branch, compiled.

A branch is a curve ``(z(s), p(s))`` of the chain of segments. From a point with unit tangent
``(z', p')`` in the scaled product ``<a, b> = (1/N) sum a_i b_i + a_p b_p / width^2`` (H. B. Keller,
1977) the next one is predicted along the tangent and corrected in the plane normal to it. The step
follows the curvature: the angle between consecutive tangents is kept near a target.

Every accepted point is watched: margins, fold ``p'``, ``chi(1)`` and ``chi(-1)``, and the labels of
its segments. The march stops at the first step over which any of them changes sign, and
:func:`locate` then brackets the place on the branch by Chandrupatla's method (Adv. Eng. Software 28
(1997) 145-149), each trial a solved point of the branch, until the bracket is at the resolution of
the arithmetic. A parabola through the last three values guards against a margin that dips below zero
and returns within one step: such a step is taken again, shorter.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import blocks, f8, helper, i8, indices, kernel, matrix, table, vector
from contfric.orbit.monitor import multipliers, watch
from contfric.orbit.newton import (
    CHECKS,
    CONVERGED,
    MULTIPLIERS,
    SOLVES,
    FunctionsType,
    LayoutType,
    correct,
    tangent_at,
)

#: Why a march stopped.
FULL, EVENT, OUTSIDE, STEP, CLOSED, BROKEN = range(6)
#: What locate() follows: a column of the tests, a label, or the parameter itself.
BY_TEST, BY_LABEL, BY_PARAMETER = range(3)
#: Extra columns of the tests behind the margins.
FOLD, CHI_ONE, CHI_MINUS = range(3)
EXTRA = 3

#: Angle between consecutive tangents (rad): wanted, and the most that is accepted. At the wanted
#: angle a branch is smooth to the eye; beyond the other one, the step may change branches.
_WANTED_ANGLE, _MOST_ANGLE = 0.12, 0.35
#: Distance from predictor to orbit in units of the step: beyond it the step may change branches.
_MOST_MISS = 0.3
#: Accuracy asked of the corrector: the tangent's solve takes one more Newton step behind it.
_ROUGH = 1e-9


@helper
def product(za, wa, zb, wb, scale):  # type: ignore[no-untyped-def]
    """Return the scaled product of two directions."""
    total = 0.0
    for i in range(za.shape[0]):
        for j in range(za.shape[1]):
            total += za[i, j] * zb[i, j]
    return total / za.shape[0] + wa * wb * scale


@helper
def apart(za, wa, zb, wb, scale):  # type: ignore[no-untyped-def]
    """Return the distance of two points in the scaled product."""
    total = 0.0
    for i in range(za.shape[0]):
        for j in range(za.shape[1]):
            total += (za[i, j] - zb[i, j]) ** 2
    return math.sqrt(total / za.shape[0] + (wa - wb) ** 2 * scale)


@helper
def copy_to(target, source):  # type: ignore[no-untyped-def]
    """Copy a matrix."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@helper
def border_rows(tz, tw, scale, d, e):  # type: ignore[no-untyped-def]
    """Write a tangent as a border row."""
    for i in range(tz.shape[0]):
        for j in range(tz.shape[1]):
            d[0, i, j] = tz[i, j] / tz.shape[0]
    e[0, 0] = tw * scale


@helper
def settle(  # type: ignore[no-untyped-def]
    functions, layout, z, p, which, tz, tw, scale, stability, tests, labels, mu, counts
):
    """Correct (z, p) normal to the tangent (tz, tw); replace the tangent; watch the point.

    Returns
    -------
    tuple
        (converged, new p', everything finite).
    """
    count, m = z.shape
    d, e = np.empty((1, count, m)), np.empty((1, 1))
    border_rows(tz, tw, scale, d, e)
    pencil = np.empty((2, m, m))
    counts[SOLVES] += 1
    status, _, _, _ = correct(functions, layout, z, p, which, d, e, False, _ROUGH, pencil)
    if status != CONVERGED:
        return False, tw, True
    new_z, new_w = np.empty((count, m)), np.empty(1)
    fine, _ = tangent_at(functions, layout, z, p, which, d, e, new_z, new_w, pencil, True)
    if not fine:
        return False, tw, True
    norm = math.sqrt(product(new_z, new_w[0], new_z, new_w[0], scale))
    if not math.isfinite(norm) or norm == 0.0:
        return False, tw, False
    for i in range(count):
        for j in range(m):
            tz[i, j] = new_z[i, j] / norm
    slope = new_w[0] / norm
    counts[CHECKS] += 1
    finite = watch(functions, layout, z, p, tests, labels)
    at = tests.shape[0] - EXTRA
    tests[at + FOLD] = slope
    tests[at + CHI_ONE] = 1.0
    tests[at + CHI_MINUS] = 1.0
    if stability:
        counts[MULTIPLIERS] += 1
        tests[at + CHI_ONE], tests[at + CHI_MINUS] = multipliers(layout, pencil, mu)
    return True, slope, finite


@helper
def dips(tests, k, arc, value, step):  # type: ignore[no-untyped-def]
    """Tell whether some test, positive at both ends of a step, is likely to be negative within.

    By the parabola through the last two points and the new one.
    """
    back = arc[k] - arc[k - 1]
    for j in range(value.shape[0]):
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
        if at < step and (f1 + 0.5 * slope * at) * f1 < 0.0:
            return True
    return False


@helper
def changed(before, after, labels_before, labels_after):  # type: ignore[no-untyped-def]
    """Tell whether any test changes sign or any label changes between two points."""
    margins = before.shape[0] - EXTRA
    for j in range(margins):
        if after[j] < 0.0:
            return True
    for j in range(margins, before.shape[0]):
        if before[j] * after[j] < 0.0:
            return True
    for j in range(labels_before.shape[0]):
        if labels_before[j] != labels_after[j]:
            return True
    return False


@helper
def returned(z, w, start_z, start_w, tz, tw, last_z, last_w, scale, step):  # type: ignore[no-untyped-def]
    """Tell whether a step passes the start of the branch again in the same direction."""
    if apart(z, w, start_z, start_w, scale) > 1.5 * step:
        return False
    start = product(start_z, start_w, tz, tw, scale)
    behind = product(last_z, last_w, tz, tw, scale)
    ahead = product(z, w, tz, tw, scale)
    return behind < start <= ahead


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
    functions, layout, p, active, options, stability, zs, ws, tzs, tws, arc, tests, labels, mu,
    counts,
):
    """Continue from the point in row 0 (with its tangent and watched values) until something happens.

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
        following = min(largest, step * factor)
        if changed(tests[k - 1], value, labels[k - 1], label):
            return EVENT, k, following
        if ws[k] < low or ws[k] > high:
            return OUTSIDE, k, following
        if k > 3 and returned(
            z, ws[k], zs[0], ws[0], tzs[0], tws[0], zs[k - 1], ws[k - 1], scale, step
        ):
            return CLOSED, k, following
        step = following
    return FULL, k, step


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


@kernel(
    types.Tuple((types.boolean, f8))(
        FunctionsType,
        LayoutType,
        matrix,
        vector,
        i8,
        matrix,
        f8,
        f8,
        types.boolean,
        vector,
        indices,
        types.complex128[::1],
        indices,
    )
)
def begin(  # type: ignore[no-untyped-def]
    functions, layout, z, p, active, tz, tw, scale, stability, tests, labels, mu, counts
):
    """Solve for the first point of a branch, normal to (tz, tw); (solved, p' of the tangent)."""
    which = np.array([active])
    fine, slope, _ = settle(
        functions, layout, z, p, which, tz, tw, scale, stability, tests, labels, mu, counts
    )
    return fine, slope
