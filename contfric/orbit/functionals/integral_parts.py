"""Expressions at the nodes of a part of a segment, and what is left over there, compiled.

A part is resolved where the last coefficients of its Legendre series are small enough
(:mod:`contfric.quantities.panels`), or where coefficients fall so fast that those which Gauss' formula
misses, from twice the degree on, are rounding.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.bvp.equations import EquationWorkspace, equation_workspace
from contfric.compiled import allocating_helper, helper
from contfric.quantities.operations import differentiate_tape, evaluate_tape
from contfric.quantities.panels import (
    DEEPEST,
    FALLS,
    HALVED,
    NOISE,
    ROUNDING,
    gauss_rule,
)
from contfric.quantities.tape import Tape

#: Nodes of a part: with these the square of a state is resolved over a half swing, and with the 16 of
#: :mod:`contfric.quantities.panels` it is not, so that three times as many are evaluated.
NODES = 20
POINTS, WEIGHTS, _SERIES = gauss_rule(NODES)
#: The last eight coefficients of a Legendre series, from the values at the nodes; a row for each node.
_LAST = np.ascontiguousarray(_SERIES[-8:].T)
#: Pairs of coefficients from the last one to twice the degree; a third of the four that are compared.
_PAIRS, _THIRD = 0.5 * NODES, 1.0 / 3.0
#: Entries of a part that waits: its ends, depth, the share of noise of the part that it is a half of, in
#: values alone and with derivatives; what is asked of it first; which half it is; then sizes.
LOW, HIGH, DEPTH, LIGHT, EXACT, ASKED, HALF, SIZES = range(8)
#: What is asked of a part first: its values alone, which cost a fraction of the derivatives; the derivatives,
#: where the values of the part that it is a half of are resolved, and where its own are likely to be.
VALUES_FIRST, VALUES_KNOWN, ALL_AT_ONCE = range(3)
#: A part is the first half of another one, the second, or the second where the first one was cut.
FIRST_HALF, SECOND_HALF, AFTER_A_CUT = range(3)
#: What Gauss' formula may miss of a derivative: a sum of so many numbers is rounded to that.
_SUMMED = NODES * float(np.finfo(np.float64).eps)


class NodeChain(NamedTuple):
    """The last node of a segment, from which the next one is reached; allocated once.

    Attributes
    ----------
    after : its time after the start of the segment, shape (1,); negative before the first node
    state, jac : its state, with the derivatives by start time, start state, time after it and parameters
    step, moved : derivatives of one step, and those that are made of both
    grads : gradients of the observables in the tape
    which : the parameters that move; jac, grads and this are empty where no derivatives are wanted
    """

    after: FloatArray
    state: FloatArray
    jac: FloatArray
    step: FloatArray
    moved: FloatArray
    grads: FloatArray
    which: IntArray


class IntegralCourse(NamedTuple):
    """What is integrated over which segment.

    Attributes
    ----------
    functions, p : the flow and its parameters
    tape, extra : the expressions, and the parameter that follows those of the model
    chained : whether the solution to a node starts at the node before
    mode, start, begin, lasts : of the segment: its mode, the time and state at its start, its duration
    """

    functions: Any
    p: FloatArray
    tape: Tape
    extra: float
    chained: bool
    mode: int
    start: float
    begin: FloatArray
    lasts: float


class IntegralWorkspace(NamedTuple):
    """Workspace of integrals; allocated once. C is 1, and where derivatives are wanted 4 + n + parameters.

    Attributes
    ----------
    equations : for the segments of the whole orbit
    exact, light : the last node, with derivatives if any are wanted, and without
    values, weights : of the operations of the tape
    gradient : of an output by time, states and parameters
    signs : least and largest noted arguments, shape (noted, 2)
    data, values_only : outputs at the nodes of a part, shapes (L, nodes, C) and (L, nodes, 1)
    wholes : outputs at the nodes of each segment as one part, shape (segments, L, nodes, C)
    states, jacs : states and derivatives at these nodes in the first half of a symmetric orbit, whose images
        are those of the second, shapes (segments, nodes, n) and (segments, nodes, n, 2 + n + parameters)
    row : integral over a segment and its gradient, shape (L, C)
    least : sizes below which values are rounding, shape (L,)
    waiting : parts of a segment that are to be resolved
    begin : state at the start of a segment
    """

    equations: EquationWorkspace
    exact: NodeChain
    light: NodeChain
    values: FloatArray
    weights: FloatArray
    gradient: FloatArray
    signs: FloatArray
    data: FloatArray
    values_only: FloatArray
    wholes: FloatArray
    states: FloatArray
    jacs: FloatArray
    row: FloatArray
    least: FloatArray
    waiting: FloatArray
    begin: FloatArray


@allocating_helper
def chain_workspace(size, n, which, exact):  # type: ignore[no-untyped-def]
    """Return the workspace of a chain of nodes, for a tape of so many operations."""
    free = which.shape[0]
    rows, wide = (n, 2 + n + free) if exact else (0, 0)
    return NodeChain(
        np.empty(1),
        np.empty(n),
        np.empty((rows, wide)),
        np.empty((rows, wide)),
        np.empty((rows, wide)),
        np.empty((size, 1 + n + free if exact else 0)),
        which,
    )


@allocating_helper
def integral_workspace(  # type: ignore[no-untyped-def]
    tape, whole, m, parameters, which, none, images, columns
):
    """Return the workspace for an orbit of so many segments, of so many of which others are images."""
    n, size, outputs, exact = m - 1, tape.operations.shape[0], tape.outputs.shape[0], columns > 1
    return IntegralWorkspace(
        equation_workspace(whole, m, which.shape[0]),
        chain_workspace(size, n, which, exact),
        chain_workspace(size, n, none, False),
        np.empty(size),
        np.empty(size),
        np.empty(2 + n + parameters),
        np.empty((tape.noted.shape[0], 2)),
        np.empty((outputs, NODES, columns)),
        np.empty((outputs, NODES, 1)),
        np.empty((whole, outputs, NODES, columns)),
        np.empty((images, NODES, n)),
        np.empty((images, NODES, n, 2 + n + which.shape[0])),
        np.empty((outputs, columns)),
        np.zeros(outputs),
        np.empty((DEEPEST + 2, SIZES + outputs)),
        np.empty(n),
    )


@helper
def reach_node(course, after, chain, before):  # type: ignore[no-untyped-def]
    """Move to a time after the start of a segment: from there, or from the last node."""
    functions, mode, start, begin = course.functions, course.mode, course.start, course.begin
    n, since, jac, step, p = begin.shape[0], chain.after[0], chain.jac, chain.step, course.p
    chain.after[0] = after
    if not course.chained or since < 0.0 or after < since:
        functions.flow(mode, start, begin, after, p, chain.which, chain.state, jac)
        return
    for i in range(n):
        before[i] = chain.state[i]
    functions.flow(mode, start + since, before, after - since, p, chain.which, chain.state, step)
    for i in range(jac.shape[0]):
        for k in range(jac.shape[1]):
            value = step[i, k] if k == 0 or k > n else 0.0
            if k != 1 + n:  # the time of the last node does not move with that of this one
                for j in range(n):
                    value += step[i, 1 + j] * jac[j, k]
            chain.moved[i, k] = value
    for i in range(jac.shape[0]):
        for k in range(jac.shape[1]):
            jac[i, k] = chain.moved[i, k]


@helper
def write_gradient(gradient, jac, which, share, out):  # type: ignore[no-untyped-def]
    """Write a gradient by time, states and parameters by start, state, duration and what moves."""
    n, wide = jac.shape
    for c in range(wide):
        out[1 + c] = 0.0
    for i in range(n):
        weight = gradient[1 + i]
        if weight != 0.0:  # most expressions have few of the states
            for c in range(wide):
                out[1 + c] += weight * jac[i, c]
    out[1] += gradient[0]
    out[2 + n] = share * (out[2 + n] + gradient[0])
    for k in range(which.shape[0]):
        out[3 + n + k] += gradient[1 + n + which[k]]
    out[1 + wide] = gradient[gradient.shape[0] - 1]


@helper
def forget_signs(signs):  # type: ignore[no-untyped-def]
    """Forget the least and largest noted arguments."""
    for q in range(signs.shape[0]):
        signs[q, 0], signs[q, 1] = np.inf, -np.inf


@helper
def keeps_signs(signs):  # type: ignore[no-untyped-def]
    """Tell whether no noted argument changed its sign."""
    for q in range(signs.shape[0]):
        if signs[q, 0] < 0.0 and signs[q, 1] > 0.0:
            return False
    return True


@helper
def sample_node(course, k, share, own, chain, data):  # type: ignore[no-untyped-def]
    """Write outputs and their gradients at node k of a part, where the chain is; note arguments."""
    signs, tape, n = own.signs, course.tape, course.begin.shape[0]
    time = course.start + share * course.lasts
    evaluate_tape(course, time, chain.state, chain.which, own.values, chain.grads)
    for q in range(signs.shape[0]):
        value = own.values[tape.noted[q]]
        signs[q, 0], signs[q, 1] = min(signs[q, 0], value), max(signs[q, 1], value)
    for j in range(data.shape[0]):
        output = tape.outputs[j]
        data[j, k, 0] = own.values[output]
        if data.shape[2] > 1:
            differentiate_tape(
                tape, output, n, chain.which, own.values, chain.grads, own.weights, own.gradient
            )
            write_gradient(own.gradient, chain.jac, chain.which, share, data[j, k])


@helper
def sample_part(course, low, high, own, chain, data):  # type: ignore[no-untyped-def]
    """Write outputs and their gradients at the nodes of a part; False if a noted argument changes sign."""
    forget_signs(own.signs)
    for k in range(NODES):
        share = low + 0.5 * (high - low) * (POINTS[k] + 1.0)
        reach_node(course, share * course.lasts, chain, own.equations.between)
        sample_node(course, k, share, own, chain, data)
    return keeps_signs(own.signs)


@helper
def image_node(layout, state, jac, d_period, chain):  # type: ignore[no-untyped-def]
    r"""Write state and derivatives half a period later in a symmetric orbit, from those at a node.

    With the symmetry S, its own inverse, and the duration h of the half, the flow has :math:`\varphi(t_0 + h,
    S y, d; p) = S \varphi(t_0, y, d; p)` for all p, so that

    .. math:: \varphi_y' = S \varphi_y S, \qquad \varphi_p' = S (\varphi_p - \varphi_{t_0} h_p) .
    """
    n, closure, moved = state.shape[0], layout.closure, chain.moved
    for i in range(n):
        chain.state[i] = 0.0
        for j in range(n):
            chain.state[i] += closure[i, j] * state[j]
        for k in range(jac.shape[1]):
            moved[i, k] = jac[i, k]
            if k > 1 + n:
                moved[i, k] -= jac[i, 0] * layout.turn * d_period[k - 2 - n]
            elif 1 <= k <= n:
                moved[i, k] = 0.0
                for j in range(n):
                    moved[i, k] += jac[i, 1 + j] * closure[j, k - 1]
    for i in range(n):
        for k in range(jac.shape[1]):
            chain.jac[i, k] = 0.0
            for j in range(n):
                chain.jac[i, k] += closure[i, j] * moved[j, k]


@helper
def sample_at_once(course, layout, i, d_period, own, data):  # type: ignore[no-untyped-def]
    """Write outputs and gradients at the nodes of segment i as one part; False if a sign changes.

    In the second half of a symmetric orbit states and derivatives are images of those in the first.
    """
    chain, images = own.exact, own.states.shape[0]
    forget_signs(own.signs)
    for k in range(NODES):
        share = 0.5 * (POINTS[k] + 1.0)
        if images > 0 and i >= images:
            base = i - images
            image_node(layout, own.states[base, k], own.jacs[base, k], d_period, chain)
        else:
            reach_node(course, share * course.lasts, chain, own.equations.between)
            if images > 0:
                for j in range(chain.state.shape[0]):
                    own.states[i, k, j] = chain.state[j]
                    for c in range(chain.jac.shape[1]):
                        own.jacs[i, k, j, c] = chain.jac[j, c]
        sample_node(course, k, share, own, chain, data)
    return keeps_signs(own.signs)


@helper
def left_over(column, size, enough):  # type: ignore[no-untyped-def]
    """Return the largest of the last two coefficients of a series, and what Gauss' formula misses; by size.

    Infinite where something is no number. The second is no larger than the first, which is returned for it
    where that is small enough.

    That formula is exact to twice the degree. What it misses is of the size of the coefficients from there
    on, if coefficients, in pairs, go on to fall at least as slowly as they did over the last four pairs.
    """
    top, a, b, c, d, e, f, g, h = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(NODES // 2):  # polynomials are even or odd, as their degree is
        value, mirrored = column[k], column[NODES - 1 - k]
        top = max(top, abs(value), abs(mirrored))
        even, odd = value + mirrored, value - mirrored
        # sums next to each other: each alone would wait for its own last term
        a += _LAST[k, 0] * even
        b += _LAST[k, 1] * odd
        c += _LAST[k, 2] * even
        d += _LAST[k, 3] * odd
        e += _LAST[k, 4] * even
        f += _LAST[k, 5] * odd
        g += _LAST[k, 6] * even
        h += _LAST[k, 7] * odd
    if not math.isfinite(a + b):  # what is no number is in all sums
        return np.inf, np.inf
    one, two, three, four = (
        max(abs(a), abs(b)),
        max(abs(c), abs(d)),
        max(abs(e), abs(f)),
        max(abs(g), abs(h)),
    )
    own = max(top, size, 1e-300)
    if four <= enough * own:
        return four / own, four / own
    fall = max(
        four / max(three, four), math.sqrt(four / max(two, four)), (four / max(one, four)) ** _THIRD
    )
    return four / own, four / own * fall**_PAIRS


@helper
def noise_of(data, sizes, enough):  # type: ignore[no-untyped-def]
    """Return the largest of what is left over in a part, see :func:`left_over`; sizes grow to those there."""
    left, missed = 0.0, 0.0
    for j in range(data.shape[0]):
        for k in range(NODES):
            sizes[j] = max(sizes[j], abs(data[j, k, 0]))
        for c in range(data.shape[2]):
            tail, beyond = left_over(data[j, :, c], sizes[j], max(enough, missed))
            left, missed = max(left, tail), max(missed, beyond)
    return left, missed


@helper
def resolved(data, waiting, before, level):  # type: ignore[no-untyped-def]
    """Return what is left over in a part, and whether it is resolved; sizes of the part grow.

    ``before`` is where what was left over of the whole stands, of which it is a half.
    """
    rounding = ROUNDING if before == LIGHT else _SUMMED
    left, missed = noise_of(data, waiting[SIZES:], level)
    if left > level:  # what Gauss' formula misses matters only then
        left, missed = noise_of(data, waiting[SIZES:], 0.5 * rounding)
    noise = waiting[DEPTH] >= HALVED and FALLS * waiting[before] < left < NOISE
    return left, left <= level or noise or (left < NOISE and missed < rounding)


@helper
def add_part(data, low, high, lasts, row):  # type: ignore[no-untyped-def]
    """Add a resolved part to the integral over its segment, and to the gradient of that."""
    half = 0.5 * (high - low)
    for j in range(data.shape[0]):
        for c in range(data.shape[2]):
            mean = 0.0
            for k in range(NODES):
                mean += WEIGHTS[k] * data[j, k, c]
            row[j, c] += half * lasts * mean
