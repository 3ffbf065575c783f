"""The largest and smallest displacement of an orbit, at joints or inside segments, compiled."""

from __future__ import annotations

import numpy as np
from numba import types

from contfric.bvp.equations import LayoutType, close_chain, equation_workspace
from contfric.bvp.monitor import start_value
from contfric.bvp.stationary_points import find_after_reset, find_stationary, stationary_workspace
from contfric.compiled import i8, kernel, matrix, vector
from contfric.flow.layouts import FlowType


@kernel(types.boolean(FlowType, LayoutType, i8, matrix, vector, vector))
def extent(functions, layout, c, z, p, out):  # type: ignore[no-untyped-def]
    """Write the least and the largest displacement of a whole orbit; False if a search fails.

    Parameters
    ----------
    c : the displacement as an observable, whose stationary points are found inside of segments
    z : joints of the whole orbit, shape (N, 1 + n)
    """
    count, m = z.shape
    free = min(count, 0)  # no parameter, and no literal
    workspace, stationary = equation_workspace(count, m, free), stationary_workspace()
    close_chain(functions, layout, z, p, workspace.none, workspace)
    low, high = np.inf, -np.inf
    for i in range(count):
        low, high = min(low, z[i, 1]), max(high, z[i, 1])
        if layout.resets[i] >= 0:
            found = find_after_reset(functions, layout, i, c, z, p, workspace, stationary)
            begin = start_value(functions, layout, i, c, z, p, workspace)
            low, high = min(low, begin), max(high, begin)
        else:
            found = find_stationary(functions, layout, i, c, z, p, workspace.last, stationary)
        if found < 0:
            return False
        for k in range(found):
            low, high = min(low, stationary.values[k]), max(high, stationary.values[k])
    out[0], out[1] = low, high
    return True
