"""The multipliers of one turn, compiled.

They are the eigenvalues of the linear map M of one turn on ``z_0 = (t_0, y_0)``. It has one eigenvalue
0 for the direction off the section, and one more for each direction that a stick takes away; those
are exactly zero. One or two others are the roots of a quadratic in closed form, more of them LAPACK's.

What an itinerary conserves is taken away in the same way (:mod:`contfric.bvp.conserved`).

Of an autonomous model a shift in time is mapped to itself: M is block triangular with a 1 for dt_0, the
trivial multiplier, and the map of the states in the section. Its first column is made zero, which takes
the trivial multiplier away exactly, and leaves one direction less.

Where disturbances grow far in a turn the entries of M are large, and the other multipliers are lost in their
rounding; so is the sign of ``chi(s) = det(1 - s M)``, which tells of events. The pencil of the turn has
entries of order 1 however far they grow: ``chi(s) = det(Q K + s P) / det(Q K)``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray
from contfric.bvp.cyclic import turn_map
from contfric.bvp.equations import LayoutType
from contfric.bvp.newton import MULTIPLIERS
from contfric.compiled import allocating_helper, blocks, f8, helper, indices, kernel

#: LAPACK's dgeev, by numba's own wrapper (that of ``numpy.linalg.eigvals`` in compiled code): it allocates
#: its own workspace and returns 0, so that helpers can call it. (kind, jobvl, jobvr, n, a, lda, wr, wi, vl,
#: ldvl, vr, ldvr); scipy's library is loaded at the first call.
_geev = types.ExternalFunction(
    "numba_ez_rgeev",
    types.intc(
        *(types.char, types.char, types.char, types.intp, types.CPointer(f8), types.intp),
        *(types.CPointer(f8), types.CPointer(f8), types.CPointer(f8), types.intp),
        *(types.CPointer(f8), types.intp),
    ),
)
_DOUBLE, _NO = ord("d"), ord("N")
#: Multiplier from which on the determinants are those of the pencil: below it four digits are lost at most.
_GROWN = 1e4


@helper
def largest_of(m, rank, out, real, imaginary, copy):  # type: ignore[no-untyped-def]
    """Write the ``rank`` largest eigenvalues of m by LAPACK, largest first; the others of a turn are zero."""
    size = m.shape[0]
    for i in range(size):
        for j in range(size):
            if not math.isfinite(m[i, j]):
                out[:] = np.inf
                return
            copy[i, j] = m[i, j]  # the eigenvalues of the transpose are the same
    failed = _geev(
        _DOUBLE,
        _NO,
        _NO,
        size,
        copy.ctypes,
        copy.shape[1],
        real.ctypes,
        imaginary.ctypes,
        real.ctypes,
        1,
        real.ctypes,
        1,
    )
    if failed != 0:
        out[:] = np.inf
        return
    for k in range(rank):
        best = -1
        for j in range(size):
            if real[j] != np.inf and (
                best < 0
                or math.hypot(real[j], imaginary[j])
                > math.hypot(real[best], imaginary[best]) * (1.0 + 1e-14)
            ):
                best = j
        out[k] = complex(real[best], imaginary[best])
        real[best] = np.inf


@helper
def determinant(m, sign, copy):  # type: ignore[no-untyped-def]
    """Return det(1 + sign m)."""
    size = m.shape[0]
    for i in range(size):
        for j in range(size):
            copy[i, j] = sign * m[i, j] + (1.0 if i == j else 0.0)
    return eliminated(copy)


@helper
def eliminated(copy):  # type: ignore[no-untyped-def]
    """Return the determinant of a matrix, by elimination with row exchanges in its place."""
    size, value = copy.shape[0], 1.0
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(copy[i, k]) > abs(copy[best, k]):
                best = i
        if copy[best, k] == 0.0:
            return 0.0
        if best != k:
            value = -value
            for j in range(k, size):
                copy[k, j], copy[best, j] = copy[best, j], copy[k, j]
        value *= copy[k, k]
        for i in range(k + 1, size):
            factor = copy[i, k] / copy[k, k]
            for j in range(k + 1, size):
                copy[i, j] -= factor * copy[k, j]
    return value


@helper
def of_rank_two(m, rank, out):  # type: ignore[no-untyped-def]
    """Write the eigenvalues of m in closed form, from its trace and the sum of its minors."""
    trace, minors = 0.0, 0.0
    for i in range(m.shape[0]):
        trace += m[i, i]
        for j in range(i):
            minors += m[i, i] * m[j, j] - m[i, j] * m[j, i]
    if rank < 2:
        minors = 0.0
    if rank == 1:
        out[0] = trace
    elif rank == 2:
        half = 0.5 * trace
        disc = half * half - minors
        if disc >= 0.0:
            big = half + math.copysign(math.sqrt(disc), half)
            out[0] = big
            out[1] = minors / big if big != 0.0 else 0.0
        else:
            out[0] = complex(half, math.sqrt(-disc))
            out[1] = complex(half, -math.sqrt(-disc))
    if rank == 0:
        trace = 0.0
    return 1.0 - trace + minors, 1.0 + trace + minors


@helper
def spectrum(m, rank, out, real, copy, other):  # type: ignore[no-untyped-def]
    """Write the n eigenvalues of one turn, those that are zero exactly so; return (chi(1), chi(-1)).

    ``chi(s)`` is the product of ``1 - s mu`` over the multipliers mu: the determinant of ``1 - s m``.
    """
    for k in range(out.shape[0]):
        out[k] = 0.0
    if rank <= 2:
        return of_rank_two(m, rank, out)
    largest_of(m, rank, out, real, other[0], copy)
    return determinant(m, -1.0, copy), determinant(m, 1.0, copy)


class SpectralWorkspace(NamedTuple):
    """Workspace for the multipliers of one turn: three matrices and the real parts."""

    turn: FloatArray
    left: FloatArray
    product: FloatArray
    real: FloatArray


@allocating_helper
def spectral_workspace(m):  # type: ignore[no-untyped-def]
    """Return the workspace for matrices of one turn, shape (m, m)."""
    return SpectralWorkspace(np.empty((m, m)), np.empty((m, m)), np.empty((m, m)), np.empty(m + 1))


@helper
def take_away(turn, directions):  # type: ignore[no-untyped-def]
    """Make the eigenvalues zero whose left eigenvectors are given: ``turn (1 - w w')``."""
    n = turn.shape[0] - 1
    for d in range(directions.shape[0]):
        for i in range(n + 1):
            along = 0.0
            for j in range(n):
                along += turn[i, 1 + j] * directions[d, j]
            for j in range(n):
                turn[i, 1 + j] -= along * directions[d, j]


@helper
def pencil_determinant(q, close, sign, p, copy):  # type: ignore[no-untyped-def]
    """Return det(Q K + sign P)."""
    size = q.shape[0]
    for i in range(size):
        for j in range(size):
            value = sign * p[i, j]
            for k in range(size):
                value += q[i, k] * close[k, j]
            copy[i, j] = value
    return eliminated(copy)


@helper
def of_grown(layout, pencil, close, rank, out, workspace):  # type: ignore[no-untyped-def]
    """Return (chi(1), chi(-1)) by determinants of the pencil; of two real multipliers write the small one.

    Infinite where the map of the turn is: then neither is known.
    """
    p, copy, timeless = workspace.left, workspace.product, close[0, 0] == 0.0
    size = p.shape[0]
    for i in range(size):
        for j in range(size):
            p[i, j] = 0.0 if timeless and j == 0 else pencil[0, i, j]
    take_away(p, layout.conserved)
    close[0, 0] = 1.0
    base = pencil_determinant(pencil[1], close, 0.0, p, copy)
    one = pencil_determinant(pencil[1], close, 1.0, p, copy)
    minus = pencil_determinant(pencil[1], close, -1.0, p, copy)
    if timeless:
        close[0, 0] = 0.0
    if base == 0.0:
        return np.inf, np.inf
    one, minus = one / base, minus / base
    if rank == 2 and out[0].imag == 0.0 and abs(out[1]) < abs(out[0]) * 1e-8:
        out[1] = (0.5 * (one + minus) - 1.0) / out[0].real
    return one, minus


@helper
def multipliers(layout, pencil, close, out, workspace):  # type: ignore[no-untyped-def]
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
    take_away(workspace.turn, layout.conserved)
    rank = max(0, min(layout.rank, n))
    one, minus = spectrum(
        workspace.turn, rank, out, workspace.real, workspace.left, workspace.product
    )
    if rank > 1 and abs(out[0]) > _GROWN and abs(out[0]) < np.inf:
        return of_grown(layout, pencil, close, rank, out, workspace)
    return one, minus


@kernel(types.UniTuple(f8, 2)(LayoutType, blocks, types.complex128[::1], indices))
def stability(layout, pencil, mu, counts):  # type: ignore[no-untyped-def]
    """Fill the multipliers of one turn from its pencil; return (chi(1), chi(-1))."""
    counts[MULTIPLIERS] += 1
    m = pencil.shape[1]
    close = np.empty((m, m))
    for i in range(m):
        for j in range(m):
            inner = i > 0 and j > 0
            close[i, j] = layout.closing[i - 1, j - 1] if inner else 0.0
    close[0, 0] = 0.0 if layout.turn == 0.0 else 1.0
    return multipliers(layout, pencil, close, mu, spectral_workspace(m))
