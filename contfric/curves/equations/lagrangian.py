r"""An extremum over the orbit as a condition of a curve, compiled: its gradient, and that of its gradient.

Let Q(z, p) be the extremum (:mod:`contfric.orbit.functionals.peak`). The orbits F(z, p) = 0 have the total
derivatives

.. math:: \frac{dQ}{dp_k} = G_{p_k}, \qquad G = Q' - \lambda^T F', \qquad F_z^T \lambda = Q_z ,

so that one transposed solve serves all parameters. With the direction :math:`d_k = (z_k, e_k)`,
:math:`F' d_k = 0`, in which orbits move with :math:`p_k`, the same is :math:`Q' d_k`. Its derivative is

.. math:: \delta\Bigl(\frac{dQ}{dp_k}\Bigr) = Q''[d_k, \delta] + Q_z \delta z_k
   = \bigl(Q'' - \lambda^T F''\bigr)[d_k, \delta] ,

since :math:`F''[d_k, \delta] + F_z \delta z_k = 0`. That is the derivative of the row G in the direction
:math:`d_k` at fixed :math:`\lambda`: a central difference of exact first derivatives, good to 1e-9. Points
are as accurate as G; only the speed of Newton's method depends on the difference.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.equations import close_chain, segment_rows
from contfric.compiled import allocating_helper, helper
from contfric.curves.equations.bending import DIFFERENCE
from contfric.curves.equations.chain import chain_solve, fill_blocks, set_border
from contfric.orbit.functionals.peak import (
    ExtremeWorkspace,
    extreme_row,
    extreme_workspace,
    find_location,
)


class LagrangianWorkspace(NamedTuple):
    """Workspace of the conditions; allocated once.

    Attributes
    ----------
    extreme : of the extremum
    multipliers : lambda, shape (N, m)
    rhs : right-hand sides, shape (N, m)
    direction, displaced : of joints, shape (N, m)
    on_joints, on_parameters : rows, shapes (2, N, m) and (2, q)
    """

    extreme: ExtremeWorkspace
    multipliers: FloatArray
    rhs: FloatArray
    direction: FloatArray
    displaced: FloatArray
    on_joints: FloatArray
    on_parameters: FloatArray


@allocating_helper
def lagrangian_workspace(count, whole, m, free):  # type: ignore[no-untyped-def]
    """Return the workspace for a chain of ``count`` segments, ``whole`` of the whole orbit."""
    return LagrangianWorkspace(
        extreme_workspace(whole, m, min(count, 0)),
        np.empty((count, m)),
        np.empty((count, m)),
        np.empty((count, m)),
        np.empty((count, m)),
        np.empty((2, count, m)),
        np.empty((2, free)),
    )


@helper
def location_found(way, z):  # type: ignore[no-untyped-def]
    """Tell whether the extremum has a location on the orbit, which is noted."""
    stationary = way.workspace.stationary
    return find_location(
        way.functions, way.layout, way.held.extreme, z, way.p, way.own.extreme, stationary
    )


@helper
def quantity_row(way, z, on_joints, on_parameters):  # type: ignore[no-untyped-def]
    """Return Q at the location that was found, and write Q'."""
    equations, stationary = way.workspace.equations, way.workspace.stationary
    return extreme_row(
        way.functions,
        way.layout,
        way.held.extreme,
        z,
        way.p,
        way.which,
        equations,
        stationary,
        way.own.extreme,
        on_joints,
        on_parameters,
    )


@helper
def subtract_equations(way, z, on_joints, on_parameters):  # type: ignore[no-untyped-def]
    """Subtract ``lambda^T F'`` from a row; False if something is not finite."""
    functions, layout, p, which = way.functions, way.layout, way.p, way.which
    equations, rows, factors = (
        way.workspace.equations,
        way.workspace.elimination.rows,
        way.own.multipliers,
    )
    count, m = z.shape
    close_chain(functions, layout, z, p, which, equations)
    close, close_w = equations.close, equations.close_w
    for i in range(count):
        after = z[i + 1] if i + 1 < count else equations.last
        if segment_rows(functions, layout, i, m, z[i], after, p, which, equations, rows) == np.inf:
            return False
        for j in range(m):
            factor, row = factors[i, j], m + j
            for k in range(m):
                on_joints[i, k] -= factor * rows[row, m + k]
                end = factor * rows[row, 2 * m + k]
                if i + 1 < count:
                    on_joints[i + 1, k] -= end
                    continue
                for c in range(m):
                    on_joints[0, c] -= end * close[k, c]
                for c in range(which.shape[0]):
                    on_parameters[c] -= end * close_w[k, c]
            for k in range(which.shape[0]):
                on_parameters[k] -= factor * rows[row, 3 * m + k]
    return True


