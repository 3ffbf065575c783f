"""Joints of smooth cycles on their section, along a branch: one moves to another crossing before it vanishes.

An orbit that only touches a section does not change. But where it has a joint there, the joint vanishes with
the crossing: as an unknown it has a fold, which the orbit itself does not have.
"""

from __future__ import annotations

import numpy as np

from contfric.bvp.system import Margin
from contfric.continuation.half_branch import Side, first_point
from contfric.continuation.locating.smooth import SAME_TANGENCY
from contfric.continuation.points import Point, Settings
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.orbit.canonical.sections import moved
from contfric.orbit.orbit import Orbit

#: Why a branch ends where its orbits have no joint left that could take the place of one that vanishes.
LAST_CROSSING = (
    "the orbit crosses its section once less beyond this point, and no other crossing can take that place: "
    "continue an orbit from there"
)
#: A joint moves to another crossing where that is faster by this: far from all others it could be moved to.
_FASTER = 4.0


def is_known_touch(side: Side, point: Point) -> bool:
    """Tell whether a touch of a section was met a rounding before: which joints it has makes one of two."""
    if not side.bifurcations or not side.bifurcations[-1].orbit.model.joined:
        return False
    last = side.bifurcations[-1]
    return last.kind is Kind.T and abs(point.arc - last.position) < SAME_TANGENCY


def is_on_section(bifurcation: Bifurcation) -> bool:
    """Tell whether an event would take away a joint on a section: there the orbit only touches it."""
    itinerary, sections = bifurcation.orbit.system.itinerary, bifurcation.orbit.model.sections
    return bifurcation.kind is Kind.T and any(
        test.margin is Margin.EXIT and itinerary[test.segment] in sections
        for test in bifurcation.tests
    )


def move_joints(orbit: Orbit, side: Side, settings: Settings) -> bool:
    """Go on from the last point on joints at faster crossings of the section; tell whether it has any."""
    system, tip = orbit.system, side.tip
    at = [
        k
        for k, test in enumerate(system.tests)
        if test.margin is Margin.EXIT and system.itinerary[test.segment] in orbit.model.sections
    ]
    if not at:
        return False
    other = moved(tip.orbit(orbit, orbit.model.index_of(settings.parameter)))
    point = None if other is None else first_point(other, settings)
    if point is None or not np.min(point.tests[at]) > _FASTER * np.min(tip.tests[at]):
        return False
    if point.slope * tip.slope < 0.0:
        point = point.reversed()
    point.arc = tip.arc
    side.restart(point)
    return True
