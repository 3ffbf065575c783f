"""Finds and follows the branches that leave an event, by the kind of bifurcation.

* CS, SS, AS, GS: every candidate that the transition graph proposes, bridges among them;
* BP: the asymmetric branch from a symmetric one, or the symmetric branch from an asymmetric one;
* PD: the branch of twice the period, or the one of half the period from it.

A candidate is accepted when it is solved, and admissible beyond the event in one direction.
"""

from __future__ import annotations

from collections.abc import Iterable

from contfric.atlas.collect import NOT_ASKED_FOR, Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving.crossings import follow_crossing, whole_branch
from contfric.atlas.leaving.departures import NO_WIDTH, ends_at, follow_departure
from contfric.atlas.leaving.families import (
    follow_beside_family,
    follow_family_at,
    meets,
    solved_next_to,
)
from contfric.atlas.leaving.faults import (
    STANDS_STILL,
    fault_of,
    fault_of_itinerary,
    slips_to_one_side,
)
from contfric.atlas.leaving.folds import follow_arms
from contfric.atlas.leaving.from_flow import follow_flow, meeting_next_to
from contfric.atlas.leaving.many_contacts import GOES_ON, composes, goes_on, in_order
from contfric.atlas.leaving.short_branches import follow_short
from contfric.atlas.leaving.splitting import follow_split
from contfric.atlas.leaving.trace_away import (
    from_admissible,
    leave_event,
    leave_singular,
    may_have_passed,
    settings_for,
)
from contfric.atlas.matching import SAME_SOLUTION, inner_orbit, same_kind
from contfric.bvp.system import Itinerary
from contfric.continuation.branch import Branch
from contfric.continuation.families.continuum import in_continuum
from contfric.continuation.points import Settings
from contfric.continuation.singular_points.crossing import LOCATED, crossing_near
from contfric.events.accumulating import accumulates
from contfric.events.bifurcation import ACCURACY, TERMINAL, Decision, End, EndReason, Kind
from contfric.events.incident.candidates import Candidate, sequences_of
from contfric.events.incident.incident import incident_forms, kinds_between
from contfric.events.incident.partial_touches import partial_touches
from contfric.events.local.jumps import nothing_jumps
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.orbit import Orbit

#: The same for an event that is located to the root of rounding only.
_NOWHERE_ROUGHLY = 1e-3
#: A branch shorter than this violates a condition by its square from the start on, which is rounding up to
#: there (1e-10 at a slack of 1e-9 over a rate that is small).
_ROUNDED = 1e-5
#: A first point that violates a condition by more than this is outside: rounding is a tenth of it.
_OUTSIDE = 1e-11
#: Where rounding moves an event by this share of the range its orbits hold for every value of the parameter.
_UNKNOWN = 0.1

#: Why what was traced is no branch of an event: its first step has gone to a branch nearby.
_ELSEWHERE = "it is a branch that begins at another event nearby"
#: Why nothing is followed where the impacts of a chatter just come to rest before the wall lets go.
_INCOMPLETE = (
    "the chatter is not complete beyond: branches with any number of impacts come together here"
)
#: The same where such branches follow each other, each with one impact more.
_ACCUMULATE = (
    "impacts accumulate (chatter): branches with ever more of them follow each other, without end"
)


def follow(state: Exploration, event: Event) -> None:
    """Trace everything that leaves an event and is not known yet."""
    kind = event.bifurcation.kind
    if kind in TERMINAL:
        _follow_sliding(state, event)
    elif kind is Kind.BP:
        if not follow_arms(state, event):
            _follow_branch_point(state, event)
    elif kind is Kind.PD:
        if not follow_arms(state, event):
            _follow_doubling(state, event)
    elif kind is Kind.SN:
        follow_arms(state, event)


# -------------------------------------------------------------------------- sliding events


