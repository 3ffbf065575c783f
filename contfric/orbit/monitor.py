"""What is watched on a solved orbit: margins, labels and multipliers, compiled.

Admissibility cannot miss a violation: between its stationary points an observable is monotone, so
the smallest distance to a bounding surface inside a segment is attained at a stationary point (or at
the joints, which the exit and joint margins watch). The flow delivers *all* stationary points.

The multipliers are the eigenvalues of the linear map M of one turn on ``z_0 = (t_0, y_0)``. It has
one eigenvalue 0 for the direction off the section, and one more for each direction that a stick
takes away; those are exactly zero, and the characteristic polynomial of the others is cut off there.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from contfric.compiled import blocks, f8, helper, indices, kernel, matrix, vector
from contfric.orbit.cyclic import turn_map
from contfric.orbit.newton import (
    CHECKS,
    MULTIPLIERS,
    FunctionsType,
    LayoutType,
    last_joint,
)

#: Most interior stationary points of one observable in one segment; beyond it the orbit is reported
#: as not finite. A stick of 30 excitation periods has 180 of them with a third harmonic.
_MOST_TURNINGS = 256


@helper
def observed(functions, mode, c, start, duration, p, none, empty, nothing, y):  # type: ignore[no-untyped-def]
    """Return observable c after a duration in a mode."""
    functions[0](mode, start[0], start[1:], duration, p, none, y, nothing)
    return functions[1](c, start[0] + duration, y, p, none, empty)


@helper
def exit_rate(functions, mode, c, after, p, none, y, jac, grad):  # type: ignore[no-untyped-def]
    """Return the rate of observable c along a mode at a state."""
    functions[0](mode, after[0], after[1:], 0.0, p, none, y, jac)
    functions[1](c, after[0], after[1:], p, none, grad)
    n = y.shape[0]
    rate = grad[0]
    for j in range(n):
        rate += grad[1 + j] * jac[j, 1 + n]
    return rate


@helper
def margins(functions, layout, z, p, last, out, times):  # type: ignore[no-untyped-def]
    """Fill the margins in the order interior, exit, joint; an interior one is inf without turnings."""
    n = z.shape[1] - 1
    none, empty, nothing = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    y, jac, grad = np.empty(n), np.empty((n, 2 + n)), np.empty(1 + n)
    modes, exits, observables = layout.modes, layout.exits, layout.observables
    interior, joint = layout.interior, layout.joint
    count = z.shape[0]
    at = 0
    for k in range(interior.shape[0]):
        i, surface, sign = interior[k, 0], interior[k, 1], float(interior[k, 2])
        after = z[i + 1] if i + 1 < count else last
        duration = after[0] - z[i, 0]
        c = observables[surface]
        least = np.inf  # also of a segment that vanishes: the joint and exit margins watch it
        if duration > 0.0:
            found = functions[3](modes[i], c, z[i, 0], z[i, 1:], duration, p, times)
            target = functions[2](surface, p, none, empty)
            if found < 0:
                least = np.nan
            for turn in range(found):
                value = observed(
                    functions, modes[i], c, z[i], times[turn], p, none, empty, nothing, y
                )
                least = min(least, sign * (value - target))
        out[at] = least
        at += 1
    for i in range(count):
        after = z[i + 1] if i + 1 < count else last
        c = observables[exits[i]]
        rate = exit_rate(functions, modes[i], c, after, p, none, y, jac, grad)
        out[at] = layout.exit_signs[i] * rate
        at += 1
    for k in range(joint.shape[0]):
        i, surface = joint[k, 0], joint[k, 1]
        after = z[i + 1] if i + 1 < count else last
        value = functions[1](observables[surface], after[0], after[1:], p, none, empty)
        out[at] = joint[k, 2] * (value - functions[2](surface, p, none, empty))
        at += 1


@helper
def crossings(functions, layout, k, z, p, last, times):  # type: ignore[no-untyped-def]
    """Return the surfaces that the segment of row k crosses, as digits of one integer."""
    none, empty, nothing = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
    y = np.empty(z.shape[1] - 1)
    i, c, on = layout.labels[k, 0], layout.labels[k, 1], layout.labels[k, 2]
    mode, observables = layout.modes[i], layout.observables
    after = z[i + 1] if i + 1 < z.shape[0] else last
    duration = after[0] - z[i, 0]
    if duration <= 0.0:
        return 0
    found = functions[3](mode, c, z[i, 0], z[i, 1:], duration, p, times)
    if found < 0:
        return -1
    if on >= 0:
        value = functions[2](on, p, none, empty)
    else:
        value = functions[1](c, z[i, 0], z[i, 1:], p, none, empty)
    code = 0
    for piece in range(found + 1):
        if piece < found:
            following = observed(functions, mode, c, z[i], times[piece], p, none, empty, nothing, y)
        else:
            following = functions[1](c, after[0], after[1:], p, none, empty)
        code = crossed_between(functions, observables, c, value, following, p, none, empty, code)
        value = following
    return code


@helper
def crossed_between(functions, observables, c, value, following, p, none, empty, code):  # type: ignore[no-untyped-def]
    """Add the surfaces between two values of observable c to a code, in the order of the motion."""
    surfaces = observables.shape[0]
    for j in range(surfaces):
        # surfaces of an observable are listed from the highest level down
        surface = surfaces - 1 - j if following > value else j
        if observables[surface] == c:
            target = functions[2](surface, p, none, empty)
            if min(value, following) < target < max(value, following):
                code = code * (surfaces + 1) + surface + 1
    return code


@helper
def characteristic(m, rank, e):  # type: ignore[no-untyped-def]
    """Fill e[k], k <= rank, with the elementary symmetric functions of the eigenvalues of m.

    Faddeev and LeVerrier: ``k e_k = tr(m b_k)``, ``b_1 = 1``, ``b_{k+1} = e_k - m b_k``; a matrix
    of rank r has no others.
    """
    size = m.shape[0]
    b, product = np.zeros((size, size)), np.zeros((size, size))
    for i in range(size):
        b[i, i] = 1.0
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
def spectrum(m, rank, out):  # type: ignore[no-untyped-def]
    """Write the n eigenvalues of one turn; return (chi(1), chi(-1)).

    ``chi(s)`` is the product of ``1 - s mu`` over the multipliers mu.
    """
    e = np.zeros(rank + 1)
    characteristic(m, rank, e)
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


@helper
def multipliers(layout, pencil, out):  # type: ignore[no-untyped-def]
    """Write the multipliers of one turn from its pencil; return (chi(1), chi(-1))."""
    m = pencil.shape[1]
    n = m - 1
    close = np.zeros((m, m))
    close[0, 0] = 1.0
    for i in range(n):
        for j in range(n):
            close[1 + i, 1 + j] = layout.closure[i, j]
    turn = np.empty((m, m))
    if not turn_map(pencil[0], pencil[1], close, turn):
        for k in range(n):
            out[k] = np.inf
        return np.nan, np.nan
    return spectrum(turn, min(layout.rank, n), out)


@helper
def watch(functions, layout, z, p, out, labels):  # type: ignore[no-untyped-def]
    """Fill margins and labels of an orbit; False if something is not finite."""
    close = np.empty((z.shape[1], z.shape[1]))
    close_w = np.empty((z.shape[1], 0))
    none = np.empty(0, dtype=np.int64)
    last = np.empty(z.shape[1])
    times = np.empty(_MOST_TURNINGS)
    last_joint(functions, layout, z, p, none, last, close, close_w)
    margins(functions, layout, z, p, last, out, times)
    for k in range(layout.labels.shape[0]):
        labels[k] = crossings(functions, layout, k, z, p, last, times)
    for k in range(layout.interior.shape[0] + z.shape[0] + layout.joint.shape[0]):
        if np.isnan(out[k]):
            return False
    return True


@kernel(types.boolean(FunctionsType, LayoutType, matrix, vector, vector, indices, indices))
def examine(functions, layout, z, p, out, labels, counts):  # type: ignore[no-untyped-def]
    """Fill margins and labels of a solved orbit; False if something is not finite."""
    counts[CHECKS] += 1
    return watch(functions, layout, z, p, out, labels)


@kernel(types.UniTuple(f8, 2)(LayoutType, blocks, types.complex128[::1], indices))
def stability(layout, pencil, mu, counts):  # type: ignore[no-untyped-def]
    """Fill the multipliers of one turn from its pencil; return (chi(1), chi(-1))."""
    counts[MULTIPLIERS] += 1
    return multipliers(layout, pencil, mu)
