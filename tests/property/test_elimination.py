"""Elimination of random chains with a border row, against the dense system."""

from __future__ import annotations

import numpy as np
import restarts
from numba import types

import contfric as cf
from contfric.base.arrays import FloatArray
from contfric.bvp.cyclic import elimination_workspace, finish, next_rows, start_border, take_out
from contfric.compiled import blocks, kernel, matrix


@kernel(
    types.boolean(blocks, blocks, matrix, matrix, matrix, blocks, matrix, matrix, blocks, matrix)
)
def solve_chain(a, b, c, r, close, d, e, s, z, w):  # type: ignore[no-untyped-def]
    """Solve ``a_i z_i + b_i z_{i+1} + c_i w = r_i`` with one border row; False if singular."""
    count, m = r.shape
    one = max(1 - count, 1)  # 1, but no literal
    work = elimination_workspace(count, m, one, one)
    start_border(work, d, e, s, m)
    rows = work.rows
    for i in range(count):
        if i > 0:
            next_rows(work, d, i, m)
        at = 0 if i == 0 else m
        for j in range(m):
            for k in range(rows.shape[1]):
                rows[m + j, k] = 0.0
            for k in range(m):
                rows[m + j, at + k] = a[i, j, k]
                rows[m + j, 2 * m + k] = b[i, j, k]
            rows[m + j, 3 * m], rows[m + j, 3 * m + 1] = c[i, j], r[i, j]
        if i > 0 and not take_out(work, i, m):
            return False
    pencil = np.empty((2, m, m))
    if not finish(work, close, np.zeros((m, 1)), d, pencil[0], pencil[1]):
        return False
    for i in range(count):
        for j in range(m):
            z[i, j, 0] = work.z[i, j, 0]
    w[0, 0] = work.w[0, 0]
    return True


def _weak(a: FloatArray, b: FloatArray, rng: np.random.Generator, both: bool) -> None:
    """Leave rounding as pivots of one unknown, and the same row as the only pivot of another one."""
    count, m, _ = a.shape
    i, size = int(rng.integers(1, count)), float(10.0 ** rng.uniform(-17.0, -9.0))
    k, other = (int(n) for n in rng.permutation(m)[:2])
    row = int(rng.integers(m))
    b[i - 1, :, k] = a[i, :, k] = 0.0
    b[i - 1, row, k] = size
    if both:
        kept = b[i - 1, row, other]
        b[i - 1, :, other] = a[i, :, other] = 0.0
        b[i - 1, row, other] = kept


def test_a_border_row_is_pivot_where_no_other_is() -> None:
    """One unknown has a pivot in the border row alone, or a second one in what is carried along instead.

    The carried row was never a pivot again: such a chain was called singular. A pivot of 1e-13 was taken for
    one, and the border row was left with three digits.
    """
    rng = np.random.default_rng(0)
    solved = 0
    for case in range(1200):
        count, m = int(rng.integers(2, 6)), int(rng.integers(2, 5))
        a, b = rng.normal(size=(2, count, m, m))
        c, r = rng.normal(size=(2, count, m))
        close, d = rng.normal(size=(m, m)), rng.normal(size=(1, count, m))
        e, s = rng.normal(size=(2, 1, 1))
        if case % 3 < 2:
            _weak(a, b, rng, both=case % 3 == 1)
        else:
            a, b, d = (part * (rng.random(part.shape) < 0.5) for part in (a, b, d))
        n = count * m
        full, right = np.zeros((n + 1, n + 1)), np.append(r.ravel(), s)
        for i in range(count):
            at, after = slice(i * m, (i + 1) * m), slice((i + 1) * m, (i + 2) * m)
            full[at, at] += a[i]
            if i + 1 < count:
                full[at, after] += b[i]
            else:
                full[at, :m] += b[i] @ close
        full[:-1, -1], full[-1, :-1], full[-1, -1] = c.ravel(), d.ravel(), e[0, 0]
        if not np.linalg.cond(full) < 1e6:
            continue
        z, w = np.empty((count, m, 1)), np.empty((1, 1))
        assert solve_chain(a, b, c, r, close, d, e, s, z, w), case
        found = np.append(z.ravel(), w)
        assert np.abs(full @ found - right).max() < 1e-11 * (1.0 + np.abs(found).max()), case
        solved += 1
    assert solved > 1000


def test_a_bridge_ends_where_its_slide_has_no_length() -> None:
    """Between two holds, without damping: its end was not located there, and the branch ended just before."""
    found = restarts.scene(42, 56)
    rng, ends = np.random.default_rng(1), 0
    for share in (0.0, 1e-3, -1e-3):
        params = {**found.params, "zeta": 0.0, "S": found.params["S"] * (1.0 + share)}
        diagram = cf.explore(cf.find_orbit("coulomb", params, longest=1000), "Omega", found.range)
        assert not diagram.loose_ends, share
        for bridge in (b for b in diagram.branches if len(b.system.holds) == 1 and b.symmetric):
            places = [e.bifurcation.params["Omega"] for e in bridge.ends if e.bifurcation]
            for _ in range(4):
                step = float(10.0 ** rng.uniform(-3.0, -2.0))
                middle = bridge[len(bridge) // 2]
                again = cf.continue_orbit(middle, "Omega", found.range, max_step=step)
                for end in again.ends:
                    assert end.bifurcation is not None, (share, step)
                    value = end.bifurcation.params["Omega"]
                    assert min(abs(value - place) for place in places) < 1e-10, (share, step)
                    ends += 1
    assert ends > 30
