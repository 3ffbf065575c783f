"""The distance of two solutions, compiled: needed for every pair of events."""

from __future__ import annotations

import math

import numpy as np

from contfric.compiled import f8, helper, kernel, matrix, vector


@helper
def joint_gap(one, i, other, j, cycles):  # type: ignore[no-untyped-def]
    """Return how far a joint of one solution is from one of another, in the largest component."""
    gap = 0.0
    for k in range(one.shape[1]):
        apart, cycle = abs(one[i, k] - other[j, k]), cycles[k]
        if math.isfinite(cycle):
            apart = abs((apart + 0.5 * cycle) % cycle - 0.5 * cycle)
        if apart > gap or math.isnan(apart):
            gap = apart
    return gap


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
                gap = joint_gap(here, i, there, j, cycles)
                if math.isnan(gap):
                    return np.nan
                nearest = min(nearest, gap)
            farthest = max(farthest, nearest)
    return farthest


@kernel(f8(matrix, matrix, vector))
def cyclic_apart(one, other, cycles):  # type: ignore[no-untyped-def]
    """Return the distance of two cyclic sequences of as many joints, turned so that it is the least.

    The same joints in another order are another sequence.
    """
    count, least = one.shape[0], np.inf
    for turn in range(count):
        farthest = 0.0
        for i in range(count):
            gap = joint_gap(one, i, other, (i + turn) % count, cycles)
            if math.isnan(gap):
                return np.nan
            farthest = max(farthest, gap)
            if farthest >= least:
                break
        least = min(least, farthest)
    return least
