"""First hits of many solutions of the oscillator at once: slides side by side, and what ends a rest.

Without damping and third harmonic, as the planes of Lyapunov exponents have them. Values differ from those
of :func:`contfric.flow.oscillator.flow.hit` in the last digits, as the sines do
(:mod:`contfric.flow.oscillator.sines`); for one solution they are the same as for many.
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import helper, kernel, together_signature
from contfric.compiling.lanes import LANES
from contfric.flow.oscillator.motion import OMEGA, S0, STICK, ZETA, H, S, direction
from contfric.flow.oscillator.rest import time_to_cosine
from contfric.flow.oscillator.slides import (
    LOAD,
    LONGEST,
    ROWS,
    SIDE,
    STOP,
    TAU,
    TIME,
    V_D,
    V_T,
    V_V,
    X_D,
    X_T,
    X_V,
    X_X,
    X,
    stops,
)
from contfric.flow.oscillator.slides import OMEGA as FREQUENCY
from contfric.flow.without import SINGLY

#: The surface v = 0, and the loads (relative to 1) that are at a limit by rounding.
_AT_REST, _AWAY = 2, 1e-6


@helper
def released(x, t, p, longest):  # type: ignore[no-untyped-def]
    """Return how long a rest lasts, and the limit of the load that ends it; SINGLY if that is not clear."""
    theta = p[OMEGA] * t
    load, limit = x - math.cos(theta), p[S0]
    if abs(load - limit) <= _AWAY or abs(load + limit) <= _AWAY:
        return 0.0, SINGLY
    start = theta - 2.0 * math.pi if theta > math.pi else theta
    above = time_to_cosine(x - limit, start, p[OMEGA])
    below = time_to_cosine(x + limit, start, p[OMEGA])
    first = above >= 0.0 and (below < 0.0 or above <= below)
    tau = above if first else below
    if not 0.0 <= tau <= longest:
        return 0.0, SINGLY
    return tau, (0 if first else 1)


@helper
def write_slides(who, count, work, tau, surfaces, ends, jac):  # type: ignore[no-untyped-def]
    """Find the stops of the slides in a vector, and write them to the rows of their motions."""
    for j in range(count, LANES):
        for i in range(TAU):
            work[i, j] = work[i, 0]
    stops(work)
    for j in range(count):
        k = who[j]
        if not work[TAU, j] > 0.0:
            continue
        tau[k], surfaces[k] = work[TAU, j], _AT_REST
        ends[k, 0], ends[k, 1] = work[STOP, j], 0.0
        jac[k, 0, 0], jac[k, 1, 0] = work[X_T, j], work[V_T, j]
        jac[k, 0, 1], jac[k, 1, 1] = work[X_X, j], -work[X_V, j]
        jac[k, 0, 2], jac[k, 1, 2] = work[X_V, j], work[V_V, j]
        jac[k, 0, 3], jac[k, 1, 3] = work[X_D, j], work[V_D, j]


@kernel(together_signature)
def together(count, modes, on, times, states, p, longest, tau, surfaces, ends, jac):  # type: ignore[no-untyped-def]
    """Find the first hits of many solutions; the signature stands in :mod:`contfric.compiled`."""
    work, who, filled = np.zeros((ROWS, LANES)), np.empty(LANES, dtype=np.int64), 0
    for k in range(count):
        surfaces[k] = SINGLY
        own = p[k]
        if modes[k] < 0 or own[H] != 0.0 or own[ZETA] != 0.0:
            continue
        x, t = states[k, 0], times[k]
        if modes[k] == STICK:
            tau[k], surfaces[k] = released(x, t, own, longest[k])
            ends[k, 0], ends[k, 1] = x, 0.0
            for j in range(4):
                jac[k, 0, j], jac[k, 1, j] = (1.0 if j == 1 else 0.0), 0.0
        elif on[k] >> _AT_REST & 1 == 1 and states[k, 1] == 0.0:
            side = direction(modes[k])
            work[FREQUENCY, filled], work[TIME, filled] = own[OMEGA], t
            work[X, filled], work[LOAD, filled] = x, x + side * own[S]
            work[SIDE, filled], work[LONGEST, filled] = side, longest[k]
            who[filled] = k
            filled += 1
            if filled == LANES:
                write_slides(who, filled, work, tau, surfaces, ends, jac)
                filled = 0
    if filled > 0:
        write_slides(who, filled, work, tau, surfaces, ends, jac)
