"""The branches that pass or leave a branch point at which two curves of orbits of one problem cross."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving.trace_away import settings_for
from contfric.base.arrays import FloatArray
from contfric.continuation.branch import Branch
from contfric.continuation.points import FIRST_STEP, Settings
from contfric.continuation.singular_points.crossing import Crossing, Direction
from contfric.continuation.singular_points.switching import LEAVE, leave_along
from contfric.continuation.trace import follow_orbit
from contfric.errors import ConvergenceError
from contfric.events.bifurcation import Decision, EndReason
from contfric.orbit.clock import clocked
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

Depart = Callable[[Exploration, Orbit, Event, EndReason, Direction], None]
#: Cosine above which two directions are the same.
_ALONG = 0.9
#: Where a branch through a branch point is begun, in first steps from it: the point is in the middle of one.
#: A step that ends at the point has no tangent there, and may go on along the other curve.
_INSIDE_STEP = 0.5
#: Joints that agree to this are those of the same motion: ends of branches at a branch point are located.
_SAME = 1e-6


def follow_crossing(state: Exploration, crossing: Crossing, event: Event, depart: Depart) -> None:
    """Trace the two curves of orbits that cross at a branch point.

    A curve whose parameter turns there is two branches, as it is where a declared symmetry is broken.

    Parameters
    ----------
    depart : what traces a branch that leaves an orbit in a direction
    """
    for direction in crossing.directions:
        if not direction.turns:
            _follow_through(state, crossing, direction, event)
            continue
        for way in (direction, direction.reversed()):
            known = (
                i
                for i in event.branches
                if starts_along(state.branches[i], crossing, way, state.settings.scale)
            )
            text = "the branch that leaves along the null vector"
            if (index := next(known, None)) is not None:
                state.judge(event, text, Decision.KNOWN, index)
            else:
                depart(state, crossing.orbit, event, EndReason.BP, way)


def _follow_through(
    state: Exploration, crossing: Crossing, direction: Direction, event: Event
) -> None:
    """Continue the branch that passes a branch point in a direction, from just next to it."""
    orbit, settings = crossing.orbit, state.settings
    reason = "the branch that goes on through the event"
    distance = min(LEAVE, _INSIDE_STEP * FIRST_STEP * settings.largest)
    for way in (direction, direction.reversed()):
        start = leave_along(orbit, settings, way, distance)
        if start is None or not settings.low <= start.point.value <= settings.high:
            continue
        active = orbit.model.index_of(settings.parameter)
        there = refine(start.point.orbit(orbit, active), damped=False)
        if not (there.converged and there.admissible):
            continue
        if state.knows(event, reason, there):
            return
        if (branch := whole_branch(there, settings)) is not None:
            state.take(event, reason, branch)
            return
    state.judge(event, reason, Decision.REFUSED, why="no orbit near the event was found")


def whole_branch(orbit: Orbit, settings: Settings) -> Branch | None:
    """Return the branch of an orbit, both ways; None if it is one of a continuum at each parameter value."""
    try:
        return follow_orbit(orbit, settings_for(orbit, settings))
    except ConvergenceError:
        return None


def starts_along(branch: Branch, crossing: Crossing, direction: Direction, scale: float) -> bool:
    """Tell whether a branch has an end at a branch point and leaves it in a direction."""
    orbit = crossing.orbit
    if len(branch) < 2 or branch.system.half != orbit.system.half:
        return False
    for tip, inner in ((0, 1), (-1, -2)):
        end = _aligned(branch, tip, tip, orbit)
        near = _aligned(branch, inner, tip, orbit)
        if end is None or near is None or np.abs(end - orbit.joints).max() > _SAME:
            continue
        slope = float(branch.values[inner] - branch.values[tip])
        if direction.cosine(near - end, slope, scale) > _ALONG:
            return True
    return False


def _aligned(branch: Branch, k: int, reference: int, orbit: Orbit) -> FloatArray | None:
    """Return the joints of a point, turned so that those of another one are next to an orbit's.

    A branch may begin with another segment of the same solution, and in another period.
    """
    itinerary, wanted = branch.system.itinerary, orbit.system.itinerary
    if len(itinerary) != len(wanted) or branch.system.half:
        return branch.joints[k] if itinerary == wanted else None
    best: tuple[float, FloatArray] | None = None
    for first in range(len(itinerary)):
        if itinerary[first:] + itinerary[:first] != wanted:
            continue
        turned = [_turned(branch[i], first) for i in (reference, k)]
        shift = 0.0
        if not orbit.model.autonomous:
            unit = orbit.period / orbit.periods
            shift = unit * round(float(turned[0][0, 0] - orbit.joints[0, 0]) / unit)
        for joints in turned:
            joints[:, 0] -= shift
        gap = float(np.abs(turned[0] - orbit.joints).max())
        if best is None or gap < best[0]:
            best = gap, turned[1]
    return None if best is None else best[1]


def _turned(orbit: Orbit, first: int) -> FloatArray:
    """Return the joints of an orbit from another segment on."""
    joints = np.roll(orbit.joints, -first, axis=0)
    joints[len(joints) - first :, 0] += orbit.period
    return clocked(orbit.model, joints, float(joints[0, 0]) + orbit.period)
