r"""Integrals of expressions over an orbit of an integrated flow: each is one more state.

With :math:`y' = f(t, y, p)` an integral is a state of its own, with :math:`q' = g(t, y, p)` and q = 0 at the
start of a segment. The integrator carries it along, and its variations with those of the states: one pass
over the segment gives the integral and its gradient by start, duration and parameters, with the error that a
step may make. Nodes (:mod:`contfric.orbit.functionals.integrals`) would ask for many short passes, and for
many nodes in boundary layers, which the steps of the solution resolve anyhow. An expression with a kink or
jump (``abs``, ``sign``, ``where``) is left to these.

The model with more states is one like any other: its functions call those of the model and evaluate the
expressions (:mod:`contfric.quantities.operations`), which are data. No kernel is compiled for an expression
or a model. Parameters are p, the extra one of the expressions, and the size of each: the unit of its
tolerance.
"""

from __future__ import annotations

import dataclasses
import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import carray, types

from contfric.base.arrays import FloatArray
from contfric.bvp.equations import LayoutType
from contfric.compiled import (
    Kernel,
    allocating_helper,
    blocks,
    f8,
    field_signature,
    flow_signature,
    helper,
    i8,
    indices,
    kernel,
    matrix,
    observe_signature,
    period_signature,
    rate_signature,
    scale_signature,
    vector,
)
from contfric.flow.general import kernels_of
from contfric.flow.layouts import FlowType
from contfric.handle import TABLE, WEIGHTS, Block, Bound, HandleType, with_handle
from contfric.models.definition import Model
from contfric.models.deriving.growing_model import ComposedModel
from contfric.orbit.functionals.integral_parts import IntegralCourse, reach_node
from contfric.orbit.functionals.integral_rows import (
    TapeType,
    add_to_joints,
    enter_segment,
    whole_turn,
)
from contfric.orbit.functionals.peak import ExtremeType
from contfric.quantities.operations import differentiate_tape, evaluate_tape
from contfric.quantities.tape import Tape

#: Places in each segment at which the size of an expression is looked for, the unit of its tolerance.
_PLACES = 4

#: What is after the handle of a model with integrals as states: its own functions, and the expressions.
LAYOUT = {
    "field": field_signature,
    "observe": observe_signature,
    "rate": rate_signature,
    "scale": scale_signature,
    "onto": field_signature,
    "operations": TABLE,
    "outputs": TABLE,
    "constants": WEIGHTS,
    "rows": i8,  # operations
    "integrals": i8,
    "numbers": i8,  # constants
    "states": i8,
    "parameters": i8,
}
CARRYING = HandleType("carrying", LAYOUT)
#: The flow of states and integrals.
CARRIED = {"flow": flow_signature}
CarriedType = HandleType("carried", CARRIED)


class Expressions(NamedTuple):
    """What operations are evaluated with (:func:`contfric.quantities.operations.evaluate_tape`)."""

    functions: Any
    p: FloatArray
    tape: Tape
    extra: float


@allocating_helper
def expressions_of(own, p):  # type: ignore[no-untyped-def]
    """Return the expressions at some parameters."""
    tape = Tape(
        carray(own.operations, (own.rows, 4)),
        carray(own.constants, (own.numbers,)),
        carray(own.outputs, (own.integrals,)),
        carray(own.outputs, (0,)),
    )
    return Expressions(own, p[: own.parameters], tape, p[own.parameters])


@helper
def spread(own, source, target, after):  # type: ignore[no-untyped-def]
    """Write derivatives by (t, states, parameters), which integrals and the extra parameter do not change.

    ``after`` columns of the target follow the first one and those of the states and integrals.
    """
    n, extra = own.states, own.integrals
    for j in range(target.shape[0]):
        target[j] = 0.0
    for j in range(1 + n):
        target[j] = source[j]
    for k in range(after - 1):
        target[1 + n + extra + k] = source[1 + n + k]


