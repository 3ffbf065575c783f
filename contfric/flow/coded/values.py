"""Fields, observables, resets and levels from tables, with their gradients."""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.flow.coded.operations import evaluate, operate
from contfric.flow.coded.tables import coefficients_of, wave_shift


@helper
def row_at(model, group, i, co, t, y, w, slopes):  # type: ignore[no-untyped-def]
    """Return a row of a group at a state, and its derivatives by time; its slopes are written."""
    row, value, rate, second = model.row_of[group] + i, 0.0, 0.0, 0.0
    shift = wave_shift(model, group)
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
    shift = wave_shift(model, group)
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
def numbers_at(model, p, which):  # type: ignore[no-untyped-def]
    """Return all operations' results with their derivatives, and the frequencies with theirs."""
    free = which.shape[0]
    values, by = np.empty(model.values), np.empty((free, model.values))
    evaluate(model, p, which, values, by)
    w, dw = np.empty(model.waves), np.empty((free, model.waves))
    for j in range(model.waves):
        w[j] = values[model.frequency_at[j]]
        for k in range(free):
            dw[k, j] = by[k, model.frequency_at[j]]
    return values, by, w, dw


@allocating_helper
def group_at(model, group, values, by):  # type: ignore[no-untyped-def]
    """Return the coefficients of a group with their derivatives."""
    co, slopes = np.empty(model.coefficients), np.empty((by.shape[0], model.coefficients))
    coefficients_of(model, group, values, by, co, slopes)
    return co, slopes


@allocating_helper
def map_of(model, group, t, y, p, which, out, jac):  # type: ignore[no-untyped-def]
    """Write the n rows of a group at a state; their derivatives where ``jac`` has space."""
    n, free = y.shape[0], which.shape[0] if jac.shape[0] > 0 else 0
    values, by, w, dw = numbers_at(model, p, which[:free])
    (co, slopes), row = group_at(model, group, values, by), np.empty(n)
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
    map_of(model, model.group_of[piece], t, y, p, which, out, jac)


def reset(model, k, t, y, p, which, y1, jac):  # type: ignore[no-untyped-def]
    """Write the state after the reset at a surface (``reset_signature``)."""
    map_of(model, model.reset_at[k], t, y, p, which, y1, jac)


@allocating_helper
def seen(model, c, t, y, p, which, grad):  # type: ignore[no-untyped-def]
    """Return an observable, with its gradient."""
    n, free, group = y.shape[0], which.shape[0] if grad.shape[0] > 0 else 0, model.observable_of[c]
    values, by, w, dw = numbers_at(model, p, which[:free])
    (co, slopes), row = group_at(model, group, values, by), np.empty(n)
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
    values, by, w, dw = numbers_at(model, p, which[:free])
    co, slopes = group_at(model, group, values, by)
    moved = model.group_of[mode]
    own, owns = group_at(model, moved, values, by)
    weights, row = np.empty(n), np.empty(n)
    _, total, second = row_at(model, group, 0, co, t, y, w, weights)
    for m in range(grad.shape[0]):
        grad[m] = 0.0
    first = model.slope_at[model.row_of[group]]
    for k in range(first, model.slope_at[model.row_of[group] + 1]):
        i = model.columns[k]
        f, f_t, _ = row_at(model, moved, i, own, t, y, w, row)
        total += weights[i] * f
        if grad.shape[0] == 0:
            continue
        grad[0] += weights[i] * f_t
        for j in range(n):
            grad[1 + j] += weights[i] * row[j]
        for q in range(free):
            by_q, _ = varied_row(model, moved, i, own, owns[q], t, y, w, dw[q])
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
