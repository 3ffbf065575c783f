"""Many nodes of an orbit in one call, compiled: states and observables with their derivatives."""

from __future__ import annotations

import numpy as np
from numba import types

from contfric.compiled import blocks, helper, i8, indices, kernel, matrix, vector
from contfric.flow.layouts import FlowType


@helper
def carry(jac, begin_time, begin, d_time, d_vector, out):  # type: ignore[no-untyped-def]
    """Write how a state moves, (n, D + 1), whose solution starts where time and state move by ``begin``."""
    n, count, free = out.shape[0], out.shape[1] - 1, d_vector.shape[0]
    for i in range(n):
        for d in range(count):
            value = jac[i, 0] * begin_time[d] + jac[i, 1 + n] * (d_time[d] - begin_time[d])
            for j in range(n):
                value += jac[i, 1 + j] * begin[j, d]
            for k in range(free):
                value += jac[i, 2 + n + k] * d_vector[k, d]
            out[i, d] = value
        out[i, count] = jac[i, 1 + n]


@kernel(
    types.void(
        *(FlowType, indices, vector, matrix, vector, matrix, blocks, matrix),
        *(vector, indices, matrix, types.boolean, indices, vector),
        *(vector, matrix, matrix, blocks),
    )
)
def move(  # type: ignore[no-untyped-def]
    functions,
    modes,
    starts,
    states,
    lasts,
    d_starts,
    d_states,
    d_lasts,
    p,
    which,
    d_vector,
    chained,
    where,
    shares,
    times,
    d_times,
    out,
    slopes,
):
    """Write times and states at shares of segments, and how they move; the last direction is time itself.

    Parameters
    ----------
    modes, starts, states, lasts : the segments; shapes (N,), (N,), (N, n), (N,)
    d_starts, d_states, d_lasts : how they move, shapes (N, D), (N, n, D), (N, D)
    which, d_vector : the parameters that move, and how, shape (moving, D)
    chained : whether the solution to a node starts at the node before, where that is earlier
    where, shares : segment of each node, and its share of that, shape (k,)
    times, d_times : shapes (k,) and (k, D + 1), or (k, 0) where no derivatives are wanted
    out, slopes : states, shapes (k, n) and (k, n, D + 1)
    """
    n, exact = states.shape[1], d_times.shape[1] > 0
    jac = np.empty((n if exact else 0, 2 + n + which.shape[0]))
    before = -1  # the node that the solution starts at; a segment's own start
    for k in range(where.shape[0]):
        s = where[k]
        times[k] = starts[s] + shares[k] * lasts[s]
        for d in range(d_times.shape[1] - 1):
            d_times[k, d] = d_starts[s, d] + shares[k] * d_lasts[s, d]
        if exact:
            d_times[k, d_times.shape[1] - 1] = 1.0
        if not chained or before < 0 or where[before] != s or times[k] < times[before]:
            since = starts[s]
            functions.flow(modes[s], since, states[s], times[k] - since, p, which, out[k], jac)
            if exact:
                carry(jac, d_starts[s], d_states[s], d_times[k], d_vector, slopes[k])
        else:
            since = times[before]
            functions.flow(modes[s], since, out[before], times[k] - since, p, which, out[k], jac)
            if exact:
                carry(jac, d_times[before], slopes[before], d_times[k], d_vector, slopes[k])
        before = k


@kernel(
    types.void(
        *(FlowType, i8, vector, matrix, matrix, blocks),
        *(vector, indices, matrix, vector, matrix),
    )
)
def observe(functions, c, times, d_times, states, slopes, p, which, d_vector, values, out):  # type: ignore[no-untyped-def]
    """Write an observable at some nodes, and how it moves; the arguments are those of :func:`move`."""
    n, columns = states.shape[1], d_times.shape[1]
    grad = np.empty(1 + n + which.shape[0] if columns else 0)
    for k in range(times.shape[0]):
        values[k] = functions.observe(c, times[k], states[k], p, which, grad)
        for d in range(columns):
            value = grad[0] * d_times[k, d]
            for j in range(n):
                value += grad[1 + j] * slopes[k, j, d]
            if d < columns - 1:
                for q in range(which.shape[0]):
                    value += grad[1 + n + q] * d_vector[q, d]
            out[k, d] = value
