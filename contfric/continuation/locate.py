"""Events between two points of a branch: located, classified, grouped, in the order of the branch."""

from __future__ import annotations

import numpy as np

from contfric.continuation.events import Bifurcation, Kind
from contfric.continuation.points import Point, Settings
from contfric.continuation.sliding import sliding_events
from contfric.continuation.smooth import SAME_PLACE, smooth_events
from contfric.orbit.orbit import Orbit

#: The same for a tangency: beside a tangential release (AS) the load overshoots its limit by the square
#: of the release's rate, which is rounding up to this distance.
_SAME_TANGENCY = 2e-6


def locate_events(
    orbit: Orbit, before: Point, after: Point, settings: Settings
) -> list[tuple[Bifurcation, Point]]:
    """Return the bifurcations between two points with their located points, in order.

    A point that is ``lost`` is no event: Newton fails behind it before any condition is violated.
    """
    sliding = sliding_events(orbit, before, after, settings)
    first = min((point.arc for _, point in sliding), default=np.inf)
    beyond = sliding[0][1] if sliding else after
    smooth = [
        (b, point)
        for b, point in smooth_events(orbit, before, after, settings, beyond)
        if point.arc < first - (_SAME_TANGENCY if b.kind is Kind.T else SAME_PLACE)
    ]
    return sorted([*smooth, *sliding], key=lambda pair: pair[1].arc)
