"""Linear algebra of a cyclic chain: cost in proportion to the number of segments.

Unknowns are the joints ``z_0 .. z_{N-1}`` (m numbers each) and q parameters w::

    A_i z_i + B_i z_{i+1} + C_i w = r_i,   i = 0 .. N-1,   z_N = K z_0 + k w,
    sum_i D_i z_i + E w = s                                  (q border rows).

One joint after the other is eliminated: the rows that link ``z_0`` and ``z_i`` stand above those that
link ``z_i`` and ``z_{i+1}``, and Gaussian elimination with row exchanges over all 2m rows takes
``z_i`` out of m of them (S. J. Wright, SIAM J. Sci. Stat. Comput. 13 (1992) 742-764). The border rows
are carried along. What is left is one small system for ``z_0`` and w, and the pencil (P, Q) of the
orbit: ``P z_0 + Q z_N = 0`` is the linear map of one turn, whose eigenvalues are the multipliers.
"""

from __future__ import annotations

import numpy as np

from contfric.compiled import helper


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
        if pivot == 0.0 or not np.isfinite(pivot):
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


@helper
def eliminate_joint(rows, border, m):  # type: ignore[no-untyped-def]
    """Take the columns m .. 2m out of the last m rows and of the border; False if singular."""
    width = rows.shape[1]
    for j in range(m):
        col = m + j
        best = j
        for row in range(j + 1, 2 * m):
            if abs(rows[row, col]) > abs(rows[best, col]):
                best = row
        pivot = rows[best, col]
        if pivot == 0.0 or not np.isfinite(pivot):
            return False
        if best != j:
            swap_rows(rows, j, best)
        for row in range(j + 1, 2 * m):
            factor = rows[row, col] / pivot
            if factor != 0.0:
                for k in range(width):
                    rows[row, k] -= factor * rows[j, k]
        for row in range(border.shape[0]):
            factor = border[row, col] / pivot
            if factor != 0.0:
                for k in range(width):
                    border[row, k] -= factor * rows[j, k]
    return True


@helper
def solve_cyclic(a, b, c, r, close, close_w, d, e, s, z, w, p, q):  # type: ignore[no-untyped-def]
    """Solve the chain for several right-hand sides.

    Parameters
    ----------
    a, b : blocks on z_i and z_{i+1}, shape (N, m, m)
    c : blocks on the parameters, shape (N, m, q)
    r : right-hand sides, shape (N, m, right)
    close, close_w : closure K (m, m) and k (m, q)
    d, e, s : border rows on the joints (q, N, m), on the parameters (q, q), right (q, right)
    z, w : solution, shapes (N, m, right) and (q, right)
    p, q : pencil of one turn, shape (m, m) each

    Returns
    -------
    bool
        False if the system is singular to working precision or not finite.
    """
    count, m = a.shape[0], a.shape[1]
    free, right = c.shape[2], r.shape[2]
    width = 3 * m + free + right
    rows = np.zeros((2 * m, width))
    kept = np.zeros((count, m, width))
    border = np.zeros((free, width))
    first_border(border, d, e, s, m)
    for i in range(count):
        if i > 0:
            shift_rows(rows, border, m)
        fill_rows(rows, a, b, c, r, i, 0 if i == 0 else m)
        if i == 0:
            continue
        if i + 1 < count:
            for k in range(free):
                for j in range(m):
                    border[k, 2 * m + j] = d[k, i + 1, j]
        if not eliminate_joint(rows, border, m):
            return False
        for j in range(m):
            for k in range(width):
                kept[i, j, k] = rows[j, k]
    for i in range(m):
        for j in range(m):
            p[i, j] = rows[m + i, j]
            q[i, j] = rows[m + i, 2 * m + j]
    if not solve_ends(rows, border, close, close_w, m, free, z, w):
        return False
    back_substitute(kept, close, close_w, z, w, m, free)
    return True


@helper
def first_border(border, d, e, s, m):  # type: ignore[no-untyped-def]
    """Start the border rows: their parts on z_0, z_1, the parameters and the right-hand sides."""
    free, right = e.shape[0], s.shape[1]
    for k in range(free):
        for j in range(m):
            border[k, j] = d[k, 0, j]
            if d.shape[1] > 1:
                border[k, 2 * m + j] = d[k, 1, j]
        for j in range(free):
            border[k, 3 * m + j] = e[k, j]
        for j in range(right):
            border[k, 3 * m + free + j] = s[k, j]


