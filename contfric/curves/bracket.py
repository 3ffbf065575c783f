"""Location of a change between two points of a curve, compiled.

The bracket is that of :mod:`contfric.continuation.bracket`; every trial is watched as a point of the curve.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types

from contfric.compiled import blocks, f8, helper, i8, indices, kernel, matrix, vector
from contfric.continuation.bracket import BY_LABEL, BY_PARAMETER, BY_TEST, bracketing
from contfric.continuation.geometry import PointsType
from contfric.continuation.steps import AT_EVENT
from contfric.curves.conditions import ConditionType, curve_workspace
from contfric.curves.correct import AlongCurve, correct_curve, observe_curve
from contfric.flow.layouts import FlowType, SecondType
from contfric.models.definition import FloatArray
from contfric.orbit.equations import LayoutType

__all__ = ["BY_LABEL", "BY_PARAMETER", "BY_TEST", "locate_on_curve"]

#: Share of a step to which a place is bracketed.
_RESOLUTION = 4e-16
#: Values below this are rounding: a narrower bracket would follow noise.
_NOISE = 2e-15
#: What is left at a place that counts as found.
_FOUND = 1e-6
#: A margin without stationary points is infinite: this is as good, and fit for interpolation.
_LARGE = 1e3


class SoughtOnCurve(NamedTuple):
    """The value whose change of sign is sought along a curve.

    Attributes
    ----------
    kind, number, target : a test, a label that was ``target``, or (BY_PARAMETER) the least of the planes
    planes : rows (a, b, c) of ``a p + b q + c``
    """

    kind: int
    number: int
    target: int
    planes: FloatArray


@helper
def value_of(sought, points, row):  # type: ignore[no-untyped-def]
    """Return the value that is sought, at one row of the points."""
    ws, tests, labels = points.w, points.tests, points.labels
    if sought.kind == BY_TEST:
        return min(tests[row, sought.number], _LARGE)
    if sought.kind == BY_LABEL:
        margins = tests.shape[1] - labels.shape[1] - 4
        size = max(tests[row, margins + sought.number], 1e-300)
        return size if labels[row, sought.number] == sought.target else -size
    least, planes = np.inf, sought.planes
    for k in range(planes.shape[0]):
        value = planes[k, 0] * ws[row, 0] + planes[k, 1] * ws[row, 1] + planes[k, 2]
        least = min(least, value)
    return least


@helper
def observed_value(way, sought, points, row):  # type: ignore[no-untyped-def]
    """Watch a corrected point, and return the value that is sought."""
    zs, ws, _, tws, _, tests, labels, mu = points
    observe_curve(way, zs[row], ws[row], tws[row], tests[row], labels[row], mu[row])
    return value_of(sought, points, row)


_bracket = bracketing(correct_curve, observed_value)


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
        PointsType,
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
    kind, index, target, planes : those of :class:`SoughtOnCurve`
    points : four rows; the third one is for trials

    Returns
    -------
    tuple
        (1 if it is bracketed to its last digits, 0 if not, -1 if no trial was solved; the value there).
    """
    followed = min(index, 0)  # nothing, but no literal
    workspace = curve_workspace(
        points.joints.shape[1],
        points.joints.shape[2],
        p.shape[0],
        followed,
        followed,
        which.shape[0],
    )
    way = AlongCurve(
        functions, second, layout, condition, border, p.copy(), which, scale, counts, workspace
    )
    sought = SoughtOnCurve(kind, index, target, planes)
    ends = value_of(sought, points, 0), value_of(sought, points, 1)
    rules = AT_EVENT, True, _NOISE, _RESOLUTION, 0.0
    _, value, lost, solved = _bracket(way, sought, points, ends, rules)
    if not solved:
        return -1, value
    return (1 if not lost and value < _FOUND else 0), value
