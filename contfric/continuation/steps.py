"""One step of a branch, compiled: the corrector normal to a tangent, and what is watched on a point."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.continuation.geometry import anchor, take_tangent
from contfric.models.definition import FloatArray
from contfric.orbit.cyclic import Elimination, elimination_workspace
from contfric.orbit.equations import EquationWorkspace, close_chain, equation_workspace
from contfric.orbit.followed import Followed, followed_values, remember
from contfric.orbit.monitor import watch
from contfric.orbit.newton import (
    CHECKS,
    CONVERGED,
    MULTIPLIERS,
    NOT_FINITE,
    SOLVES,
    correcting,
    normal_to_tangent,
)
from contfric.orbit.spectrum import SpectralWorkspace, multipliers, spectral_workspace
from contfric.orbit.stationary import StationaryPoints, stationary_workspace
from contfric.orbit.system import IntArray

#: Extra columns of the tests behind the margins and the distances of the labels: slope of the
#: parameter, products of 1 - mu and of
#: 1 + mu, and 1 - |mu_1 mu_2| of the two largest multipliers.
FOLD, CHI_ONE, CHI_MINUS, CHI_PAIR = range(4)
EXTRA = 4
#: Correction that ends the iteration where an event is located: its test function counts to its last
#: digits.
AT_EVENT = 3e-15


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


class Along(NamedTuple):
    """What a step along a branch needs besides its points.

    Attributes
    ----------
    functions, layout : the model's flow and the chain
    p : parameters, those that are free overwritten
    which, scale : indices of the free parameters, and their weights in the scaled product
    stability : whether multipliers are evaluated
    counts, workspace : what is counted, and what is allocated once
    """

    functions: Any
    layout: Any
    p: FloatArray
    which: IntArray
    scale: FloatArray
    stability: bool
    counts: IntArray
    workspace: StepWorkspace


_correct = correcting(normal_to_tangent)


@helper
def correct_branch(way, z, w, tz, tw, accuracy):  # type: ignore[no-untyped-def]
    """Correct (z, w) normal to the tangent (tz, tw), and replace the tangent; (converged, all is finite)."""
    functions, layout, p, workspace = way.functions, way.layout, way.p, way.workspace
    p[way.which[0]] = w[0]
    anchor(workspace, z, p, way.which, tz, tw, way.scale)
    way.counts[SOLVES] += 1
    status, _, _, _ = _correct(
        functions, layout, z, p, way.which, np.inf, accuracy, 0.0, workspace, 0
    )
    w[0] = p[way.which[0]]
    if status != CONVERGED:
        return False, status != NOT_FINITE
    if not take_tangent(workspace.elimination, tz, tw, way.scale):
        return False, False
    close_chain(functions, layout, z, p, workspace.equations.none, workspace.equations)
    return True, True


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
