"""Pseudo-arclength continuation of a condition in the plane of two parameters, compiled.

The march is that of :mod:`contfric.continuation.march`. The unknowns are the joints and both parameters; the
second border row is the condition.
"""

from __future__ import annotations

import numpy as np
from numba import types

from contfric.compiled import blocks, f8, i8, indices, kernel, matrix, vector
from contfric.continuation.geometry import PointsType
from contfric.continuation.march import marching
from contfric.curves.conditions import ConditionType, curve_workspace
from contfric.curves.correct import AlongCurve, accept_curve, correct_curve, observe_curve
from contfric.flow.layouts import FlowType, SecondType
from contfric.orbit.equations import LayoutType
from contfric.orbit.followed import count_followed

_march_points = marching(correct_curve, observe_curve, accept_curve)


@kernel(
    types.Tuple((i8, i8, f8))(
        FlowType,
        SecondType,
        LayoutType,
        ConditionType,
        vector,
        indices,
        f8,
        vector,
        matrix,
        i8,
        blocks,
        matrix,
        i8,
        blocks,
        PointsType,
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
    accuracy,
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

    Parameters
    ----------
    accuracy : size of a correction after which no other is asked for
    options : those of :func:`contfric.continuation.march.march`
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
    zs, scale = points.joints, 1.0 / box[2] ** 2
    rows, surfaces = count_followed(layout), layout.observables.shape[0]
    workspace = curve_workspace(
        zs.shape[1], zs.shape[2], p.shape[0], rows, surfaces, which.shape[0]
    )
    way = AlongCurve(
        functions, second, layout, condition, border, p.copy(), which, scale, counts, workspace
    )
    guess = np.empty((zs.shape[1], zs.shape[2])), np.empty(2)
    return _march_points(
        way,
        accuracy,
        options,
        box,
        k,
        start_z,
        start_w,
        taken,
        points,
        guess,
    )
