"""The functions of affine modes from tables of numbers: compiled once, for all models.

A model of many modes has its matrices as data. The formulas of its parameters are a list of operations
(:data:`OPERATIONS`) that are carried out with their derivatives; a coefficient is a sum of their results
times weights; a row of an affine form lists its coefficients of states and of harmonics. Forms come in
*groups*: the rates of a piece (n rows), an observable (one row), a reset (n rows).

The tables, of what :class:`contfric.models.coded.Tables` writes::

    operations[4 v : 4 v + 4]  kind, and up to three operands;  numbers[v] its constant
    row_of[g]                  first row of a group;  slope_at[r], wave_at[r] its first slope, and wave
    columns[s], harmonics[s]   state of a slope, frequency of a wave
    term_at[k]                 first term of a coefficient;  operands[j], weights[j] of a term
    places[g]                  first coefficient of a group: its slopes, then cosine and sine of each wave
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import (
    Kernel,
    allocating_helper,
    field_signature,
    helper,
    level_signature,
    observe_signature,
    period_signature,
    rate_signature,
    reset_signature,
    scale_signature,
)
from contfric.flow.layouts import AFFINE
from contfric.handle import TABLE, WEIGHTS, HandleType, with_handle

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

_TABLES = (
    *("operations", "row_of", "slope_at", "wave_at", "columns", "harmonics", "term_at", "operands"),
    *("places", "frequency_at", "level_at", "scale_at", "reset_at", "surface_at", "surfaces"),
    *("observable_of", "seen_at"),
)
_NUMBERS = ("values", "states", "waves", "parameters", "coefficients", "period_at")
#: What is behind a handle of a model whose formulas are data.
LAYOUT = {
    **dict.fromkeys(_TABLES, TABLE),
    **dict.fromkeys(("numbers", "weights", "returns"), WEIGHTS),
    **dict.fromkeys(_NUMBERS, types.int64),
}
CODED = HandleType("coded", LAYOUT)


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


@helper
def coefficients_of(model, group, values, by, co, jac):  # type: ignore[no-untyped-def]
    """Write the coefficients of a group, and their derivatives."""
    first = model.places[group]
    for k in range(model.places[group + 1] - first):
        total, begin, end = 0.0, model.term_at[first + k], model.term_at[first + k + 1]
        for j in range(begin, end):
            total += model.weights[j] * values[model.operands[j]]
        co[k] = total
        for q in range(jac.shape[0]):
            total = 0.0
            for j in range(begin, end):
                total += model.weights[j] * by[q, model.operands[j]]
            jac[q, k] = total


@allocating_helper
def group_entries(model, group, p, which, co, jac):  # type: ignore[no-untyped-def]
    """Write the coefficients of a group at some parameters, and their derivatives."""
    values, by = np.empty(model.values), np.empty((which.shape[0], model.values))
    evaluate(model, p, which, values, by)
    coefficients_of(model, group, values, by, co, jac)


def entries(model, piece, p, which, co, jac):  # type: ignore[no-untyped-def]
    """Write the coefficients of a piece."""
    group_entries(model, piece, p, which, co, jac)


def entries_seen(model, c, p, which, co, jac):  # type: ignore[no-untyped-def]
    """Write the coefficients of an observable."""
    group_entries(model, model.observable_of[c], p, which, co, jac)


def frequencies(model, p, which, out, jac):  # type: ignore[no-untyped-def]
    """Write the frequencies."""
    values, by = np.empty(model.values), np.empty((which.shape[0], model.values))
    evaluate(model, p, which, values, by)
    for j in range(model.waves):
        out[j] = values[model.frequency_at[j]]
        for k in range(which.shape[0]):
            jac[k, j] = by[k, model.frequency_at[j]]


@helper
def wave_place(model, group):  # type: ignore[no-untyped-def]
    """Return the first wave of a group, and the place of its cosine less twice its number."""
    row, last = model.row_of[group], model.row_of[group + 1]
    first = model.wave_at[row]
    return first, model.slope_at[last] - model.slope_at[row] - 2 * first


@helper
def group_audible(model, group, co, on):  # type: ignore[no-untyped-def]
    """Mark the harmonics whose factors are not zero."""
    begin, shift = wave_place(model, group)
    for s in range(begin, model.wave_at[model.row_of[group + 1]]):
        at = shift + 2 * s
        if co[at] != 0.0 or co[at + 1] != 0.0:
            on[model.harmonics[s]] = 1.0


def audible(model, piece, co, on):  # type: ignore[no-untyped-def]
    """Mark the harmonics of a piece."""
    group_audible(model, piece, co, on)


def audible_seen(model, c, co, on):  # type: ignore[no-untyped-def]
    """Mark the harmonics of an observable."""
    group_audible(model, model.observable_of[c], co, on)


@helper
def group_rows(model, group, co, y, c, s, out):  # type: ignore[no-untyped-def]
    """Write the rows of a group at a state."""
    row = model.row_of[group]
    begin, shift = wave_place(model, group)
    first = model.slope_at[row]
    for i in range(out.shape[0]):
        total = 0.0
        for k in range(model.wave_at[row + i], model.wave_at[row + i + 1]):
            j, at = model.harmonics[k], shift + 2 * k
            total += co[at] * c[j] + co[at + 1] * s[j]
        for k in range(model.slope_at[row + i], model.slope_at[row + i + 1]):
            total += co[k - first] * y[model.columns[k]]
        out[i] = total


def rates(model, piece, co, y, c, s, out):  # type: ignore[no-untyped-def]
    """Write the rates of a piece."""
    group_rows(model, piece, co, y, c, s, out)


@helper
def add_waves(model, row, count, shift, co, c, s, w, h, terms, series):  # type: ignore[no-untyped-def]
    """Add the harmonics of some rows to the Taylor terms of their integrals."""
    for i in range(count):
        for k in range(model.wave_at[row + i], model.wave_at[row + i + 1]):
            j, at = model.harmonics[k], shift + 2 * k
            cosine, sine = co[at] * c[j] + co[at + 1] * s[j], co[at + 1] * c[j] - co[at] * s[j]
            for m in range(terms):
                f = h / (m + 1.0)
                series[m + 1, i] += f * cosine
                cosine, sine = f * w[j] * sine, -f * w[j] * cosine
                if cosine == 0.0 and sine == 0.0:
                    break


def expand(model, piece, co, y, c, s, w, h, terms, series):  # type: ignore[no-untyped-def]
    """Write the Taylor terms of the state along a step."""
    n, row = y.shape[0], model.row_of[piece]
    begin, shift = wave_place(model, piece)
    first = model.slope_at[row]
    for i in range(n):
        series[0, i] = y[i]
        for m in range(1, terms + 1):
            series[m, i] = 0.0
    add_waves(model, row, n, shift, co, c, s, w, h, terms, series)
    for m in range(terms):
        f = h / (m + 1.0)
        for i in range(n):
            total = 0.0
            for k in range(model.slope_at[row + i], model.slope_at[row + i + 1]):
                total += co[k - first] * series[m, model.columns[k]]
            series[m + 1, i] += f * total


@helper
def add_varied_waves(model, row, n, shift, co, by, waves, w, dw, h, terms, out):  # type: ignore[no-untyped-def]
    """Add the derivatives of the harmonics by a parameter to the Taylor terms of their integrals."""
    for i in range(n):
        for k in range(model.wave_at[row + i], model.wave_at[row + i + 1]):
            j, at = model.harmonics[k], shift + 2 * k
            c, s, u, v = waves[0, j], waves[1, j], waves[2, j], waves[3, j]
            for m in range(terms):
                f = h / (m + 1.0)
                total = by[at] * c + by[at + 1] * s + dw[j] * (co[at] * u + co[at + 1] * v)
                out[m + 1, i] += f * total
                u, v = -f * (s + w[j] * v), f * (c + w[j] * u)
                c, s = -f * w[j] * s, f * w[j] * c


def vary(model, piece, co, by, z, waves, w, dw, h, terms, series, out):  # type: ignore[no-untyped-def]
    """Write the derivatives of the Taylor terms by a parameter."""
    n, row = z.shape[0], model.row_of[piece]
    begin, shift = wave_place(model, piece)
    first = model.slope_at[row]
    for i in range(n):
        out[0, i] = z[i]
        for m in range(1, terms + 1):
            out[m, i] = 0.0
    add_varied_waves(model, row, n, shift, co, by, waves, w, dw, h, terms, out)
    for m in range(terms):
        f = h / (m + 1.0)
        for i in range(n):
            total = 0.0
            for k in range(model.slope_at[row + i], model.slope_at[row + i + 1]):
                j = model.columns[k]
                total += co[k - first] * out[m, j] + by[k - first] * series[m, j]
            out[m + 1, i] += f * total


def sums(model, piece, co, d, row, column, own):  # type: ignore[no-untyped-def]
    """Add up the sizes of the matrix in units ``d``."""
    begin = model.row_of[piece]
    first = model.slope_at[begin]
    for i in range(d.shape[0]):
        for k in range(model.slope_at[begin + i], model.slope_at[begin + i + 1]):
            j, size = model.columns[k], abs(co[k - first])
            if i == j:
                own[i] = size
            else:
                row[i] += size * d[j]
                column[j] += size / d[i]


def look(model, c, co, cs, sn, w, h, terms, series, poly):  # type: ignore[no-untyped-def]
    """Write the Taylor terms of an observable."""
    group = model.observable_of[c]
    row = model.row_of[group]
    begin, shift = wave_place(model, group)
    first, last = model.slope_at[row], model.slope_at[row + 1]
    for m in range(terms + 1):
        total = 0.0
        for k in range(first, last):
            total += co[k - first] * series[m, model.columns[k]]
        poly[m] = total
    for k in range(begin, model.wave_at[row + 1]):
        j, at = model.harmonics[k], shift + 2 * k
        cosine, sine = co[at] * cs[j] + co[at + 1] * sn[j], co[at + 1] * cs[j] - co[at] * sn[j]
        for m in range(terms + 1):
            poly[m] += cosine
            f = h / (m + 1.0)
            cosine, sine = f * w[j] * sine, -f * w[j] * cosine


@helper
def row_at(model, group, i, co, t, y, w, slopes):  # type: ignore[no-untyped-def]
    """Return a row of a group at a state, and its derivatives by time; its slopes are written."""
    row, value, rate, second = model.row_of[group] + i, 0.0, 0.0, 0.0
    begin, shift = wave_place(model, group)
    first = model.slope_at[model.row_of[group]]
    for k in range(model.wave_at[row], model.wave_at[row + 1]):
        j, at = model.harmonics[k], shift + 2 * k
        c, s = math.cos(w[j] * t), math.sin(w[j] * t)
        value += co[at] * c + co[at + 1] * s
        rate += w[j] * (co[at + 1] * c - co[at] * s)
        second -= w[j] * w[j] * (co[at] * c + co[at + 1] * s)
    for j in range(y.shape[0]):
        slopes[j] = 0.0
    for k in range(model.slope_at[row], model.slope_at[row + 1]):
        slopes[model.columns[k]] = co[k - first]
        value += co[k - first] * y[model.columns[k]]
    return value, rate, second


@helper
def varied_row(model, group, i, co, by, t, y, w, dw):  # type: ignore[no-untyped-def]
    """Return the derivatives of a row, and of its rate by time, by a parameter."""
    row, value, rate = model.row_of[group] + i, 0.0, 0.0
    begin, shift = wave_place(model, group)
    first = model.slope_at[model.row_of[group]]
    for k in range(model.wave_at[row], model.wave_at[row + 1]):
        j, at = model.harmonics[k], shift + 2 * k
        c, s = math.cos(w[j] * t), math.sin(w[j] * t)
        along, across = co[at + 1] * c - co[at] * s, co[at] * c + co[at + 1] * s
        value += by[at] * c + by[at + 1] * s + dw[j] * t * along
        rate += dw[j] * (along - w[j] * t * across) + w[j] * (by[at + 1] * c - by[at] * s)
    for k in range(model.slope_at[row], model.slope_at[row + 1]):
        value += by[k - first] * y[model.columns[k]]
    return value, rate


@allocating_helper
def waves_at(model, values, by, w, dw):  # type: ignore[no-untyped-def]
    """Write the frequencies and their derivatives."""
    for j in range(model.waves):
        w[j] = values[model.frequency_at[j]]
        for k in range(by.shape[0]):
            dw[k, j] = by[k, model.frequency_at[j]]


@allocating_helper
def map_of(model, group, t, y, p, which, out, jac):  # type: ignore[no-untyped-def]
    """Write the n rows of a group at a state; their derivatives where ``jac`` has space."""
    n, free = y.shape[0], which.shape[0] if jac.shape[0] > 0 else 0
    values, by = np.empty(model.values), np.empty((free, model.values))
    evaluate(model, p, which[:free], values, by)
    co, slopes = np.empty(model.coefficients), np.empty((free, model.coefficients))
    coefficients_of(model, group, values, by, co, slopes)
    w, dw, row = np.empty(model.waves), np.empty((free, model.waves)), np.empty(n)
    waves_at(model, values, by, w, dw)
    for i in range(n):
        out[i], rate, _ = row_at(model, group, i, co, t, y, w, row)
        if jac.shape[0] == 0:
            continue
        jac[i, 0] = rate
        for j in range(n):
            jac[i, 1 + j] = row[j]
        for k in range(free):
            jac[i, 1 + n + k], _ = varied_row(model, group, i, co, slopes[k], t, y, w, dw[k])


def field(model, piece, t, y, p, which, out, jac):  # type: ignore[no-untyped-def]
    """Write the rates of a piece (``field_signature``)."""
    map_of(model, piece, t, y, p, which, out, jac)


def reset(model, k, t, y, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Write the state after the reset at a surface (``reset_signature``)."""
    map_of(model, model.reset_at[k], t, y, p, which, y1, jac)


