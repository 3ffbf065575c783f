"""The orbits of a census, each once: up to rotation, mirror image and repetition."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from contfric.atlas.matching import stops_distance
from contfric.censuses.itineraries import canonical_pair
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine_with_symmetry
from contfric.signature import ReducedItinerary

#: Orbits of one itinerary whose stops agree to this are one: rounding over a multiplier's distance from 1
#: of 1e-7 (nearer to a fold the two orbits of the fold are one).
_SAME = 1e-8


@dataclass(eq=False)
class Catalogue:
    """Orbits by their itineraries.

    Attributes
    ----------
    continua : itineraries on which the orbits found are degenerate; one orbit of each is kept
    """

    orbits: dict[tuple[ReducedItinerary, int], list[Orbit]] = field(default_factory=dict)
    continua: set[tuple[ReducedItinerary, int]] = field(default_factory=set)

    def __len__(self) -> int:
        return sum(len(found) for found in self.orbits.values())

    def copy(self) -> Catalogue:
        """Return a catalogue of the same orbits that grows by itself."""
        found = {key: list(orbits) for key, orbits in self.orbits.items()}
        return Catalogue(found, set(self.continua))

    def add(self, orbit: Orbit) -> None:
        """Add an orbit unless it is known, or repeats a shorter one."""
        if shortest(orbit) is not orbit:
            return
        key = canonical_pair(orbit.model, orbit.itinerary), orbit.periods
        found = self.orbits.setdefault(key, [])
        mirror = orbit.model.symmetry is not None
        if any(stops_distance(orbit.stops, other.stops, mirror) < _SAME for other in found):
            return
        if orbit.degenerate:
            if key in self.continua:
                return
            self.continua.add(key)
        refined = orbit if orbit.system.half else refine_with_symmetry(orbit)
        found.append(refined if refined.converged and refined.admissible else orbit)

    def sorted(self) -> tuple[Orbit, ...]:
        """Return the orbits by periods, stops, name and largest displacement."""
        found = [orbit for group in self.orbits.values() for orbit in group]
        return tuple(sorted(found, key=lambda o: (o.periods, len(o.stops), o.name, extent(o))))


def extent(orbit: Orbit) -> float:
    """Return the largest displacement of an orbit or its mirror image."""
    return float(np.max(np.abs(orbit.stops)))
