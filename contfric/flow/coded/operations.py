"""Formulas of the parameters as a list of operations, carried out with their derivatives.

Operation ``v`` has a kind, up to three operands (results of operations before it, or a parameter) and a
number; its derivatives by the parameters follow by the chain rule.
"""

from __future__ import annotations

import math

from contfric.compiled import helper

#: Kinds of operations: a parameter, a number, a sum, a product, a power with a whole exponent, functions.
PARAMETER, NUMBER, SUM, PRODUCT, WHOLE, INVERSE_OF, POWER, WHERE = range(8)
FUNCTIONS = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt"),
    *("abs", "sign"),
)
SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, EXP, LOG, SQRT, ABS, SIGN = range(
    WHERE + 1, WHERE + 1 + len(FUNCTIONS)
)
OPERATIONS = {
    "inverse": INVERSE_OF,
    "power": POWER,
    "where": WHERE,
    **{name: WHERE + 1 + i for i, name in enumerate(FUNCTIONS)},
}


@helper
def slope_of(kind, x, value):  # type: ignore[no-untyped-def]
    """Return the derivative of a function at x, of which the value is known."""
    if kind == SIN:
        return math.cos(x)
    if kind == COS:
        return -math.sin(x)
    if kind == TAN:
        return 1.0 + value * value
    if kind == ASIN:
        return 1.0 / math.sqrt(1.0 - x * x)
    if kind == ACOS:
        return -1.0 / math.sqrt(1.0 - x * x)
    if kind == ATAN:
        return 1.0 / (1.0 + x * x)
    if kind == SINH:
        return math.cosh(x)
    if kind == COSH:
        return math.sinh(x)
    if kind == TANH:
        return 1.0 - value * value
    if kind == EXP:
        return value
    if kind == LOG:
        return 1.0 / x
    if kind == SQRT:
        return 0.5 / value
    if kind == ABS:
        return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)
    if kind == SIGN:
        return 0.0
    return -value * value  # INVERSE_OF


@helper
def function_of(kind, x):  # type: ignore[no-untyped-def]
    """Return a function at x; no number where it has no value."""
    if kind == SIN:
        return math.sin(x)
    if kind == COS:
        return math.cos(x)
    if kind == TAN:
        return math.tan(x)
    if kind == ASIN:
        return math.asin(x) if abs(x) <= 1.0 else math.nan
    if kind == ACOS:
        return math.acos(x) if abs(x) <= 1.0 else math.nan
    if kind == ATAN:
        return math.atan(x)
    if kind == SINH:
        return math.sinh(x)
    if kind == COSH:
        return math.cosh(x)
    if kind == TANH:
        return math.tanh(x)
    if kind == EXP:
        return math.exp(x)
    if kind == LOG:
        return math.log(x) if x > 0.0 else math.nan
    if kind == SQRT:
        return math.sqrt(x) if x >= 0.0 else math.nan
    if kind == ABS:
        return abs(x)
    if kind == SIGN:
        return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)
    return 1.0 / x  # INVERSE_OF


@helper
def operate(model, v, p, which, values, by):  # type: ignore[no-untyped-def]
    """Carry out one operation, with its derivatives by the parameters."""
    kind, a, b = model.operations[4 * v], model.operations[4 * v + 1], model.operations[4 * v + 2]
    c, free = model.numbers[v], which.shape[0]
    if kind == PARAMETER:
        values[v] = p[a]
        for k in range(free):
            by[k, v] = 1.0 if which[k] == a else 0.0
    elif kind == NUMBER:
        values[v] = c
        for k in range(free):
            by[k, v] = 0.0
    elif kind == SUM:  # c times the first, added to the second
        values[v] = c * values[a] + values[b]
        for k in range(free):
            by[k, v] = c * by[k, a] + by[k, b]
    elif kind == PRODUCT:
        values[v] = values[a] * values[b]
        for k in range(free):
            by[k, v] = by[k, a] * values[b] + values[a] * by[k, b]
    elif kind == WHOLE:
        values[v] = values[a] ** b
        for k in range(free):
            by[k, v] = b * values[a] ** (b - 1) * by[k, a]
    elif kind == POWER:
        base, exponent = values[a], values[b]
        values[v] = base**exponent if base > 0.0 else (0.0 if base == 0.0 else math.nan)
        for k in range(free):
            by[k, v] = exponent * base ** (exponent - 1.0) * by[k, a] if base > 0.0 else 0.0
            if base > 0.0 and by[k, b] != 0.0:
                by[k, v] += math.log(base) * values[v] * by[k, b]
    elif kind == WHERE:
        chosen = b if values[a] > 0.0 else model.operations[4 * v + 3]
        values[v] = values[chosen]
        for k in range(free):
            by[k, v] = by[k, chosen]
    else:
        values[v] = function_of(kind, values[a])
        slope = slope_of(kind, values[a], values[v]) if free > 0 else 0.0
        for k in range(free):
            by[k, v] = slope * by[k, a]


@helper
def evaluate(model, p, which, values, by):  # type: ignore[no-untyped-def]
    """Carry out all operations, with their derivatives by the parameters."""
    for v in range(model.values):
        operate(model, v, p, which, values, by)
