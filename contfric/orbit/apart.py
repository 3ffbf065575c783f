"""How far two motions are apart, compiled: asked for every pair of events."""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import f8, kernel, matrix, vector


@kernel(f8(matrix, matrix, vector))
def farthest_apart(one, other, cycles):  # type: ignore[no-untyped-def]
    """Return the Hausdorff distance of two sets of joints (t, y), in the largest component.

    Parameters
    ----------
    one, other : shapes (k, 1 + n)
    cycles : each column is modulo this; infinite where it is not, shape (1 + n,)
    """
    farthest = 0.0
    for side in range(2):
        here, there = (one, other) if side == 0 else (other, one)
        for i in range(here.shape[0]):
            nearest = np.inf
            for j in range(there.shape[0]):
                gap = 0.0
                for k in range(here.shape[1]):
                    apart, cycle = abs(here[i, k] - there[j, k]), cycles[k]
                    if math.isfinite(cycle):
                        apart = abs((apart + 0.5 * cycle) % cycle - 0.5 * cycle)
                    if apart > gap or math.isnan(apart):
                        gap = apart
                if math.isnan(gap):
                    return np.nan
                nearest = min(nearest, gap)
            farthest = max(farthest, nearest)
    return farthest