def field(own, piece, t, y, p, which, out, jac):  # type: ignore[no-untyped-def]
    """Write the rates of states and integrals (``field_signature``)."""
    n, free = own.states, max(which.shape[0] - 1, 0) if jac.shape[0] > 0 else 0
    rows = n if jac.shape[0] > 0 else 0
    partial, moving = np.empty((rows, 1 + n + free)), which[:free]
    own.field(piece, t, y[:n], p[: own.parameters], moving, out[:n], partial)
    asked = expressions_of(own, p)
    tape, grads = asked.tape, np.empty((own.rows, 1 + n + free if rows > 0 else 0))
    values, weights = np.empty(own.rows), np.empty(own.rows)
    gradient = np.empty(2 + n + own.parameters)
    evaluate_tape(asked, t, y, moving, values, grads)
    for i in range(rows):
        spread(own, partial[i], jac[i], 1 + free)
    for j in range(own.integrals):
        out[n + j] = values[tape.outputs[j]]
        if rows == 0:
            continue
        differentiate_tape(tape, tape.outputs[j], n, moving, values, grads, weights, gradient)
        row = jac[n + j]
        for k in range(row.shape[0]):
            row[k] = 0.0
        for k in range(1 + n):
            row[k] = gradient[k]
        for k in range(free):
            row[1 + n + own.integrals + k] = gradient[1 + n + which[k]]
        row[1 + n + own.integrals + free] = gradient[1 + n + own.parameters]


def observe(own, c, t, y, p, which, grad):  # type: ignore[no-untyped-def]
    """Return an observable of the model (``observe_signature``)."""
    n, free = own.states, max(which.shape[0] - 1, 0) if grad.shape[0] > 0 else 0
    partial = np.empty(1 + n + free if grad.shape[0] > 0 else 0)
    value = own.observe(c, t, y[:n], p[: own.parameters], which[:free], partial)
    if grad.shape[0] > 0:
        spread(own, partial, grad, 1 + free)
    return value


def rate(own, mode, c, t, y, p, which, grad):  # type: ignore[no-untyped-def]
    """Return the rate of an observable of the model (``rate_signature``)."""
    n, free = own.states, max(which.shape[0] - 1, 0) if grad.shape[0] > 0 else 0
    partial = np.empty(1 + n + free if grad.shape[0] > 0 else 0)
    value = own.rate(mode, c, t, y[:n], p[: own.parameters], which[:free], partial)
    if grad.shape[0] > 0:
        spread(own, partial, grad, 1 + free)
    return value


def scale(own, i, p):  # type: ignore[no-untyped-def]
    """Return the natural size of a state, or of an integral (``scale_signature``)."""
    if i < own.states:
        return own.scale(i, p[: own.parameters])
    return p[own.parameters + 1 + i - own.states]


