"""Holds that end together: the located orbit on which all of them last some time.

Let a hold at a touch of rest have the length tau. Near the event at which it ends the parameter changes by
the square of it: orbits with tau and with -tau have the same value, and a branch goes through tau = 0. Where
one motion touches rest twice in the same way (as its image, or after the same stick) the two holds end
together. The values of the parameter are then those of

    p = c tau_1^2 + (terms of higher order),   p = c tau_2^2 + ...,

and four orbits lie next to the event: (tau, tau), which is the branch, (-tau, -tau), and two on which only
one of the holds is negative. At the event the equations have two null vectors. Newton's method, started as
near to it as locations are, may converge to any of the four. An orbit on which one of the holds is negative
is taken to the branch by giving that one the length -tau, and solving again normal to the way from the point
before. (Not at the same value of the parameter: beyond that of the event there is no orbit.)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.continuation.points import Point, Settings
from contfric.continuation.side import first_point
from contfric.orbit.orbit import Orbit
from contfric.orbit.slides import SHORT, time_unit
from contfric.orbit.system import Margin

#: What is solved for again is the same orbit but for the lengths of holds: all joints stay within so many of
#: the largest length. They are functions of the lengths, with derivatives of the order of one.
_NEAR = 10.0


def with_holds_forward(
    here: Orbit, before: Point, point: Point, settings: Settings, first: int
) -> tuple[Point, Orbit, int]:
    """Return a located point at which no hold is negative, its orbit, and the margin that vanishes.

    All as they are if no hold is negative, or no such orbit is found.

    Parameters
    ----------
    before : a point of the branch before the located one: its tangent leads to that
    first : the margin that vanishes at the located point
    """
    lasts = here.durations
    most = SHORT * time_unit(here)
    count = here.system.segments
    back = [h.segment for h in here.system.holds if -most < lasts[h.segment] < 0.0]
    # the last hold of all ends at the first joint, a cycle later: that would move the origin of time
    back = [i for i in back if i + 1 < count]
    if not back:
        return point, here, first
    joints = here.joints.copy()
    for i in back:
        joints[i + 1] = joints[i]
        joints[i + 1, 0] -= lasts[i]
    way, slope = joints - before.joints, point.value - before.value
    solved = first_point(replace(here, joints=joints), settings, way, slope)
    if solved is None:
        return point, here, first
    moved = float(np.abs(solved.joints - here.joints).max())
    there = solved.orbit(here, here.model.index_of(settings.parameter))
    last = float(np.min(there.durations))
    if moved > _NEAR * float(np.max(-lasts[back])) or last < 0.0 or not there.admissible:
        return point, here, first
    ahead = solved if np.sum(way * solved.tangent) >= 0.0 else solved.reversed()
    return replace(ahead, arc=point.arc), there, _exit_of(here, back, first)


def _exit_of(here: Orbit, holds: list[int], first: int) -> int:
    """Return the margin of the exit of one of some holds; ``first`` if it has none."""
    exits = (
        k
        for k, test in enumerate(here.system.tests)
        if test.margin is Margin.EXIT and test.segment in holds
    )
    return next(exits, first)
