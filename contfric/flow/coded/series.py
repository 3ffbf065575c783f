"""Taylor terms of affine modes from tables: what the closed form takes (:mod:`contfric.flow.layouts`)."""

from __future__ import annotations

import numpy as np

from contfric.compiled import allocating_helper, helper
from contfric.flow.coded.operations import evaluate
from contfric.flow.coded.tables import coefficients_of, wave_shift


@allocating_helper
def group_entries(model, group, p, which, co, jac):  # type: ignore[no-untyped-def]
    """Write the coefficients of a group at some parameters, and their derivatives."""
    values, by = np.empty(model.values), np.empty((which.shape[0], model.values))
    evaluate(model, p, which, values, by)
    coefficients_of(model, group, values, by, co, jac)


def entries(model, piece, p, which, co, jac):  # type: ignore[no-untyped-def]
    """Write the coefficients of a piece."""
    group_entries(model, model.group_of[piece], p, which, co, jac)


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
def group_audible(model, group, co, on):  # type: ignore[no-untyped-def]
    """Mark the harmonics whose factors are not zero."""
    shift = wave_shift(model, group)
    for s in range(model.wave_at[model.row_of[group]], model.wave_at[model.row_of[group + 1]]):
        at = shift + 2 * s
        if co[at] != 0.0 or co[at + 1] != 0.0:
            on[model.harmonics[s]] = 1.0


def audible(model, piece, co, on):  # type: ignore[no-untyped-def]
    """Mark the harmonics of a piece."""
    group_audible(model, model.group_of[piece], co, on)


def audible_seen(model, c, co, on):  # type: ignore[no-untyped-def]
    """Mark the harmonics of an observable."""
    group_audible(model, model.observable_of[c], co, on)


@helper
def group_rows(model, group, co, y, c, s, out):  # type: ignore[no-untyped-def]
    """Write the rows of a group at a state."""
    row = model.row_of[group]
    shift = wave_shift(model, group)
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
    group_rows(model, model.group_of[piece], co, y, c, s, out)


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
    n, group = y.shape[0], model.group_of[piece]
    row, shift = model.row_of[group], wave_shift(model, group)
    first = model.slope_at[row]
    for i in range(n):
        series[0, i] = y[i]
        for m in range(1, terms + 1):
            series[m, i] = 0.0
    add_waves(model, row, n, shift, co, c, s, w, h, terms, series)
    for m in range(terms):
        f, y_m, y_next, begin = h / (m + 1.0), series[m], series[m + 1], first
        for i in range(n):
            total, end = 0.0, model.slope_at[row + i + 1]
            for k in range(begin, end):
                # a whole number without a sign: else a place counted from the end is asked for first
                total += co[np.uint64(k - first)] * y_m[np.uint64(model.columns[k])]
            y_next[i] += f * total
            begin = end


def carry(model, piece, co, h, terms, columns):  # type: ignore[no-untyped-def]
    """Multiply a matrix by exp(A h): ``v + h A (v + h A / 2 (v + ...))``."""
    n, count = columns.shape
    row = model.row_of[model.group_of[piece]]
    first = model.slope_at[row]
    sums, other = columns.copy(), np.empty((n, count))
    for m in range(terms, 0, -1):
        f = h / m
        for i in range(n):
            into, start = other[i], columns[i]
            for j in range(count):
                into[j] = start[j]
            for k in range(model.slope_at[row + i], model.slope_at[row + i + 1]):
                a, source = f * co[k - first], sums[model.columns[k]]
                for j in range(count):
                    into[j] += a * source[j]
        sums, other = other, sums
    for i in range(n):
        for j in range(count):
            columns[i, j] = sums[i, j]


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
    n, group = z.shape[0], model.group_of[piece]
    row, shift = model.row_of[group], wave_shift(model, group)
    first = model.slope_at[row]
    for i in range(n):
        out[0, i] = z[i]
        for m in range(1, terms + 1):
            out[m, i] = 0.0
    add_varied_waves(model, row, n, shift, co, by, waves, w, dw, h, terms, out)
    for m in range(terms):
        f, y_m, z_m, z_next, begin = h / (m + 1.0), series[m], out[m], out[m + 1], first
        for i in range(n):
            total, end = 0.0, model.slope_at[row + i + 1]
            for k in range(begin, end):
                j, q = np.uint64(model.columns[k]), np.uint64(k - first)
                total += co[q] * z_m[j] + by[q] * y_m[j]
            z_next[i] += f * total
            begin = end


def sums(model, piece, co, d, row, column, own):  # type: ignore[no-untyped-def]
    """Add up the sizes of the matrix in units ``d``."""
    begin = model.row_of[model.group_of[piece]]
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
    shift = wave_shift(model, group)
    first, last = model.slope_at[row], model.slope_at[row + 1]
    for m in range(terms + 1):
        total = 0.0
        for k in range(first, last):
            total += co[k - first] * series[m, model.columns[k]]
        poly[m] = total
    for k in range(model.wave_at[row], model.wave_at[row + 1]):
        j, at = model.harmonics[k], shift + 2 * k
        cosine, sine = co[at] * cs[j] + co[at + 1] * sn[j], co[at + 1] * cs[j] - co[at] * sn[j]
        for m in range(terms + 1):
            poly[m] += cosine
            f = h / (m + 1.0)
            cosine, sine = f * w[j] * sine, -f * w[j] * cosine
