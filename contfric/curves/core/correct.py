"""One point of a curve, compiled: the corrector normal to the tangent, the watch, the border vectors.

As :mod:`contfric.continuation.core.steps` for a branch; the border rows after the first are the gradients of
the conditions. Along a curve on which a quantity is held changes of stability and labels are no events.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.equations import LayoutType
from contfric.bvp.monitor import watch
from contfric.bvp.newton import CHECKS, MULTIPLIERS, off_normal
from contfric.bvp.spectrum import multipliers
from contfric.bvp.stationary_points import find_after_reset, find_stationary
from contfric.bvp.stationary_values import remember
from contfric.compiled import allocating_helper, helper, indices, vector
from contfric.continuation.core.steps import CHI_MINUS, CHI_ONE, CHI_PAIR, EXTRA, correcting_along
from contfric.curves.equations.bending import DIFFERENCE
from contfric.curves.equations.conditions import (
    EXIT,
    JOINT,
    QUANTITY,
    SPECTRAL,
    Condition,
    ConditionType,
    CurveWorkspace,
    condition_value,
    curve_workspace,
)
from contfric.curves.equations.held_conditions import Conditions, ConditionsType, fill_conditions
from contfric.curves.equations.lagrangian import LagrangianWorkspace, lagrangian_workspace
from contfric.curves.equations.normal_form import cubic_coefficient
from contfric.flow.layouts import FlowType, SecondType

#: The extra column that a curve watches where a branch watches the slope of its parameter: the
#: coefficient of the normal form, or the rate of the load at a stop.
BEND = 0
#: A stationary value this near to a surface on which one is pinned is that one: it is solved for.
_TOUCHES = 1e-9
#: Differences that are tried, and how much shorter each is: at the third (6e-10) a derivative that is
#: good to 1e-12 still leaves three digits, with which Newton converges and tangents are good enough.
_ATTEMPTS, _SHORTER = 3, 1e-2


class CurveProblem(NamedTuple):
    """A curve to follow, as the compiled engine takes it.

    Attributes
    ----------
    functions, second, layout : the model's flow, its second derivatives, and the chain
    condition, held : what vanishes along the curve: a bifurcation, or (QUANTITY) what is asked of a quantity
    p : parameters
    which, widths : indices of the q that are free, and the widths of their ranges
    """

    functions: Any
    second: Any
    layout: Any
    condition: Condition
    held: Conditions
    p: FloatArray
    which: IntArray
    widths: FloatArray


CurveProblemType = types.NamedTuple(
    [FlowType, SecondType, LayoutType, ConditionType, ConditionsType, vector, indices, vector],
    CurveProblem,
)


class AlongCurve(NamedTuple):
    """What a step along a curve needs besides its points: the problem, what is counted, workspace.

    The free ones of the parameters ``p`` are overwritten; ``border`` are the vectors b and c, shape
    (2, N, m), which follow the null vectors; ``scale`` the weights of the free parameters.
    """

    functions: Any
    second: Any
    layout: Any
    condition: Condition
    held: Conditions
    p: FloatArray
    which: IntArray
    widths: FloatArray
    border: FloatArray
    scale: FloatArray
    counts: IntArray
    workspace: CurveWorkspace
    own: LagrangianWorkspace


@allocating_helper
def along_curve(problem, border, count, m, rows, counts):  # type: ignore[no-untyped-def]
    """Return what steps along a curve need; ``rows`` of stationary values are followed, -1: nothing is."""
    functions, second, layout, condition, held, p, which, widths = problem
    free, surfaces = which.shape[0], layout.observables.shape[0] if rows >= 0 else 0
    whole = held.extreme.whole.modes.shape[0]
    return AlongCurve(
        functions,
        second,
        layout,
        condition,
        held,
        p.copy(),
        which,
        widths,
        border,
        1.0 / widths**2,
        counts,
        curve_workspace(count, m, p.shape[0], max(rows, 0), surfaces, free),
        lagrangian_workspace(count, whole, m, free),
    )


@helper
def normal_and_condition(way, z):  # type: ignore[no-untyped-def]
    """Border a curve with the plane normal to its tangent, and with its conditions."""
    condition, s, values = way.condition, way.workspace.s, way.held.values
    s[0, 0], s[0, 1] = -off_normal(way, z), 1.0
    if condition.kind == QUANTITY:
        worst = fill_conditions(way, z)
        for k in range(values.shape[0]):
            s[1 + k, 0], s[1 + k, 1] = -values[k], 0.0
        return worst, -1
    value = condition_value(way, z)
    s[1, 0], s[1, 1] = -value, 0.0
    return value, condition.segment if condition.kind == EXIT else -1


@helper
def with_shorter_differences(way, attempt, converged):  # type: ignore[no-untyped-def]
    """Return whether Newton's method is tried again: where second derivatives by differences fail.

    Near a touch of a kink the first derivatives change within less than the difference.
    """
    difference = way.workspace.bordered.difference
    again = not converged and difference[1] != 0.0 and attempt < _ATTEMPTS
    difference[0] = DIFFERENCE * _SHORTER**attempt if again else DIFFERENCE
    difference[1] = 0.0
    return again


correct_curve = correcting_along(normal_and_condition, with_shorter_differences)


@helper
def accept_curve(way):  # type: ignore[no-untyped-def]
    """Remember a point that is accepted, and let the border follow its null vectors."""
    remember(way.workspace.followed)
    if way.condition.kind == SPECTRAL:
        follow_border(way.border, way.workspace)


@helper
def follow_border(border, workspace):  # type: ignore[no-untyped-def]
    """Make the null vectors of the last point the border of the next one."""
    bordered = workspace.bordered
    count, m = bordered.v.shape
    for side in range(2):
        source = bordered.u if side == 0 else bordered.v
        total = 0.0
        for i in range(count):
            for j in range(m):
                total += source[i, j] ** 2
        norm = math.sqrt(total)
        for i in range(count):
            for j in range(m):
                border[side, i, j] = source[i, j] / norm


@helper
def bend_value(way, z):  # type: ignore[no-untyped-def]
    """Return the coefficient or rate whose zero is a point of codimension two; else 1."""
    condition, layout, workspace = way.condition, way.layout, way.workspace
    if condition.kind == SPECTRAL and condition.sign < 0.0:
        return cubic_coefficient(way, z)
    if condition.kind == SPECTRAL:
        bordered, value = workspace.bordered, 0.0
        for i in range(z.shape[0]):
            for j in range(z.shape[1]):
                value += workspace.d[1, i, j] * bordered.v[i, j]
        return value
    if condition.kind == JOINT and condition.rest >= 0:
        i, equations = condition.segment, workspace.equations
        after = z[i + 1] if i + 1 < z.shape[0] else equations.last
        c = layout.observables[condition.surface]
        none, empty = equations.none, equations.empty
        return way.functions.rate(condition.rest, c, after[0], after[1:], way.p, none, empty)
    return 1.0


@helper
def other_touches(way, row, z):  # type: ignore[no-untyped-def]
    """Return an interior margin without the one stationary point that lies on the surface."""
    functions, layout, p = way.functions, way.layout, way.p
    i, surface = layout.interior[row, 0], layout.interior[row, 1]
    stationary, equations = way.workspace.stationary, way.workspace.equations
    sign = float(layout.interior[row, 2])
    c = layout.observables[surface]
    if layout.resets[i] >= 0:
        found = find_after_reset(functions, layout, i, c, z, p, equations, stationary)
    else:
        found = find_stationary(functions, layout, i, c, z, p, equations.last, stationary)
    target = functions.level(surface, p, equations.none, equations.empty)
    touch, least = -1, np.inf
    for k in range(found):
        gap = abs(stationary.values[k] - target)
        if gap < _TOUCHES and (touch < 0 or gap < abs(stationary.values[touch] - target)):
            touch = k
    for k in range(found):
        if k != touch:
            least = min(least, sign * (stationary.values[k] - target))
    return least


@helper
def observe_curve(way, z, w, tw, tests, labels, mu):  # type: ignore[no-untyped-def]
    """Fill everything that is watched on a corrected point; False if something is not finite."""
    functions, layout, condition, workspace = (
        way.functions,
        way.layout,
        way.condition,
        way.workspace,
    )
    way.counts[CHECKS] += 1
    way.counts[MULTIPLIERS] += 1
    equations = workspace.equations
    at = tests.shape[0] - EXTRA
    one, minus = multipliers(layout, workspace.pencil, equations.close, mu, workspace.spectral)
    tests[at + BEND] = bend_value(way, z)
    stationary, followed = workspace.stationary, workspace.followed
    finite = watch(functions, layout, z, way.p, equations, stationary, tests, labels, followed)
    for k in range(condition.pinned.shape[0]):
        row = condition.pinned[k]
        tests[row] = 1.0
        if row < layout.interior.shape[0]:
            tests[row] = other_touches(way, row, z)
    distances = at - labels.shape[0]
    for k in range(condition.quiet.shape[0]):
        labels[condition.quiet[k]] = 0
        tests[distances + condition.quiet[k]] = 1.0
    spectral = condition.kind == SPECTRAL
    tests[at + CHI_ONE] = 1.0 if spectral and condition.sign > 0.0 else one
    tests[at + CHI_MINUS] = 1.0 if spectral and condition.sign < 0.0 else minus
    tests[at + CHI_PAIR] = 1.0
    if layout.rank > 1:
        tests[at + CHI_PAIR] = 1.0 - abs(mu[0]) * abs(mu[1])
    if condition.kind == EXIT or condition.kind == QUANTITY:
        for k in range(CHI_ONE, EXTRA):
            tests[at + k] = 1.0
    if condition.kind == EXIT:  # multipliers are infinite there
        for k in range(mu.shape[0]):
            mu[k] = np.inf
    return finite
