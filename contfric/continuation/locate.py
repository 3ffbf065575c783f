"""Events between two points of a branch: located, classified, grouped, in the order of the branch."""

from __future__ import annotations

from contfric.continuation.events import TERMINAL, Bifurcation, Kind
from contfric.continuation.near_sliding_events import SAME_FOLD, SAME_LOCATION, SAME_VALUE
from contfric.continuation.points import Point, Settings
from contfric.continuation.sliding import sliding_events
from contfric.continuation.smooth import SAME_TANGENCY, smooth_events
from contfric.orbit.orbit import Orbit

#: Events from which simpler orbits go on, and how much farther (in their accuracies) they are told from what
#: is next to them.
_OPENS, _TOLD = frozenset({Kind.BP, Kind.PD}), 10.0


def locate_events(
    orbit: Orbit, before: Point, after: Point, settings: Settings
) -> list[tuple[Bifurcation, Point]]:
    """Return the bifurcations between two points with their located points, in order.

    A point that is ``lost`` is no event: Newton fails after it before any condition is violated.
    """
    sliding = sliding_events(orbit, before, after, settings)
    if not sliding:
        smooth = smooth_events(orbit, before, after, settings, after)
        return sorted(smooth, key=lambda pair: pair[1].arc)
    end = sliding[0][1]
    if end.arc <= before.arc:  # it is at the first point: nothing comes before it
        return sliding
    smooth = [
        (b, point)
        for b, point in smooth_events(orbit, before, after, settings, end)
        if point.arc < end.arc and not belongs_to(b, point, end, settings)
    ]
    return sorted([*smooth, *sliding], key=lambda pair: pair[1].arc)


def belongs_to(event: Bifurcation, point: Point, end: Point, settings: Settings) -> bool:
    """Tell whether a smooth event before a sliding event, or after it, is part of it.

    Where an exit becomes tangential the branch folds and multipliers are infinite, and near there a location
    along the branch is good to the root of what the parameter is. A vertex is no such fold: the simpler
    orbits there have been solved. And where no multiplier is infinite a branch point or a doubling is known
    well: with little damping it lies as near to a slide of no length as the damping is small.
    """
    if event.kind in TERMINAL:
        return False
    apart = abs(point.arc - end.arc)
    gap = abs(point.value - end.value) / settings.width
    if event.kind in _OPENS and gap > 0.0 and apart < SAME_LOCATION:
        return gap <= _TOLD * event.accuracy
    if apart < (SAME_TANGENCY if event.kind is Kind.T else SAME_LOCATION):
        return True
    if event.kind is Kind.T or event.orbit.system.segments != len(point.joints):
        return False
    return gap < SAME_VALUE and apart < SAME_FOLD