def _follow_sliding(state: Exploration, event: Event) -> None:
    accepted, jumps, most = False, False, 0
    orbit = event.bifurcation.orbit
    chatters = any(test.surface in orbit.model.fixed_sides for test in event.bifurcation.tests)
    if chatters or accumulates(event.bifurcation):
        why = _INCOMPLETE if chatters else _ACCUMULATE
        state.judge(event, "go on after the event", Decision.REFUSED, why=why)
        return
    if event.bifurcation.accuracy > _UNKNOWN and _begins_continuum(state, orbit, event):
        reason, why = "go on after the event", EndReason.CONTINUUM.value
        state.judge(event, reason, Decision.REFUSED, why=why)
        return
    active = orbit.model.index_of(state.settings.parameter)
    edits = bool(orbit.model.resets) or any(m.sliding for m in orbit.model.modes)  # else no rest
    # the forms are the same both times where the event is known roughly; what else the second time tries is
    # what local conditions exclude, and these are not asked of many contacts
    once = composes(orbit) and event.bifurcation.accuracy > ACCURACY
    tried: set[tuple[object, ...]] = set()  # by what an orbit is solved from: it ends the same
    itineraries: set[Itinerary] = set()
    for candidate in partial_touches(event.bifurcation, active, state.max_periods, state.copies):
        _judge(state, event, candidate)  # what crosses nothing is looked for below
    for wide in ((False,) if once else (False, True)) if edits else ():
        incident = incident_forms(event.bifurcation, wide, event.members)
        state.raise_copies(shortest(orbit).periods // incident.unit.periods)
        most = min(state.max_periods, state.copies * incident.unit.periods)
        proposed: Iterable[Candidate] = sequences_of(incident, active, most, state.bridges)
        for candidate in in_order(proposed) if composes(orbit) else proposed:
            jumps = jumps or (candidate.has_hold and not nothing_jumps(orbit))
            if candidate.orbit is not None:
                if (start := _start_of(candidate)) in tried:
                    continue
                tried.add(start)
            accepted = _judge(state, event, candidate) or accepted
            if event.bifurcation.orbit is not orbit:  # better located: outcomes are asked anew
                state.waiting.appendleft(event)
                return
            if composes(orbit) and goes_on(state, event):
                state.judge(event, "other orders of the changes", Decision.REFUSED, why=GOES_ON)
                accepted = True  # or known: nothing else is looked for
                break
            if event.proposals and event.proposals[-1].verdict is not Decision.REFUSED:
                itineraries |= candidate.itineraries
        follow_beside_family(state, event)
        event.kinds |= kinds_between(incident.names, itineraries)
        if accepted or follow_split(state, event):
            return
    if not jumps:  # else motions near the event are not near what follows it
        if follow_flow(state, event) and most > shortest(orbit).periods:
            # its solution has more forms now, which may follow each other
            state.waiting.appendleft(event)
    elif len(event.branches) == 1 and slips_to_one_side(orbit, event.proposals):
        event.final = EndReason.SHAKEDOWN


def _start_of(candidate: Candidate) -> tuple[object, ...]:
    """Return what a candidate is solved from; two with the same are one."""
    orbit, away = candidate.orbit, candidate.away
    assert orbit is not None
    system = orbit.system
    moves = b"" if away is None else away.tobytes()
    return system.itinerary, system.periods, system.half, orbit.joints.tobytes(), moves


def _judge(state: Exploration, event: Event, candidate: Candidate) -> bool:
    """Try one candidate; return whether a branch of it meets the event."""
    if candidate.orbit is None:
        state.judge(event, candidate.reason, Decision.REFUSED, why=candidate.refusal)
        event.final = EndReason.REST if candidate.rest else event.final
        return candidate.rest
    known = state.ends_here(candidate.orbit, event)
    if known is not None:
        arrived = event.branches[:1] == [known]
        state.judge(event, candidate.reason, Decision.KNOWN, known)
        return not arrived
    return _try(state, event, candidate)


def _try(state: Exploration, event: Event, candidate: Candidate) -> bool:
    assert candidate.orbit is not None
    if event.bifurcation.accuracy > ACCURACY and follow_family_at(
        state, event, candidate.orbit, candidate.reason
    ):
        return True
    fault = fault_of_itinerary(candidate.orbit)
    if fault is not None and not _begins_continuum(state, candidate.orbit, event):
        state.judge(event, candidate.reason, Decision.REFUSED, why=fault)  # whatever is traced
        return False
    if (met := follow_short(state, candidate, event)) is not None:
        return met
    branch = leave_event(state, candidate, event)
    if branch is None and event.bifurcation.accuracy > ACCURACY:
        branch = _through(state, candidate.orbit)
        if branch is not None and branch.arc[-1] < _NOWHERE_ROUGHLY:
            branch = None
        if branch is not None and state.knows(event, candidate.reason, inner_orbit(branch)):
            return True
    if branch is None:
        why = "no admissible orbit beyond the event"
        if _begins_continuum(state, candidate.orbit, event):
            why = EndReason.CONTINUUM.value
        state.judge(event, candidate.reason, Decision.REFUSED, why=why)
        return False
    if _has_no_width(branch, event, state.settings):
        own = settings_for(candidate.orbit, state.settings)
        branch = leave_singular(state, candidate.orbit, event, own) or branch
    fault = fault_of(branch, state.settings.width)
    if fault == STANDS_STILL:  # a line of such solutions leaves the event, too
        other, ends = meeting_next_to(state, candidate.orbit, event, [])
        if other is not None:
            state.take(event, candidate.reason, other, ends)
            return True
    if fault is None and _has_no_width(branch, event, state.settings):
        fault = "it begins and ends at the event, without any width"
    if fault is None and (found := state.known(inner_orbit(branch))) is not None:
        if any(ends_at(end, event, state.settings) for end in state.branches[found].ends):
            state.judge(event, candidate.reason, Decision.KNOWN, found)
            return True
        fault = _ELSEWHERE
    if fault is not None:
        state.judge(event, candidate.reason, Decision.REFUSED, why=fault)
        return False
    branch, ends = _located_by(state, branch, event)
    branch = from_admissible(branch, candidate.orbit) if not ends else branch
    state.accept(event, candidate.reason, branch, ends)
    for end in ends:
        event.take_better(end)
    return True


def _located_by(state: Exploration, branch: Branch, event: Event) -> tuple[Branch, list[End]]:
    """Return a branch from an event that is known roughly, with its own end there where that is known better.

    Where the equations of the branch that arrives are singular at its end, those of another one need not be.
    From a location off by the root of rounding that one begins outside of its conditions: that is seen of it
    however well the event seems to be known. What begins too far from the event may have passed another one.
    """
    known = event.bifurcation.accuracy
    outside = branch[0].margins.min(initial=0.0) < -_OUTSIDE
    elsewhere = (known > ACCURACY or outside) and not branch.bridge
    passed = elsewhere or may_have_passed(branch, known * state.settings.width)
    if branch.arc[-1] < _NOWHERE_ROUGHLY or not passed:
        return branch, []
    whole = whole_branch(branch[len(branch) // 2], state.settings)
    if whole is None or (not elsewhere and len(whole.bifurcations) <= len(branch.bifurcations)):
        return branch, []
    ends = [end for end in whole.ends if meets(end, event, state.settings)]
    # what begins outside or too far needs its own location, even if the event is known as well
    better = [end for end in ends if end.bifurcation and end.bifurcation.accuracy <= ACCURACY]
    located = better and not fault_of(whole, state.settings.width)
    return (whole, better[:1]) if located else (branch, [])


def _begins_continuum(state: Exploration, orbit: Orbit | None, event: Event) -> bool:
    """Tell whether the orbits that follow an event are a continuum, and say so on the event."""
    assert orbit is not None
    active = orbit.model.index_of(state.settings.parameter)
    found = in_continuum(orbit, active)
    event.final = EndReason.CONTINUUM if found else event.final
    return found


def _has_no_width(branch: Branch, event: Event, settings: Settings) -> bool:
    """Tell whether a branch begins and ends at one event and is nowhere else: admissible to rounding only.

    Where a half of a symmetric orbit cannot change without the other, its change alone ends at once. That end
    may have other joints than the event (where the phase is cut by sections): their parameters tell.
    """
    if branch.arc[-1] <= NO_WIDTH and ends_at(branch.ends[1], event, settings):
        return True
    last, b = branch.ends[1].bifurcation, event.bifurcation
    if last is None or branch.arc[-1] >= _ROUNDED or not same_kind(last, b):
        return False
    if branch.bridge:
        return last.outline.apart(b.outline) < SAME_SOLUTION
    gap = abs(last.params[settings.parameter] - b.params[settings.parameter])
    return gap <= settings.width * max(last.accuracy, b.accuracy)


# --------------------------------------------------------------------------- branch points


def _follow_branch_point(state: Exploration, event: Event) -> None:
    orbit = event.bifurcation.orbit
    if follow_family_at(state, event, orbit, "the family of orbits at this value"):
        if not any(state.branches[i].system.half for i in event.branches):
            _follow_both_ways(state, orbit, event)
        return
    crossing = crossing_near(orbit, state.settings, LOCATED)
    if crossing is not None:
        follow_crossing(state, crossing, event, follow_departure)
        return
    if not orbit.system.half:
        _follow_both_ways(state, orbit, event)
        return
    if not any(state.branches[i].system.half for i in event.branches):
        _follow_both_ways(state, orbit, event)
    if any(not state.branches[i].system.half for i in event.branches):
        return
    follow_departure(state, orbit.as_whole(), event, EndReason.BP)


def _follow_both_ways(state: Exploration, orbit: Orbit, event: Event) -> None:
    """Continue a branch through an event that it passes, from just next to it."""
    reason = "the branch that goes on through the event"
    branch = _through(state, orbit)
    if branch is None:
        state.judge(event, reason, Decision.REFUSED, why="no orbit near the event was found")
    else:
        state.take(event, reason, branch)


def _through(state: Exploration, orbit: Orbit) -> Branch | None:
    """Return the branch through an orbit at which it may be singular, from just next to it."""
    found = (whole_branch(near, state.settings) for near in solved_next_to(orbit, state.settings))
    return next((branch for branch in found if branch is not None), None)


# ------------------------------------------------------------------------- period doubling


def _follow_doubling(state: Exploration, event: Event) -> None:
    orbit = event.bifurcation.orbit
    if not any(state.branches[i].system.periods == orbit.periods for i in event.branches):
        _follow_both_ways(state, orbit, event)
    if any(state.branches[i].system.periods == 2 * orbit.periods for i in event.branches):
        return
    if 2 * orbit.periods > state.max_periods:
        why = f"{NOT_ASKED_FOR} = {state.max_periods}"
        reason = f"the branch of {2 * orbit.periods} periods"
        state.judge(event, reason, Decision.REFUSED, why=why)
        return
    follow_departure(state, orbit.doubled(), event, EndReason.PD)
