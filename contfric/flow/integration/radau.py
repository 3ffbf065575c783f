"""The implicit method for stiff motion: Radau IIA collocation with exact derivatives of its equations.

With s stages at the Radau nodes c (the last one is 1), increments ``Z_i = Y_i - y_0`` and J_j the
field's Jacobian at stage j::

    Z_i = h sum_j A_ij f(t + c_j h, y_0 + Z_j),        y_1 = y_0 + Z_s,

of order 2 s - 1, stable at any stiffness, and exact at infinite stiffness. Newton's method uses all J_j,
not one of them: its matrix ``I - h A_ij J_j`` is that of the variations, too, whose discrete equations
are

    sum_j (I - h A_ij J_j) W_j = h sum_j A_ij (J_j M_0 + [f_t, 0, f_p]_j),      M_1 = M_0 + W_s.

The error is what the collocation polynomial misses at the start, filtered::

    error = (I - h g J_0)^-1 h g (f(t, y_0) - P'(0)),

with g the real eigenvalue of A; it falls like the power s + 1 of the step, and bounds the error of the
whole polynomial, not only of its end. Source: E. Hairer, G. Wanner, "Solving Ordinary Differential
Equations II", 2nd edition, Springer 1996, sections IV.5 (method) and IV.8 (increments, estimate).
"""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import helper
from contfric.flow.integration.collocation import collocation_matrix, radau_nodes, values_at_start
from contfric.flow.integration.elimination import lu, lu_solve
from contfric.flow.integration.stepping import REMEMBERED

#: Number of stages: seven are faster than five from tolerances of 1e-9 on (docs/integration.md).
IMPLICIT_STAGES = 7
#: Most iterations of Newton's method with one matrix, and most matrices in a step.
_ITERATIONS, _MATRICES = 8, 3
#: What the iteration may leave, in units of the allowed error: far below it, so that the discrete map is
#: smooth.
_LEFT = 1e-3
#: Corrections that no longer fall are rounding if they are below this, in the same units.
_ROUNDING = 0.1
#: A correction of more than this share of the one before asks for a new matrix.
_SLOW = 0.2
#: The last step is continued as a prediction over at most this many times its length.
_FARTHEST = 2.5


_NODES = radau_nodes(IMPLICIT_STAGES)
_A = collocation_matrix(_NODES)
_LAGRANGE = values_at_start(_NODES)
_REAL = float(min(np.linalg.eigvals(_A), key=lambda value: abs(value.imag)).real)
_DEFECT = -_REAL * np.linalg.solve(_A.T, _LAGRANGE)
#: Nodes of the collocation polynomial: the start and the stages.
_ALL = np.concatenate([[0.0], _NODES])


@helper
def lagrange(j, place):  # type: ignore[no-untyped-def]
    """Return the polynomial that is 1 at stage j and 0 at the start and at the others, at a place."""
    value = 1.0
    for m in range(_ALL.shape[0]):
        if m != j + 1:
            value *= (place - _ALL[m]) / (_ALL[j + 1] - _ALL[m])
    return value


@helper
def predict(h, workspace, remembered, inside):  # type: ignore[no-untyped-def]
    """Predict the increments from the polynomial of the last step: after it, or (inside) within it."""
    z, memory, slopes = workspace.increments, workspace.memory, workspace.slopes
    s, n = z.shape
    known = remembered != 0.0 and abs(h) <= _FARTHEST * abs(remembered)
    for i in range(s):
        for k in range(n):
            z[i, k] = 0.0 if known else _NODES[i] * h * slopes[0, k]
        if known:
            place = _NODES[i] * h / remembered + (0.0 if inside else 1.0)
            for j in range(s):
                weight = lagrange(j, place)
                if not inside and j == s - 1:
                    weight -= 1.0  # relative to the end of the last step
                for k in range(n):
                    z[i, k] += weight * memory[j, k]


@helper
def stage_fields(motion, mode, t, h, p, which, workspace, differentiated):  # type: ignore[no-untyped-def]
    """Evaluate the field at the stages, with its derivatives if they are asked for."""
    z, stage, start = workspace.increments, workspace.stage, workspace.start
    s, n = z.shape
    for i in range(s):
        for k in range(n):
            stage[k] = start[k] + z[i, k]
        jac = workspace.stage_partials[i] if differentiated else workspace.nothing
        place = t + _NODES[i] * h
        motion.field(mode, place, stage[:n], p, which, workspace.stage_slopes[i], jac)


@helper
def factorise(h, workspace):  # type: ignore[no-untyped-def]
    """Write and factorise Newton's matrix; tell whether it is regular."""
    matrix, partials = workspace.matrix, workspace.stage_partials
    s, n = workspace.increments.shape
    for i in range(s):
        for j in range(s):
            a = h * _A[i, j]
            for k in range(n):
                for m in range(n):
                    matrix[i * n + k, j * n + m] = -a * partials[j, k, 1 + m]
        for k in range(n):
            matrix[i * n + k, i * n + k] += 1.0
    return lu(matrix, workspace.pivots, s * n)


@helper
def correct_stages(motion, h, workspace):  # type: ignore[no-untyped-def]
    """Make one correction of Newton's method; return its size in units of the allowed error."""
    z, right, slopes = workspace.increments, workspace.right, workspace.stage_slopes
    s, n = z.shape
    for i in range(s):
        for k in range(n):
            value = -z[i, k]
            for j in range(s):
                value += h * _A[i, j] * slopes[j, k]
            right[i * n + k, 0] = value
    lu_solve(workspace.matrix, workspace.pivots, s * n, right, 1)
    size = 0.0
    for i in range(s):
        for k in range(n):
            change = right[i * n + k, 0]
            z[i, k] += change
            here = abs(change) / (workspace.allowed[k] + motion.relative * abs(workspace.start[k]))
            if not here <= size:
                size = here
    return size


