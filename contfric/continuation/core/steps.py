"""One step of a branch, compiled: the corrector normal to a tangent, and what is watched on a point."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.convergence import CONVERGED, NOT_FINITE, rounding_of
from contfric.bvp.crossed_surfaces import TOUCH
from contfric.bvp.cyclic import Elimination, elimination_workspace
from contfric.bvp.equations import EquationWorkspace, LayoutType, close_chain, equation_workspace
from contfric.bvp.monitor import watch
from contfric.bvp.newton import CHECKS, MULTIPLIERS, SOLVES, correcting, normal_to_tangent
from contfric.bvp.spectrum import SpectralWorkspace, multipliers, spectral_workspace
from contfric.bvp.stationary_points import StationaryPoints, stationary_workspace
from contfric.bvp.stationary_values import Followed, followed_values, remember
from contfric.compiled import allocating_helper, helper, indices, vector
from contfric.continuation.core.geometry import (
    anchor,
    copy_to,
    copy_vector,
    largest_state,
    take_tangent,
)
from contfric.flow.layouts import FlowType

#: Extra columns of the tests after the margins and the distances of the labels: slope of the
#: parameter, products of 1 - mu and of
#: 1 + mu, and 1 - |mu_1 mu_2| of the two largest multipliers.
FOLD, CHI_ONE, CHI_MINUS, CHI_PAIR = range(4)
EXTRA = 4
#: Correction that ends the iteration where an event is located: its test function counts to its last
#: digits.
AT_EVENT = 3e-15
#: How many times the rounding of an orbit a stationary value is off at most.
TOLD = 10.0
#: A product of multipliers from which on one of them is infinite to half of the digits.
INFINITE = 1e8


class StepWorkspace(NamedTuple):
    """Workspace for the steps of one branch: all that a corrector and the watch need, allocated once."""

    equations: EquationWorkspace
    elimination: Elimination
    spectral: SpectralWorkspace
    stationary: StationaryPoints
    followed: Followed
    pencil: FloatArray
    d: FloatArray
    e: FloatArray
    s: FloatArray
    z_ref: FloatArray
    p_ref: FloatArray


@allocating_helper
def step_workspace(count, m, parameters, rows, surfaces):  # type: ignore[no-untyped-def]
    """Return the workspace for the branch of a chain; ``rows`` of stationary values are followed."""
    free = max(1 - count, 1)  # one parameter, but no literal
    return StepWorkspace(
        equation_workspace(count, m, free),
        elimination_workspace(count, m, free, free + free),
        spectral_workspace(m),
        stationary_workspace(),
        followed_values(rows, surfaces, m),
        np.empty((2, m, m)),
        np.empty((1, count, m)),
        np.empty((1, 1)),
        np.empty((1, 2)),
        np.empty((count, m)),
        np.empty(parameters),
    )


class BranchProblem(NamedTuple):
    """A branch to follow, as the compiled engine takes it.

    Attributes
    ----------
    functions, layout : the model's flow and the chain
    p : parameters
    which, scale : index of the one that is free, and its weight in the scaled product, shapes (1,)
    stability : whether multipliers are evaluated
    """

    functions: Any
    layout: Any
    p: FloatArray
    which: IntArray
    scale: FloatArray
    stability: bool


BranchProblemType = types.NamedTuple(
    [FlowType, LayoutType, vector, indices, vector, types.boolean], BranchProblem
)


class Along(NamedTuple):
    """What a step along a branch needs besides its points: the problem, what is counted, workspace.

    The free one of the parameters ``p`` is overwritten.
    """

    functions: Any
    layout: Any
    p: FloatArray
    which: IntArray
    scale: FloatArray
    stability: bool
    counts: IntArray
    workspace: StepWorkspace


@allocating_helper
def along_branch(problem, count, m, rows, surfaces, counts):  # type: ignore[no-untyped-def]
    """Return what steps along a branch need; ``rows`` of stationary values are followed."""
    functions, layout, p, which, scale, stability = problem
    workspace = step_workspace(count, m, p.shape[0], rows, surfaces)
    return Along(functions, layout, p.copy(), which, scale, stability, counts, workspace)


def correcting_along(border: Any, again: Any) -> Any:
    """Return the corrector of branches or curves, as a helper.

    Parameters
    ----------
    border : that of :func:`contfric.bvp.newton.correcting`
    again : is told before the first attempt (0), and after each one whether it has converged; returns whether
        to try once more
    """
    correct = correcting(border)

    @helper
    def correct_at(way, z, w, tz, tw, accuracy):  # type: ignore[no-untyped-def]
        """Correct (z, w) normal to the tangent (tz, tw), and replace it; (converged, all is finite)."""
        p, which, workspace = way.p, way.which, way.workspace
        copy_free(p, which, w)
        anchor(workspace, z, p, which, tz, tw, way.scale)
        way.counts[SOLVES] += 1
        attempt, tries, status = 0, True, NOT_FINITE
        again(way, attempt, True)
        while tries:
            status, _, _, _ = correct(way, z, (np.inf, accuracy, 0.0))
            attempt += 1
            tries = again(way, attempt, status == CONVERGED)
            if tries:
                copy_to(z, workspace.z_ref)
                copy_vector(p, workspace.p_ref)
        for k in range(which.shape[0]):
            w[k] = p[which[k]]
        if status != CONVERGED:
            return False, status != NOT_FINITE
        close_chain(way.functions, way.layout, z, p, which, workspace.equations)
        fine = take_tangent(workspace.elimination, tz, tw, way.scale)
        return fine, fine

    return correct_at


@helper
def copy_free(p, which, w):  # type: ignore[no-untyped-def]
    """Write the free ones of the parameters."""
    for k in range(which.shape[0]):
        p[which[k]] = w[k]


@helper
def once(way, attempt, converged):  # type: ignore[no-untyped-def]
    """Return whether Newton's method is tried again along a branch: never."""
    return False


