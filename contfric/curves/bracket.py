"""Location of a change between two points of a curve, compiled: a bracket, each trial a point of the curve.

A trial is predicted by the cubic through both ends of the step, and corrected normal to the tangent between
them. Places are chosen by regula falsi with the halving of the end that stays (Illinois), and a bisection
every fourth trial. A trial that is not solved counts as beyond the place.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import blocks, f8, helper, i8, indices, kernel, matrix, vector
from contfric.continuation.bracket import BY_LABEL, BY_PARAMETER, BY_TEST
from contfric.continuation.steps import AT_EVENT
from contfric.curves.conditions import ConditionType, curve_room
from contfric.curves.correct import observe_curve, settle_curve
from contfric.curves.march import RowsType
from contfric.flow.layouts import FlowType, SecondType
from contfric.orbit.equations import LayoutType

__all__ = ["BY_LABEL", "BY_PARAMETER", "BY_TEST", "locate_on_curve"]

#: Share of a step to which a place is bracketed, and trials after which it is, whatever the function.
_RESOLUTION, _MOST_TRIALS = 4e-16, 120
#: Values below this are rounding: a narrower bracket would follow noise.
_NOISE = 2e-15
#: A margin without stationary points is infinite: this is as good, and fit for interpolation.
_LARGE = 1e3


@helper
def sought(kind, index, target, planes, row, points, margins):  # type: ignore[no-untyped-def]
    """Return the value whose change of sign is sought, at one row of the points."""
    ws, tests, labels = points[1], points[5], points[6]
    if kind == BY_TEST:
        return min(tests[row, index], _LARGE)
    if kind == BY_LABEL:
        size = max(tests[row, margins + index], 1e-300)
        return size if labels[row, index] == target else -size
    least = np.inf
    for k in range(planes.shape[0]):
        value = planes[k, 0] * ws[row, 0] + planes[k, 1] * ws[row, 1] + planes[k, 2]
        least = min(least, value)
    return least


@helper
def trial_between(points, x, w, tw):  # type: ignore[no-untyped-def]
    """Write the prediction at a share of the step from row 0 to row 1 to row 2, ``w`` and ``tw``."""
    zs, ws, tzs, tws, arc = points[0], points[1], points[2], points[3], points[4]
    y, length = 1.0 - x, arc[1] - arc[0]
    ha, hb = y * y * (1.0 + 2.0 * x), x * x * (3.0 - 2.0 * x)
    ga, gb = x * y * y * length, -x * x * y * length
    for i in range(zs.shape[1]):
        for j in range(zs.shape[2]):
            value = ha * zs[0, i, j] + hb * zs[1, i, j]
            zs[2, i, j] = value + ga * tzs[0, i, j] + gb * tzs[1, i, j]
            tzs[2, i, j] = y * tzs[0, i, j] + x * tzs[1, i, j]
    for k in range(2):
        w[k] = ha * ws[0, k] + hb * ws[1, k] + ga * tws[0, k] + gb * tws[1, k]
        tw[k] = y * tws[0, k] + x * tws[1, k]
    arc[2] = arc[0] + x * length


@helper
def keep_trial(points):  # type: ignore[no-untyped-def]
    """Copy row 2 to row 3."""
    zs, ws, tzs, tws, arc, tests, labels, mu = points
    for i in range(zs.shape[1]):
        for j in range(zs.shape[2]):
            zs[3, i, j], tzs[3, i, j] = zs[2, i, j], tzs[2, i, j]
    for k in range(2):
        ws[3, k], tws[3, k] = ws[2, k], tws[2, k]
    arc[3] = arc[2]
    for k in range(tests.shape[1]):
        tests[3, k] = tests[2, k]
    for k in range(labels.shape[1]):
        labels[3, k] = labels[2, k]
    for k in range(mu.shape[1]):
        mu[3, k] = mu[2, k]


@kernel(
    types.Tuple((i8, f8))(
        FlowType,
        SecondType,
        LayoutType,
        ConditionType,
        vector,
        indices,
        vector,
        i8,
        i8,
        i8,
        matrix,
        blocks,
        RowsType,
        indices,
    )
)
def locate_on_curve(  # type: ignore[no-untyped-def]
    functions,
    second,
    layout,
    condition,
    p,
    which,
    scale,
    kind,
    index,
    target,
    planes,
    border,
    points,
    counts,
):
    """Find where a value changes sign between rows 0 and 1 of the points; the place is left in row 3.

    Parameters
    ----------
    kind, index, target : what is sought: a test, a label, or (BY_PARAMETER) the least of
        ``planes[k] . (p, q, 1)``
    points : four rows; the third one is for trials

    Returns
    -------
    tuple
        (1 if it is bracketed to its last digits, 0 if not, -1 if no trial was solved; the value there).
    """
    margins = points[5].shape[1] - points[6].shape[1] - 4
    room = curve_room(points[0].shape[1], points[0].shape[2], p.shape[0])
    trial, w, tw = p.copy(), np.empty(2), np.empty(2)
    f_low = sought(kind, index, target, planes, 0, points, margins)
    f_high = sought(kind, index, target, planes, 1, points, margins)
    sign = -1.0 if f_low < 0.0 else 1.0
    low, high, side, best, lost, solved = 0.0, 1.0, 0, np.inf, False, False
    for step in range(_MOST_TRIALS):
        x = 0.5 * (low + high)
        if step % 4 != 3 and f_low != f_high:
            between = low + (high - low) * f_low / (f_low - f_high)
            if low < between < high:
                x = between
        trial_between(points, x, w, tw)
        for k in range(2):
            trial[which[k]] = w[k]
        fine = settle_curve(
            functions,
            second,
            layout,
            condition,
            points[0][2],
            trial,
            which,
            border,
            points[2][2],
            tw,
            scale,
            AT_EVENT,
            counts,
            room,
        )
        f = -sign
        if fine:
            observe_curve(
                functions,
                second,
                layout,
                condition,
                points[0][2],
                trial,
                which,
                points[5][2],
                points[6][2],
                points[7][2],
                counts,
                room,
            )
            for k in range(2):
                points[1][2, k], points[3][2, k] = trial[which[k]], tw[k]
            f = sought(kind, index, target, planes, 2, points, margins)
            f = f if math.isfinite(f) else sign
            if not solved or abs(f) < abs(best) or f * sign >= 0.0:
                best, solved = f, True
                keep_trial(points)
            if abs(f) <= _NOISE:
                return 1, f
        if f * sign > 0.0:
            low, f_low = x, f
            f_high = 0.5 * f_high if side == 1 else f_high
            side = 1
        else:
            high, f_high, lost = x, f, not fine
            f_low = 0.5 * f_low if side == -1 else f_low
            side = -1
        if high - low <= _RESOLUTION:
            break
    if not solved:
        return -1, best
    return (1 if not lost and abs(best) < 1e-6 else 0), best
