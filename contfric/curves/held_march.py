"""Pseudo-arclength continuation of conditions on quantities, compiled: q free parameters, q - 1 conditions.

The march is that of :mod:`contfric.continuation.march`; the border rows behind the first are the conditions
(:mod:`contfric.curves.held_conditions`).
"""

from __future__ import annotations

import numpy as np
from numba import types

from contfric.compiled import (
    allocating_helper,
    blocks,
    f8,
    helper,
    i8,
    indices,
    kernel,
    matrix,
    vector,
)
from contfric.continuation.geometry import PointsType, anchor, take_tangent
from contfric.continuation.march import marching
from contfric.continuation.steps import EXTRA
from contfric.curves.conditions import curve_workspace
from contfric.curves.held_conditions import AlongHeld, ConditionsType, normal_and_held
from contfric.curves.lagrangian import lagrangian_workspace
from contfric.flow.layouts import FlowType
from contfric.orbit.equations import LayoutType, close_chain
from contfric.orbit.followed import count_followed, remember
from contfric.orbit.monitor import watch
from contfric.orbit.newton import (
    CHECKS,
    CONVERGED,
    MULTIPLIERS,
    NOT_FINITE,
    SOLVES,
    correcting,
)
from contfric.orbit.spectrum import multipliers

_correct = correcting(normal_and_held)


@helper
def correct_held(way, z, w, tz, tw, accuracy):  # type: ignore[no-untyped-def]
    """Correct (z, w) normal to the tangent (tz, tw), and replace the tangent; (converged, all is finite)."""
    functions, layout, p, which, workspace = (
        way.functions,
        way.layout,
        way.p,
        way.which,
        way.workspace,
    )
    for k in range(which.shape[0]):
        p[which[k]] = w[k]
    anchor(workspace, z, p, which, tz, tw, way.scale)
    way.counts[SOLVES] += 1
    status, _, _, _ = _correct(
        functions, layout, z, p, which, np.inf, accuracy, 0.0, workspace, way
    )
    for k in range(which.shape[0]):
        w[k] = p[which[k]]
    if status != CONVERGED:
        return False, status != NOT_FINITE
    close_chain(functions, layout, z, p, which, workspace.equations)
    fine = take_tangent(workspace.elimination, tz, tw, way.scale)
    return fine, fine


@helper
def accept_held(way):  # type: ignore[no-untyped-def]
    """Remember a point that is accepted."""
    remember(way.workspace.followed)


@helper
def observe_held(way, z, w, tw, tests, labels, mu):  # type: ignore[no-untyped-def]
    """Fill margins and multipliers of a corrected point; False if something is not finite.

    Labels and changes of stability are no events of such a curve.
    """
    layout, workspace = way.layout, way.workspace
    equations = workspace.equations
    way.counts[CHECKS] += 1
    way.counts[MULTIPLIERS] += 1
    multipliers(layout, workspace.pencil, equations.close, mu, workspace.spectral)
    finite = watch(
        way.functions,
        layout,
        z,
        way.p,
        equations,
        workspace.stationary,
        tests,
        labels,
        workspace.followed,
    )
    for k in range(tests.shape[0] - EXTRA - labels.shape[0], tests.shape[0]):
        tests[k] = 1.0
    for k in range(labels.shape[0]):
        labels[k] = 0
    return finite


_march_points = marching(correct_held, observe_held, accept_held)


@allocating_helper
def way_along(functions, layout, conditions, p, which, widths, counts, count, m):  # type: ignore[no-untyped-def]
    """Return what a step needs, with its workspace."""
    free, rows, surfaces = which.shape[0], count_followed(layout), layout.observables.shape[0]
    whole = conditions.extreme.whole.modes.shape[0]
    return AlongHeld(
        functions,
        layout,
        conditions,
        p.copy(),
        which,
        widths,
        1.0 / widths**2,
        counts,
        curve_workspace(count, m, p.shape[0], rows, surfaces, free),
        lagrangian_workspace(count, whole, m, free),
    )


@kernel(
    types.Tuple((i8, i8, f8))(
        FlowType,
        LayoutType,
        ConditionsType,
        vector,
        indices,
        f8,
        vector,
        matrix,
        i8,
        blocks,
        matrix,
        i8,
        PointsType,
        indices,
    )
)
def march_held(  # type: ignore[no-untyped-def]
    functions,
    layout,
    conditions,
    p,
    which,
    accuracy,
    options,
    box,
    k,
    start_z,
    start_w,
    taken,
    points,
    counts,
):
    """Continue from the point in row k until something happens; with k = -1 solve row 0 alone.

    Parameters
    ----------
    accuracy : size of a correction after which no other is asked for
    options : those of :func:`contfric.continuation.march.march`
    box : lower corner, upper corner, widths; shape (3, q)
    start_z, start_w : first point of the curve and its tangent, shapes (2, N, m) and (2, q)
    taken : points since then
    points : rows that are filled from k + 1

    Returns
    -------
    tuple
        (why it stopped, index of the last row written, next step).
    """
    zs = points.joints
    way = way_along(
        functions, layout, conditions, p, which, box[2], counts, zs.shape[1], zs.shape[2]
    )
    guess = np.empty((zs.shape[1], zs.shape[2])), np.empty(which.shape[0])
    return _march_points(way, accuracy, options, box, k, start_z, start_w, taken, points, guess)
