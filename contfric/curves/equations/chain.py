"""The chain of segments with one border row, compiled: its blocks, and solves with it or its transpose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.cyclic import (
    Elimination,
    elimination_workspace,
    finish,
    next_rows,
    start_border,
    take_out,
)
from contfric.bvp.equations import segment_rows
from contfric.compiled import allocating_helper, helper
from contfric.curves.equations.bending import DIFFERENCE


class BorderedWorkspace(NamedTuple):
    """Workspace for the bordered solves of one chain; allocated once.

    Attributes
    ----------
    a, b : blocks of the Jacobian on both joints of each segment, shape (N, m, m)
    columns : its derivatives by the free parameters, shape (N, m, q)
    v, u : null vectors of the chain and of its transpose, shape (N, m)
    even : second-order response of the orbit to its null vector, shape (N, m)
    work, d, e, s, close, close_w : for the elimination with one border row
    along, other : a direction of a segment, shape (2 + n,)
    bent, plus : derivatives of the flow's and of an observable's in a direction, shape (n, 2 + n + q)
    divided : the same of a divided exit row, shape (2 + n + q,)
    start, after : displaced joints, shape (m,)
    numbers : scratch for the flow, shape (8,)
    difference : step of the differences, and whether any was taken, shape (2,)
    """

    a: FloatArray
    b: FloatArray
    columns: FloatArray
    v: FloatArray
    u: FloatArray
    even: FloatArray
    work: Elimination
    d: FloatArray
    e: FloatArray
    s: FloatArray
    close: FloatArray
    close_w: FloatArray
    along: FloatArray
    other: FloatArray
    bent: FloatArray
    plus: FloatArray
    divided: FloatArray
    start: FloatArray
    after: FloatArray
    numbers: FloatArray
    difference: FloatArray


@allocating_helper
def bordered_workspace(count, m, free):  # type: ignore[no-untyped-def]
    """Return the workspace for chains of ``count`` segments and ``free`` parameters."""
    one = max(1 - count, 1)  # 1, but no literal
    return BorderedWorkspace(
        np.empty((count, m, m)),
        np.empty((count, m, m)),
        np.empty((count, m, free)),
        np.empty((count, m)),
        np.empty((count, m)),
        np.empty((count, m)),
        elimination_workspace(count, m, one, one),
        np.empty((1, count, m)),
        np.empty((1, 1)),
        np.empty((1, 1)),
        np.empty((m, m)),
        np.zeros((m, 1)),
        np.empty(1 + m),
        np.empty(1 + m),
        np.empty((m - 1, 1 + m + free)),
        np.empty((m - 1, 1 + m + free)),
        np.empty(1 + m + free),
        np.empty(m),
        np.empty(m),
        np.empty(8),
        np.array([DIFFERENCE, 0.0]),
    )


@helper
def fill_blocks(way, z):  # type: ignore[no-untyped-def]
    """Write the blocks of the Jacobian on both joints of each segment, and its columns of the parameters."""
    functions, layout, p, which = way.functions, way.layout, way.p, way.which
    (count, m), equations = z.shape, way.workspace.equations
    rows, bordered = way.workspace.elimination.rows, way.workspace.bordered
    for i in range(count):
        after = z[i + 1] if i + 1 < count else equations.last
        worst = segment_rows(functions, layout, i, m, z[i], after, p, which, equations, rows)
        if worst == np.inf:
            return False
        for j in range(m):
            for k in range(m):
                bordered.a[i, j, k] = rows[m + j, m + k]
                bordered.b[i, j, k] = rows[m + j, 2 * m + k]
            for k in range(which.shape[0]):
                bordered.columns[i, j, k] = rows[m + j, 3 * m + k]
    return True


@helper
def chain_solve(bordered, sign, column, rhs, transposed, close, pencil):  # type: ignore[no-untyped-def]
    """Solve the chain (its transpose) with one border row, which is in d, e, s of the workspace.

    ``column`` stands next to the rows, shape (N, m); ``rhs`` on their right-hand sides. False if singular.
    """
    work, rows = bordered.work, bordered.work.rows
    count, m = column.shape
    for i in range(m):
        for j in range(m):
            unit = 1.0 if i == j else 0.0
            bordered.close[i, j] = unit if transposed else sign * close[i, j]
    start_border(work, bordered.d, bordered.e, bordered.s, m)
    for i in range(count):
        if i > 0:
            next_rows(work, bordered.d, i, m)
        at = 0 if i == 0 else m
        after = i + 1 if i + 1 < count else 0
        for j in range(m):
            for k in range(rows.shape[1]):
                rows[m + j, k] = 0.0
            for k in range(m):
                if not transposed:
                    rows[m + j, at + k] = bordered.a[i, j, k]
                    rows[m + j, 2 * m + k] = bordered.b[i, j, k]
                    continue
                value = bordered.b[i, k, j]
                if i + 1 == count:
                    value = 0.0
                    for n in range(m):
                        value += bordered.b[i, k, n] * sign * close[n, j]
                rows[m + j, at + k] = value
                rows[m + j, 2 * m + k] = bordered.a[after, k, j]
            row = after if transposed else i
            rows[m + j, 3 * m] = column[row, j]
            rows[m + j, 3 * m + 1] = rhs[row, j]
        if i > 0 and not take_out(work, i, m):
            return False
    return finish(work, bordered.close, bordered.close_w, bordered.d, pencil[0], pencil[1])


@helper
def set_border(bordered, row, corner, value):  # type: ignore[no-untyped-def]
    """Set the border row: on the unknowns (times ``1 - corner``), on the extra one, right-hand side."""
    for i in range(row.shape[0]):
        for j in range(row.shape[1]):
            bordered.d[0, i, j] = (1.0 - corner) * row[i, j]
    bordered.e[0, 0] = corner
    bordered.s[0, 0] = value
