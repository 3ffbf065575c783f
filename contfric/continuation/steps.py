"""One step of a branch, compiled: the scaled product, the corrector normal to a tangent, the watch.

The product of two directions is ``<a, b> = (1/N) sum a_i b_i + a_p b_p / width^2``, so that neither
the number of segments nor the unit of the parameter matters.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import helper
from contfric.orbit.monitor import multipliers, watch
from contfric.orbit.newton import (
    CHECKS,
    CONVERGED,
    MULTIPLIERS,
    SOLVES,
    correct,
    tangent_at,
)

#: Extra columns of the tests behind the margins: slope of the parameter, products of 1 - mu and of
#: 1 + mu, and 1 - |mu_1 mu_2| of the two largest multipliers.
FOLD, CHI_ONE, CHI_MINUS, CHI_PAIR = range(4)
EXTRA = 4
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
def largest_state(z):  # type: ignore[no-untyped-def]
    """Return the largest component of the states, times left out."""
    size = 0.0
    for i in range(z.shape[0]):
        for j in range(1, z.shape[1]):
            size = max(size, abs(z[i, j]))
    return size


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
    status, _, _, _ = correct(functions, layout, z, p, which, d, e, np.inf, _ROUGH, pencil)
    if status != CONVERGED:
        return False, tw, True
    new_z, new_w = np.empty((count, m)), np.empty(1)
    fine, _ = tangent_at(functions, layout, z, p, which, d, e, new_z, new_w, pencil, 1.0)
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
    tests[at + CHI_PAIR] = 1.0
    if stability:
        counts[MULTIPLIERS] += 1
        tests[at + CHI_ONE], tests[at + CHI_MINUS] = multipliers(layout, pencil, mu)
        if layout.rank > 1:
            tests[at + CHI_PAIR] = 1.0 - abs(mu[0]) * abs(mu[1])
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
