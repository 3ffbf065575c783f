"""What leaves an event: the branches that each kind of bifurcation leads to.

* CS, SS, AS, GS: every candidate that the transition graph proposes, bridges among them;
* BP: the asymmetric branch from a symmetric one, or the symmetric branch from an asymmetric one;
* PD: the branch of twice the period, or the one of half the period from it.

A candidate is accepted when it is solved, and admissible beyond the event in one direction.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contfric.atlas.collect import Event
from contfric.atlas.crossings import follow_crossing, whole_branch
from contfric.atlas.exploration import Exploration, Progress
from contfric.atlas.matching import SAME_MOTION, part_distance, same_place
from contfric.continuation.assembly import assemble
from contfric.continuation.branch import Branch
from contfric.continuation.candidates import Candidate, directions, sequences_of
from contfric.continuation.crossing import LOCATED, Direction, crossing_near
from contfric.continuation.events import (
    ACCURACY,
    TERMINAL,
    Bifurcation,
    End,
    EndReason,
    Kind,
    Verdict,
)
from contfric.continuation.incident import incident_forms
from contfric.continuation.points import Point, Settings
from contfric.continuation.side import Side, first_point
from contfric.continuation.switching import (
    NEARER,
    leaps,
    leave_along,
    null_vector,
    settings_value,
)
from contfric.continuation.trace import follow_orbit, trace_side
from contfric.continuation.vertices import symmetrised
from contfric.continuation.walked import walked
from contfric.models.definition import FloatArray
from contfric.orbit.linear import null_space
from contfric.orbit.orbit import Orbit
from contfric.orbit.repetition import shortest
from contfric.orbit.solve import polish
from contfric.orbit.system import Word
from contfric.signature.edits import show

#: First step away from an event, in largest steps: the new word is proved close to it.
_NEAR_EVENT = 0.01
#: Where an orbit beside an event is looked for, relative to the range.
_SHARES = (1e-4, -1e-4, 1e-3, -1e-3, 1e-6, -1e-6)
#: Null vectors where two curves may cross, and the directions between them that are tried: the corrector
#: reaches a curve from 30 degrees beside it.
_PLANE, _ANGLES = 2, 12
#: An orbit this much (of its distance from a symmetric one) off its own symmetry image is asymmetric.
_ODD = 0.1
#: A branch that gets no farther than this (arclength) from the event it starts at has left it in the
#: direction in which it is not admissible.
_NOWHERE = 1e-7
#: The same for an event that is located to the root of rounding only.
_NOWHERE_ROUGHLY = 1e-3
#: A branch shorter than this (arclength) that comes back to its event has been nowhere.
_NO_WIDTH = 1e-3
#: One that gets this far has left it in the right one. A shorter one may have gone back the way that the
#: start was beside the event: a touch at the very end of a segment is located to the root of rounding.
_SURELY_AWAY = 1e-4


def follow(state: Exploration, event: Event) -> None:
    """Trace everything that leaves an event and is not known yet."""
    kind = event.bifurcation.kind
    if kind in TERMINAL:
        _follow_sliding(state, event)
    elif kind is Kind.BP:
        _follow_branch_point(state, event)
    elif kind is Kind.PD:
        _follow_doubling(state, event)
    elif kind is Kind.SN:
        _follow_fold(state, event)


def _follow_fold(state: Exploration, event: Event) -> None:
    """Try the families that cross a symmetric bridge where it turns.

    A hold has an effect that is stationary in its length: there each of two symmetric holds may be shorter
    or longer, so that the bridge with one of either passes the same motion, and turns there as well.
    """
    orbit = event.bifurcation.orbit
    half = orbit if orbit.system.half else symmetrised(orbit)
    if half is None:
        return
    _try_crossing(
        state, event, half.as_whole(), "the asymmetric branch with one hold of either length"
    )
    if not any(state.branches[i].system.half for i in event.branches):
        _try_crossing(state, event, half, "the symmetric branch through the fold")


def _try_crossing(state: Exploration, event: Event, orbit: Orbit, reason: str) -> None:
    settings = settings_for(orbit, state.settings)
    active = orbit.model.index_of(settings.parameter)
    for distance in NEARER:
        for direction in _plane_of(orbit, active):
            moved = replace(orbit, joints=orbit.joints + distance * direction)
            point = first_point(moved, settings, direction, 0.0)
            if point is None:
                continue
            there = point.orbit(orbit.system, orbit.vector, active)
            off = there.mirror_distance > _ODD * distance
            if not there.admissible or off is orbit.system.half:
                continue
            if (known := state.known(there)) is not None:
                state.judge(event, reason, Verdict.KNOWN, known)
                return
            _add_crossing(state, event, orbit, point, reason)
            return


def _add_crossing(
    state: Exploration, event: Event, orbit: Orbit, point: Point, reason: str
) -> None:
    """Trace a family that crosses a fold: both ways, or to one side of it where the other is its image."""
    settings = settings_for(orbit, state.settings)
    active = orbit.model.index_of(settings.parameter)
    if orbit.system.half:
        there = point.orbit(orbit.system, orbit.vector, active)
        branch = follow_orbit(there, settings)
    else:
        if float(np.sum((point.joints - orbit.joints) * point.tangent)) < 0.0:
            point = point.reversed()
        origin = replace(point, joints=orbit.joints, value=settings_value(orbit, settings), arc=0.0)
        point.arc = float(np.linalg.norm(point.joints - orbit.joints)) / len(orbit.joints) ** 0.5
        side = trace_side(orbit, point, settings, progress=state.progress)
        first = _first_end(EndReason.BP, event, side, settings)
        branch = assemble(orbit, settings, side, first, origin)
    state.judge(event, reason, Verdict.ACCEPTED, len(state.branches))
    state.add_from(branch, event)


def _plane_of(orbit: Orbit, active: int) -> Iterator[FloatArray]:
    """Yield directions in the plane of two null vectors; none where the curve has a unique direction."""
    vectors, _ = null_space(orbit.system, orbit.joints, orbit.vector, active)
    if len(vectors) != _PLANE:
        return
    for angle in np.arange(_ANGLES) * (2.0 * np.pi / _ANGLES):
        away = np.cos(angle) * vectors[0] + np.sin(angle) * vectors[1]
        yield away / np.max(np.abs(away))


# -------------------------------------------------------------------------- sliding events


def _follow_sliding(state: Exploration, event: Event) -> None:
    accepted = jumps = False
    orbit = event.bifurcation.orbit
    active = orbit.model.index_of(state.settings.parameter)
    edits = bool(orbit.model.resets) or any(
        mode.sliding for mode in orbit.model.modes
    )  # else nothing rests
    for wide in (False, True) if edits else ():
        incident = incident_forms(event.bifurcation, wide)
        words: set[Word] = set()
        state.raise_copies(shortest(orbit).periods // incident.unit.periods)
        most = min(state.max_periods, state.copies * incident.unit.periods)
        for candidate in sequences_of(incident, active, most, state.bridges):
            jumps = jumps or candidate.has_hold
            accepted = _judge(state, event, candidate) or accepted
            if event.proposals and event.proposals[-1].verdict is not Verdict.REFUSED:
                words |= candidate.words
        event.kinds |= {n.kind for n in incident.names if n.before & words and n.after & words}
        if accepted:
            return
    if not jumps:  # else motions beside the event are not near what follows it
        _follow_flow(state, event)


def _follow_flow(state: Exploration, event: Event) -> None:
    """Try the words that motions beside an event walk."""
    orbit, settings = event.bifurcation.orbit, state.settings
    if orbit.system.holds:
        return
    active = orbit.model.index_of(settings.parameter)
    shifts = tuple((active, share * settings.width) for share in _SHARES)
    reason = "the word that the flow walks beside the event"
    for found in walked(orbit.as_whole(), shifts):
        guess = replace(found, vector=orbit.vector)
        branch = _through(state, guess)
        ends = [] if branch is None else [e for e in branch.ends if _meets(e, event, settings)]
        if branch is None or not ends:
            why = f"no orbit of {show(guess.word)} meets the event"
            state.judge(event, reason, Verdict.REFUSED, why=why)
        elif (known := state.known(branch[len(branch) // 2])) is not None:
            state.judge(event, reason, Verdict.KNOWN, known)
        else:
            state.judge(event, reason, Verdict.ACCEPTED, len(state.branches))
            state.add_from(branch, event)
            for end in ends:
                state.merge(event, end)


def _meets(end: End, event: Event, settings: Settings) -> bool:
    """Tell whether a branch ends at an event, by whatever name it calls it.

    A stop that comes in there is one of the new orbit only.
    """
    a, b = end.bifurcation, event.bifurcation
    if a is None or a.kind not in TERMINAL:
        return False
    gap = abs(a.params[settings.parameter] - b.params[settings.parameter])
    if gap > max(a.accuracy, b.accuracy) * settings.width:
        return False
    return part_distance(a.orbit.stops, b.orbit.stops) < SAME_MOTION


def _judge(state: Exploration, event: Event, candidate: Candidate) -> bool:
    """Try one candidate; return whether a branch of it meets the event."""
    if candidate.orbit is None:
        state.judge(event, candidate.reason, Verdict.REFUSED, why=candidate.refusal)
        event.rests = event.rests or candidate.rest
        return candidate.rest
    known = state.ends_here(candidate.orbit, event)
    if known is not None:
        arrived = event.branches[:1] == [known]
        state.judge(event, candidate.reason, Verdict.KNOWN, known)
        return not arrived
    return _try(state, event, candidate)


def _try(state: Exploration, event: Event, candidate: Candidate) -> bool:
    branch = _leave_event(state, candidate, event)
    if branch is None and event.bifurcation.accuracy > ACCURACY:
        assert candidate.orbit is not None
        branch = _through(state, candidate.orbit)
        if branch is not None and branch.arc[-1] < _NOWHERE_ROUGHLY:
            branch = None
        known = None if branch is None else state.known(branch[len(branch) // 2])
        if known is not None:
            state.judge(event, candidate.reason, Verdict.KNOWN, known)
            return True
    if branch is not None and _has_no_width(branch, event, state.settings):
        assert candidate.orbit is not None
        own = settings_for(candidate.orbit, state.settings)
        branch = _leave_singular(state, candidate.orbit, event, own) or branch
    if branch is not None and _has_no_width(branch, event, state.settings):
        why = "it begins and ends at the event, without any width"
        state.judge(event, candidate.reason, Verdict.REFUSED, why=why)
        return False
    if branch is None:
        why = "no admissible orbit beyond the event"
        state.judge(event, candidate.reason, Verdict.REFUSED, why=why)
        return False
    state.judge(event, candidate.reason, Verdict.ACCEPTED, len(state.branches))
    state.add_from(branch, event)
    return True


def _has_no_width(branch: Branch, event: Event, settings: Settings) -> bool:
    """Tell whether a branch begins and ends at one event and is nowhere else: admissible to rounding only."""
    b, last = event.bifurcation, branch.ends[1].bifurcation
    if last is None or branch.arc[-1] > _NO_WIDTH:
        return False
    return same_place(last, b, settings.parameter, settings.width)


def _leave_event(state: Exploration, candidate: Candidate, event: Event) -> Branch | None:
    """Trace away from an event, in the direction in which the orbit is admissible."""
    orbit = candidate.orbit
    assert orbit is not None
    settings = settings_for(orbit, state.settings)
    if candidate.away is not None:
        return _leave_beside(state, orbit, candidate.away, event, settings)
    longest: tuple[Orbit, Side] | None = None
    for there, side in _ways(orbit, settings, state.progress):
        if _went_somewhere(side, event) and (longest is None or side.length > longest[1].length):
            longest = there, side
        if longest is not None and side.length > _SURELY_AWAY:
            break
    if longest is None:
        return _leave_singular(state, orbit, event, settings)
    there, side = longest
    first = _first_end(EndReason[event.bifurcation.kind.name], event, side, settings)
    return assemble(there, settings, side, first)


def _ways(
    orbit: Orbit, settings: Settings, progress: Progress | None
) -> Iterator[tuple[Orbit, Side]]:
    """Yield what is traced in each direction from an orbit at an event."""
    active = orbit.model.index_of(settings.parameter)
    for tangent, slope in directions(orbit, active):
        start = first_point(orbit, settings, tangent, slope)
        if start is None:
            continue
        there = start.orbit(orbit.system, orbit.vector, active)
        for point in (start, start.reversed()):
            yield there, _trace(there, point, settings, progress)


def _leave_beside(
    state: Exploration, orbit: Orbit, away: FloatArray, event: Event, settings: Settings
) -> Branch | None:
    """Trace away from an event at which the new orbit is singular, from a little beside it."""
    active = orbit.model.index_of(settings.parameter)
    for distance in NEARER:
        moved = replace(orbit, joints=orbit.joints + distance * orbit.period * away)
        for tangent, slope in directions(moved, active):
            point = first_point(moved, settings, tangent, slope)
            if point is None:
                continue
            there = point.orbit(orbit.system, orbit.vector, active)
            if float(np.sum(away * point.tangent)) < 0.0:
                point = point.reversed()
            point.arc = float(np.linalg.norm(there.joints - orbit.joints)) / len(away) ** 0.5
            side = _trace(there, point, settings, state.progress)
            if there.admissible and side.count > 1:
                origin = replace(point, joints=orbit.joints, value=settings_value(orbit, settings))
                origin.arc = 0.0
                first = _first_end(EndReason[event.bifurcation.kind.name], event, side, settings)
                return assemble(there, settings, side, first, origin)
    return None


def _leave_singular(
    state: Exploration, orbit: Orbit, event: Event, settings: Settings
) -> Branch | None:
    """Trace away from an event at which the curve has no unique direction.

    Its directions lie in the plane of two null vectors; those at regular angles are tried.
    """
    for away in _plane_of(orbit, orbit.model.index_of(settings.parameter)):
        branch = _leave_beside(state, orbit, away, event, settings)
        if branch is not None and branch.arc[-1] > _SURELY_AWAY:
            return branch
    return None


def _trace(orbit: Orbit, point: Point, settings: Settings, progress: Progress | None) -> Side:
    return trace_side(
        orbit, point, settings, first_step=_NEAR_EVENT, at_event=True, progress=progress
    )


def settings_for(orbit: Orbit, settings: Settings) -> Settings:
    """Return the settings for a branch: on a bridge there are no multipliers."""
    return replace(settings, stability=False) if orbit.system.holds else settings


def _went_somewhere(side: Side, event: Event) -> bool:
    rough = event.bifurcation.accuracy > ACCURACY
    return side.length > (_NOWHERE_ROUGHLY if rough else _NOWHERE)


def _first_end(reason: EndReason, event: Event, side: Side, settings: Settings) -> End:
    """Return the end of a branch at the event that it starts from."""
    b = event.bifurcation
    stable: bool | None = False if side_is_bridge(side) else None
    if settings.stability and not side_is_bridge(side):
        stable = bool(np.all(np.abs(side.second_multipliers) < 1.0))
    here = replace(b, position=0.0, stable_before=None, stable_after=stable)
    return End(reason, f"{EndReason.START.value}: {where(b, settings.parameter)}", here)


def side_is_bridge(side: Side) -> bool:
    """Return whether a side was traced without multipliers because it has holds."""
    return "mu" not in side.names


def where(bifurcation: Bifurcation, parameter: str) -> str:
    """Return what a bifurcation is and where, for a message."""
    return f"{bifurcation.label} at {parameter} = {bifurcation.params[parameter]:.10g}"


# --------------------------------------------------------------------------- branch points


def _follow_branch_point(state: Exploration, event: Event) -> None:
    orbit = event.bifurcation.orbit
    crossing = crossing_near(orbit, state.settings, LOCATED)
    if crossing is not None:
        follow_crossing(state, crossing, event, _follow_departure)
        return
    if not orbit.system.half:
        _follow_both_ways(state, orbit, event)
        return
    if not any(state.branches[i].system.half for i in event.branches):
        _follow_both_ways(state, orbit, event)
    if any(not state.branches[i].system.half for i in event.branches):
        return
    _follow_departure(state, orbit.as_whole(), event, EndReason.BP)


def _follow_both_ways(state: Exploration, orbit: Orbit, event: Event) -> None:
    """Continue a branch through an event that it passes, from just beside it."""
    reason = "the branch that goes on through the event"
    branch = _through(state, orbit)
    if branch is None:
        state.judge(event, reason, Verdict.REFUSED, why="no orbit beside the event was found")
    elif (known := state.known(branch[len(branch) // 2])) is not None:
        state.judge(event, reason, Verdict.KNOWN, known)
    else:
        state.judge(event, reason, Verdict.ACCEPTED, len(state.branches))
        state.add_from(branch, event)


def _follow_departure(
    state: Exploration,
    orbit: Orbit,
    event: Event,
    reason: EndReason,
    direction: Direction | None = None,
) -> None:
    """Trace the branch that leaves a branch point or a period doubling; by default along the null vector."""
    settings = settings_for(orbit, state.settings)
    text = "the branch that leaves along the null vector"
    active = orbit.model.index_of(settings.parameter)
    along = direction or Direction(null_vector(orbit), 0.0)
    for distance in NEARER:
        departure = leave_along(orbit, settings, along, reason.value, distance)
        if departure is None:
            continue
        there = departure.point.orbit(orbit.system, orbit.vector, active)
        if shortest(there) is not there:
            continue  # Newton has fallen back on the orbit that it is to leave
        known = state.known(there)
        if known is not None:
            state.judge(event, text, Verdict.KNOWN, known)
            return
        if distance != NEARER[-1] and leaps(orbit, settings, departure, distance, along):
            continue
        side = trace_side(orbit, departure.point, settings, progress=state.progress)
        if _went_somewhere(side, event):
            first = _first_end(reason, event, side, settings)
            state.judge(event, text, Verdict.ACCEPTED, len(state.branches))
            state.add_from(assemble(orbit, settings, side, first, departure.origin), event)
            return
    state.judge(event, text, Verdict.REFUSED, why="it is not admissible")


def _through(state: Exploration, orbit: Orbit) -> Branch | None:
    """Return the branch through an orbit at which it may be singular, from just beside it."""
    settings = state.settings
    value = settings_value(orbit, settings)
    active = orbit.model.index_of(settings.parameter)
    for share in _SHARES:
        beside = value + share * settings.width
        if not settings.low <= beside <= settings.high:
            continue
        vector = orbit.vector.copy()
        vector[active] = beside
        solved = polish(Orbit(orbit.system, orbit.joints, vector, np.inf))
        if solved.converged and solved.admissible:
            return whole_branch(shortest(solved), settings)
    return None


# ------------------------------------------------------------------------- period doubling


def _follow_doubling(state: Exploration, event: Event) -> None:
    orbit = event.bifurcation.orbit
    if not any(state.branches[i].system.periods == orbit.periods for i in event.branches):
        _follow_both_ways(state, orbit, event)
    if any(state.branches[i].system.periods == 2 * orbit.periods for i in event.branches):
        return
    if 2 * orbit.periods > state.max_periods:
        why = f"max_periods = {state.max_periods}"
        reason = f"the branch of {2 * orbit.periods} periods"
        state.judge(event, reason, Verdict.REFUSED, why=why)
        return
    _follow_departure(state, orbit.doubled(), event, EndReason.PD)
