"""Statistics of samples in blocks: shares with intervals, Sobol indices with intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.response.basins import wilson

#: Resamples for the intervals of Sobol indices: their ends are the 10th of each side, good to a third of the
#: interval's own width at most.
_RESAMPLES = 400
#: Fewest blocks for indices: of fewer they are no better than 0.5, with an error of about 2 / sqrt(blocks).
_LEAST = 16


@dataclass(frozen=True)
class Interval:
    """A share with the limits of its 95 % interval."""

    share: float
    low: float
    high: float


@dataclass(frozen=True)
class SobolIndices:
    """How much of the variance of an event's place each parameter has.

    Attributes
    ----------
    first, total : by the parameter's name: its own share of the variance, and that with all its interactions
    first_interval, total_interval : their 95 % intervals, by resampling blocks
    blocks : blocks of samples that they come from: a power of 2, as scipy asks for
    share : share of all whole blocks that have the event in each of their samples; below 1 the indices
        are those among such samples, whose parameters are no longer independent
    """

    first: dict[str, float]
    total: dict[str, float]
    first_interval: dict[str, tuple[float, float]]
    total_interval: dict[str, tuple[float, float]]
    blocks: int
    share: float


def share_of(members: NDArray[np.bool_], counted: NDArray[np.bool_], block: int) -> Interval:
    """Return the share of members among what is counted, with its interval.

    Samples of a block depend on each other, blocks do not: Wilson's interval is taken for as many independent
    samples as have the same variance of the share (a ratio of sums over blocks).

    Examples
    --------
    >>> every = np.ones(10, dtype=bool)
    >>> found = share_of(np.arange(10) < 8, every, 1)
    >>> round(found.low, 2), round(found.high, 2)
    (0.49, 0.94)
    """
    first = np.arange(0, len(counted), block)
    m = np.add.reduceat(counted.astype(float), first)
    y = np.add.reduceat((members & counted).astype(float), first)
    total, blocks = float(m.sum()), int(np.sum(m > 0))
    if total == 0.0:
        return Interval(np.nan, 0.0, 1.0)
    share = float(y.sum()) / total
    spread = float(np.sum((y - share * m) ** 2)) * blocks / max(blocks - 1, 1) / total**2
    # a block is at least one sample, and no more than all of its own
    like = share * (1.0 - share) / spread if spread > 0.0 else float(blocks)
    return Interval(share, *wilson(share, float(np.clip(like, blocks, total))))


def sobol_indices(values: FloatArray, names: tuple[str, ...], seed: int) -> SobolIndices | None:
    """Return the Sobol indices of a number of each sample, nan where it has none; None of few blocks.

    Parameters
    ----------
    values : shape (samples,), in blocks as :meth:`contfric.ensembles.drawing.Varied.draw` returns them
    seed : of the resampling
    """
    d = len(names)
    whole = len(values) // (d + 2)
    table = values[: whole * (d + 2)].reshape(whole, d + 2)
    table = table[np.isfinite(table).all(axis=1)]
    found = len(table)
    if found < _LEAST:
        return None
    blocks = 1 << (found.bit_length() - 1)
    table = table[:blocks]
    first, total = _indices(table)
    draw = np.random.default_rng(seed)
    drawn = [_indices(table[draw.integers(blocks, size=blocks)]) for _ in range(_RESAMPLES)]
    ends = np.quantile(np.array(drawn), [0.025, 0.975], axis=0)

    def named(row: Any) -> dict[str, Any]:
        return {n: x.tolist() for n, x in zip(names, row, strict=True)}

    one, other = (
        {n: (low, high) for n, (low, high) in named(ends[:, k].T).items()} for k in (0, 1)
    )
    return SobolIndices(named(first), named(total), one, other, blocks, found / whole)


def _indices(table: FloatArray) -> tuple[FloatArray, FloatArray]:
    from scipy.stats import sobol_indices as of_scipy

    columns = table.T
    d = len(columns) - 2
    mixed = np.resize(columns[2:], (max(d, 2), len(table)))  # scipy fails at a single parameter
    parts = {"f_A": columns[:1], "f_B": columns[1:2], "f_AB": mixed[:, None, :]}
    found = of_scipy(func=parts, n=len(table))
    return np.asarray(found.first_order[:d]), np.asarray(found.total_order[:d])