@helper
def lagrangian_row(way, z, side):  # type: ignore[no-untyped-def]
    """Return Q, and write the row G with the multipliers that are known; NaN if something is not finite."""
    on_joints, on_parameters = way.own.on_joints[side], way.own.on_parameters[side]
    value = quantity_row(way, z, on_joints, on_parameters)
    return value if subtract_equations(way, z, on_joints, on_parameters) else np.nan


@helper
def solve_plainly(workspace, rhs, transposed, out):  # type: ignore[no-untyped-def]
    """Solve the chain (its transpose) whose blocks are filled; False if it is singular."""
    bordered = workspace.bordered
    bordered.even[:, :] = 0.0
    set_border(bordered, bordered.even, 1.0, 0.0)
    close, pencil = workspace.equations.close, workspace.pencil
    if not chain_solve(bordered, 1.0, bordered.even, rhs, transposed, close, pencil):
        return False
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = bordered.work.z[i, j, 0]
    return True


@helper
def differentiated_extreme(way, z):  # type: ignore[no-untyped-def]
    """Return Q, and write its multipliers and the row G: that of the parameters is dQ/dp.

    The closure of the chain is in the workspace, and is again. NaN where the orbit has no derivative.
    """
    workspace, own, turned = way.workspace, way.own, z.shape[0] > 0  # a flag, but no literal
    if not fill_blocks(way, z) or not location_found(way, z):
        return np.nan
    on_joints, on_parameters = own.on_joints[0], own.on_parameters[0]
    quantity_row(way, z, on_joints, on_parameters)
    if not solve_plainly(workspace, on_joints, turned, own.multipliers):
        return np.nan
    return lagrangian_row(way, z, 0)


@helper
def moves_with(k, workspace, own):  # type: ignore[no-untyped-def]
    """Write how the joints of the orbit move with free parameter k; False if the orbit has no derivative."""
    bordered, close_w = workspace.bordered, workspace.equations.close_w
    count, m = own.rhs.shape
    plain = count < 0  # a flag, but no literal
    for i in range(count):
        for j in range(m):
            own.rhs[i, j] = -bordered.columns[i, j, k]
            if i + 1 == count:
                for n in range(m):
                    own.rhs[i, j] -= bordered.b[i, j, n] * close_w[n, k]
    return solve_plainly(workspace, own.rhs, plain, own.direction)


@helper
def add_bend(way, k, z, d, e):  # type: ignore[no-untyped-def]
    """Write the derivative of the row G as parameter k moves the orbits; False if it fails."""
    p, which, workspace, own = way.p, way.which, way.workspace, way.own
    if not moves_with(k, workspace, own):
        return False
    here, direction, displaced = p[which[k]], own.direction, own.displaced
    size = 1.0 / (1.0 + abs(here))
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            size = max(size, abs(direction[i, j]) / (1.0 + abs(z[i, j])))
    step, fine = DIFFERENCE / size, True
    for side in range(2):
        h = step if side == 0 else -step
        p[which[k]] = here + h
        for i in range(z.shape[0]):
            for j in range(z.shape[1]):
                displaced[i, j] = z[i, j] + h * direction[i, j]
        fine = fine and math.isfinite(lagrangian_row(way, displaced, side))
    p[which[k]] = here
    for i in range(z.shape[0]):
        for j in range(z.shape[1]):
            d[i, j] = (own.on_joints[0, i, j] - own.on_joints[1, i, j]) / (2.0 * step)
    for j in range(which.shape[0]):
        e[j] = (own.on_parameters[0, j] - own.on_parameters[1, j]) / (2.0 * step)
    return fine
