"""Branches that leave a branch point or a period doubling along its null vector."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving.short_branches import leave_short
from contfric.atlas.leaving.trace_away import first_end, settings_for, went_somewhere
from contfric.atlas.matching import same_event
from contfric.continuation.assembly import assemble
from contfric.continuation.events_of_step import violates
from contfric.continuation.half_branch import Side
from contfric.continuation.points import FIRST_STEP, Settings
from contfric.continuation.singular_points.crossing import Direction
from contfric.continuation.singular_points.switching import (
    NEARER,
    BranchStart,
    leave_along,
    null_direction,
    overshoots,
)
from contfric.continuation.trace import trace_side
from contfric.events.bifurcation import Decision, End, EndReason, Kind
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.orbit import Orbit
from contfric.remember.advance import foresee

#: A branch shorter than this (arclength) that comes back to its event has been nowhere.
NO_WIDTH = 1e-3


def follow_departure(
    state: Exploration,
    orbit: Orbit,
    event: Event,
    reason: EndReason,
    direction: Direction | None = None,
) -> None:
    """Trace the branch that leaves a branch point or a period doubling; by default along the null vector."""
    settings = settings_for(orbit, state.settings)
    text = "the branch that leaves along the null vector"
    if direction is None and leave_short(state, orbit, event, reason, text):
        return
    along = direction or null_direction(orbit)
    if along is None:
        why = "its equations have no derivatives here"
        state.judge(event, text, Decision.REFUSED, why=why)
        return
    for departure, distance, known in _departures(orbit, settings, along, state.known):
        if known is not None:
            state.judge(event, text, Decision.KNOWN, known)
            return
        side = trace_side(
            orbit,
            departure.point,
            settings,
            first_step=_first_step(distance, settings),
            progress=state.progress,
        )
        if went_somewhere(side, event, settings) and not _comes_back(side, event, settings):
            first = first_end(reason, event, side, settings)
            state.accept(event, text, assemble(orbit, settings, side, first, departure.origin))
            return
    state.judge(event, text, Decision.REFUSED, why="it is not admissible")


def _departures(
    orbit: Orbit,
    settings: Settings,
    along: Direction,
    known: Callable[[Orbit], int | None],
) -> Iterator[tuple[BranchStart, float, int | None]]:
    """Yield departures with their distances, and the branch that is there if it is known."""
    active = orbit.model.index_of(settings.parameter)
    overshot: list[float] = []
    for distance in chain(NEARER, overshot):  # those that overshoot something come last
        departure = leave_along(orbit, settings, along, distance)
        if departure is None or violates(departure.point):
            continue  # nothing is there, or a condition has been violated on the way
        there = departure.point.orbit(orbit, active)
        if shortest(there) is not there:
            continue  # Newton has fallen back on the orbit that it is to leave
        found, again = known(there), distance in overshot
        if (
            found is None
            and not again
            and distance != NEARER[-1]
            and overshoots(orbit, settings, departure, distance, along)
        ):
            overshot.append(distance)
            continue
        yield departure, distance, found


def _first_step(distance: float, settings: Settings) -> float:
    """Return a first step no longer than what is known."""
    return min(FIRST_STEP, distance / settings.largest)


def _comes_back(side: Side, event: Event, settings: Settings) -> bool:
    """Tell whether what was traced away from an event has come back to it at once."""
    return side.length <= NO_WIDTH and ends_at(side.end, event, settings)


def ends_at(end: End, event: Event, settings: Settings) -> bool:
    """Tell whether a branch that leaves an event ends at it again.

    One that ends at another kind of event has been somewhere, however near that is: where a margin is small
    at a branch point, the branch between is as short, and its parameter changes by the square of that.
    """
    last, b = end.bifurcation, event.bifurcation
    return last is not None and same_event(last, b, settings.parameter, settings.width)


def foresee_departures(state: Exploration, event: Event) -> None:
    """Begin on another core what will be asked for after an event that is followed now.

    Doublings and branch points of one branch come in pairs: between them the other branch is the stable one,
    and mostly it joins them. The second one of a pair is not begun: it would be the same branch again.
    """
    before = event
    for one in tuple(state.waiting):
        one.paired = one.paired or (not before.paired and _alike(before, one))
        if not (one.begun or one.paired):
            one.begun = foresee(_begin, state, one)
            return
        before = one


def _alike(a: Event, b: Event) -> bool:
    """Tell whether two events are of one kind and on one branch."""
    return a.bifurcation.kind is b.bifurcation.kind and a.branches[:1] == b.branches[:1]


def _begin(state: Exploration, event: Event) -> None:
    """Trace what leaves an event that still waits, as :func:`follow_departure` will."""
    if event not in state.waiting:
        return
    kind, orbit = event.bifurcation.kind, event.bifurcation.orbit
    if kind is Kind.PD and 2 * orbit.periods <= state.max_periods:
        orbit = orbit.doubled()
    elif kind is Kind.BP and orbit.system.half:
        orbit = orbit.as_whole()
    else:
        return
    settings = settings_for(orbit, state.settings)
    if (along := null_direction(orbit)) is None:
        return
    for departure, distance, known in _departures(orbit, settings, along, state.known):
        if known is None:
            trace_side(orbit, departure.point, settings, first_step=_first_step(distance, settings))
        return
