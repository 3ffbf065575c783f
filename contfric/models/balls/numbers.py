"""Balls: real numbers that are known up to a radius (Arb, by python-flint).

Every operation on balls returns a ball that contains the results for all numbers in its arguments. So an
inequality that holds for balls holds for the numbers.

F. Johansson, Arb: efficient arbitrary-precision midpoint-radius interval arithmetic, IEEE Trans. Comput. 66
(2017) 1281-1292.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import arb, arb_mat

Vector = list[arb]


def column(values: Sequence[arb]) -> arb_mat:
    """Return numbers as a matrix of one column."""
    return arb_mat(len(values), 1, list(values))


def numbers(matrix: arb_mat) -> Vector:
    """Return the entries of a matrix, row by row."""
    return list(matrix.entries())


def around(centre: arb, radius: arb) -> arb:
    """Return a ball that contains all numbers within a radius of a centre (itself a ball, or exact)."""
    return centre + arb(0, radius.abs_upper())


def zeros(rows: int, columns: int) -> list[Vector]:
    """Return rows of zeros that can be filled."""
    return [[arb(0) for _ in range(columns)] for _ in range(rows)]


def row_norm(matrix: arb_mat) -> arb:
    """Return an upper bound of the largest row sum of moduli: the operator norm of the maximum norm."""
    rows, columns = matrix.nrows(), matrix.ncols()
    sums = [
        sum((matrix[i, j].abs_upper() for j in range(columns)), arb(0)).upper() for i in range(rows)
    ]
    return max(sums, key=float)