@allocating_helper
def seen(model, c, t, y, p, which, grad):  # type: ignore[no-untyped-def]
    """Return an observable, with its gradient."""
    n, free, group = y.shape[0], which.shape[0] if grad.shape[0] > 0 else 0, model.observable_of[c]
    values, by = np.empty(model.values), np.empty((free, model.values))
    evaluate(model, p, which[:free], values, by)
    co, slopes = np.empty(model.coefficients), np.empty((free, model.coefficients))
    coefficients_of(model, group, values, by, co, slopes)
    w, dw, row = np.empty(model.waves), np.empty((free, model.waves)), np.empty(n)
    waves_at(model, values, by, w, dw)
    value, rate, _ = row_at(model, group, 0, co, t, y, w, row)
    if grad.shape[0] > 0:
        grad[0] = rate
        for j in range(n):
            grad[1 + j] = row[j]
        for k in range(free):
            grad[1 + n + k], _ = varied_row(model, group, 0, co, slopes[k], t, y, w, dw[k])
    return value


def observe(model, c, t, y, p, which, grad):  # type: ignore[no-untyped-def]
    """Return an observable (``observe_signature``)."""
    return seen(model, c, t, y, p, which, grad)


def rate(model, mode, c, t, y, p, which, grad):  # type: ignore[no-untyped-def]
    """Return the rate of an observable along a mode: ``o_t + o_y . f`` (``rate_signature``)."""
    n, free, group = y.shape[0], which.shape[0] if grad.shape[0] > 0 else 0, model.observable_of[c]
    values, by = np.empty(model.values), np.empty((free, model.values))
    evaluate(model, p, which[:free], values, by)
    co, slopes = np.empty(model.coefficients), np.empty((free, model.coefficients))
    own, owns = np.empty(model.coefficients), np.empty((free, model.coefficients))
    coefficients_of(model, group, values, by, co, slopes)
    coefficients_of(model, mode, values, by, own, owns)
    w, dw = np.empty(model.waves), np.empty((free, model.waves))
    waves_at(model, values, by, w, dw)
    weights, row = np.empty(n), np.empty(n)
    _, total, second = row_at(model, group, 0, co, t, y, w, weights)
    for m in range(grad.shape[0]):
        grad[m] = 0.0
    first = model.slope_at[model.row_of[group]]
    for k in range(first, model.slope_at[model.row_of[group] + 1]):
        i = model.columns[k]
        f, f_t, _ = row_at(model, mode, i, own, t, y, w, row)
        total += weights[i] * f
        if grad.shape[0] == 0:
            continue
        grad[0] += weights[i] * f_t
        for j in range(n):
            grad[1 + j] += weights[i] * row[j]
        for q in range(free):
            by_q, _ = varied_row(model, mode, i, own, owns[q], t, y, w, dw[q])
            grad[1 + n + q] += weights[i] * by_q + slopes[q, k - first] * f
    if grad.shape[0] > 0:
        grad[0] += second
        for q in range(free):
            _, by_q = varied_row(model, group, 0, co, slopes[q], t, y, w, dw[q])
            grad[1 + n + q] += by_q
    return total


