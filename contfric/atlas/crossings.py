"""The branches that pass or leave a branch point at which two curves of orbits of one problem cross."""

from __future__ import annotations

from collections.abc import Callable

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving_event import settings_for
from contfric.continuation.branch import Branch
from contfric.continuation.crossing import Crossing, Direction
from contfric.continuation.crossing_ends import starts_along
from contfric.continuation.events import Decision, EndReason
from contfric.continuation.points import Settings
from contfric.continuation.switching import leave_along
from contfric.continuation.trace import follow_orbit
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

Depart = Callable[[Exploration, Orbit, Event, EndReason, Direction], None]


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
    for way in (direction, direction.reversed()):
        start = leave_along(orbit, settings, way, EndReason.BP.value)
        if start is None or not settings.low <= start.point.value <= settings.high:
            continue
        active = orbit.model.index_of(settings.parameter)
        there = refine(start.point.orbit(orbit, active), damped=False)
        if not (there.converged and there.admissible):
            continue
        if not state.knows(event, reason, there):
            state.take(event, reason, whole_branch(there, settings))
        return
    state.judge(event, reason, Decision.REFUSED, why="no orbit near the event was found")


def whole_branch(orbit: Orbit, settings: Settings) -> Branch:
    """Return the branch of an orbit, both ways."""
    return follow_orbit(orbit, settings_for(orbit, settings))
