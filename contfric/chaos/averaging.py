"""Mean rates of growth with an error estimate: batch means, compiled.

The logarithmic growth of each direction is summed in up to 32 batches of whole periods; when all are
full, neighbours are merged and batches become twice as long, so that there are always 16 or more. With
growth ``G_i`` over a time ``T_i`` in batch i of B, the estimate and its standard error are those of a
ratio of means::

    lambda = sum G_i / sum T_i,     error^2 = sum (G_i - lambda T_i)^2 / (B (B - 1)) / (mean T_i)^2.

Batches are longer than the memory of a chaotic solution, and so nearly independent (A. M. Law,
"Simulation Modeling and Analysis", section 9.5.3). Where they are not, the same sum over pairs of
batches is larger; the larger of the two is the error.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, IntArray
from contfric.compiled import allocating_helper, helper

#: Most batches; half as many are there after each merging. Even.
BATCHES = 32
#: Fewer batches than this give no standard error.
LEAST = 8
#: Standard errors by which a rate has a sign: of those that are zero three in a thousand have, too.
_SURE = 3.0
#: Logarithm of the factor by which a separation has grown when the motion has left an orbit that it came as
#: near to as 1e-4, which few do by chance.
_DEPARTED = math.log(1e4)
#: A motion that grows in every batch, by this share in all, and no more slowly in the second half than by
#: this share of the first, has no bound in sight. (Growth at a resonance without damping is linear, and so
#: twice as large after twice the time; one that converges slows down.)
_GROWTH, _STEADY = 1.2, 0.8


class Averages(NamedTuple):
    """Sums over batches, and what has been gathered since the last whole period.

    Attributes
    ----------
    growth, time, size : growth of each direction, duration and largest state of each batch, shapes
        (BATCHES, n), (BATCHES,) and (BATCHES,)
    pending : the same since the last whole period: growth, then duration, then size; shape (n + 2,)
    place : batches that are full, periods in the one at work, periods in a batch; shape (3,)
    """

    growth: FloatArray
    time: FloatArray
    size: FloatArray
    pending: FloatArray
    place: IntArray


@allocating_helper
def new_averages(n):  # type: ignore[no-untyped-def]
    """Return the workspace for the averages of n directions."""
    return Averages(
        np.empty((BATCHES, n)),
        np.empty(BATCHES),
        np.empty(BATCHES),
        np.empty(n + 2),
        np.empty(3, dtype=np.int64),
    )


@helper
def clear(averages):  # type: ignore[no-untyped-def]
    """Begin anew."""
    averages.growth[:, :] = 0.0
    averages.time[:] = 0.0
    averages.size[:] = 0.0
    averages.pending[:] = 0.0
    averages.place[0], averages.place[1], averages.place[2] = 0, 0, 1


@helper
def gather(pending, growth, live, duration, y):  # type: ignore[no-untyped-def]
    """Add what happened on one segment."""
    n = growth.shape[0]
    for k in range(live):
        pending[k] += growth[k]
    pending[n] += duration
    for j in range(y.shape[0]):
        pending[n + 1] = max(pending[n + 1], abs(y[j]))


@helper
def close_periods(averages, periods):  # type: ignore[no-untyped-def]
    """Put what is pending into the batch at work; return whether all batches have just been filled."""
    n, place, pending = averages.growth.shape[1], averages.place, averages.pending
    batch = place[0]
    for k in range(n):
        averages.growth[batch, k] += pending[k]
    averages.time[batch] += pending[n]
    averages.size[batch] = max(averages.size[batch], pending[n + 1])
    pending[:] = 0.0
    place[1] += periods
    if place[1] < place[2]:
        return False
    place[0], place[1] = batch + 1, 0
    if place[0] < BATCHES:
        return False
    for i in range(BATCHES // 2):
        for k in range(n):
            averages.growth[i, k] = averages.growth[2 * i, k] + averages.growth[2 * i + 1, k]
        averages.time[i] = averages.time[2 * i] + averages.time[2 * i + 1]
        averages.size[i] = max(averages.size[2 * i], averages.size[2 * i + 1])
    for i in range(BATCHES // 2, BATCHES):
        averages.growth[i, :] = 0.0
        averages.time[i] = 0.0
        averages.size[i] = 0.0
    place[0], place[2] = BATCHES // 2, 2 * place[2]
    return True


@helper
def scatter(averages, k, rate, width):  # type: ignore[no-untyped-def]
    """Return the standard error of rate k from batches joined ``width`` at a time; inf if too few."""
    count = averages.place[0] // width
    if count * width < LEAST:
        return np.inf
    squares, total = 0.0, 0.0
    for i in range(count):
        growth, time = 0.0, 0.0
        for j in range(width):
            growth += averages.growth[width * i + j, k]
            time += averages.time[width * i + j]
        squares += (growth - rate * time) ** 2
        total += time
    return math.sqrt(squares / (count * (count - 1.0))) * count / total


@helper
def elapsed(averages):  # type: ignore[no-untyped-def]
    """Return the time averaged over."""
    time = 0.0
    for i in range(BATCHES):
        time += averages.time[i]
    return time


@helper
def mean_rate(averages, k):  # type: ignore[no-untyped-def]
    """Return the mean growth of direction k in a unit of time, and its standard error."""
    growth, time = 0.0, elapsed(averages)
    for i in range(BATCHES):
        growth += averages.growth[i, k]
    if time <= 0.0:
        return 0.0, np.inf
    rate = growth / time
    return rate, max(scatter(averages, k, rate, 1), scatter(averages, k, rate, 2))


@helper
def sign_of(averages, rate, error):  # type: ignore[no-untyped-def]
    """Return the sign of the largest rate, 0 if it is not certain.

    A solution that leaves an orbit which repels weakly grows as steadily as can be, with no scatter
    at all; so a positive sign also takes more growth than such a departure can have.
    """
    if rate > _SURE * error and rate * elapsed(averages) > _DEPARTED:
        return 1
    return -1 if rate < -_SURE * error else 0


@helper
def grows(averages):  # type: ignore[no-untyped-def]
    """Tell whether the solution has become larger all the time, with no bound in sight."""
    size, last = averages.size, averages.place[0] - 1
    if last + 1 < LEAST:
        return False
    for i in range(last):
        if size[i + 1] <= size[i]:
            return False
    middle = last // 2
    first, second = size[middle] - size[0], size[2 * middle] - size[middle]
    return size[last] > _GROWTH * size[0] and second > _STEADY * first