@helper
def fill_rows(rows, a, b, c, r, i, at):  # type: ignore[no-untyped-def]
    """Write the equations of segment i to the last m rows, with z_i in the columns from ``at``."""
    m, free, right = a.shape[1], c.shape[2], r.shape[2]
    for row in range(m):
        for j in range(3 * m):
            rows[m + row, j] = 0.0
        for j in range(m):
            rows[m + row, at + j] = a[i, row, j]
            rows[m + row, 2 * m + j] = b[i, row, j]
        for j in range(free):
            rows[m + row, 3 * m + j] = c[i, row, j]
        for j in range(right):
            rows[m + row, 3 * m + free + j] = r[i, row, j]


@helper
def shift_rows(rows, border, m):  # type: ignore[no-untyped-def]
    """Make the rows that remain (last m) the first, with z_{i+1} in the place of z_i."""
    for row in range(m):
        for k in range(rows.shape[1]):
            rows[row, k] = rows[m + row, k]
        for j in range(m):
            rows[row, m + j] = rows[m + row, 2 * m + j]
            rows[row, 2 * m + j] = 0.0
    for row in range(border.shape[0]):
        for j in range(m):
            border[row, m + j] = border[row, 2 * m + j]
            border[row, 2 * m + j] = 0.0


@helper
def solve_ends(rows, border, close, close_w, m, free, z, w):  # type: ignore[no-untyped-def]
    """Solve the small system for z_0 and w that is left when all other joints are eliminated."""
    size = m + free
    right = z.shape[2]
    small = np.zeros((size, size))
    rhs = np.zeros((size, right))
    for i in range(size):
        for j in range(m):
            last = rows[m + i, 2 * m + j] if i < m else border[i - m, 2 * m + j]
            for k in range(m):
                small[i, k] += last * close[j, k]
            for k in range(free):
                small[i, m + k] += last * close_w[j, k]
        for j in range(m):
            small[i, j] += rows[m + i, j] if i < m else border[i - m, j]
        for k in range(free):
            small[i, m + k] += rows[m + i, 3 * m + k] if i < m else border[i - m, 3 * m + k]
        for k in range(right):
            at = 3 * m + free + k
            rhs[i, k] = rows[m + i, at] if i < m else border[i - m, at]
    if not dense_solve(small, rhs):
        return False
    for k in range(right):
        for j in range(m):
            z[0, j, k] = rhs[j, k]
        for j in range(free):
            w[j, k] = rhs[m + j, k]
    return True


@helper
def back_substitute(kept, close, close_w, z, w, m, free):  # type: ignore[no-untyped-def]
    """Fill z_{N-1} .. z_1 from the kept rows."""
    count, right = z.shape[0], z.shape[2]
    after = np.zeros((m, right))
    for i in range(m):
        for k in range(right):
            for j in range(m):
                after[i, k] += close[i, j] * z[0, j, k]
            for j in range(free):
                after[i, k] += close_w[i, j] * w[j, k]
    for i in range(count - 1, 0, -1):
        for j in range(m - 1, -1, -1):
            for k in range(right):
                value = kept[i, j, 3 * m + free + k]
                for n in range(m):
                    value -= kept[i, j, n] * z[0, n, k] + kept[i, j, 2 * m + n] * after[n, k]
                for n in range(free):
                    value -= kept[i, j, 3 * m + n] * w[n, k]
                for n in range(j + 1, m):
                    value -= kept[i, j, m + n] * z[i, n, k]
                z[i, j, k] = value / kept[i, j, m + j]
        for j in range(m):
            for k in range(right):
                after[j, k] = z[i, j, k]


@helper
def turn_map(p, q, close, out):  # type: ignore[no-untyped-def]
    """Return the linear map of one turn on z_0: ``(Q K) M = -P``; False where it is infinite."""
    m = p.shape[0]
    left = np.zeros((m, m))
    for i in range(m):
        for j in range(m):
            out[i, j] = -p[i, j]
            for k in range(m):
                left[i, j] += q[i, k] * close[k, j]
    return dense_solve(left, out)
