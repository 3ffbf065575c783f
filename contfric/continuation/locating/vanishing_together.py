"""Holds that end together, and slides that vanish together: the orbit that is located is on the branch.

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

So it is with slides. Where one motion slides twice in the same way (as its image, or after the same hold)
two slides have equal lengths all along a branch, and vanish together. A slide of no length solves its
equations at every value of the parameter. So two more curves cross the branch at the event: on each of them
one slide has no length, and the other one has another length than it has on the branch. A trial next to the
event may converge to them, and seems to have found the event too early. That is seen: the lengths are not
equal any more. Then the branch is followed to the event in steps that are a part of the way to it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import Margin
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import Point, Settings
from contfric.events.local.gradients import closing
from contfric.orbit.canonical.slides import SHORT, time_unit
from contfric.orbit.orbit import Orbit

#: What is solved for again is the same orbit but for the lengths of holds: all joints stay within so many of
#: the largest length. They are functions of the lengths, with derivatives of the order of one.
_NEAR = 10.0
#: Lengths that agree to this (relative) at a point of the branch are those of twins: points are solved to
#: 1e-14, the shortest of these lengths are 1e-6; others agree to this by a chance as small.
_EQUAL = 1e-6
#: Twins one of which has lost more than this of its length against the other are twins no more: on the branch
#: they stay equal.
_UNEQUAL = 0.1
#: Share of the way to where the slides vanish by their rate that one step goes, and the most steps: 0.3^40 is
#: far below rounding.
_STEP, _MOST = 0.7, 40
#: Length (in units of time) at which the slides have vanished but for rounding: the root of that.
_REACHED = 1e-7


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


def nearer_than_twins(
    orbit: Orbit, before: Point, point: Point, settings: Settings
) -> Point | None:
    """Return the point next to the event at which twins vanish; None if none are lost at the located point.

    Parameters
    ----------
    before, point : a point of the branch, and what was located after it
    """
    active = orbit.model.index_of(settings.parameter)
    now, most = _lasts(point, orbit, active), SHORT * time_unit(orbit)
    if orbit.model.autonomous or not now.min() < most:
        return None
    twins = _lost_twins(_lasts(before, orbit, active), now)
    if not twins:
        return None
    tip, share = before, _STEP
    for _ in range(_MOST):
        lasts, rates = _lasts(tip, orbit, active)[twins], _rates(tip, orbit, active)[twins]
        if not np.all(rates < 0.0) or float(np.max(lasts)) < _REACHED * time_unit(orbit):
            break
        step = share * float(np.min(lasts / -rates))
        moved = tip.along(orbit, active, step)
        there = first_point(moved, settings, tip.tangent, tip.slope)
        if there is None or not _stays(orbit, there, twins, active, float(np.max(lasts))):
            share *= 0.5
            continue
        tip = replace(there, arc=tip.arc + step)
    return None if tip is before else tip


def _lasts(point: Point, orbit: Orbit, active: int) -> FloatArray:
    """Return how long the segments last that an orbit is solved with, shape (N,)."""
    return point.orbit(orbit, active).durations[: orbit.system.segments]


def _rates(point: Point, orbit: Orbit, active: int) -> FloatArray:
    """Return how the lengths change along the branch."""
    turn = float(closing(point.orbit(orbit, active), active)[0]) * point.slope
    rates: FloatArray = np.diff(point.tangent[:, 0], append=point.tangent[0, 0] + turn)
    return rates


def _lost_twins(then: FloatArray, now: FloatArray) -> list[int]:
    """Return the segments that had one length, of which one has vanished without the other; none: empty."""
    gone = int(np.argmin(now))
    if not now[gone] < _UNEQUAL * then[gone]:
        return []
    equal = np.flatnonzero(np.abs(then - then[gone]) <= _EQUAL * then[gone]).tolist()
    lost = any(now[i] - now[gone] > _UNEQUAL * then[gone] for i in equal)
    return equal if lost else []


def _stays(orbit: Orbit, there: Point, twins: list[int], active: int, before: float) -> bool:
    """Tell whether a point is on the branch: no margin is violated, and the twins are equal and shorter."""
    lasts = _lasts(there, orbit, active)[twins]
    tests = there.tests[: len(orbit.system.tests)]
    equal = np.ptp(lasts) <= _UNEQUAL * float(np.max(lasts))
    return bool(np.min(tests) >= 0.0 and np.min(lasts) > 0.0 and np.max(lasts) < before and equal)
