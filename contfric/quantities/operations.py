"""Operations of a tape (:mod:`contfric.quantities.tape`): forwards at one node, and backwards, compiled."""

from __future__ import annotations

import math

from contfric.compiled import helper
from contfric.flow.coded.operations import SIN, function_of, slope_of
from contfric.quantities.codes import (
    ADD,
    CONSTANT,
    DIVIDE,
    FIRST_FUNCTION,
    MULTIPLY,
    NEGATE,
    OBSERVABLE,
    PARAMETER,
    POWER,
    STATE,
    SUBTRACT,
    TIME,
    WHERE,
)

#: From the code of a function here to that in the formulas of flows, which have the same order.
_TO_FLOW = SIN - FIRST_FUNCTION


@helper
def evaluate_tape(course, t, y, which, values, grads):  # type: ignore[no-untyped-def]
    """Write the values of all operations at one node.

    Parameters
    ----------
    course : flow, tape and parameters (:class:`contfric.orbit.functionals.integral_parts.IntegralCourse`)
    values : shape (K,)
    grads : gradients of observables, shape (K, 1 + n + len(which)), not filled if (K, 0)
    """
    operations, p = course.tape.operations, course.p
    for k in range(operations.shape[0]):
        operation, a, b = operations[k, 0], operations[k, 1], operations[k, 2]
        if operation == CONSTANT:
            values[k] = course.tape.constants[a]
        elif operation == TIME:
            values[k] = t
        elif operation == STATE:
            values[k] = y[a]
        elif operation == PARAMETER:
            values[k] = p[a] if a < p.shape[0] else course.extra
        elif operation == OBSERVABLE:
            values[k] = course.functions.observe(a, t, y, p, which, grads[k])
        elif operation == NEGATE:
            values[k] = -values[a]
        elif operation == ADD:
            values[k] = values[a] + values[b]
        elif operation == SUBTRACT:
            values[k] = values[a] - values[b]
        elif operation == MULTIPLY:
            values[k] = values[a] * values[b]
        elif operation == DIVIDE:
            values[k] = values[a] / values[b]
        elif operation == POWER:
            values[k] = values[a] ** values[b]
        elif operation == WHERE:
            values[k] = values[b] if values[a] > 0.0 else values[operations[k, 3]]
        else:
            values[k] = function_of(operation + _TO_FLOW, values[a])


@helper
def spread_back(operations, k, weight, values, weights):  # type: ignore[no-untyped-def]
    """Add what the value of one operation weighs to the weights of its arguments."""
    operation, a, b = operations[k, 0], operations[k, 1], operations[k, 2]
    if operation == NEGATE:
        weights[a] -= weight
    elif operation == ADD:
        weights[a] += weight
        weights[b] += weight
    elif operation == SUBTRACT:
        weights[a] += weight
        weights[b] -= weight
    elif operation == MULTIPLY:
        weights[a] += weight * values[b]
        weights[b] += weight * values[a]
    elif operation == DIVIDE:
        weights[a] += weight / values[b]
        weights[b] -= weight * values[k] / values[b]
    elif operation == POWER:
        base, exponent = values[a], values[b]
        if exponent != 0.0:
            weights[a] += weight * exponent * base ** (exponent - 1.0)
        if operations[b, 0] != CONSTANT and base > 0.0:
            weights[b] += weight * values[k] * math.log(base)
    elif operation == WHERE:
        weights[b if values[a] > 0.0 else operations[k, 3]] += weight
    else:
        weights[a] += weight * slope_of(operation + _TO_FLOW, values[a], values[k])


@helper
def differentiate_tape(tape, output, n, which, values, grads, weights, gradient):  # type: ignore[no-untyped-def]
    """Write the derivatives of one output by time, states and all parameters, the extra one last.

    Parameters
    ----------
    output : which operation it is
    which : the parameters that observables are differentiated by
    values, grads : of :func:`evaluate_tape`
    weights : workspace, shape (K,)
    gradient : shape (1 + n + parameters + 1,)
    """
    operations = tape.operations
    for k in range(gradient.shape[0]):
        gradient[k] = 0.0
    for k in range(output + 1):
        weights[k] = 0.0
    weights[output] = 1.0
    for k in range(output, -1, -1):
        weight, operation, a = weights[k], operations[k, 0], operations[k, 1]
        if weight == 0.0 or operation == CONSTANT:
            continue
        if operation == TIME:
            gradient[0] += weight
        elif operation == STATE:
            gradient[1 + a] += weight
        elif operation == PARAMETER:
            gradient[1 + n + a] += weight
        elif operation == OBSERVABLE:
            for j in range(1 + n):
                gradient[j] += weight * grads[k, j]
            for j in range(which.shape[0]):
                gradient[1 + n + which[j]] += weight * grads[k, 1 + n + j]
        else:
            spread_back(operations, k, weight, values, weights)
