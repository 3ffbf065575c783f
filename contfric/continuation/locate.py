"""Events between two points of a branch: located, classified, grouped, in the order of the branch."""

from __future__ import annotations

from contfric.continuation.events import TERMINAL, Bifurcation, Kind
from contfric.continuation.near_sliding_events import SAME_FOLD, SAME_LOCATION, SAME_VALUE
from contfric.continuation.points import Point, Settings
from contfric.continuation.sliding import sliding_events
from contfric.continuation.smooth import SAME_TANGENCY, smooth_events
from contfric.orbit.orbit import Orbit


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
    orbits there have been solved.
    """
    if event.kind in TERMINAL:
        return False
    apart = abs(point.arc - end.arc)
    if apart < (SAME_TANGENCY if event.kind is Kind.T else SAME_LOCATION):
        return True
    if event.kind is Kind.T or event.orbit.system.segments != len(point.joints):
        return False
    return abs(point.value - end.value) < SAME_VALUE * settings.width and apart < SAME_FOLD