correct_branch = correcting_along(normal_to_tangent, once)


@helper
def observe_branch(way, z, w, tw, tests, labels, mu):  # type: ignore[no-untyped-def]
    """Fill everything that is watched on a corrected point; False if something is not finite."""
    workspace, layout = way.workspace, way.layout
    way.p[way.which[0]] = w[0]
    way.counts[CHECKS] += 1
    finite = watch(
        way.functions,
        layout,
        z,
        way.p,
        workspace.equations,
        workspace.stationary,
        tests,
        labels,
        workspace.followed,
    )
    at = tests.shape[0] - EXTRA
    tests[at + FOLD] = tw[0]
    tests[at + CHI_ONE] = 1.0
    tests[at + CHI_MINUS] = 1.0
    tests[at + CHI_PAIR] = 1.0
    if way.stability:
        way.counts[MULTIPLIERS] += 1
        tests[at + CHI_ONE], tests[at + CHI_MINUS] = multipliers(
            layout, workspace.pencil, workspace.equations.close, mu, workspace.spectral
        )
        if layout.rank > 1:
            tests[at + CHI_PAIR] = 1.0 - abs(mu[0]) * abs(mu[1])
    return finite


@helper
def accept_branch(way):  # type: ignore[no-untyped-def]
    """Remember the stationary values of a point that is accepted."""
    remember(way.workspace.followed)


@helper
def told(layout, z):  # type: ignore[no-untyped-def]
    """Return the distance of a stationary value from a surface from which on rounding can tell its side."""
    return TOLD * rounding_of(layout, z) * (1.0 + largest_state(z))


@helper
def through_infinity(before, after):  # type: ignore[no-untyped-def]
    """Tell whether both products of multipliers change their signs far from zero: the largest one does."""
    at, least = before.shape[0] - EXTRA, np.inf
    for j in (at + CHI_ONE, at + CHI_MINUS):
        if not before[j] * after[j] < 0.0:
            return False
        least = min(least, abs(before[j]), abs(after[j]))
    return least > INFINITE


@helper
def turns_to_rounding(before, after, known):  # type: ignore[no-untyped-def]
    """Tell whether turns of a label lie on either side of a surface by rounding, at two points.

    As those of a motion that has died out do. What touches a surface all along is at zero, and leaves the
    label as it is. Parameters: distances of the nearest change, and what is told (:func:`told`).
    """
    return TOUCH < max(before, after) < known


@helper
def changed(before, after, labels_before, labels_after, known):  # type: ignore[no-untyped-def]
    """Tell whether any test changes sign or any label changes between two points; ``known``: :func:`told`."""
    first = before.shape[0] - EXTRA
    margins = first - labels_before.shape[0]
    for j in range(first):
        if after[j] < 0.0:
            return True
    if before[first + FOLD] * after[first + FOLD] < 0.0:
        return True
    if before[first + CHI_PAIR] * after[first + CHI_PAIR] < 0.0:
        return True
    for j in (first + CHI_ONE, first + CHI_MINUS):
        if before[j] * after[j] < 0.0 and not through_infinity(before, after):
            return True
    for j in range(labels_before.shape[0]):
        if labels_before[j] != labels_after[j] and not turns_to_rounding(
            before[margins + j], after[margins + j], known
        ):
            return True
    return False
