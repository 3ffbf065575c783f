"""The vector that is integrated: state, observable and variations.

With the field ``y' = f(t, y, p)`` and M the derivatives of the state after a duration s with respect to
(t0, y0, p)::

    dM/ds = f_y M + [f_t, 0, f_p],        M(0) = [0, I, 0]        (t0 at a fixed duration)

A Runge-Kutta method applied to both together gives the derivatives of its own discrete map, so that
Newton's method sees the Jacobian of what it solves. Where roots are sought, the observable q goes with
the state as ``q' = rate``: its steps then resolve the observable, also where the state stands still.

The vector is ``[y (n) | q (0 or 1) | M (n rows of 1 + n + m)]``. Second variations would be further rows
of the same kind, driven by f_yy; nothing else here depends on how many rows there are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from contfric.compiled import allocating_helper, helper

FloatArray = NDArray[np.float64]


class IntegrationWorkspace(NamedTuple):
    """Workspace for an integration over ``size`` numbers; allocated once a call.

    Attributes
    ----------
    start, end, trial, stage : the vector at both ends of a step, at a place within, at a stage, (size,)
    slopes : slopes at the stages, those of the start first, shape (stages, size)
    last : slopes at the end, shape (size,)
    allowed : absolute error that is allowed to each component, shape (size,)
    scales : natural size of each state, shape (n,)
    partial : derivatives of the field by (t, y, p) for the variations, shape (n, 1 + n + m) or (0, 0)
    local : derivatives of the field by (t, y) at the start of a step, shape (n, 1 + n)
    grad : gradient of an observable's rate, shape (1 + n,)
    control : what the step control remembers; see :mod:`contfric.flow.integration.stepping`
    nodes : stack of nodes in the search of roots, shape (depth, 4)
    increments, memory, before : stage values less the start, in Newton's iteration, of the last step,
        and of the step that it continues, shape (s, n)
    stage_slopes, stage_partials : the field and its derivatives at implicit stages
    matrix, pivots, right : the linear system of an implicit step and its right-hand sides
    small : matrix of the error filter, and powers of the Jacobian, shape (2, n, n)
    none, empty, nothing : what is handed over where nothing is wanted
    """

    start: FloatArray
    end: FloatArray
    trial: FloatArray
    stage: FloatArray
    slopes: FloatArray
    last: FloatArray
    allowed: FloatArray
    scales: FloatArray
    partial: FloatArray
    local: FloatArray
    grad: FloatArray
    control: FloatArray
    nodes: FloatArray
    increments: FloatArray
    memory: FloatArray
    stage_slopes: FloatArray
    stage_partials: FloatArray
    matrix: FloatArray
    pivots: FloatArray
    right: FloatArray
    small: FloatArray
    none: FloatArray
    empty: FloatArray
    nothing: FloatArray


@helper
def slope(motion, mode, c, t, y, p, which, workspace, out):  # type: ignore[no-untyped-def]
    """Write the slope of the whole vector at (t, y)."""
    n, partial = workspace.scales.shape[0], workspace.partial
    columns = partial.shape[1]
    motion.field(mode, t, y[:n], p, which, out[:n], partial)
    if c >= 0:
        out[n] = motion.rate(mode, c, t, y[:n], p, workspace.none, workspace.empty)
    for i in range(n if columns > 0 else 0):
        row = n + i * columns
        for j in range(columns):
            out[row + j] = partial[i, j] if j == 0 or j > n else 0.0
        for a in range(n):
            factor = partial[i, 1 + a]
            if factor != 0.0:
                other = n + a * columns
                for j in range(columns):
                    out[row + j] += factor * y[other + j]


#: Scale of the tolerance of a state that is known to a share of itself (its range begins at 0): an error of
#: the state's size would make a small number negative, and it would grow so. Not 0: it may begin there.
NOTHING = 1e-100


@helper
def begin(motion, y0, p, which, workspace):  # type: ignore[no-untyped-def]
    """Write the start of the variations, and what error each component is allowed."""
    n, columns, allowed = y0.shape[0], workspace.partial.shape[1], workspace.allowed
    for i in range(n):
        workspace.start[i] = y0[i]
        scale = motion.scale(i, p)
        workspace.scales[i] = abs(scale)
        allowed[i] = motion.absolute * (scale if scale > 0.0 else NOTHING)
    for i in range(n if columns > 0 else 0):
        for j in range(columns):
            k = n + i * columns + j
            unit = 1.0
            if 1 <= j <= n:
                unit = workspace.scales[j - 1]
            elif j > n:
                unit = max(1.0, abs(p[which[j - n - 1]]))
            workspace.start[k] = 1.0 if j == 1 + i else 0.0
            allowed[k] = allowed[i] / unit


#: Deepest bisection of a step in the search of roots: down to the resolution of time.
DEPTH = 32
#: Numbers that the step control remembers.
CONTROLS = 10


@allocating_helper
def integration_workspace(n, observed, columns, stages, implicit):  # type: ignore[no-untyped-def]
    """Return the workspace for n states, with 0 or 1 observable and the columns of the variations.

    ``stages`` is the number of rows for explicit slopes, ``implicit`` that of implicit stages (0: none).
    """
    size = n + observed + n * columns
    unknowns = implicit * n
    rows = n if columns > 0 else 0
    flat = np.empty((6 + stages, size))
    return IntegrationWorkspace(
        flat[0],
        flat[1],
        flat[2],
        flat[3],
        flat[6:],
        flat[4],
        flat[5],
        np.empty(n),
        np.empty((rows, columns)),
        np.empty((n, 1 + n)),
        np.empty(1 + n),
        np.zeros(CONTROLS),
        np.empty((DEPTH, 4)),
        np.empty((implicit, n)),
        np.empty((implicit, n)),
        np.empty((implicit, n)),
        np.empty((implicit, n, max(columns, 1 + n))),
        np.empty((unknowns, unknowns)),
        np.empty(unknowns, dtype=np.int64),
        np.empty((unknowns, max(columns, 1))),
        np.empty((2, n, n)),
        np.empty(0, dtype=np.int64),
        np.empty(0),
        np.empty((0, 0)),
    )
