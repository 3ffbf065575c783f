"""Basins of attraction on a grid of two states."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.extras import need_xarray
from contfric.base.shown import AtParameters
from contfric.base.tabled import Columns, Tabled
from contfric.chaos.status import Motion
from contfric.models.definition import Model
from contfric.orbit.orbit import Orbit
from contfric.response.attractors import named

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Quantile of the normal distribution for intervals of 95 percent.
_QUANTILE = 1.959963984540054


@dataclass(frozen=True)
class Share:
    """The share of the starts that lead to one attractor.

    Attributes
    ----------
    name : name of the orbit, or what the solutions are
    orbit : number of the orbit; -1 without one
    count : starts
    share, low, high : share of all starts that are computed, with the limits of its 95 % interval (Wilson)
    """

    name: str
    orbit: int
    count: int
    share: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Basins(AtParameters, Tabled):
    """What starts on a grid converge to; the result of :func:`contfric.basins`.

    Attributes
    ----------
    model : Model
    axes : dict
        The two states that vary and their values, in the order of the arrays' axes.
    vector : ndarray, shape (parameters,)
    at : dict
        The states that do not vary, and the phase of the start as a share of the period.
    orbits : tuple of Orbit
        The solved orbits that starts converge to.
    labels : ndarray, shape (len, len)
        Number of the orbit that each start converges to, -1 if it converges to none.
    motions : ndarray, shape (len, len)
        Code of the :class:`~contfric.chaos.status.Motion` of each start.

    Examples
    --------
    >>> import contfric as cf
    >>> grid = {"x": np.linspace(-2, 2, 8), "v": np.linspace(-1, 1, 8)}
    >>> cf.basins("coulomb", grid, {"Omega": 0.5, "S": 0.32, "S0": 0.4}).shares[0].name
    '1a (1)'
    """

    model: Model
    axes: dict[str, FloatArray]
    vector: FloatArray
    at: dict[str, float]
    orbits: tuple[Orbit, ...]
    labels: NDArray[np.int32]
    motions: NDArray[np.uint8]

    @property
    def shape(self) -> tuple[int, int]:
        """Lengths of the two axes."""
        rows, columns = self.labels.shape
        return rows, columns

    @property
    def complete(self) -> bool:
        """Whether all starts have been computed; False after an interrupt."""
        return not self.missing

    @property
    def missing(self) -> int:
        """Number of starts that have not been computed, after an interrupt."""
        return int(np.sum(self.motions == Motion.MISSING.code))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the orbits."""
        return tuple(named(self.orbits))

    @property
    def share(self) -> FloatArray:
        """Share of all computed starts that converge to each of the orbits, shape (orbits,)."""
        total = self.motions.size - self.missing
        counts = np.bincount(self.labels[self.labels >= 0], minlength=len(self.orbits))
        return np.asarray(counts / max(1, total))

    def where(self, what: int | Motion) -> NDArray[np.bool_]:
        """Tell which starts converge to an orbit by its number, or are solutions of a kind without one."""
        if isinstance(what, Motion):
            return np.asarray((self.labels < 0) & (self.motions == what.code))
        return np.asarray(self.labels == what)

    @cached_property
    def shares(self) -> tuple[Share, ...]:
        """Shares of all that occurs: orbits in their order, then what converges to none.

        The interval is that of as many starts drawn at random. A regular grid does better: only cells at the
        boundary are uncertain. After an interrupt they are those of the part of the grid that was computed,
        and say nothing of the rest.
        """
        total = self.motions.size - self.missing
        return tuple(
            Share(name, k, count, count / total, *wilson(count / total, total))
            for name, k, there in self._parts
            if (count := int(np.sum(there)))
        )

    @cached_property
    def of_share(self) -> NDArray[np.int32]:
        """Number of the share that each start belongs to; -1 where it was not computed."""
        found = np.full(self.labels.shape, -1, dtype=np.int32)
        for number, (_, _, there) in enumerate(part for part in self._parts if np.any(part[2])):
            found[there] = number
        return found

    @property
    def _parts(self) -> list[tuple[str, int, NDArray[np.bool_]]]:
        """Name, number of the orbit (-1: none), and starts, of all that may occur."""
        orbits = [(name, k, self.labels == k) for k, name in enumerate(self.names)]
        others = (motion for motion in Motion if motion is not Motion.MISSING)
        return orbits + [(motion.name.lower(), -1, self.where(motion)) for motion in others]

    def columns(self) -> Columns:
        """Return one row for each start: its two states, orbit, name, kind of motion."""
        (first, rows), (second, columns) = self.axes.items()
        return {
            first: np.repeat(rows, len(columns)),
            second: np.tile(columns, len(rows)),
            "orbit": self.labels.ravel(),
            "name": np.array([*self.names, ""])[self.labels.ravel()],
            "motion": Motion.words()[self.motions.ravel()],
        }

    def to_xarray(self) -> xr.Dataset:
        """Return labels and kinds over the two states as a dataset (needs xarray)."""
        need_xarray()
        import xarray as xr

        dims = tuple(self.axes)
        names = np.array([*self.names, ""])
        return xr.Dataset(
            {
                "orbit": (dims, self.labels),
                "name": (dims, names[self.labels]),
                "motion": (dims, Motion.words()[self.motions]),
            },
            coords=dict(self.axes),
            attrs={"model": self.model.name, **self.params, **self.at},
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the basins, each in a colour, and the orbits at the phase of the starts."""
        from contfric.plot.basins import plot_basins

        return plot_basins(self, ax=ax)

    def __repr__(self) -> str:
        shape = " x ".join(str(length) for length in self.shape)
        parts = [f"{s.name} {s.share:.1%}" for s in self.shares]
        if self.missing:
            parts.append(f"{self.missing} not computed, which the shares do not count")
        found = ", ".join(parts)
        return f"<Basins of {self.model.name}: {shape} starts in {', '.join(self.axes)}; {found}>"


def wilson(share: float, total: float) -> tuple[float, float]:
    """Return the 95 % interval of a share (E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209-212).

    Examples
    --------
    >>> [round(x, 4) for x in wilson(0.8, 10)]
    [0.4902, 0.9433]
    """
    square = _QUANTILE**2
    middle = (share + square / (2 * total)) / (1 + square / total)
    half = _QUANTILE * sqrt(share * (1 - share) / total + square / (4 * total**2))
    half /= 1 + square / total
    return max(0.0, middle - half), min(1.0, middle + half)
