"""The result of a census: the orbits found, what was tried, and why it ended."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from contfric.base.renamed import renamed
from contfric.base.shown import Shown, aligned
from contfric.base.tabled import as_table
from contfric.censuses.conditions import ClosedItinerary, Fate
from contfric.errors import number_and
from contfric.models.definition import Model
from contfric.orbit.orbit import DEGENERATE, Orbit

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class SectionSearch:
    """What was done on one section.

    Attributes
    ----------
    section : the segment that ends there and what follows, such as ``stick|F+ -> slide-``
    dimension : of the section
    first, last : sizes of the first and of the smallest cells, in units of each axis
    reach, farthest : half-width of the box of positions, and the largest position of an orbit found in
        it; 0 if the section is a curve
    starts, solves : trajectories, and Newton solves
    held : starts that come to rest for ever
    cut : starts that make more stops within the periods than the census asks for
    jumps, open : cells of the smallest size over which a near return jumps, and in which it closes to
        rounding and Newton finds no orbit
    complete : whether it was ended by no limit on the number of starts
    """

    section: str
    dimension: int
    first: float
    last: float
    reach: float
    farthest: float
    starts: int
    solves: int
    held: int
    cut: int
    jumps: int
    open: int
    complete: bool


@dataclass(frozen=True, eq=False)
class Census(Shown):
    """All periodic orbits that :func:`contfric.census` found at one set of parameters.

    Attributes
    ----------
    model : Model
    params : dict of str to float
    periods, stops : int
        Most excitation periods and most stops of an orbit that was asked for.
    orbits : tuple of Orbit
        Stable or not, one of each mirror pair, by periods, stops and name.
    walks : tuple of ClosedItinerary
        Every closed itinerary over every number of periods, with its fate.
    searches : tuple of SectionSearch
        What was done on each section.
    limits : tuple of str
        What bounds the census: why an orbit could be missing.
    seed : int
        Of the grids.
    complete : bool
        False if it was interrupted, or ended by the limit on starts.
    interrupted : bool

    Examples
    --------
    >>> import contfric as cf
    >>> cf.census("coulomb", {"Omega": 0.55}, stops=2).orbits
    (<Orbit 0s: Omega=0.55, S=0.32, S0=0.4, h=0, zeta=0; converged>,)
    """

    model: Model
    params: dict[str, float]
    periods: int
    stops: int
    orbits: tuple[Orbit, ...]
    walks: tuple[ClosedItinerary, ...]
    searches: tuple[SectionSearch, ...]
    limits: tuple[str, ...]
    seed: int
    complete: bool
    interrupted: bool = False

    def __len__(self) -> int:
        return len(self.orbits)

    def __iter__(self) -> Iterator[Orbit]:
        return iter(self.orbits)

    @overload
    def __getitem__(self, index: int) -> Orbit: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Orbit, ...]: ...

    def __getitem__(self, index: int | slice) -> Orbit | tuple[Orbit, ...]:
        return self.orbits[index]

    @cached_property
    def itineraries(self) -> dict[Fate, int]:
        """Number of itineraries by their fate."""
        return {fate: sum(walk.fate is fate for walk in self.walks) for fate in Fate}

    words = renamed("words", "itineraries")

    @property
    def stable(self) -> tuple[Orbit, ...]:
        """The stable ones."""
        return tuple(orbit for orbit in self.orbits if orbit.stable)

    @property
    def with_mirrors(self) -> int:
        """Number of orbits with mirror images counted."""
        return sum(images_of(orbit) for orbit in self.orbits)

    def to_dataframe(self) -> pd.DataFrame:
        """Return one row an orbit (needs pandas)."""
        return as_table(self.records())

    def records(self) -> list[dict[str, Any]]:
        """Return one mapping an orbit: name, periods, stops, images, stable, multipliers, extrema."""
        return [
            {
                "name": orbit.name,
                "periods": orbit.periods,
                "stops": len(orbit.stops),
                "images": images_of(orbit),
                "stable": orbit.stable,
                **_multipliers(orbit),
                "x_max": orbit.x_max,
                "x_min": orbit.x_min,
                "signature": str(orbit.signature),
            }
            for orbit in self.orbits
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data, ready for JSON."""
        return {
            "model": self.model.name,
            "params": self.params,
            "periods": self.periods,
            "stops": self.stops,
            "seed": self.seed,
            "complete": self.complete,
            "orbits": self.records(),
            "walks": {fate.name: count for fate, count in self.itineraries.items()},
            "searches": [asdict(search) for search in self.searches],
            "limits": list(self.limits),
        }

    def table(self) -> str:
        """Return the orbits as text with aligned columns."""
        rows = [["name", "periods", "stops", "images", "stable", "multipliers", "signature"]]
        for orbit in self.orbits:
            multipliers = ", ".join(f"{mu if mu.imag else mu.real:.6g}" for mu in orbit.multipliers)
            counts = (orbit.periods, len(orbit.stops), images_of(orbit))
            texts = [str(count) for count in counts]
            rows.append(
                [orbit.name, *texts, stability_of(orbit), multipliers, str(orbit.signature)]
            )
        return "\n".join(aligned(rows))

    def __str__(self) -> str:
        where = ", ".join(f"{k} = {v:g}" for k, v in self.params.items())
        counts = [f"  {n:>6}  {fate.value}" for fate, n in self.itineraries.items() if n]
        return "\n".join(
            [
                f"census of {self.model.name} at {where}",
                self.table(),
                f"itineraries ({len(self.walks)}):",
                *counts,
                "limits:",
                *(f"  {text}" for text in self.limits),
            ]
        )

    def __repr__(self) -> str:
        values = ", ".join(f"{k}={v:.6g}" for k, v in self.params.items())
        ended = "" if self.complete else "; incomplete"
        return (
            f"<Census of {self.model.name}: {len(self.orbits)} orbits ({len(self.stable)} stable) of up "
            f"to {number_and(self.periods, 'period')} and {number_and(self.stops, 'stop')}; {values}{ended}>"
        )


def images_of(orbit: Orbit) -> int:
    """Return how many orbits an orbit stands for: itself, and its mirror image if that is another."""
    return 1 if orbit.symmetric or orbit.model.symmetry is None else 2


def stability_of(orbit: Orbit) -> str:
    """Return ``yes`` or ``no``, or ``marginal`` if a multiplier lies on the unit circle to rounding."""
    size = np.abs(orbit.multipliers)
    if np.any(np.abs(size - 1.0) < DEGENERATE) and not np.any(size > 1.0 + DEGENERATE):
        return "marginal"
    return "yes" if orbit.stable else "no"


def _multipliers(orbit: Orbit) -> dict[str, float]:
    """Return the multipliers as columns of real numbers."""
    columns: dict[str, float] = {}
    for i, value in enumerate(orbit.multipliers):
        columns[f"mu{i + 1}"] = float(value.real)
        columns[f"mu{i + 1}_imag"] = float(value.imag) + 0.0  # no minus zero
    return columns
