"""Elimination with pivots by rows, for the few unknowns of an implicit step; nothing is allocated."""

from __future__ import annotations

from contfric.compiled import helper


@helper
def lu(matrix, pivots, size):  # type: ignore[no-untyped-def]
    """Factorise a matrix in place, with pivots by rows; tell whether it is regular."""
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivots[k] = best
        if best != k:
            for j in range(size):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        if not abs(matrix[k, k]) > 0.0:
            return False
        inverse = 1.0 / matrix[k, k]
        for i in range(k + 1, size):
            factor = matrix[i, k] * inverse
            matrix[i, k] = factor
            if factor != 0.0:
                for j in range(k + 1, size):
                    matrix[i, j] -= factor * matrix[k, j]
    return True


@helper
def lu_solve(matrix, pivots, size, right, columns):  # type: ignore[no-untyped-def]
    """Solve in place for the first columns of ``right``."""
    for k in range(size):
        if pivots[k] != k:
            for c in range(columns):
                right[k, c], right[pivots[k], c] = right[pivots[k], c], right[k, c]
    for i in range(size):
        for j in range(i):
            factor = matrix[i, j]
            if factor != 0.0:
                for c in range(columns):
                    right[i, c] -= factor * right[j, c]
    for back in range(size):
        i = size - 1 - back
        for j in range(i + 1, size):
            factor = matrix[i, j]
            if factor != 0.0:
                for c in range(columns):
                    right[i, c] -= factor * right[j, c]
        inverse = 1.0 / matrix[i, i]
        for c in range(columns):
            right[i, c] *= inverse
