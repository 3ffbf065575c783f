"""Lyapunov exponents on a grid of two parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.extras import need_xarray
from contfric.base.named import Named
from contfric.base.tabled import Columns, Tabled
from contfric.chaos.exponents import lyapunov_dimension
from contfric.chaos.status import Motion
from contfric.chaos.tiles import TileRows
from contfric.models.definition import Model

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Exact exponents that differ by more than this belong to different orbits: far above their errors, and
#: far below what differs between orbits that are not mirror images.
_DIFFERENT = 1e-7


@dataclass(frozen=True, eq=False)
class LyapunovMap(Tabled):
    """Lyapunov exponents on a grid of two parameters; the result of :func:`contfric.lyapunov_map`.

    Attributes
    ----------
    model : Model
    axes : dict
        The two parameters that vary and their values, in the order of the arrays' first axes.
    vector : ndarray, shape (parameters,)
        The parameters that do not vary.
    rows : TileRows
        What each solution turned out to be; arrays begin with shape (len, len, starts).

    Examples
    --------
    >>> import contfric as cf
    >>> grid = {"Omega": [0.35, 0.5], "S": [0.05, 0.2, 0.32]}
    >>> cf.lyapunov_map("coulomb", grid, {"S0": 0.4}, periods=100).values.shape
    (2, 3)
    """

    model: Model
    axes: dict[str, FloatArray]
    vector: FloatArray
    rows: TileRows

    @property
    def params(self) -> dict[str, float]:
        """The parameters that do not vary."""
        named = self.model.mapping(self.vector)
        return Named({name: value for name, value in named.items() if name not in self.axes})

    @property
    def shape(self) -> tuple[int, int]:
        """Lengths of the two axes."""
        rows, columns, _ = self.motions.shape
        return rows, columns

    @property
    def starts(self) -> int:
        """Number of initial states at each point."""
        return int(self.motions.shape[2])

    # --------------------------------------------------------------------- every solution

    @property
    def exponents(self) -> FloatArray:
        """All exponents of every solution, largest first, shape (len, len, starts, n)."""
        return self.rows.exponents

    @property
    def errors(self) -> FloatArray:
        """Error of the largest exponent of every solution, shape (len, len, starts)."""
        return self.rows.errors

    @property
    def motions(self) -> NDArray[np.uint8]:
        """Code of the :class:`~contfric.chaos.status.Motion` of each, shape (len, len, starts)."""
        return self.rows.motions

    @property
    def periods(self) -> NDArray[np.int32]:
        """Periods of periodic solutions, in periods of the excitation or of a clock, 0 for others."""
        return self.rows.periods

    @property
    def followed(self) -> NDArray[np.int32]:
        """Periods that each solution was followed, shape (len, len, starts)."""
        return self.rows.followed

    # --------------------------------------------------------------------- the grid

    @cached_property
    def _largest(self) -> NDArray[np.int64]:
        """The start with the largest exponent at each point."""
        first = self.exponents[..., 0]
        return np.asarray(np.argmax(np.where(np.isnan(first), -np.inf, first), axis=2))

    def _of_largest(self, array: FloatArray) -> FloatArray:
        return np.asarray(np.take_along_axis(array, self._largest[..., None], 2)[..., 0])

    @cached_property
    def values(self) -> FloatArray:
        """Largest exponent over all starts, shape (len, len); nan without one."""
        return self._of_largest(self.exponents[..., 0])

    @cached_property
    def uncertainty(self) -> FloatArray:
        """Error of the values, shape (len, len)."""
        return self._of_largest(self.errors)

    @cached_property
    def second(self) -> FloatArray:
        """Second exponent at each value, shape (len, len); -inf where sticks leave none.

        Without a second state it is nan.
        """
        if self.exponents.shape[-1] < 2:
            return np.full(self.shape, np.nan)
        return self._of_largest(self.exponents[..., 1])

    @cached_property
    def dimension(self) -> FloatArray:
        """Lyapunov dimension in the stroboscopic section at each value, shape (len, len)."""
        return self._of_largest(lyapunov_dimension(self.exponents))

    def where(self, *motions: Motion) -> NDArray[np.bool_]:
        """Tell where any start leads to one of some solutions, shape (len, len)."""
        return np.asarray(np.isin(self.motions, [m.code for m in motions]).any(axis=2))

    @property
    def chaotic(self) -> NDArray[np.bool_]:
        """Where any start leads to chaos, shape (len, len)."""
        return self.where(Motion.CHAOTIC)

    @cached_property
    def coexisting(self) -> NDArray[np.bool_]:
        """Where the starts lead to different attractors, shape (len, len).

        Mirror images of each other count as one.
        """
        kinds = self.motions.copy()
        kinds[kinds == Motion.TRANSIENT.code] = Motion.PERIODIC.code  # the same in the end
        largest = self.exponents[..., 0]
        exact = np.isin(kinds, [Motion.PERIODIC.code, Motion.HELD.code])
        low = np.min(np.where(exact, largest, np.inf), axis=2)
        high = np.max(np.where(exact, largest, -np.inf), axis=2)
        several = (kinds != kinds[..., :1]).any(axis=2)
        several |= (self.periods != self.periods[..., :1]).any(axis=2)
        return np.asarray(several | (high - low > _DIFFERENT))

    def absent(self, missing: bool = False) -> NDArray[np.bool_]:
        """Tell where no solution has an exponent, or (``missing``) where nothing was computed."""
        lost = self.where(Motion.MISSING)
        return lost if missing else np.asarray(np.isnan(self.values) & ~lost)

    @property
    def complete(self) -> bool:
        """Whether everything has been computed; False after an interrupt."""
        return not bool(np.any(self.motions == Motion.MISSING.code))

    def counts(self) -> dict[Motion, int]:
        """Return how many solutions there are of each kind that occurs."""
        found = np.bincount(self.motions.ravel(), minlength=len(Motion))
        return {motion: int(found[motion.code]) for motion in Motion if found[motion.code]}

    # --------------------------------------------------------------------- out

    def columns(self) -> Columns:
        """Return one row for each solution: parameters, start, exponents, what it is."""
        first, second = self.axes
        index = np.indices(self.motions.shape).reshape(3, -1)
        n = self.exponents.shape[-1]
        return {
            first: self.axes[first][index[0]],
            second: self.axes[second][index[1]],
            "start": index[2] + 1,
            **{f"exponent_{k + 1}": self.exponents[..., k].ravel() for k in range(n)},
            "error": self.errors.ravel(),
            "motion": Motion.words()[self.motions.ravel()],
            "periods": self.periods.ravel(),
            "followed": self.followed.ravel(),
        }

    def to_xarray(self) -> xr.Dataset:
        """Return exponents, their errors and kinds over parameters and starts as a dataset (needs xarray)."""
        need_xarray()
        import xarray as xr

        dims = (*self.axes, "start")
        return xr.Dataset(
            {
                "exponents": ((*dims, "exponent"), self.exponents),
                "error": (dims, self.errors),
                "motion": (dims, Motion.words()[self.motions]),
                "periods": (dims, self.periods),
                "followed": (dims, self.followed),
            },
            coords=dict(self.axes),
            attrs={"model": self.model.name, **self.params},
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the map: positive exponents are shaded."""
        from contfric.plot.lyapunov import plot_lyapunov_map

        return plot_lyapunov_map(self, ax=ax)

    def __repr__(self) -> str:
        ranges = ", ".join(f"{n} in [{v[0]:g}, {v[-1]:g}]" for n, v in self.axes.items())
        found = ", ".join(f"{count} {m.name.lower()}" for m, count in self.counts().items())
        shape = " x ".join(str(length) for length in self.shape)
        return f"<LyapunovMap of {self.model.name}: {shape}, {ranges}; {found}>"


def points_of(axes: Mapping[str, FloatArray]) -> Iterator[dict[str, float]]:
    """Yield the two parameters of each point of a grid, row by row."""
    (first, rows), (second, columns) = axes.items()
    for a in rows:
        for b in columns:
            yield {first: float(a), second: float(b)}
