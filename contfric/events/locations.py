"""The locations of an orbit at which a sliding event happens."""

from __future__ import annotations

from collections.abc import Iterable

from contfric.bvp.system import EventFunction, Margin
from contfric.events.bifurcation import Bifurcation
from contfric.events.sliding_kinds import hold_of_test
from contfric.orbit.orbit import Orbit
from contfric.signature.holds import left_surface, release_mode


def locations_of(bifurcation: Bifurcation) -> list[EventFunction]:
    """Return the places of the whole orbit at which a sliding event happens."""
    orbit = bifurcation.orbit
    locations = [normal_location(test, orbit) for test in bifurcation.tests]
    locations = list(dict.fromkeys(locations))
    if orbit.system.half and orbit.model.symmetry is not None:
        n, image = len(orbit.system.itinerary), orbit.model.symmetry.surfaces
        locations += [EventFunction(t.margin, t.segment + n, image[t.surface]) for t in locations]
    return locations


def rests_at(orbit: Orbit, locations: Iterable[EventFunction]) -> frozenset[str]:
    """Return the surfaces of the contacts that may be held at locations of a whole orbit."""
    model, itinerary, count = orbit.model, orbit.itinerary, len(orbit.itinerary)
    found = {hold.leaves for hold in orbit.system.holds}
    for location in locations:
        near = [itinerary[(location.segment + k) % count] for k in (0, 1)]
        found |= {s for s in (location.surface, near[0][1]) if s in model.surface_by_name}
        for mode, _ in near:
            released = release_mode(model, mode, location.surface)
            if released is not None and model.mode_by_name[mode].sliding:
                leaves = left_surface(model, mode, released)
                found |= set() if model.lies_on(released, leaves) else {leaves}
    return frozenset(s for s in found if model.rests_on(s))


#: The rate with which an exit is met that is tangential: an orbit misses the tangency by half of the square
#: of the rate, which is rounding below this.
TANGENTIAL = 1e-6


def normal_location(test: EventFunction, orbit: Orbit) -> EventFunction:
    """Return a test of what belongs to a hold as one of the hold itself, and one of an exit as of the exit.

    Where a segment meets its exit without rate, a touch of that surface inside of it is the exit itself.
    """
    hold = hold_of_test(test, orbit)
    if hold is None and test.margin is Margin.INTERIOR:
        end = EventFunction(Margin.EXIT, test.segment, test.surface)
        if orbit.itinerary[test.segment][1] == test.surface and end in orbit.system.tests:
            at_exit = abs(orbit.margins[orbit.system.tests.index(end)]) < TANGENTIAL
            return end if at_exit else test
    if hold is None or hold.segment == test.segment:
        return test
    return EventFunction(Margin.EXIT, hold.segment, hold.leaves)