@allocating_helper
def value_of(model, at, p, which, grad):  # type: ignore[no-untyped-def]
    """Return the result of one operation, with its gradient."""
    free = which.shape[0] if grad.shape[0] > 0 else 0
    values, by = np.empty(at + 1), np.empty((free, at + 1))
    for v in range(at + 1):
        operate(model, v, p, which[:free], values, by)
    for k in range(free):
        grad[k] = by[k, at]
    return values[at]


def level(model, k, p, which, grad):  # type: ignore[no-untyped-def]
    """Return the level of a surface (``level_signature``)."""
    return value_of(model, model.level_at[k], p, which, grad)


def period(model, p, which, grad):  # type: ignore[no-untyped-def]
    """Return the period of the excitation (``period_signature``)."""
    return value_of(model, model.period_at, p, which, grad)


def scale(model, i, p):  # type: ignore[no-untyped-def]
    """Return the natural size of a state, at most 1 (``scale_signature``)."""
    none, empty = np.empty(0, dtype=np.int64), np.empty(0)
    size = abs(value_of(model, model.scale_at[i], p, none, empty))
    return size if 0.0 < size < 1.0 else 1.0


def onto(model, mode, t, y, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Write the state on the surfaces that a mode slides on: ``y - Q (G y + g(t) - levels)``."""
    n, free = y.shape[0], which.shape[0] if jac.shape[0] > 0 else 0
    grad, by = np.empty(1 + n + free if jac.shape[0] > 0 else 0), np.empty(free)
    for i in range(n):
        y1[i] = y[i]
        for j in range(jac.shape[1] if jac.shape[0] > 0 else 0):
            jac[i, j] = 1.0 if j == 1 + i else 0.0
    for s in range(model.surface_at[mode], model.surface_at[mode + 1]):
        k = model.surfaces[s]
        above = seen(model, model.seen_at[k], t, y, p, which[:free], grad)
        above -= value_of(model, model.level_at[k], p, which[:free], by)
        for q in range(free):
            grad[1 + n + q] -= by[q]
        for i in range(n):
            back = model.returns[n * s + i]
            y1[i] -= back * above
            for j in range(grad.shape[0]):
                jac[i, j] -= back * grad[j]


_SIGNATURES = {
    **AFFINE,
    "field": field_signature,
    "observe": observe_signature,
    "rate": rate_signature,
    "period": period_signature,
    "scale": scale_signature,
    "onto": field_signature,
    "level": level_signature,
    "reset": reset_signature,
}
#: The kernels of models whose formulas are data, by what they are to a flow.
KERNELS = {
    name: Kernel(globals()[name], with_handle(signature, CODED))
    for name, signature in _SIGNATURES.items()
}
