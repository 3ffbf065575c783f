"""Pseudo-arclength continuation, compiled: of branches, and of curves in two parameters.

A branch is a curve ``(z(s), w(s))`` of joints and free parameters of the chain of segments: of one parameter,
or of q with q - 1 conditions (:mod:`contfric.curves.core.march`). From two points with unit tangents the
next one is predicted by the cubic through both (Hermite), and corrected in the plane normal to the
last tangent (H. B. Keller, 1977). The step follows the curvature: the angle between consecutive
tangents is kept near a target. Arclength between points is the chord c with the correction for its
arc, ``c (1 + angle^2 / 24)``.

Every accepted point is watched: margins, slope p', ``chi(1)``, ``chi(-1)``, the largest pair of
multipliers, and the labels of its segments. The march stops at the first step over which any of them
changes sign; :mod:`contfric.continuation.core.locate` then locates the location. A step within which one of
them may change its sign twice is taken again, shorter (:mod:`contfric.continuation.core.pairs`).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from contfric.bvp.stationary_values import count_followed
from contfric.compiled import f8, helper, i8, kernel
from contfric.compiling.references import by_reference
from contfric.continuation.core.dips import dips
from contfric.continuation.core.geometry import (
    CourseType,
    copy_to,
    copy_vector,
    distance,
    keep,
    largest_state,
    outside,
    predict,
    product,
    seen_from,
)
from contfric.continuation.core.pairs import hidden_pair, recall
from contfric.continuation.core.steps import (
    BranchProblemType,
    accept_branch,
    along_branch,
    changed,
    copy_free,
    correct_branch,
    observe_branch,
    told,
)

#: Why a march stopped.
FULL, EVENT, OUTSIDE, STEP, CLOSED, BROKEN, UNBOUNDED, ENDLESS, MORE = range(9)
#: Places in the options of a march (:class:`contfric.continuation.core.geometry.Course`).
GIVES_WAY, BUDGET, LOST, ACCURACY = 3, 4, 5, 6

#: Angle between consecutive tangents (rad): wanted, and the most that is accepted. At the wanted
#: angle a branch is smooth to the eye; beyond the other one, the step may change branches.
_WANTED_ANGLE, _MOST_ANGLE = 0.12, 0.35
#: Most that a step grows by: the first steps are short, and the cubic holds this far beyond its base.
_GROWTH = 2.5
#: Distance from predictor to orbit in units of the step: beyond it the step may change branches.
_MOST_MISS = 0.3
#: A miss below this is no other branch: where equations are singular together, at a branch point, a solved
#: point is off by as much, and steps were as short as that for thousands of points.
_BLUR = 1e-8
#: Steps in which a branch leaves its start, and is near it. Steps that pass the start later are shortened
#: to a point that is no farther from it than this share of the step.
_FIRST_STEPS, _ON_START = 3, 1e-2
#: Most periods of the excitation by which the phase is taken to turn in one step: a step in which it turns by
#: more is far longer than the branch it would follow.
_TURNS = 8
#: A state this large (nondimensional) is on its way to infinity: resonance without damping.
_UNBOUNDED = 1e6
#: Times of joints are unknowns like states. In a turn longer than this they are far larger than these, as in
#: units of time that are short, and arclength is theirs: steps are as long as that.
_LONG = 50.0
#: A turn this long (nondimensional) of an autonomous model is on its way to an infinite one.
_ENDLESS = 1e4


@helper
def from_start(way, course, k, turns):  # type: ignore[no-untyped-def]
    """Return how far row k is from the start, and how far ahead of it, that many periods earlier."""
    points, later = course.points, 0.0
    if turns != 0:
        equations = way.workspace.equations
        copy_free(way.p, way.which, points.w[k])
        later = turns * way.functions.period(way.p, equations.none, equations.empty)
    return seen_from(
        course.start_z, course.start_w, points.joints[k], points.w[k], later, way.scale
    )


@helper
def round_again(way, course, k, step):  # type: ignore[no-untyped-def]
    """Return (gap, how far ahead) of rows k - 1 and k from the start, in steps; infinite where that is far.

    The phase of a solution against the excitation may turn along a closed branch: an orbit of several periods
    is then met one or more of them later, and is the same. A period may change along the branch.
    """
    zs, ws, near = course.points.joints, course.points.w, 0.0
    for j in range(way.scale.shape[0]):
        near += (ws[k, j] - course.start_w[0, j]) ** 2 * way.scale[j]
    if math.sqrt(near) > 1.5 * step:
        return np.inf, np.inf, np.inf, np.inf
    first, most = 0, 0
    if way.layout.turn != 0.0:  # in a long step the phase may turn by periods
        equations, begin = way.workspace.equations, course.start_z[0, 0, 0]
        period = way.functions.period(way.p, equations.none, equations.empty)
        first, most = (
            round((zs[k - 1, 0, 0] - begin) / period),
            round((zs[k, 0, 0] - begin) / period),
        )
    best = (np.inf, np.inf, np.inf, np.inf)
    for i in range(min(abs(most - first), _TURNS) + 1):
        turns = most - i if most > first else most + i
        last, before = from_start(way, course, k - 1, turns)
        gap, ahead = from_start(way, course, k, turns)
        if last + gap < best[0] + best[2]:
            best = (last, before, gap, ahead)
    return best[0] / step, best[1] / step, best[2] / step, best[3] / step


@helper
def share_to_start(way, course, k, step):  # type: ignore[no-untyped-def]
    """Return up to which share the step to row k is taken again to end on the start that it passes; 1 if not.

    Whether it is the start is told there: with long steps other orbits are near it, some periods later.
    """
    last, before, gap, ahead = round_again(way, course, k, step)
    if gap > 1.5 or last < _ON_START or before > -_ON_START or ahead < _ON_START:
        return 1.0
    return (0.5 * _ON_START - before) / (ahead - before)


@helper
def arrival(way, course, k, taken, step):  # type: ignore[no-untyped-def]
    """Return why the march stops at row k, or FULL if it goes on."""
    points = course.points
    zs, ws, tests, labels = points.joints, points.w, points.tests, points.labels
    known = told(way.layout, zs[k])
    if changed(tests[k - 1], tests[k], labels[k - 1], labels[k], known):
        return EVENT
    if outside(ws[k], course.box):
        return OUTSIDE
    if taken > _FIRST_STEPS:
        last, _before, gap, _ahead = round_again(way, course, k, step)
        if min(last, gap) < _ON_START:
            return CLOSED
    if largest_state(zs[k]) > _UNBOUNDED:
        return UNBOUNDED
    if way.layout.turn == 0.0 and -zs[k, 0, 0] > _ENDLESS:
        return ENDLESS
    return FULL


@helper
def accepted_share(way, points, k, length, step):  # type: ignore[no-untyped-def]
    """Return up to which share a step is taken again, as something may be undone in it; 1 if it is not."""
    if k > 0 and dips(way, points.tests, k, points.arc, points.tests[k + 1], step):
        return 0.25
    share = hidden_pair(way, points, k, length)
    return share if share > 0.0 else 1.0


@helper
def following_step(way, z, angle, step, largest):  # type: ignore[no-untyped-def]
    """Return the step after an accepted point, from the angle between its tangent and the last one."""
    factor = min(_GROWTH, max(0.4, _WANTED_ANGLE / max(angle, 1e-6)))
    size, turn = largest_state(z), way.workspace.equations.last[0] - z[0, 0]
    if way.layout.turn == 0.0:  # the duration is one of the unknowns
        size = max(size, -z[0, 0])
    return min(largest * (1.0 + max(size, turn / _LONG)), step * factor)


def trying(correct_at: Any, observe_at: Any) -> Any:
    """Return a trial of the march of branches or curves, as a helper; parameters as of :func:`marching`."""

    @helper
    def trial(way, course, k, step, first, guess_z, guess_w):  # type: ignore[no-untyped-def]
        """Correct and watch the point behind row k, predicted there unless it is the first.

        (Whether it is solved and near enough; whether all is finite; angle between its tangent and the last.)
        """
        points, options, row, angle = course.points, course.options, k + 1, 0.0
        zs, ws, tzs, tws = points.joints, points.w, points.tangents, points.directions
        if not first:
            predict(points, k, step)
            keep(way.layout.conserved, zs[k], zs[row])
            copy_to(guess_z, zs[row])
            copy_vector(guess_w, ws[row])
        fine, finite = correct_at(way, zs[row], ws[row], tzs[row], tws[row], options[ACCURACY])
        if fine and not first:
            miss = distance(zs[row], ws[row], guess_z, guess_w, way.scale)
            cosine = product(tzs[row], tws[row], tzs[k], tws[k], way.scale)
            angle = math.acos(min(1.0, max(-1.0, cosine)))
            if (angle > _MOST_ANGLE or miss > _MOST_MISS * step + _BLUR) and step > options[
                GIVES_WAY
            ]:
                return False, finite, angle
        if fine:
            tests, labels, mu = points.tests[row], points.labels[row], points.mu[row]
            finite = observe_at(way, zs[row], ws[row], tws[row], tests, labels, mu)
        return fine, finite, angle

    return trial


def marching(correct_at: Any, observe_at: Any, accept: Any) -> Any:
    """Return the march of branches or curves, as a helper.

    Parameters
    ----------
    correct_at : corrects (z, w) normal to (tz, tw) in place; (converged, everything finite)
    observe_at : fills what is watched on a point; whether that is finite
    accept : is told of every point that is accepted
    """
    trial = trying(correct_at, observe_at)

    @helper
    def march_points(way, course, guess_z, guess_w):  # type: ignore[no-untyped-def]
        """Continue until something happens: ``way`` is what the three functions need, the guess overwritten.

        (Why it stopped; last row written; next step.)
        """
        way, course = by_reference(way), by_reference(course)
        points, options, k, taken = course.points, course.options, course.last, course.taken
        step, largest, smallest = options[0], options[1], options[2]
        first, finite, solved = k < 0, options[LOST] == 0.0, 0.0
        recall(way, points, k - 1)
        recall(way, points, k)
        while k + 1 < points.w.shape[0]:
            if solved >= options[BUDGET]:
                options[LOST] = 0.0 if finite else 1.0
                return MORE, k, step
            solved += 1.0
            if not first and step < smallest:
                return (STEP if finite else BROKEN), k, step
            fine, finite, angle = trial(way, course, k, step, first, guess_z, guess_w)
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
            zs, ws, row = points.joints, points.w, k + 1
            chord = distance(zs[row], ws[row], zs[k], ws[k], way.scale)
            length = chord * (1.0 + angle * angle / 24.0)
            if step > 1e-4 * largest:
                share = accepted_share(way, points, k, length, step)
                if share < 1.0:
                    step *= share
                    continue
            if taken >= _FIRST_STEPS:
                share = share_to_start(way, course, row, step)
                if share < 1.0 and share * step > 64.0 * smallest:
                    step *= share
                    continue
            k, taken = row, taken + 1
            accept(way)
            points.arc[k] = points.arc[k - 1] + length
            following = following_step(way, zs[k], angle, step, largest)
            why = arrival(way, course, k, taken, step)
            if why != FULL:
                return why, k, following
            step = following
        return FULL, k, step

    return march_points


_march_branch = marching(correct_branch, observe_branch, accept_branch)


@kernel(types.Tuple((i8, i8, f8))(BranchProblemType, CourseType))
def march(problem, course):  # type: ignore[no-untyped-def]
    """Continue a branch from a point, with its tangent and watched values, until something happens.

    A call that has used up its budget ends with MORE: called again with the last row, the next step and the
    same options, it goes on as if nothing had been.

    Returns
    -------
    tuple
        (why it stopped, index of the last row written, next step).
    """
    zs, layout = course.points.joints, problem.layout
    rows, surfaces = count_followed(layout), layout.observables.shape[0]
    way = along_branch(problem, zs.shape[1], zs.shape[2], rows, surfaces, course.counts)
    guess_z, guess_w = np.empty((zs.shape[1], zs.shape[2])), np.empty(1)
    return _march_branch(way, course, guess_z, guess_w)
