"""Linear algebra of a cyclic chain: cost in proportion to the number of segments.

Unknowns are the joints ``z_0 .. z_{N-1}`` (m numbers each) and q parameters w::

    A_i z_i + B_i z_{i+1} + C_i w = r_i,   i = 0 .. N-1,   z_N = K z_0 + k w,
    sum_i D_i z_i + E w = s                                  (q border rows).

One joint after the other is eliminated: the rows that link ``z_0`` and ``z_i`` stand above those that
link ``z_i`` and ``z_{i+1}``, and Gaussian elimination with row exchanges over all 2m rows takes
``z_i`` out of m of them (S. J. Wright, SIAM J. Sci. Stat. Comput. 13 (1992) 742-764). The border rows
are carried along. What is left is one small system for ``z_0`` and w, and the pencil (P, Q) of the
orbit: ``P z_0 + Q z_N = 0`` is the linear map of one turn, whose eigenvalues are the multipliers.

Where the part of a chain between two holds folds by itself, its last joint has no pivot in these rows: only a
border row knows of it. Such a pivot would be rounding, and so would be all that the border row is left with.
The two rows change places: the border row is the pivot, with its parts on all later joints, and the row of
the chain is carried along in its stead. The other rows of the chain, and the pencil, are those of the plain
elimination. What is carried along may be the only pivot of another unknown (a slide of no length between two
holds: the velocity at its end): then it comes back by the same exchange, with the share that it has of the
border's parts on later joints.

Nothing is stored but what the back substitution needs: the rows of a segment are written where they
are eliminated. The columns are ``[z_0 | z_i | z_{i+1} | w | right-hand sides]``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.compiled import allocating_helper, helper, inlined_helper
from contfric.compiling.vectors import subtract_eight

#: Share of an entry of the border row below which it is the pivot itself: above it that row keeps at least
#: half of its digits. Whether other pivots are small or rounding need not be told.
_WEAK = 1e-8


class Elimination(NamedTuple):
    """Workspace for the elimination of one chain; allocated once, used for every solve.

    Attributes
    ----------
    rows : the 2m rows at work, shape (2m, width)
    kept : what the back substitution needs, shape (N, m, width)
    border : border rows, shape (q, width)
    small, rhs : the system that is left, shapes (m + q, m + q) and (m + q, right)
    after : shape (m, right)
    z, w : solution, shapes (N, m, right) and (q, right)
    shares : share of the border's parts on later joints that each kept row has, shape (N, m)
    carried : how many rows have changed places with the border row; the share of what is carried along
    """

    rows: FloatArray
    kept: FloatArray
    border: FloatArray
    small: FloatArray
    rhs: FloatArray
    after: FloatArray
    z: FloatArray
    w: FloatArray
    shares: FloatArray
    carried: FloatArray


@allocating_helper
def elimination_workspace(count, m, free, right):  # type: ignore[no-untyped-def]
    """Return the workspace for a chain of ``count`` segments with ``free`` parameters."""
    width = 3 * m + free + right
    return Elimination(
        np.empty((2 * m, width)),
        np.empty((count, m, width)),
        np.empty((free, width)),
        np.empty((m + free, m + free)),
        np.empty((m + free, right)),
        np.empty((m, right)),
        np.empty((count, m, right)),
        np.empty((free, right)),
        np.zeros((count, m)),
        np.array([0.0, 1.0]),
    )


@helper
def dense_solve(a, b):  # type: ignore[no-untyped-def]
    """Solve ``a x = b`` in place by partial pivoting; False where a pivot is zero or not finite."""
    n = a.shape[0]
    for col in range(n):
        best = col
        for row in range(col + 1, n):
            if abs(a[row, col]) > abs(a[best, col]):
                best = row
        pivot = a[best, col]
        if not 0.0 < abs(pivot) < np.inf:
            return False
        if best != col:
            swap_rows(a, col, best)
            swap_rows(b, col, best)
        for row in range(col + 1, n):
            factor = a[row, col] / pivot
            if factor != 0.0:
                for k in range(col + 1, n):
                    a[row, k] -= factor * a[col, k]
                for k in range(b.shape[1]):
                    b[row, k] -= factor * b[col, k]
    for col in range(n - 1, -1, -1):
        for k in range(b.shape[1]):
            value = b[col, k]
            for j in range(col + 1, n):
                value -= a[col, j] * b[j, k]
            b[col, k] = value / a[col, col]
    return True


@helper
def swap_rows(a, i, j):  # type: ignore[no-untyped-def]
    """Exchange two rows."""
    for k in range(a.shape[1]):
        a[i, k], a[j, k] = a[j, k], a[i, k]


@inlined_helper
def subtract_multiple(target, row, source, j, factor, begin, end):  # type: ignore[no-untyped-def]
    """Subtract a multiple of a part of a row, eight numbers at a time."""
    k = begin
    while k + 8 <= end:
        subtract_eight(target, row, source, j, factor, k)
        k += 8
    while k < end:
        target[row, k] -= factor * source[j, k]
        k += 1


@helper
def subtract(target, row, source, j, factor, m, col):  # type: ignore[no-untyped-def]
    """Subtract a multiple of a row; the columns m .. col of both are eliminated already."""
    subtract_multiple(target, row, source, j, factor, 0, m)
    subtract_multiple(target, row, source, j, factor, col + 1, source.shape[1])


@helper
def eliminate_joint(rows, border, m, shares, i, carried):  # type: ignore[no-untyped-def]
    """Take the columns of joint i, m .. 2m, out of the last m rows and of the border; False if singular.

    Where the only border row is the pivot, the share of what is kept is written to ``shares``.
    """
    free_to = border.shape[0] == 1
    for j in range(m):
        col = m + j
        best, largest = j, abs(rows[j, col])
        for row in range(j + 1, 2 * m):
            size = abs(rows[row, col])
            if size > largest:
                best, largest = row, size
        weak = free_to and largest < _WEAK * abs(border[0, col])
        if not largest < np.inf or (largest == 0.0 and not weak):
            return False
        if best != j:
            swap_rows(rows, j, best)
        scale = 1.0 / rows[j, col] if largest > 0.0 else 0.0
        for row in range(j + 1, 2 * m):
            factor = rows[row, col] * scale
            if factor != 0.0:
                subtract(rows, row, rows, j, factor, m, col)
        if weak:
            for k in range(rows.shape[1]):
                rows[j, k], border[0, k] = border[0, k], rows[j, k]
            factor = border[0, col] / rows[j, col]
            subtract(border, 0, rows, j, factor, m, col)
            shares[i, j] = carried[1]
            carried[0], carried[1] = carried[0] + 1.0, -factor * carried[1]
            continue
        for row in range(border.shape[0]):
            factor = border[row, col] * scale
            if factor != 0.0:
                subtract(border, row, rows, j, factor, m, col)
    return True


@helper
def start_border(workspace, d, e, s, m):  # type: ignore[no-untyped-def]
    """Start the border rows: their parts on z_0, z_1, the parameters and the right-hand sides."""
    border, free, right = workspace.border, e.shape[0], s.shape[1]
    if workspace.carried[0] > 0.0:
        for i in range(workspace.shares.shape[0]):
            for j in range(m):
                workspace.shares[i, j] = 0.0
        workspace.carried[0], workspace.carried[1] = 0.0, 1.0
    for k in range(free):
        for j in range(m):
            border[k, j] = d[k, 0, j]
            border[k, m + j] = 0.0
            border[k, 2 * m + j] = d[k, 1, j] if d.shape[1] > 1 else 0.0
        for j in range(free):
            border[k, 3 * m + j] = e[k, j]
        for j in range(right):
            border[k, 3 * m + free + j] = s[k, j]


@helper
def next_rows(workspace, d, i, m):  # type: ignore[no-untyped-def]
    """Make the rows that remain (last m) the first ones of segment i, z_i in its place."""
    rows, border, width = workspace.rows, workspace.border, workspace.rows.shape[1]
    for row in range(m):
        for k in range(m):
            rows[row, k] = rows[m + row, k]
            rows[row, m + k] = rows[m + row, 2 * m + k]
            rows[row, 2 * m + k] = 0.0
        for k in range(3 * m, width):
            rows[row, k] = rows[m + row, k]
    share, count = workspace.carried[1], d.shape[1]
    for row in range(border.shape[0]):
        for k in range(m):
            border[row, m + k] = border[row, 2 * m + k]
            border[row, 2 * m + k] = share * d[row, i + 1, k] if i + 1 < count else 0.0


@helper
def take_out(workspace, i, m):  # type: ignore[no-untyped-def]
    """Eliminate joint i and keep its rows; False if singular."""
    rows, kept = workspace.rows, workspace.kept
    if not eliminate_joint(rows, workspace.border, m, workspace.shares, i, workspace.carried):
        return False
    for j in range(m):
        for k in range(rows.shape[1]):
            kept[i, j, k] = rows[j, k]
    return True


@helper
def finish(workspace, close, close_w, d, p, q):  # type: ignore[no-untyped-def]
    """Solve for all unknowns when every joint but the first is out, and fill the pencil (p, q).

    ``d`` are the border rows, one of which may be a pivot.
    """
    rows, m = workspace.rows, close.shape[0]
    for i in range(m):
        for j in range(m):
            p[i, j] = rows[m + i, j]
            q[i, j] = rows[m + i, 2 * m + j]
    if not solve_ends(
        rows,
        workspace.border,
        close,
        close_w,
        workspace.small,
        workspace.rhs,
        workspace.z,
        workspace.w,
    ):
        return False
    back_substitute(workspace, close, close_w, d)
    return True


@helper
def solve_ends(rows, border, close, close_w, small, rhs, z, w):  # type: ignore[no-untyped-def]
    """Solve the small system for z_0 and w that is left when all other joints are eliminated."""
    m, free, right = z.shape[1], w.shape[0], z.shape[2]
    for i in range(m + free):
        source, row = (rows, m + i) if i < m else (border, i - m)
        for j in range(m):
            small[i, j] = source[row, j]
        for k in range(free):
            small[i, m + k] = source[row, 3 * m + k]
        for k in range(right):
            rhs[i, k] = source[row, 3 * m + free + k]
        for j in range(m):
            last = source[row, 2 * m + j]
            if last != 0.0:
                for k in range(m):
                    small[i, k] += last * close[j, k]
                for k in range(free):
                    small[i, m + k] += last * close_w[j, k]
    if not dense_solve(small, rhs):
        return False
    for k in range(right):
        for j in range(m):
            z[0, j, k] = rhs[j, k]
        for j in range(free):
            w[j, k] = rhs[m + j, k]
    return True


@helper
def back_substitute(workspace, close, close_w, d):  # type: ignore[no-untyped-def]
    """Fill z_{N-1} .. z_1 from the kept rows; that of a border row has parts on all later joints."""
    kept, z, w, after = workspace.kept, workspace.z, workspace.w, workspace.after
    shares, exchanged = workspace.shares, workspace.carried[0] > 0.0
    count, m, right = z.shape
    free = w.shape[0]
    for i in range(m):
        for k in range(right):
            value = 0.0
            for j in range(m):
                value += close[i, j] * z[0, j, k]
            for j in range(free):
                value += close_w[i, j] * w[j, k]
            after[i, k] = value
    for i in range(count - 1, 0, -1):
        for j in range(m - 1, -1, -1):
            for k in range(0, right, 2):  # two columns for each number that is loaded
                other = min(k + 1, right - 1)
                first, second = kept[i, j, 3 * m + free + k], kept[i, j, 3 * m + free + other]
                for n in range(m):
                    one, two = kept[i, j, n], kept[i, j, 2 * m + n]
                    first -= one * z[0, n, k] + two * after[n, k]
                    second -= one * z[0, n, other] + two * after[n, other]
                for n in range(free):
                    one = kept[i, j, 3 * m + n]
                    first, second = first - one * w[n, k], second - one * w[n, other]
                for n in range(j + 1, m):
                    one = kept[i, j, m + n]
                    first, second = first - one * z[i, n, k], second - one * z[i, n, other]
                if exchanged and shares[i, j] != 0.0:
                    for later in range(i + 2, count):
                        for n in range(m):
                            one = shares[i, j] * d[0, later, n]
                            first -= one * z[later, n, k]
                            second -= one * z[later, n, other]
                pivot = kept[i, j, m + j]
                z[i, j, k], z[i, j, other] = first / pivot, second / pivot
        for j in range(m):
            for k in range(right):
                after[j, k] = z[i, j, k]


@helper
def turn_map(p, q, close, left, out):  # type: ignore[no-untyped-def]
    """Return the linear map of one turn on z_0: ``(Q K) M = -P``; False where it is infinite."""
    m = p.shape[0]
    for i in range(m):
        for j in range(m):
            out[i, j] = -p[i, j]
            value = 0.0
            for k in range(m):
                value += q[i, k] * close[k, j]
            left[i, j] = value
    return dense_solve(left, out)
