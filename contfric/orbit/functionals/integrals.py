r"""Integrals of expressions over an orbit, with their gradients by joints and parameters, compiled.

A segment starts at :math:`(t_0, y_0)` and lasts d. At the share s of it the expression is :math:`g(t, y, p)`
with :math:`t = t_0 + s d`, :math:`y = \varphi(t_0, y_0, s d; p)`, and its integral is

.. math:: I = d \int_0^1 g\,ds, \qquad \nabla I = d \int_0^1 \nabla g\,ds + (\nabla d) \int_0^1 g\,ds .

:math:`\nabla g` by :math:`(t_0, y_0, d, p)` is the gradient of g by (t, y, p), one pass backwards
(:mod:`contfric.quantities.tape`), times the derivatives of the flow. So the derivatives are one row by joints
and parameters, as that of an extremum is (:mod:`contfric.orbit.functionals.peak`), whatever the number of
directions that it is asked for in. Expression and derivatives are resolved on the panels of
:mod:`contfric.quantities.panels`, by the same rules. Where an argument of ``abs``, ``sign`` or ``where``
changes its sign inside of a panel, or nothing resolves it, this says so, and the panels of Python decide.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray
from contfric.bvp.equations import LayoutType
from contfric.compiled import blocks, f8, helper, i8, indices, kernel, matrix, vector
from contfric.flow.layouts import FlowType
from contfric.orbit.functionals.integral_parts import (
    AFTER_A_CUT,
    ALL_AT_ONCE,
    ASKED,
    DEPTH,
    EXACT,
    FIRST_HALF,
    HALF,
    HIGH,
    LIGHT,
    LOW,
    NODES,
    SECOND_HALF,
    SIZES,
    VALUES_FIRST,
    VALUES_KNOWN,
    IntegralCourse,
    add_part,
    resolved,
    sample_at_once,
    sample_part,
)
from contfric.orbit.functionals.integral_rows import (
    TapeType,
    add_to_joints,
    enter_segment,
    whole_turn,
)
from contfric.orbit.functionals.peak import Extreme, ExtremeType
from contfric.quantities.motion import Directions, goes_on
from contfric.quantities.panels import DEEPEST, RESOLVED, ROUNDING, resolved_level
from contfric.quantities.tape import Tape

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: The parameters that move, and how, where nothing does.
_STILL = np.empty(0, dtype=np.int64), np.empty((0, 0))


@helper
def begin_parts(own):  # type: ignore[no-untyped-def]
    """Let the whole segment wait, and forget the last nodes."""
    own.row[:, :] = 0.0
    first = own.waiting[0]
    first[LOW], first[HIGH], first[DEPTH] = 0, 1, 0
    first[LIGHT], first[EXACT], first[HALF] = np.inf, np.inf, AFTER_A_CUT
    first[ASKED] = ALL_AT_ONCE if own.data.shape[2] > 1 else VALUES_FIRST
    for j in range(own.least.shape[0]):
        first[SIZES + j] = own.least[j]
    own.exact.after[0], own.light.after[0] = -1.0, -1.0


@helper
def cut_part(own, count, left, with_slopes, known):  # type: ignore[no-untyped-def]
    """Let both halves of a part wait, which was taken from place ``count``.

    What is hard to resolve is most often at one end: where a first half was cut the second one is likely to
    be resolved, and in a second half after one that was not cut the first half is. There values and
    derivatives are taken at once.
    """
    waiting, slopes = own.waiting, own.data.shape[2] > 1
    low, high, depth, half = (
        waiting[count, LOW],
        waiting[count, HIGH],
        waiting[count, DEPTH],
        waiting[count, HALF],
    )
    if half == FIRST_HALF:
        waiting[count - 1, HALF] = AFTER_A_CUT
        if slopes and waiting[count - 1, ASKED] == VALUES_FIRST:
            waiting[count - 1, ASKED] = ALL_AT_ONCE
    middle = 0.5 * (low + high)
    for j in range(own.least.shape[0]):
        waiting[count + 1, SIZES + j] = waiting[count, SIZES + j]
    for k in range(2):
        part = waiting[count + k]
        part[LOW], part[HIGH] = (middle, high) if k == 0 else (low, middle)
        part[DEPTH], part[LIGHT], part[EXACT] = depth + 1, left, with_slopes
        part[HALF] = SECOND_HALF if k == 0 else FIRST_HALF
        part[ASKED] = VALUES_KNOWN if known else VALUES_FIRST
        if slopes and not known and k == 1 and half == SECOND_HALF:
            part[ASKED] = ALL_AT_ONCE


@helper
def over_segment(course, level, own, whole):  # type: ignore[no-untyped-def]
    """Write the integral over a segment, and its gradient; False if it is left to others.

    Of a part that is not likely to be resolved the values are asked first, which cost a fraction of the
    derivatives. The whole segment is known. Where values are resolved, those of both halves are.
    """
    waiting, row, data = own.waiting, own.row, own.data
    begin_parts(own)
    count = 1
    while count > 0:
        count -= 1
        part = waiting[count]
        low, high, depth, asked = part[LOW], part[HIGH], part[DEPTH], part[ASKED]
        left, with_slopes, known = part[LIGHT], np.inf, asked == VALUES_KNOWN
        if asked == VALUES_FIRST:
            light = own.values_only if depth > 0 else whole
            if depth > 0 and not sample_part(course, low, high, own, own.light, light):
                return False
            left, known = resolved(light, part, LIGHT, level)
            if known and data.shape[2] == 1:
                add_part(light, low, high, course.lasts, row)
                continue
        if known or asked == ALL_AT_ONCE:
            found = whole if depth == 0 and asked == ALL_AT_ONCE else data
            if (depth > 0 or asked != ALL_AT_ONCE) and not sample_part(
                course, low, high, own, own.exact, data
            ):
                return False
            if asked == ALL_AT_ONCE:
                left, known = resolved(found[:, :, :1], part, LIGHT, level)
            with_slopes, fine = resolved(found, part, EXACT, level)
            if known and fine:
                add_part(found, low, high, course.lasts, row)
                continue
        if depth >= DEEPEST or not left < np.inf:
            return False
        cut_part(own, count, left, with_slopes, known)
        count += 2
    if data.shape[2] > 1:  # the mean times how the duration moves
        for j in range(data.shape[0]):
            row[j, 2 + course.begin.shape[0]] += row[j, 0] / course.lasts
    return True


@helper
def least_sizes(course, layout, i, d_period, own, whole):  # type: ignore[no-untyped-def]
    """Write the values over segment i, and let the sizes below which they are rounding grow to theirs.

    False if a noted argument changes its sign there.
    """
    own.light.after[0], own.exact.after[0] = -1.0, -1.0
    if whole.shape[2] > 1:
        smooth = sample_at_once(course, layout, i, d_period, own, whole)
    else:
        smooth = sample_part(course, 0.0, 1.0, own, own.light, whole)
    for j in range(own.least.shape[0]):
        for k in range(NODES):
            size = abs(whole[j, k, 0]) * (ROUNDING / RESOLVED)
            own.least[j] = max(own.least[j], size)
    return smooth


@kernel(
    types.boolean(
        *(FlowType, LayoutType, ExtremeType, TapeType, matrix, vector, indices, f8, f8, i8),
        *(vector, blocks, matrix),
    )
)
def integrate(  # type: ignore[no-untyped-def]
    functions,
    layout,
    extreme,
    tape,
    z,
    p,
    which,
    extra,
    level,
    chained,
    out,
    on_joints,
    by_parameters,
):
    """Write the integrals of L expressions over an orbit, and their gradients; False if it is left to others.

    Parameters
    ----------
    extreme : an extremum, of which the layout of the whole orbit is used
    which : the parameters that move, none where no gradients are wanted
    extra : the parameter that follows those of the model
    level : share of the last coefficients at which a part is resolved
    chained : 1 where the solution to a node starts at the node before
    out : shape (L,)
    on_joints : by the joints, shape (L, N, m), or (0, N, m) where no gradients are wanted
    by_parameters : by the parameters that move and the extra one, shape (L, len(which) + 1)
    """
    m, free, exact, whole = z.shape[1], which.shape[0], on_joints.shape[0] > 0, extreme.whole
    length, columns = whole.modes.shape[0], 3 + m + free if exact else 1
    images = z.shape[0] if exact and length > z.shape[0] else 0
    turn = whole_turn(functions, layout, extreme, tape, z, p, which, images, columns)
    own, d_period = turn.own, turn.d_period
    out[:] = 0.0
    on_joints[:, :, :] = 0.0
    by_parameters[:, :] = 0.0
    for k in range(2 * length):  # sizes of all segments are known before the first one is resolved
        i, joint = k % length, turn.cycle[k % length]
        lasts = enter_segment(functions, whole, i, z, turn.last, joint, p, own)
        course = IntegralCourse(
            functions, p, tape, extra, chained == 1, whole.modes[i], joint[0], own.begin, lasts
        )
        if not lasts > 0.0:
            continue
        if k < length:
            if not least_sizes(course, layout, i, d_period, own, own.wholes[i]):
                return False
            continue
        if not over_segment(course, level, own, own.wholes[i]):
            return False
        after = own.equations.after_reset
        for j in range(out.shape[0]):
            out[j] += own.row[j, 0]
            if exact:
                add_to_joints(
                    layout, whole, i, own.row[j], after, on_joints[j], by_parameters[j], d_period
                )
    return True


@kernel(
    types.void(
        *(FlowType, LayoutType, vector, i8, f8, blocks, matrix, blocks, indices, matrix, matrix)
    )
)
def follow_directions(  # type: ignore[no-untyped-def]
    functions,
    layout,
    p,
    turns,
    by_period,
    on_joints,
    by_parameters,
    joints,
    which,
    moved,
    out,
):
    """Write how integrals move in D directions, and as the last row how the period of the orbit does.

    Parameters
    ----------
    turns : 2 for a symmetric orbit, solved on its half, 1 otherwise
    by_period : how the extra parameter moves with the period of the orbit, as the rate of waves does
    on_joints, by_parameters : the gradients, of :func:`integrate`
    joints : how the joints move, shape (N, m, D)
    which, moved : the parameters that move, and how, shape (len(which), D)
    out : shape (L + 1, D)
    """
    last, free = out.shape[0] - 1, which.shape[0]
    grad = np.zeros(free)
    if layout.turn != 0.0:
        functions.period(p, which, grad)
    for d in range(out.shape[1]):
        turn = -joints[0, 0, d] if layout.turn == 0.0 else 0.0  # a cycle ends at time 0
        for k in range(free):
            turn += layout.turn * grad[k] * moved[k, d]
        out[last, d] = turns * turn
        for j in range(last):
            value = by_parameters[j, free] * by_period * out[last, d]
            for k in range(free):
                value += by_parameters[j, k] * moved[k, d]
            for i in range(joints.shape[0]):
                for k in range(joints.shape[1]):
                    value += on_joints[j, i, k] * joints[i, k, d]
            out[j, d] = value


class Integrals(NamedTuple):
    """Integrals over an orbit, with their derivatives in D directions.

    Attributes
    ----------
    values : shape (L,)
    slopes : how they move, and as the last row how the period of the orbit does, shape (L + 1, D)
    """

    values: list[float]
    slopes: FloatArray


def integrals_of(
    orbit: Orbit, tape: Tape, rate: float, directions: Directions | None
) -> Integrals | None:
    """Return what :meth:`contfric.Orbit.integrals` does."""
    system, joints, model = orbit.system, np.ascontiguousarray(orbit.joints), orbit.model
    count, rows = len(tape.outputs), 0 if directions is None else len(tape.outputs)
    which, moved = _STILL if directions is None else directions.moving
    found = np.empty(count), np.empty((rows, *joints.shape)), np.empty((rows, len(which) + 1))
    whole = Extreme(-1, 0, 1.0, orbit.as_whole().system.layout)
    at = joints, orbit.vector, which, rate
    engine = system.functions(), system.layout, whole, tape
    if not (goes_on(model) and _carried(orbit, tape, engine, at, found)) and not integrate(
        *engine, *at, resolved_level(model), int(goes_on(model)), *found
    ):
        return None
    slopes = np.empty((count + 1, moved.shape[1]))
    if directions is not None:
        turns, by_period = 1 + system.half, -rate / orbit.period
        along = np.ascontiguousarray(directions.joints), which, moved
        follow_directions(*engine[:2], orbit.vector, turns, by_period, *found[1:], *along, slopes)
    values: list[float] = found[0].tolist()
    return Integrals(values, slopes) if math.isfinite(sum(values)) else None


def _carried(orbit: Orbit, tape: Tape, engine: Any, at: Any, found: Any) -> bool:
    """Carry the integrals along as states, where that is the way; tell whether they were found so."""
    from contfric.orbit.functionals.integral_states import carried_by, carry

    flow = carried_by(orbit.model, tape)
    return flow is not None and bool(carry(*engine, flow.address, *at, *found))
