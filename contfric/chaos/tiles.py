"""A tile of a map: an independent task; its cells do not know of each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.chaos.rows import FollowingLimits, follow
from contfric.chaos.starts import default_states
from contfric.chaos.status import Motion
from contfric.chaos.work import TileTask
from contfric.models.definition import Model

#: Rows and columns of a rectangle.
Place: TypeAlias = tuple[slice, slice]


@dataclass(frozen=True, eq=False)
class TileRows:
    """Results of a tile; all arrays begin with shape (rows, columns, starts).

    Attributes
    ----------
    exponents : shape (rows, columns, starts, n)
    errors, motions, periods, followed : error of the largest exponent, number of the motion, its period,
        periods that it was followed
    """

    exponents: FloatArray
    errors: FloatArray
    motions: NDArray[np.uint8]
    periods: NDArray[np.int32]
    followed: NDArray[np.int32]


def empty_tile(shape: tuple[int, int, int], n: int) -> TileRows:
    """Return rows of which nothing is computed yet."""
    return TileRows(
        np.full((*shape, n), np.nan),
        np.full(shape, np.nan),
        np.full(shape, Motion.MISSING.code, dtype=np.uint8),
        np.zeros(shape, dtype=np.int32),
        np.zeros(shape, dtype=np.int32),
    )


@dataclass(frozen=True, eq=False)
class Tile(TileTask):
    """A task: the cells of a rectangle of the grid.

    Attributes
    ----------
    model : Model
    limits : Limits
        How long solutions are followed.
    vector : ndarray, shape (parameters,)
        The parameters that do not vary.
    varied : tuple of int
        Positions of the two that do.
    values : tuple of ndarray
        Their values in this tile, shapes (rows,) and (columns,).
    starts : int
        Solutions in each cell.
    states : ndarray or None
        Their initial states, shape (rows, columns, starts, n); None for the default ones.
    time : float
        Their initial time.
    """

    model: Model
    limits: FollowingLimits
    vector: FloatArray
    varied: tuple[int, int]
    values: tuple[FloatArray, FloatArray]
    starts: int
    states: FloatArray | None
    time: float

    @property
    def shape(self) -> tuple[int, int, int]:
        """Rows, columns and starts."""
        return len(self.values[0]), len(self.values[1]), self.starts

    def part(self, place: Place) -> Tile:
        """Return a rectangle of it."""
        values = self.values[0][place[0]], self.values[1][place[1]]
        states = None if self.states is None else self.states[place]
        return replace(self, values=values, states=states)

    def vectors(self) -> FloatArray:
        """Return the parameters of each cell, shape (rows * columns, parameters)."""
        rows, columns, _ = self.shape
        vectors = np.tile(self.vector, (rows, columns, 1))
        vectors[:, :, self.varied[0]] = self.values[0][:, None]
        vectors[:, :, self.varied[1]] = self.values[1][None, :]
        return vectors.reshape(rows * columns, -1)


def inside(model: Model, named: Mapping[str, Any], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Tell where a model is defined; its parameters are numbers or arrays that make up ``shape``."""
    holds = np.ones(shape, dtype=np.bool_)
    for constraint in model.constraints:
        try:
            left = constraint.value(named)
        except (TypeError, OverflowError):  # a value that is no number: what takes it says so
            continue
        holds &= (left > 0.0) if constraint.strict else (left >= 0.0)
    return holds


def compute_tile(tile: Tile, stop: IntArray | None = None) -> TileRows:
    """Compute the cells of a tile; what it returns depends on nothing but the tile.

    ``stop`` is that of :func:`contfric.chaos.rows.follow`.
    """
    rows, columns, starts = tile.shape
    n = len(tile.model.states)
    vectors = tile.vectors()
    columns_of = dict(zip(tile.model.parameter_names, vectors.T, strict=True))
    defined = inside(tile.model, columns_of, (len(vectors),))
    found = empty_tile((rows * columns, starts, 1), n)
    found.motions[~defined] = Motion.OUTSIDE.code
    vectors = vectors[defined]
    if tile.states is not None:
        states = tile.states.reshape(rows * columns, starts, n)[defined]
    else:
        named = (tile.model.mapping(vector) for vector in vectors)
        states = np.array([default_states(tile.model, params, starts) for params in named])
    cells = follow(
        tile.model,
        np.repeat(vectors, starts, axis=0),
        states.reshape(-1, n),
        tile.time,
        tile.limits,
        stop,
    )
    shape = (len(vectors), starts, 1)
    found.exponents[defined] = cells.exponents.reshape(*shape, n)
    found.errors[defined] = cells.errors[:, 0].reshape(shape)
    found.motions[defined] = cells.motions.reshape(shape)
    found.periods[defined] = cells.turns.reshape(shape)
    found.followed[defined] = cells.followed.reshape(shape)
    return reshaped(found, (rows, columns, starts))


def reshaped(rows: TileRows, shape: tuple[int, int, int]) -> TileRows:
    """Return the same rows in another shape."""
    return TileRows(
        rows.exponents.reshape(*shape, -1),
        rows.errors.reshape(shape),
        rows.motions.reshape(shape),
        rows.periods.reshape(shape),
        rows.followed.reshape(shape),
    )


def places(shape: tuple[int, ...], side: int) -> Iterator[Place]:
    """Yield the rectangles that a grid is cut into, row by row.

    Examples
    --------
    >>> [(rows.start, columns.stop) for rows, columns in places((2, 3), 2)]
    [(0, 2), (0, 3)]
    """
    for row in range(0, shape[0], side):
        for column in range(0, shape[1], side):
            yield (
                slice(row, min(row + side, shape[0])),
                slice(column, min(column + side, shape[1])),
            )
