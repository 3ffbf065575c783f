"""Cells of a grid, and where the return map of a section may have a fixed point.

A cell is a box of the section whose corners are nodes. With the event j of all corners at the end of
the same itinerary back to the section, the gap of a corner is what its return misses,

    g = (time since the start - periods, position at the return - position at the start),

for a return to the mirror image after half of an odd number of periods the same with the image.
A fixed point is a zero of g. The box of the gaps at the corners, enlarged by its own size, contains the
gaps in the cell unless g bends in the cell by as much as it changes; where that enlarged box does
not contain zero the cell has no fixed point of this itinerary. Otherwise the cell is **near**.

Corners whose itineraries differ within the limits make a cell **mixed**: a discontinuity goes through it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.censuses.grid import Grid

#: Times at which itineraries may differ without harm, beyond the longest orbit (periods).
_SLACK = 0.05


@dataclass(frozen=True)
class Cells:
    """Boxes of one size.

    Attributes
    ----------
    low : lowest corner of each, shape (K, d)
    size : of all of them, in units of the lattice
    rows : of the grid's nodes at the corners, shape (K, 2**d)
    """

    low: IntArray
    size: int
    rows: IntArray

    def __len__(self) -> int:
        return len(self.low)


@dataclass(frozen=True)
class Near:
    """Cells that may have a fixed point of one itinerary.

    Attributes
    ----------
    cells : their indices, shape (K,)
    event : index of the event that closes the itinerary
    periods, half : of the orbit; whether it closes with its mirror image
    gaps : at the corners, shape (K, 2**d, d)
    """

    cells: IntArray
    event: int
    periods: int
    half: bool
    gaps: FloatArray


def corners_of(dimension: int) -> IntArray:
    """Return the corners of the unit box, shape (2**d, d).

    Examples
    --------
    >>> corners_of(1).tolist()
    [[0], [1]]
    """
    places = np.arange(1 << dimension)
    return (places[:, None] >> np.arange(dimension)[None, :]) & 1


def make_cells(grid: Grid, low: IntArray, size: int) -> Cells:
    """Return the cells with these lowest corners; those without any start are left out."""
    corners = low[:, None, :] + size * corners_of(low.shape[1])[None, :, :]
    rows = grid.rows(corners.reshape(-1, low.shape[1])).reshape(len(low), corners.shape[1])
    alive = (grid.code[rows, 0] >= 0).any(axis=1)
    return Cells(low[alive], size, rows[alive])


def halved(grid: Grid, cells: Cells, chosen: NDArray[np.bool_]) -> Cells:
    """Return the parts of half the size of the chosen cells."""
    size = cells.size // 2
    dimension = cells.low.shape[1]
    low = cells.low[chosen][:, None, :] + size * corners_of(dimension)[None, :, :]
    return make_cells(grid, low.reshape(-1, dimension), size)


def common_events(grid: Grid, cells: Cells) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the events that all corners have in common, shape (K, E), and which cells are mixed."""
    code, lift = grid.code[cells.rows], grid.lift[cells.rows]
    same = (code == code[:, :1]).all(axis=1)
    common = np.logical_and.accumulate(same, axis=1)
    first = np.argmin(common, axis=1)
    earliest = lift.min(axis=1)[np.arange(len(cells)), first]
    mixed = ~common.all(axis=1) & (earliest <= grid.limits.periods + _SLACK)
    return common & (code[:, 0] >= 0), mixed


def near_cells(grid: Grid, cells: Cells, common: NDArray[np.bool_]) -> Iterator[Near]:
    """Yield the cells that are near to a fixed point, for every itinerary and number of periods."""
    code = grid.code[cells.rows[:, 0]]

    def is_near(gaps: FloatArray) -> NDArray[np.bool_]:
        low, high = gaps.min(axis=1), gaps.max(axis=1)
        width = high - low
        return np.asarray(((low - width <= 0.0) & (high + width >= 0.0)).all(axis=1))

    for event, half, letter in _closings(grid):
        chosen = np.flatnonzero(common[:, event] & (code[:, event] == letter))
        yield from _near(grid, chosen, cells.rows[chosen], event, half, is_near)


def closing_nodes(grid: Grid, rows: IntArray, limit: FloatArray) -> Iterator[Near]:
    """Yield the nodes with gaps below a limit, shape (d,), for every itinerary and number of periods.

    The cells of the result are the rows of the nodes.
    """

    def is_near(gaps: FloatArray) -> NDArray[np.bool_]:
        return np.asarray((np.abs(gaps[:, 0]) <= limit).all(axis=1))

    for event, half, letter in _closings(grid):
        chosen = rows[grid.code[rows, event] == letter]
        yield from _near(grid, chosen, chosen[:, None], event, half, is_near)


def _closings(grid: Grid) -> Iterator[tuple[int, bool, int]]:
    """Yield the events that may close an itinerary, by itself or with its mirror image, and their letters."""
    for event in range(grid.events):
        yield from ((event, False, grid.own), (event, True, grid.image))


def _near(
    grid: Grid,
    chosen: IntArray,
    rows: IntArray,
    event: int,
    half: bool,
    is_near: Callable[[FloatArray], NDArray[np.bool_]],
) -> Iterator[Near]:
    """Yield those of the chosen cells, with the rows of their corners, that are near for some periods."""
    if not len(chosen):
        return
    gaps = gaps_of(grid, rows, event, half)
    step, fraction = (2, _fraction(grid)) if half else (1, 1.0)
    for periods in range(1, grid.limits.periods + 1, step):
        here = gaps.copy()
        here[..., 0] -= periods * fraction
        near = is_near(here)
        if near.any():
            yield Near(chosen[near], event, periods, half, here[near])


def _fraction(grid: Grid) -> float:
    assert grid.model.symmetry is not None  # there is no half without it
    return grid.model.symmetry.fraction


def gaps_of(grid: Grid, rows: IntArray, event: int, half: bool) -> FloatArray:
    """Return the gaps of nodes at one event, shape (.., d); the periods are not yet taken off."""
    start, end = grid.start[rows], grid.state[rows, event]
    if half:
        assert grid.model.symmetry is not None
        start = start @ grid.model.symmetry.array().T
        # the section's own directions, as the symmetry sees them
        basis = grid.model.symmetry.array() @ grid.section.basis
    else:
        basis = grid.section.basis
    return np.concatenate([grid.lift[rows, event][..., None], (end - start) @ basis], axis=-1)
