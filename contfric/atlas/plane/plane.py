"""A plane of two parameters: curves of bifurcations, where they meet, and what lives between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contfric.atlas.diagram import Diagram
from contfric.base.arrays import FloatArray
from contfric.base.shown import Shown
from contfric.base.tabled import stacked
from contfric.curves.curve import Curve
from contfric.curves.special import SpecialPoint
from contfric.errors import number_and
from contfric.events.bifurcation import Kind
from contfric.models.definition import Model

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, order=True)
class Family:
    """Orbits of one name that live in a region."""

    name: str
    stable: bool

    def __str__(self) -> str:
        return f"{self.name} ({'stable' if self.stable else 'unstable'})"


@dataclass(frozen=True, eq=False)
class Region(Shown):
    """A part of the plane that no curve crosses.

    Attributes
    ----------
    point : dict
        Parameters inside, as far from all curves as possible.
    share : float
        Share of the plane.
    bounds : tuple of int
        Indices of the curves that bound it.
    families : tuple of Family
        Orbits that live there, as the sections through it show; empty if none crosses it.
    sampled : bool
        Whether a section crosses it.
    disputed : tuple of Family
        Orbits that some sections show and others do not: a curve between them is not known.
    """

    point: dict[str, float]
    share: float
    bounds: tuple[int, ...]
    families: tuple[Family, ...]
    sampled: bool
    disputed: tuple[Family, ...] = ()

    def __repr__(self) -> str:
        where = ", ".join(f"{k}={v:.4g}" for k, v in self.point.items())
        lives = "; ".join(map(str, self.families)) or ("nothing" if self.sampled else "not sampled")
        return f"<Region at {where}, {100.0 * self.share:.2g} %: {lives}>"


@dataclass(frozen=True, eq=False)
class Plane(Shown):
    """What :func:`contfric.explore_plane` found.

    Attributes
    ----------
    model : Model
    parameters : (str, str)
    ranges : ndarray, shape (2, 2)
        Lower and upper limits of each parameter, one a row.
    vector : ndarray
        The other parameters.
    curves : tuple of Curve
        Each once; one event of two itineraries (CS) is a curve of each.
    twins : tuple of int
        For each curve the first one with the same solution: its own index if it is that.
    regions : tuple of Region
        Largest first.
    cells : ndarray, shape (n, n)
        Number of the region of each cell of a grid, -1 on a curve and outside of the model's limits.
    sections : tuple of Diagram
        The one-parameter diagrams that the curves started from.
    complete : bool
        False if the exploration was stopped before it was done.
    notes : tuple of str

    Examples
    --------
    >>> import contfric as cf
    >>> orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    >>> ranges = {"Omega": (0.53, 0.55), "S": (0.31, 0.33)}
    >>> plane = cf.explore_plane(orbit, ("Omega", "S"), ranges, max_sections=1)
    >>> sorted({curve.label for curve in plane.curves})
    ['CS_s', 'SN_1a']
    """

    model: Model
    parameters: tuple[str, str]
    ranges: FloatArray
    vector: FloatArray
    curves: tuple[Curve, ...]
    twins: tuple[int, ...]
    regions: tuple[Region, ...]
    cells: NDArray[np.int64]
    sections: tuple[Diagram, ...] = ()
    complete: bool = True
    notes: tuple[str, ...] = field(default=())

    @property
    def special(self) -> tuple[SpecialPoint, ...]:
        """Points of codimension two, each once."""
        found: list[SpecialPoint] = []
        for k, curve in enumerate(self.curves):
            if self.twins[k] != k:
                continue
            for point in curve.special:
                if not any(self._same(point, other) for other in found):
                    found.append(point)
        return tuple(found)

    def _same(self, a: SpecialPoint, b: SpecialPoint) -> bool:
        widths = self.ranges[:, 1] - self.ranges[:, 0]
        gaps = [abs(a.params[n] - b.params[n]) for n in self.parameters]
        near = _SAME_LOCATION if a.located and b.located else _SAME_ROUGHLY
        same = bool(np.all(np.array(gaps) < near * widths))
        return same and (a.kind is b.kind and set(a.name.split("-")) == set(b.name.split("-")))

    def of_kind(self, kind: Kind | str) -> tuple[Curve, ...]:
        """Return the curves of one kind.

        Raises
        ------
        ParameterError
            If there is no such kind.
        """
        wanted = Kind.named(kind)
        return tuple(c for c in self.curves if c.kind is wanted)

    def region_at(self, params: dict[str, float]) -> Region | None:
        """Return the region that a point lies in; None on a curve or outside."""
        size = len(self.cells)
        cell = []
        for (low, high), name in zip(self.ranges, self.parameters, strict=True):
            cell.append(min(size - 1, max(0, int((params[name] - low) / (high - low) * size))))
        index = int(self.cells[cell[0], cell[1]])
        return None if index < 0 else self.regions[index]

    def to_dataframe(self) -> pd.DataFrame:
        """Return the points of all curves as one table, with the curve's number and label (pandas)."""
        return stacked(
            ({"curve": i + 1, "label": curve.label}, curve.to_dataframe())
            for i, curve in enumerate(self.curves)
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the curves by kind and stability, with the points of codimension two."""
        from contfric.plot.plane import plot_plane

        return plot_plane(self, ax=ax)

    def __repr__(self) -> str:
        one, other = self.parameters
        return (
            f"<Plane {one}-{other} of {self.model.name}: {number_and(len(self.curves), 'curve')}, "
            f"{number_and(len(self.special), 'special point')}, {number_and(len(self.regions), 'region')}>"
        )


#: Points of codimension two of one kind this near to each other (relative to the ranges) are one: where
#: conditions are nearly singular they are located to the root of rounding.
_SAME_LOCATION = 1e-6
#: The same where one of them is not bracketed to its last digits: the root of what a singular state is.
_SAME_ROUGHLY = 1e-4