def onto(own, mode, t, y, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Write the state on the surfaces that a mode slides on; integrals as they are."""
    n, free = own.states, max(which.shape[0] - 1, 0) if jac.shape[0] > 0 else 0
    rows = n if jac.shape[0] > 0 else 0
    partial = np.empty((rows, 1 + n + free))
    own.onto(mode, t, y[:n], p[: own.parameters], which[:free], y1[:n], partial)
    for i in range(rows):
        spread(own, partial[i], jac[i], 1 + free)
    for i in range(n, n + own.integrals):
        y1[i] = y[i]
        for k in range(jac.shape[1] if rows > 0 else 0):
            jac[i, k] = 1.0 if k == 1 + i else 0.0


@kernel(period_signature, counts=False)
def unfolded(p, which, grad):  # type: ignore[no-untyped-def]
    """Return no period: expressions of time are no functions of the phase."""
    for k in range(grad.shape[0]):
        grad[k] = 0.0
    return 0.0


#: The functions of the model with more states, by what they are to it.
KERNELS = {
    name: Kernel(function, with_handle(signature, CARRYING))
    for name, function, signature in (
        ("field", field, field_signature),
        ("observe", observe, observe_signature),
        ("rate", rate, rate_signature),
        ("scale", scale, scale_signature),
        ("onto", onto, field_signature),
    )
}


class Carried(NamedTuple):
    """The flow of states and integrals: its handle, and what keeps that alive."""

    address: int
    block: Block


def carried_by(model: Model, tape: Tape) -> Carried | None:
    """Return the flow of a model with the integrals of a tape as states; None if nodes are the way.

    They are where no mode is integrated, or the expressions have kinks.
    """
    functions = None if isinstance(model, ComposedModel) else model.flow.made_of
    if functions is None or len(tape.noted) or functions.in_closed_form:
        return None
    return _carried(model, *(part.tobytes() for part in tape[:3]))


@lru_cache(maxsize=64)
def _carried(model: Model, operations: bytes, constants: bytes, outputs: bytes) -> Carried:
    functions = model.flow.made_of
    assert functions is not None
    rows = np.frombuffer(operations, dtype=np.int64)
    numbers, results = np.frombuffer(constants), np.frombuffer(outputs, dtype=np.int64)
    own = {name: getattr(functions, name) for name in ("field", "observe", "scale", "onto")}
    own |= {"rate": functions.rate, "operations": rows, "outputs": results, "constants": numbers}
    own |= {"rows": len(rows) // 4, "integrals": len(results), "numbers": len(numbers)}
    own |= {"states": len(model.states), "parameters": len(model.parameter_names)}
    block = Block(LAYOUT, own)
    changed: dict[str, Any] = {name: Bound(each, block) for name, each in KERNELS.items()}
    # solutions of affine modes are integrated as well: a closed form knows no integrals
    changed |= {"sides": {}, "idle": (), "timed": (), "affine": None, "period": unfolded}
    more = dataclasses.replace(functions, **changed)
    flow = Block(CARRIED, {"flow": Bound(kernels_of(more.kind)[0], more.block)})
    return Carried(flow.address, flow)


@helper
def size_in_segment(course, own, sizes):  # type: ignore[no-untyped-def]
    """Let the sizes of the expressions grow to those at some places in a segment."""
    light, tape = own.light, course.tape
    light.after[0] = -1.0
    for k in range(_PLACES):
        after = course.lasts * (k + 0.5) / _PLACES
        reach_node(course, after, light, own.equations.between)
        time = course.start + after
        evaluate_tape(course, time, light.state, light.which, own.values, light.grads)
        for j in range(sizes.shape[0]):
            sizes[j] = max(sizes[j], abs(own.values[tape.outputs[j]]))


@helper
def fill_row(row, y1, jac, n, j, count):  # type: ignore[no-untyped-def]
    """Write an integral over a segment: its value and its gradient, without that by integrals."""
    row[0] = y1[n + j]
    if jac.shape[0] == 0:
        return
    for k in range(1 + n):
        row[1 + k] = jac[n + j, k]
    for k in range(jac.shape[1] - 1 - n - count):
        row[2 + n + k] = jac[n + j, 1 + n + count + k]


@kernel(
    types.boolean(
        *(FlowType, LayoutType, ExtremeType, TapeType, CarriedType, matrix, vector, indices, f8),
        *(vector, blocks, matrix),
    )
)
def carry(  # type: ignore[no-untyped-def]
    functions, layout, extreme, tape, carried, z, p, which, extra, out, on_joints, by_parameters
):
    """Write what :func:`~.integrals.integrate` does, the integrals carried along as states."""
    m, free, exact, whole = z.shape[1], which.shape[0], on_joints.shape[0] > 0, extreme.whole
    length, count, columns, n = whole.modes.shape[0], out.shape[0], 3 + m + free, m - 1
    turn = whole_turn(functions, layout, extreme, tape, z, p, which, 0, columns)
    own, d_period = turn.own, turn.d_period
    out[:] = 0.0
    on_joints[:, :, :] = 0.0
    by_parameters[:, :] = 0.0
    numbers, moving = np.zeros(p.shape[0] + 1 + count), np.empty(free + 1 if exact else 0, np.int64)
    numbers[: p.shape[0]], numbers[p.shape[0]] = p, extra
    if exact:
        moving[:free], moving[free] = which, p.shape[0]
    sizes, start, end = numbers[p.shape[0] + 1 :], np.zeros(n + count), np.empty(n + count)
    jac = np.empty((n + count if exact else 0, 2 + n + count + free + 1))
    for k in range(2 * length):  # the sizes of all are known before one is integrated
        i, joint = k % length, turn.cycle[k % length]
        lasts = enter_segment(functions, whole, i, z, turn.last, joint, p, own)
        if not lasts > 0.0:
            continue
        if k < length:
            course = IntegralCourse(
                functions, p, tape, extra, True, whole.modes[i], joint[0], own.begin, lasts
            )
            size_in_segment(course, own, sizes)
            continue
        for j in range(count):  # nothing to be seen: any size is one
            sizes[j] = sizes[j] if sizes[j] > 0.0 else 1.0
        start[:n] = own.begin
        carried.flow(whole.modes[i], joint[0], start, lasts, numbers, moving, end, jac)
        if not math.isfinite(end[n + count - 1]):
            return False
        for j in range(count):
            fill_row(own.row[j], end, jac, n, j, count)
            out[j] += own.row[j, 0]
            if exact:
                add_to_joints(
                    layout, whole, i, own.row[j], own.equations.after_reset, on_joints[j], by_parameters[j],
                    d_period,
                )  # fmt: skip
    return True
