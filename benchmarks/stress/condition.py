"""What rounding of the arguments does to an orbit: its condition.

Whoever solves the equations in doubles has rounded phases, durations and unknowns. That leaves a residual
in each equation, and ``|J^-1|`` times it in the joints.
"""

from __future__ import annotations

import numpy as np
from chain import Exact, FloatArray, flat, inverse_of

EPS = float(np.finfo(float).eps)


def rounding(exact: Exact) -> FloatArray:
    """Return what rounding of the arguments costs in each equation: half a unit of each, in effect.

    The phases ``k Omega t`` of both ends and the duration are rounded; a phase error moves the force
    (of size 1 + |h|), and the response to it grows with the duration d at most (at resonance).
    """
    w, _, S0, h, zeta = (float(v) for v in exact.p)
    fastest = (3.0 if h else 1.0) * w
    closed = [(float(t), float(x)) for t, x in exact.chain.closed(exact.z, exact.p)]
    rows = []
    for piece, (t0, x0), (t1, x1) in zip(exact.pieces, closed, closed[1:], strict=False):
        d = abs(t1 - t0)
        size = (1.0 + abs(h)) * (1.0 + fastest * max(abs(t0), abs(t1)) + (1.0 + 2.0 * zeta) * d)
        a, b = (np.abs(np.array(block, dtype=float)) for block in (piece.a, piece.b))
        own = a @ np.abs([t0, x0]) + b @ np.abs([t1, x1])
        rows += list(EPS * (own + size * (1.0 + min(d, 1.0 / max(zeta, 1e-300))) + S0))
    return np.array(rows)


def sensitivity(exact: Exact) -> FloatArray:
    """Return the error that rounding may leave in each unknown: ``|J^-1|`` times that of each row."""
    inverse = inverse_of(exact.chain.jacobian(exact.pieces))
    return np.abs(inverse) @ rounding(exact) + EPS * np.abs([float(v) for v in flat(exact.z)])
