"""Conditions on quantities as border rows, compiled: q free parameters, q - 1 conditions.

What is held or stationary is an extremum over the orbit (:mod:`contfric.curves.equations.lagrangian`), or
any other function, which is called by its address: it finds the point in arrays that it shares with the
march, and leaves values and rows there.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import types

from contfric.base.arrays import FloatArray
from contfric.bvp.equations import LayoutType, close_chain
from contfric.bvp.system import Layout
from contfric.compiled import blocks, f8, helper, i8, matrix, vector
from contfric.continuation.core.geometry import copy_to, copy_vector
from contfric.curves.equations.lagrangian import (
    add_bend,
    differentiated_extreme,
    location_found,
    quantity_row,
)
from contfric.handle import HandleType
from contfric.orbit.functionals.peak import Extreme, ExtremeType

#: What the conditions are: an extremum that has a value, one that is stationary in all free parameters but
#: the last, a function that is called.
AT_VALUE, STATIONARY, CALLED = range(3)
#: A function of Python that fills the arrays of its conditions; 0 if it cannot.
FILL = {"fill": i8(i8)}
FillType = HandleType("fill", FILL)


class Conditions(NamedTuple):
    """What vanishes along a curve, as the compiled engine takes it.

    Attributes
    ----------
    kind : one of the three above
    value : what the extremum is held at
    extreme : the extremum
    call : handle of the function
    z, p : where the function is asked, shapes (N, m) and (parameters,)
    values : what vanishes, shape (q - 1,)
    on_joints, on_parameters : its derivatives, shapes (q - 1, N, m) and (q - 1, q)
    """

    kind: int
    value: float
    extreme: Extreme
    call: Any
    z: FloatArray
    p: FloatArray
    values: FloatArray
    on_joints: FloatArray
    on_parameters: FloatArray


ConditionsType = types.NamedTuple(
    [i8, f8, ExtremeType, FillType, matrix, vector, vector, blocks, matrix], Conditions
)


def _nothing(kind: Any) -> Any:
    """Return a value of a type of a layout's member that holds nothing."""
    if not isinstance(kind, types.Array):
        return 0.0 if kind == f8 else 0
    return np.empty((0,) * kind.ndim, dtype=str(kind.dtype))


@cache
def no_quantity() -> Conditions:
    """Return what stands where nothing is asked of a quantity."""
    extreme = Extreme(-1, 0, 1.0, Layout(*map(_nothing, LayoutType.types)))
    none, grid = np.empty(0), np.empty((0, 0))
    return Conditions(CALLED, 0.0, extreme, 0, grid, none, none, np.empty((0, 0, 0)), grid)


@helper
def call_conditions(way, z):  # type: ignore[no-untyped-def]
    """Ask a function for the conditions; return the largest of them, NaN if it fails."""
    conditions, workspace = way.held, way.workspace
    copy_to(conditions.z, z)
    copy_vector(conditions.p, way.p)
    if conditions.call.fill(0) == 0:
        return np.nan
    worst = 0.0
    for k in range(conditions.values.shape[0]):
        copy_to(workspace.d[1 + k], conditions.on_joints[k])
        copy_vector(workspace.e[1 + k], conditions.on_parameters[k])
        worst = max(worst, abs(conditions.values[k]))
    return worst


@helper
def fill_conditions(way, z):  # type: ignore[no-untyped-def]
    """Evaluate the conditions, and write their rows to the border; return the largest value."""
    conditions, widths, d, e = way.held, way.widths, way.workspace.d, way.workspace.e
    values = conditions.values
    if conditions.kind == CALLED:
        return call_conditions(way, z)
    if conditions.kind == AT_VALUE:
        if not location_found(way, z):
            return np.nan
        values[0] = quantity_row(way, z, d[1], e[1]) - conditions.value
        return abs(values[0])
    if not math.isfinite(differentiated_extreme(way, z)):
        return np.nan
    worst = 0.0
    for k in range(values.shape[0]):
        values[k] = way.own.on_parameters[0, k] * widths[k]
    for k in range(values.shape[0]):
        if not add_bend(way, k, z, d[1 + k], e[1 + k]):
            return np.nan
        for i in range(z.shape[0]):
            for j in range(z.shape[1]):
                d[1 + k, i, j] *= widths[k]
        for j in range(way.which.shape[0]):
            e[1 + k, j] *= widths[k]
        close_chain(way.functions, way.layout, z, way.p, way.which, way.workspace.equations)
        worst = max(worst, abs(values[k]))
    return worst
