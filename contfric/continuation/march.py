"""Pseudo-arclength continuation, compiled: of branches, and of curves in two parameters.

A branch is a curve ``(z(s), w(s))`` of joints and free parameters of the chain of segments: of one parameter,
or of two with a condition (:mod:`contfric.curves.march`). From two points with unit tangents the
next one is predicted by the cubic through both (Hermite), and corrected in the plane normal to the
last tangent (H. B. Keller, 1977). The step follows the curvature: the angle between consecutive
tangents is kept near a target. Arclength between points is the chord c with the correction for its
arc, ``c (1 + angle^2 / 24)``.

Every accepted point is watched: margins, slope p', ``chi(1)``, ``chi(-1)``, the largest pair of
multipliers, and the labels of its segments. The march stops at the first step over which any of them
changes sign; :mod:`contfric.continuation.bracket` then locates the place. A step within which one of them
may change its sign twice is taken again, shorter (:mod:`contfric.continuation.pairs`).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from contfric.compiled import blocks, f8, helper, i8, indices, kernel, matrix, vector
from contfric.compiling.references import by_reference
from contfric.continuation.dips import dips
from contfric.continuation.geometry import (
    PointsType,
    copy_to,
    copy_vector,
    distance,
    keep,
    largest_state,
    outside,
    predict,
    product,
    returned,
)
from contfric.continuation.pairs import hidden_pair, recall
from contfric.continuation.steps import (
    Along,
    accept_branch,
    changed,
    correct_branch,
    observe_branch,
    step_workspace,
)
from contfric.flow.layouts import FlowType
from contfric.orbit.equations import LayoutType
from contfric.orbit.followed import count_followed
from contfric.orbit.newton import ALONG, INTEGRATED, ON_THE_WAY

#: Why a march stopped.
FULL, EVENT, OUTSIDE, STEP, CLOSED, BROKEN, UNBOUNDED, ENDLESS, MORE = range(9)
#: Places in the options of a march.
BUDGET, LOST = 4, 5

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
def arrival(way, points, k, start_z, start_w, taken, step, box):  # type: ignore[no-untyped-def]
    """Return why the march stops at row k, or FULL if it goes on."""
    zs, ws, _, _, _, tests, labels, _ = points
    if changed(tests[k - 1], tests[k], labels[k - 1], labels[k]):
        return EVENT
    if outside(ws[k], box):
        return OUTSIDE
    if taken > 3 and returned(
        zs[k], ws[k], start_z, start_w, zs[k - 1], ws[k - 1], way.scale, step
    ):
        return CLOSED
    if largest_state(zs[k]) > _UNBOUNDED:
        return UNBOUNDED
    if way.layout.turn == 0.0 and -zs[k, 0, 0] > _ENDLESS:
        return ENDLESS
    return FULL


def marching(correct_at: Any, observe_at: Any, accept: Any) -> Any:
    """Return the march of branches or curves, as a helper.

    Parameters
    ----------
    correct_at : corrects (z, w) normal to (tz, tw) in place; (converged, everything finite)
    observe_at : fills what is watched on a point; whether that is finite
    accept : is told of every point that is accepted
    """

    @helper
    def march_points(  # type: ignore[no-untyped-def]
        way, accuracy, options, box, k, start_z, start_w, taken, points, guess
    ):
        """Continue from the point in row k until something happens.

        Parameters
        ----------
        way : what the three functions need
        guess : a prediction (joints, parameters), overwritten
        others : those of :func:`march`
        """
        way = by_reference(way)
        zs, ws, tzs, tws, arc, tests, labels, mu = points
        guess_z, guess_w = guess
        step, largest, smallest, gives_way, budget, lost = options
        first, finite, solved, angle = k < 0, lost == 0.0, 0.0, 0.0
        recall(way, points, k - 1)
        recall(way, points, k)
        while k + 1 < ws.shape[0]:
            row = k + 1
            if solved >= budget:
                options[LOST] = 0.0 if finite else 1.0
                return MORE, k, step
            solved += 1.0
            if not first:
                if step < smallest:
                    return (STEP if finite else BROKEN), k, step
                predict(points, k, step)
                keep(way.layout.conserved, zs[k], zs[row])
                copy_to(guess_z, zs[row])
                copy_vector(guess_w, ws[row])
            fine, finite = correct_at(way, zs[row], ws[row], tzs[row], tws[row], accuracy)
            if fine and not first:
                miss = distance(zs[row], ws[row], guess_z, guess_w, way.scale)
                cosine = product(tzs[row], tws[row], tzs[k], tws[k], way.scale)
                angle = math.acos(min(1.0, max(-1.0, cosine)))
                if (angle > _MOST_ANGLE or miss > _MOST_MISS * step) and step > gives_way:
                    step *= 0.5
                    continue
            if fine:
                finite = observe_at(
                    way, zs[row], ws[row], tws[row], tests[row], labels[row], mu[row]
                )
            if first:
                if fine:
                    accept(way)
                return FULL if fine else BROKEN, 0, step
            if not fine:
                step *= 0.5
                continue
            if not finite:
                if step <= 64.0 * smallest:
                    return BROKEN, k, step
                step *= 0.25
                continue
            if k > 0 and step > 1e-4 * largest and dips(way, tests, k, arc, tests[row], step):
                step *= 0.25
                continue
            chord = distance(zs[row], ws[row], zs[k], ws[k], way.scale)
            length = chord * (1.0 + angle * angle / 24.0)
            if step > 1e-4 * largest:
                share = hidden_pair(way, points, k, length)
                if share > 0.0:
                    step *= share
                    continue
            k, taken = row, taken + 1
            accept(way)
            arc[k] = arc[k - 1] + length
            factor = min(_GROWTH, max(0.4, _WANTED_ANGLE / max(angle, 1e-6)))
            size = largest_state(zs[k])
            if way.layout.turn == 0.0:  # the duration is one of the unknowns
                size = max(size, -zs[k, 0, 0])
            following = min(largest * (1.0 + size), step * factor)
            why = arrival(way, points, k, start_z, start_w, taken, step, box)
            if why != FULL:
                return why, k, following
            step = following
        return FULL, k, step

    return march_points


_march_branch = marching(correct_branch, observe_branch, accept_branch)


@kernel(
    types.Tuple((i8, i8, f8))(
        FlowType,
        LayoutType,
        vector,
        indices,
        types.boolean,
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
def march(  # type: ignore[no-untyped-def]
    functions, layout, p, which, stability, options, box, k, start_z, start_w, taken, points, counts
):
    """Continue from the point in row k (with its tangent and watched values) until something happens.

    With k = -1, row 0 alone is solved, normal to the tangent given there. A call that has used up its budget
    ends with MORE: called again with the last row, the next step and the same options, it goes on as if
    nothing had been.

    Parameters
    ----------
    p, which : parameters, and the index of the one that is free, shape (1,)
    options : (first step, largest step, smallest step, step below which it is not refused for its angle,
        budget: most points that are solved for, whether the last trial was not finite)
    box : lower limit, upper limit and width of what is free, shape (3, 1)
    k : last row that is given; an earlier one serves the prediction
    start_z, start_w, taken : where the branch began (point, tangent; shapes (2, N, m) and (2, 1)), and points
        since then
    points : of the branch, one a row; filled from row k + 1

    Returns
    -------
    tuple
        (why it stopped, index of the last row written, next step).
    """
    zs = points.joints
    rows, surfaces = count_followed(layout), layout.observables.shape[0]
    workspace = step_workspace(zs.shape[1], zs.shape[2], p.shape[0], rows, surfaces)
    way = Along(functions, layout, p.copy(), which, 1.0 / box[2] ** 2, stability, counts, workspace)
    integrated = layout.rounding > INTEGRATED
    accuracy = ON_THE_WAY if integrated and k >= 0 else ALONG
    guess = np.empty((zs.shape[1], zs.shape[2])), np.empty(1)
    return _march_branch(
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