@helper
def solve_stages(motion, mode, t, h, p, which, workspace):  # type: ignore[no-untyped-def]
    """Solve for the increments from their prediction; tell whether the iteration converged."""
    for _ in range(_MATRICES):
        stage_fields(motion, mode, t, h, p, which, workspace, True)
        if not factorise(h, workspace):
            return False
        before = np.inf
        for iteration in range(_ITERATIONS):
            if iteration > 0:
                stage_fields(motion, mode, t, h, p, which, workspace, False)
            size = correct_stages(motion, h, workspace)
            if not math.isfinite(size):
                return False
            share = size / before  # 0 at the first correction
            if size <= _LEFT or (
                iteration > 0 and share < 1.0 and size * share <= _LEFT * (1.0 - share)
            ):
                return True
            if share > _SLOW:
                if size <= _ROUNDING:
                    return True
                break
            before = size
    return False


@helper
def implicit_step(motion, mode, c, t, h, p, which, workspace, target, inside):  # type: ignore[no-untyped-def]
    """Step from ``workspace.start``; write the end to ``target`` and tell whether there is one."""
    start, z = workspace.start, workspace.increments
    s, n = z.shape
    columns = workspace.partial.shape[1]
    predict(h, workspace, workspace.control[REMEMBERED], inside)
    if not solve_stages(motion, mode, t, h, p, which, workspace):
        return False
    for k in range(n):
        target[k] = start[k] + z[s - 1, k]
    if c >= 0:
        target[n] = start[n] + h * mean_rate(motion, mode, c, t, h, p, workspace, False)
    if columns > 0:
        return vary_stages(motion, mode, t, h, p, which, workspace, target)
    return True


@helper
def vary_stages(motion, mode, t, h, p, which, workspace, target):  # type: ignore[no-untyped-def]
    """Solve the discrete equations of the variations: the increments stay in ``workspace.right``."""
    start, right, partials = workspace.start, workspace.right, workspace.stage_partials
    s, n = workspace.increments.shape
    columns = workspace.partial.shape[1]
    stage_fields(motion, mode, t, h, p, which, workspace, True)
    if not factorise(h, workspace):
        return False
    for i in range(s * n):
        for column in range(columns):
            right[i, column] = 0.0
    for j in range(s):
        for k in range(n):
            for column in range(columns):
                drive = partials[j, k, column] if column == 0 or column > n else 0.0
                for a in range(n):
                    drive += partials[j, k, 1 + a] * start[n + a * columns + column]
                for i in range(s):
                    right[i * n + k, column] += h * _A[i, j] * drive
    lu_solve(workspace.matrix, workspace.pivots, s * n, right, columns)
    for k in range(n):
        for column in range(columns):
            at = n + k * columns + column
            target[at] = start[at] + right[(s - 1) * n + k, column]
    return True


@helper
def mean_rate(motion, mode, c, t, h, p, workspace, at_start):  # type: ignore[no-untyped-def]
    """Return the mean rate of the observable over the step, or its polynomial's value at the start."""
    z, stage = workspace.increments, workspace.stage
    s, n = z.shape
    total = 0.0
    for i in range(s):
        for k in range(n):
            stage[k] = workspace.start[k] + z[i, k]
        value = motion.rate(
            mode, c, t + _NODES[i] * h, stage[:n], p, workspace.none, workspace.empty
        )
        total += (_LAGRANGE[i] if at_start else _A[s - 1, i]) * value
    return total


@helper
def implicit_error(motion, mode, c, t, h, p, workspace):  # type: ignore[no-untyped-def]
    """Return the error of the last step, of its worst component, in units of what is allowed."""
    z, right, small, slopes = (
        workspace.increments,
        workspace.right,
        workspace.small[0],
        workspace.slopes,
    )
    s, n = z.shape
    columns = workspace.partial.shape[1]
    for k in range(n):
        for m in range(n):
            small[k, m] = (1.0 if k == m else 0.0) - h * _REAL * workspace.local[k, 1 + m]
    if not lu(small, workspace.pivots, n):
        return np.inf
    worst = 0.0
    if columns > 0:
        for k in range(n):
            for column in range(columns):
                at = n + k * columns + column
                defect = h * _REAL * slopes[0, at]
                for i in range(s):
                    defect += _DEFECT[i] * right[i * n + k, column]
                right[k, column] = defect
        lu_solve(small, workspace.pivots, n, right, columns)
        for k in range(n):
            for column in range(columns):
                worst = share_of(
                    motion, n + k * columns + column, right[k, column], workspace, worst
                )
    for k in range(n):
        defect = h * _REAL * slopes[0, k]
        for i in range(s):
            defect += _DEFECT[i] * z[i, k]
        right[k, 0] = defect
    lu_solve(small, workspace.pivots, n, right, 1)
    for k in range(n):
        worst = share_of(motion, k, right[k, 0], workspace, worst)
    if c >= 0:
        missed = slopes[0, n] - mean_rate(motion, mode, c, t, h, p, workspace, True)
        worst = share_of(motion, n, h * _REAL * missed, workspace, worst)
    return worst


@helper
def share_of(motion, k, error, workspace, worst):  # type: ignore[no-untyped-def]
    """Return the larger of ``worst`` and the error of component k in units of what is allowed."""
    size = max(abs(workspace.start[k]), abs(workspace.end[k]))
    here = abs(error) / (workspace.allowed[k] + motion.relative * size)
    return worst if here <= worst else here
