"""Tests whether the impacts before a grazing point accumulate as in chatter.

Where a mass is pressed to a wall, impacts come ever closer and slower. A parameter may bring the end of such
a chatter to the time at which the wall lets go, where the acceleration is ``-k s`` at a time s before. There
impacts at ``s, l s, l^2 s ...`` with speeds of ``s^2`` follow each other, ``l^2 (2 + l) = e (1 + 2 l)`` for a
restitution e. On the way every one of infinitely many impacts begins at a graze of its own, and these come
ever closer in the parameter, by a constant ratio. No list of branches is complete there, and soon
flights are so low that each of them counts as a graze.
"""

from __future__ import annotations

from contfric.bvp.system import EventFunction
from contfric.events.bifurcation import Bifurcation
from contfric.events.locations import locations_of
from contfric.orbit.orbit import Orbit

#: An impact with this share of the largest speed of its run ends a flight whose height, the square of that,
#: is what an event that is known roughly is missed by.
_SLOW = 1e-3
#: Impacts of which the ratios of successive speeds are asked for, and by how much these may differ: they
#: come to one limit.
_IMPACTS, _ALIKE = 4, 1.5


def accumulates(bifurcation: Bifurcation) -> bool:
    """Tell whether an event is one of the grazes that accumulate before a chatter is complete."""
    orbit = bifurcation.orbit.as_whole()
    return any(_comes_to_rest(_speeds_before(orbit, place)) for place in locations_of(bifurcation))


def _speeds_before(orbit: Orbit, place: EventFunction) -> list[float]:
    """Return the speeds of the impacts on a wall before a place on it, the last one first, while they grow.

    The run begins where the solution meets anything else; sections are passed. A touch in the segment that
    ends with the first impact comes after all of them.
    """
    model, surface, speeds = orbit.model, place.surface, list[float]()
    reset = model.reset_by_surface.get(surface)
    if reset is None or not reset.lands.get(surface):
        return []
    gap, count = model.surface_by_name[surface].observable, len(orbit.itinerary)
    for segment in ((place.segment - k) % count for k in range(1, count + 1)):
        mode, exit_ = orbit.itinerary[segment]
        if exit_ == surface:
            end = orbit.ends[segment]
            speed = abs(orbit.flow.rate(mode, gap, float(end[0]), end[1:]))
            if speeds and not speed > speeds[-1]:
                break
            speeds.append(speed)
        elif (mode, exit_) not in model.sections:
            break
    return speeds


def _comes_to_rest(speeds: list[float]) -> bool:
    """Tell whether speeds that grow, the last one first, have become small by one ratio.

    Examples
    --------
    >>> _comes_to_rest([0.3**k for k in range(9, 0, -1)]), _comes_to_rest([1e-4, 0.1, 0.5, 1.0])
    (True, False)
    """
    if len(speeds) < _IMPACTS or not speeds[0] < _SLOW * speeds[-1]:
        return False
    ratios = [speeds[k] / speeds[k + 1] for k in range(_IMPACTS - 1)]
    return max(ratios) < _ALIKE * min(ratios)
