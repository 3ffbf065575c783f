"""The multipliers of one turn, compiled.

They are the eigenvalues of the linear map M of one turn on ``z_0 = (t_0, y_0)``. It has one eigenvalue
0 for the direction off the section, and one more for each direction that a stick takes away; those
are exactly zero, and the characteristic polynomial of the others is cut off there.

Of an autonomous model a shift in time is mapped to itself: M is block triangular with a 1 for dt_0, the
trivial multiplier, and the map of the states in the section. Its first column is made zero, which takes
the trivial multiplier away exactly, and leaves one direction less.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import types

from contfric.compiled import allocating_helper, blocks, f8, helper, indices, kernel
from contfric.models.definition import FloatArray
from contfric.orbit.cyclic import turn_map
from contfric.orbit.equations import LayoutType
from contfric.orbit.newton import MULTIPLIERS


@helper
def characteristic(m, rank, e, b, product):  # type: ignore[no-untyped-def]
    """Fill e[k], k <= rank, with the elementary symmetric functions of the eigenvalues of m.

    Faddeev and LeVerrier: ``k e_k = tr(m b_k)``, ``b_1 = 1``, ``b_{k+1} = e_k - m b_k``; a matrix
    of rank r has no others.
    """
    size = m.shape[0]
    for i in range(size):
        for j in range(size):
            b[i, j] = 1.0 if i == j else 0.0
    e[0] = 1.0
    for k in range(1, rank + 1):
        trace = 0.0
        for i in range(size):
            for j in range(size):
                value = 0.0
                for n in range(size):
                    value += m[i, n] * b[n, j]
                product[i, j] = value
            trace += product[i, i]
        e[k] = trace / k
        for i in range(size):
            for j in range(size):
                b[i, j] = (e[k] if i == j else 0.0) - product[i, j]


@helper
def polynomial_roots(e, rank, out):  # type: ignore[no-untyped-def]
    """Write the roots of ``z^r - e_1 z^{r-1} + e_2 z^{r-2} - ..``, by the iteration of Aberth."""
    if rank == 1:
        out[0] = e[1]
        return
    if rank == 2:
        half = 0.5 * e[1]
        disc = half * half - e[2]
        if disc >= 0.0:
            big = half + math.copysign(math.sqrt(disc), half)
            out[0] = big
            out[1] = e[2] / big if big != 0.0 else 0.0
        else:
            out[0] = complex(half, math.sqrt(-disc))
            out[1] = complex(half, -math.sqrt(-disc))
        return
    radius = 0.0
    for k in range(1, rank + 1):
        radius = max(radius, abs(e[k]) ** (1.0 / k))
    for k in range(rank):
        angle = 0.4 + 2.0 * math.pi * k / rank  # off the real axis, where real roots would stall
        out[k] = radius * complex(math.cos(angle), math.sin(angle))
    for _ in range(60):
        largest = 0.0
        for k in range(rank):
            value, slope = complex(1.0, 0.0), complex(0.0, 0.0)
            for j in range(1, rank + 1):
                slope = slope * out[k] + value
                value = value * out[k] + (e[j] if j % 2 == 0 else -e[j])
            if value == 0.0:
                continue
            others = complex(0.0, 0.0)
            for j in range(rank):
                if j != k and out[j] != out[k]:
                    others += 1.0 / (out[k] - out[j])
            step = value / (slope - value * others)
            out[k] -= step
            largest = max(largest, abs(step))
        if largest <= 1e-16 * radius:
            return


@helper
def spectrum(m, rank, out, e, b, product):  # type: ignore[no-untyped-def]
    """Write the n eigenvalues of one turn; return (chi(1), chi(-1)).

    ``chi(s)`` is the product of ``1 - s mu`` over the multipliers mu.
    """
    characteristic(m, rank, e, b, product)
    for k in range(out.shape[0]):
        out[k] = 0.0
    polynomial_roots(e, rank, out)
    for i in range(1, rank):  # largest first
        for j in range(i, 0, -1):
            if abs(out[j]) > abs(out[j - 1]) * (1.0 + 1e-14):
                out[j], out[j - 1] = out[j - 1], out[j]
    one, minus = 0.0, 0.0
    for k in range(rank + 1):
        one += e[k] if k % 2 == 0 else -e[k]
        minus += e[k]
    return one, minus


class SpectralWorkspace(NamedTuple):
    """Workspace for the multipliers of one turn: three matrices and the characteristic polynomial."""

    turn: FloatArray
    left: FloatArray
    product: FloatArray
    symmetric: FloatArray


@allocating_helper
def spectral_workspace(m):  # type: ignore[no-untyped-def]
    """Return the workspace for matrices of one turn, shape (m, m)."""
    return SpectralWorkspace(np.empty((m, m)), np.empty((m, m)), np.empty((m, m)), np.empty(m + 1))


@helper
def multipliers(rank, pencil, close, out, workspace):  # type: ignore[no-untyped-def]
    """Write the multipliers of one turn from its pencil; return (chi(1), chi(-1))."""
    n = out.shape[0]
    timeless = close[0, 0] == 0.0  # autonomous: the closure forgets the time, the turn does not
    close[0, 0] = 1.0
    solved = turn_map(pencil[0], pencil[1], close, workspace.left, workspace.turn)
    if timeless:
        close[0, 0] = 0.0
        for k in range(n + 1):
            workspace.turn[k, 0] = 0.0
    if not solved:
        for k in range(n):
            out[k] = np.inf
        return np.nan, np.nan
    return spectrum(
        workspace.turn, min(rank, n), out, workspace.symmetric, workspace.left, workspace.product
    )


@kernel(types.UniTuple(f8, 2)(LayoutType, blocks, types.complex128[::1], indices))
def stability(layout, pencil, mu, counts):  # type: ignore[no-untyped-def]
    """Fill the multipliers of one turn from its pencil; return (chi(1), chi(-1))."""
    counts[MULTIPLIERS] += 1
    m = pencil.shape[1]
    close = np.empty((m, m))
    for i in range(m):
        for j in range(m):
            inner = i > 0 and j > 0
            close[i, j] = layout.closure[i - 1, j - 1] if inner else 0.0
    close[0, 0] = 0.0 if layout.turn == 0.0 else 1.0
    return multipliers(layout.rank, pencil, close, mu, spectral_workspace(m))
