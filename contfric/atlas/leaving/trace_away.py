"""Tracing away from an event: in the direction in which an orbit of another itinerary is admissible."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain

import numpy as np

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration, Progress
from contfric.atlas.leaving.crossing_directions import ways_in_plane
from contfric.atlas.leaving.several_locations import opening_together
from contfric.atlas.matching import SAME_SOLUTION
from contfric.base.arrays import FloatArray
from contfric.base.attributes import altered
from contfric.continuation.assembly import assemble
from contfric.continuation.branch import Branch
from contfric.continuation.half_branch import Side, first_point
from contfric.continuation.points import Point, Settings, displaced
from contfric.continuation.singular_points.switching import LEAVE, NEARER, start_nearby
from contfric.continuation.trace import trace_side
from contfric.events.bifurcation import ACCURACY, TERMINAL, Bifurcation, End, EndReason
from contfric.events.incident.candidates import Candidate, directions
from contfric.orbit.orbit import Orbit

#: First step away from an event, in largest steps: the new itinerary is proved close to it. Where the
#: parameter stands there (a share of the tangent below the second number), it and margins change by the
#: square of the step, which may be rounding: then a longer one is tried.
_NEAR_EVENT, _STANDS = (0.01, 0.1), 1e-9
#: The same where these lead nowhere, or to an end at once: the branch may turn back before. In a tenth of it
#: what comes in on it, which grows with the square of its length, could not be told from rounding.
_TURNS_BACK = 1e-3
#: Points of what consists of its ends.
_ENDS = 2
#: Cosines that miss 1 by less are those of one tangent: of an angle of 1e-4, which the corrector closes.
_ONE_WAY = 1e-8
#: Sine of the angle by which a curve may miss the direction it is looked for in.
_NEARBY = 0.5**0.5
#: A branch that gets no farther than this (arclength) from the event it starts at has left it in the
#: direction in which it is not admissible.
_NOWHERE = 1e-7
#: The same for an event that is located to the root of rounding only.
_NOWHERE_ROUGHLY = 1e-3
#: The first start near an event that is singular, in roots of rounding: states are known there to a share
#: of 1e-5, and what happens nearer changes the parameter by rounding only (by the square of this).
_KNOWN = 500.0
#: Distance between two points, and how many times their arclength, at which they are on two curves.
_ELSEWHERE, _LOST = 1e-3, 100.0
#: One that gets this far has left it in the right one. A shorter one may have gone back the way that the
#: start was near the event: a touch at the very end of a segment is located to the root of rounding.
_SURELY_AWAY = 1e-4


def leave_event(state: Exploration, candidate: Candidate, event: Event) -> Branch | None:
    """Trace away from an event, in the direction in which the orbit is admissible."""
    orbit = candidate.orbit
    assert orbit is not None
    settings = settings_for(orbit, state.settings)
    if candidate.away is not None:
        way = _straight(candidate.away)
        branch = _leave_nearby(state, orbit, way, event, settings, candidate.share)
        return branch or leave_singular(state, orbit, event, settings)
    longest: tuple[Orbit, Side] | None = None
    for first_step in _NEAR_EVENT:
        found, stands = _longest_way(orbit, event, settings, first_step, state.progress)
        if found is not None and (longest is None or found[1].length > longest[1].length):
            longest = found
        # where the parameter stands a short side may have left in the wrong direction, by rounding
        if not stands or (longest is not None and longest[1].length > _SURELY_AWAY):
            break
    if event.bifurcation.accuracy <= ACCURACY and (longest is None or longest[1].count == _ENDS):
        found, _ = _longest_way(orbit, event, settings, _TURNS_BACK, state.progress)
        if found is not None and (longest is None or found[1].length > 0.5 * longest[1].length):
            longest = found
    if longest is None:
        return leave_singular(state, orbit, event, settings)
    there, side = longest
    _end_where_it_began(side, side.first, event, settings)
    first = first_end(EndReason[event.bifurcation.kind.name], event, side, settings)
    return assemble(there, settings, side, first)


def from_admissible(branch: Branch, orbit: Orbit) -> Branch:
    """Return a branch whose first point is the orbit at the event, where the solved one misses a condition.

    At an event at which another curve crosses, the first point is solved to the root of rounding only.
    """
    if branch[0].admissible or not orbit.admissible or orbit.joints.shape != branch.joints[0].shape:
        return branch
    joints, values = branch.joints.copy(), branch.values.copy()
    joints[0], values[0] = orbit.joints, orbit.params[branch.parameter]
    return altered(branch, joints=joints, values=values)


def _longest_way(
    orbit: Orbit, event: Event, settings: Settings, first_step: float, progress: Progress | None
) -> tuple[tuple[Orbit, Side] | None, bool]:
    """Return what gets farthest from an event, if any does, and whether the parameter stands there."""
    longest: tuple[Orbit, Side] | None = None
    stands = False
    # where curves cross joints are known to the root of what the parameter is known to
    known = max(SAME_SOLUTION, event.bifurcation.accuracy**0.5)
    value = orbit.params[settings.parameter]
    apart = ACCURACY if event.bifurcation.accuracy <= ACCURACY else np.inf
    for there, side in _ways(orbit, settings, first_step, progress, known):
        if abs(side.first.value - value) > apart * settings.width:
            continue  # it begins at another event, whose solution is nearly the same
        stands = stands or abs(side.first.slope) < _STANDS * settings.width
        if went_somewhere(side, event, settings) and (
            longest is None or side.length > longest[1].length
        ):
            longest = there, side
        if longest is not None and side.length > _SURELY_AWAY:
            break
    return longest, stands


def _ways(
    orbit: Orbit, settings: Settings, first_step: float, progress: Progress | None, known: float
) -> Iterator[tuple[Orbit, Side]]:
    """Yield what is traced in each direction from an orbit at an event, where joints are known to ``known``.

    What Newton's method finds farther away is no orbit at the event.
    """
    active = orbit.model.index_of(settings.parameter)
    farthest = known * (1.0 + float(np.abs(orbit.joints).max()))
    tried: list[Point] = []
    for tangent, slope in directions(orbit, active):
        start = first_point(orbit, settings, tangent, slope)
        if start is None or not np.abs(start.joints - orbit.joints).max() <= farthest:
            continue
        if any(_is_along(start, known_way, settings) for known_way in tried):
            continue
        tried.append(start)
        there = start.orbit(orbit, active)
        for point in (start, start.reversed()):
            yield there, _trace(there, point, settings, first_step, progress)


def _is_along(one: Point, other: Point, settings: Settings) -> bool:
    """Tell whether two starts at one orbit have one tangent: then what is traced from both is the same."""
    along = np.sum(one.tangent * other.tangent) / len(one.tangent)
    return bool(1.0 - abs(along + one.slope * other.slope * settings.scale) < _ONE_WAY)


def _straight(away: FloatArray) -> Callable[[float], FloatArray]:
    """Return how joints move by a distance in one direction."""
    return lambda distance: distance * away


def _leave_nearby(
    state: Exploration,
    orbit: Orbit,
    way: Callable[[float], FloatArray],
    event: Event,
    settings: Settings,
    share: float = 0.0,
) -> Branch | None:
    """Trace away from an event at which the new orbit is singular, from a short distance off it.

    ``way`` tells how joints move by a distance; ``share`` is that of the parameter, where it is known.
    """
    active = orbit.model.index_of(settings.parameter)
    for distance in _distances(orbit, event):
        away = way(distance * orbit.period)
        known = ((away / np.abs(away).max(), share),) if share else ()
        moved = displaced(orbit, active, away, distance * orbit.period * share)
        for tangent, slope in chain(known, directions(moved, active)):
            point = first_point(moved, settings, tangent, slope)
            if point is None:
                continue
            there = point.orbit(orbit, active)
            if not (_is_nearby(there, moved, orbit) and there.admissible):
                continue
            point, origin = start_nearby(orbit, point, settings, away)
            side = _trace(there, point, settings, _NEAR_EVENT[0], state.progress)
            if side.count > 1:
                _end_where_it_began(side, origin, event, settings)
                first = first_end(EndReason[event.bifurcation.kind.name], event, side, settings)
                return assemble(there, settings, side, first, origin)
    return None


def _is_nearby(there: Orbit, moved: Orbit, orbit: Orbit) -> bool:
    """Tell whether what was solved for from a short distance off an orbit is next to it.

    A curve through the orbit within 45 degrees of the direction passes the guess at less than this. What
    Newton's method finds farther away lies on another curve, or is the orbit itself.
    """
    missed = np.linalg.norm(there.joints - moved.joints)
    return bool(missed <= _NEARBY * np.linalg.norm(moved.joints - orbit.joints))


def _distances(orbit: Orbit, event: Event) -> list[float]:
    """Return at which distances from an event to start: as near as states are known, farther, then nearer.

    At an event that is known roughly what is near is rounding.
    """
    least = _KNOWN * orbit.model.rounding**0.5
    if event.bifurcation.accuracy > ACCURACY:
        least = NEARER[0]
    return [d for d in reversed(NEARER) if d >= least] + [d for d in NEARER if d < least]


def leave_singular(
    state: Exploration, orbit: Orbit, event: Event, settings: Settings
) -> Branch | None:
    """Trace away from an event at which the curve has no unique direction.

    Where several locations open at once leading orders tell the direction. Others lie in the plane of two
    null vectors; those at regular angles are tried.
    """
    branch = _leave_together(state, orbit, event, settings)
    if branch is not None:
        return branch
    active = orbit.model.index_of(settings.parameter)
    for away, slope in ways_in_plane(orbit, active):
        branch = _leave_nearby(state, orbit, _straight(away), event, settings, slope)
        if branch is not None and branch.arc[-1] > _SURELY_AWAY:
            return branch
    return None


def _leave_together(
    state: Exploration, orbit: Orbit, event: Event, settings: Settings
) -> Branch | None:
    """Trace away from an event at which several locations of an orbit open at once."""
    for away in opening_together(orbit, orbit.model.index_of(settings.parameter)):
        branch = _leave_nearby(state, orbit, away.at, event, settings)
        if branch is not None and branch.arc[-1] > _SURELY_AWAY:
            return branch
    return None


def _trace(
    orbit: Orbit, point: Point, settings: Settings, first_step: float, progress: Progress | None
) -> Side:
    return trace_side(
        orbit, point, settings, first_step=first_step, at_event=True, progress=progress
    )


def settings_for(orbit: Orbit, settings: Settings) -> Settings:
    """Return the settings for a branch: on a bridge there are no multipliers."""
    return altered(settings, stability=False) if orbit.system.holds else settings


def went_somewhere(side: Side, event: Event, settings: Settings) -> bool:
    """Tell whether what was traced away from an event got anywhere.

    A regular orbit may meet the next event at once: two stops of a nearly symmetric one reach a boundary one
    after the other. Both events are known then to less than what is between them.
    """
    if _ends_elsewhere(side, settings):
        return False
    there, end = event.bifurcation, side.end.bifurcation
    rough = there.accuracy > ACCURACY
    if side.length > (_NOWHERE_ROUGHLY if rough else _NOWHERE):
        return True
    if rough or end is None or end.kind not in TERMINAL or side_is_bridge(side):
        return False
    gap = abs(end.params[settings.parameter] - there.params[settings.parameter]) / settings.width
    return gap > there.accuracy + end.accuracy


def _ends_elsewhere(side: Side, settings: Settings) -> bool:
    """Tell whether the last point of a side is on another curve: far from the one before for their arclength.

    Next to an event at which curves cross a point is off by rounding over the distance. A side that creeps
    there, in steps as short as that, may be lost to any of them.
    """
    if side.last < 1:
        return False
    tip, before = side.tip, side.before_tip
    square = float(np.sum((tip.joints - before.joints) ** 2)) / len(tip.joints)
    apart = (square + (tip.value - before.value) ** 2 * settings.scale) ** 0.5
    return bool(apart > max(_ELSEWHERE, _LOST * (tip.arc - before.arc)))


def first_end(reason: EndReason, event: Event, side: Side, settings: Settings) -> End:
    """Return the end of a branch at the event that it starts from."""
    b = event.bifurcation
    stable: bool | None = False if side_is_bridge(side) else None
    if settings.stability and not side_is_bridge(side):
        stable = bool(np.all(np.abs(side.second_multipliers) < 1.0))
    here = altered(b, position=0.0, stable_before=None, stable_after=stable)
    return End(reason, f"{EndReason.START.value}: {where(b, settings.parameter)}", here)


def _end_where_it_began(side: Side, there: Point, event: Event, settings: Settings) -> None:
    """Give a side that comes back to the event it began at its second end there.

    At the event orbits of its itinerary begin: the curve is not closed, both of its ends are at one location.
    Which of them is met last is rounding where a condition vanishes there with its slope.
    """
    if side.end.reason is not EndReason.CLOSED:
        return
    b, grows = event.bifurcation, side.tip.value > side.before_tip.value
    side.put_tip(altered(there, arc=side.position))
    stable: bool | None = False if side_is_bridge(side) else None
    if settings.stability and not side_is_bridge(side):
        stable = bool(np.all(np.abs(side.before_tip.mu) < 1.0))
    before, after = (stable, None) if grows else (None, stable)
    here = altered(b, position=side.position, stable_before=before, stable_after=after)
    side.end = End(EndReason[b.kind.name], where(b, settings.parameter), here)


def may_have_passed(branch: Branch, known: float) -> bool:
    """Tell whether a branch may have an event before the first point that was solved for away from its start.

    As far as ``LEAVE`` a branch is a parabola. Farther a fold may be passed, and one is passed for certain
    where the parameter goes back the way that it has come, by more than its value at the event is ``known``
    to.
    """
    if branch.arc[1] > LEAVE:
        return True
    if len(branch) < 3 or any(0.0 < b.position <= branch.arc[2] for b in branch.bifurcations):
        return False
    moved = np.diff(branch.values[:3])
    return bool(moved[0] * moved[1] < 0.0 and np.abs(moved).min() > known)


def side_is_bridge(side: Side) -> bool:
    """Return whether a side was traced without multipliers because it has holds."""
    return "mu" not in side.names


def where(bifurcation: Bifurcation, parameter: str) -> str:
    """Return what a bifurcation is and where, for a message."""
    return f"{bifurcation.label} at {parameter} = {bifurcation.params[parameter]:.10g}"
