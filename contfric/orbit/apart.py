"""How far two motions are apart, compiled: asked for every pair of events."""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import f8, kernel, matrix


@kernel(f8(matrix, matrix, f8))
def farthest_apart(one, other, cycle):  # type: ignore[no-untyped-def]
    """Return the Hausdorff distance of two sets of joints (t, y), in the largest component.

    Parameters
    ----------
    one, other : shapes (k, 1 + n)
    cycle : times are modulo this; infinite if they are not
    """
    farthest = 0.0
    for side in range(2):
        here, there = (one, other) if side == 0 else (other, one)
        for i in range(here.shape[0]):
            nearest = np.inf
            for j in range(there.shape[0]):
                gap = abs(here[i, 0] - there[j, 0])
                if math.isfinite(cycle):
                    gap = abs((gap + 0.5 * cycle) % cycle - 0.5 * cycle)
                for k in range(1, here.shape[1]):
                    apart = abs(here[i, k] - there[j, k])
                    if apart > gap or math.isnan(apart):
                        gap = apart
                if math.isnan(gap):
                    return np.nan
                nearest = min(nearest, gap)
            farthest = max(farthest, nearest)
    return farthest
