"""The arguments of a census search, and the state from which it can continue."""

from __future__ import annotations

from dataclasses import dataclass

from contfric.censuses.conditions import Fate
from contfric.censuses.itineraries import canonical_pair
from contfric.censuses.orbits import Catalogue
from contfric.censuses.result import SectionSearch
from contfric.models.definition import Model
from contfric.signature import ReducedItinerary


@dataclass(frozen=True)
class Mesh:
    """Sizes of cells, as powers of two a unit of each axis.

    Attributes
    ----------
    coarse : of the first cells
    torn, near : of the smallest ones that are torn, or near
    decided : a cell with an orbit in it is halved down to this (sections of dimension above one)
    """

    coarse: int
    torn: int
    near: int
    decided: int

    def refined(self, by: int) -> Mesh:
        """Return the mesh with all cells halved a number of times."""
        return Mesh(self.coarse + by, self.torn + by, self.near + by, self.decided + by)


@dataclass(frozen=True, eq=False)
class Wanted:
    """Which itineraries may have an orbit: those within the limits that no condition excludes."""

    model: Model
    fates: dict[tuple[ReducedItinerary, int], Fate | None]

    def __call__(self, itinerary: ReducedItinerary, periods: int) -> bool:
        """Return whether an itinerary may have an orbit."""
        asked = canonical_pair(self.model, itinerary), periods
        return asked in self.fates and self.fates[asked] is None


@dataclass(frozen=True, eq=False)
class Findings:
    """What a search has left.

    Attributes
    ----------
    catalogue : the orbits known after it
    itineraries : an example of each itinerary from the section back to it or to its mirror image
    done : what was done
    """

    catalogue: Catalogue
    itineraries: tuple[tuple[int, ...], ...]
    done: SectionSearch
