"""Branches that leave an event by what solutions next to it do, or are solved at parameters next to it."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving.crossings import whole_branch
from contfric.atlas.leaving.families import SHARES, meets, solved_next_to
from contfric.atlas.leaving.faults import fault_of
from contfric.atlas.matching import on_branch
from contfric.base.attributes import altered
from contfric.bvp.conserved import conserved
from contfric.bvp.system import Itinerary
from contfric.continuation.branch import Branch
from contfric.events.bifurcation import Decision, End, EndReason
from contfric.events.incident.from_simulation import solutions_near
from contfric.orbit.itinerary.one_way import only_grows
from contfric.orbit.orbit import Orbit
from contfric.signature import canonical_itinerary
from contfric.signature.walks import show

#: Points to either side of an orbit next to an event, within which its branch ends there if it does: it comes
#: after 4 to 30 of them. Those that do not were nine tenths of the time of a pendulum's diagram.
_NEXT_TO_IT = 100


def follow_flow(state: Exploration, event: Event) -> bool:
    """Try the itineraries that solutions near an event follow; return whether a new branch does."""
    orbit, settings = event.bifurcation.orbit, state.settings
    if orbit.system.holds:
        return False
    active = orbit.model.index_of(settings.parameter)
    shifts = tuple((active, share * settings.width) for share in SHARES)
    reason = "the itinerary that the flow follows near the event"
    new, refused = False, dict[Itinerary, str]()
    done: set[Itinerary] = set()
    creeps: set[Itinerary] = set()
    asked: list[Branch] = []
    whole = orbit.as_whole()
    halves = solutions_near(whole, shifts, half=True) if orbit.symmetric else ()
    for found in chain(solutions_near(whole, shifts), halves):
        guess = replace(found, vector=orbit.vector)
        itinerary = canonical_itinerary(guess.itinerary, orbit.model)
        if itinerary in done:
            continue
        if only_grows(orbit.model, guess.itinerary):  # on its way to another orbit
            creeps.add(itinerary)
            refused.setdefault(itinerary, f"no periodic solution is {show(guess.itinerary)}")
            continue
        branch, ends = meeting_next_to(state, guess, event, asked)
        if branch is None:
            refused.setdefault(itinerary, f"no orbit of {show(guess.itinerary)} meets the event")
            continue
        done.add(itinerary)
        new = state.take(event, reason, branch, ends) or new
    for itinerary in (w for w in refused if w not in done):
        state.judge(event, reason, Decision.REFUSED, why=refused[itinerary])
    # with an offset that is conserved nothing else goes on from here: other walks lead to orbits elsewhere,
    # and those that stick all along are the continuum at which this begins, each with its own offset
    others = refused.keys() - creeps
    alone = len(orbit.system.layout.conserved) > 0 or all(
        len(conserved(orbit.model, itinerary)) for itinerary in others
    )
    if creeps and alone and not done and len(event.branches) == 1:
        event.final = EndReason.SHAKEDOWN
    return new


def meeting_next_to(
    state: Exploration, orbit: Orbit, event: Event, asked: list[Branch]
) -> tuple[Branch | None, list[End]]:
    """Return the branch next to an orbit that ends at an event, and those ends; others were ``asked``.

    A branch between an event and a doubling next to it may be very short. At a larger distance another branch
    is found; so smaller distances are tried. Solutions near several events may follow the same itinerary,
    which ends at one of them: what was traced is not traced again.
    """
    for near in solved_next_to(orbit, state.settings, guessed=True):
        if any(_passes(branch, near) for branch in asked):
            continue
        traced = (*state.branches, *state.elsewhere)
        branch = next((b for b in traced if _passes(b, near)), None)
        if branch is None:
            branch = _traced_towards(state, near, event)
            if branch is None:
                continue
            if not _is_cut(branch):
                state.elsewhere.append(branch)
        ends = [end for end in branch.ends if meets(end, event, state.settings)]
        if ends and not fault_of(branch, state.settings.width):
            return branch, ends
        asked.append(branch)
    return None, []


def _traced_towards(state: Exploration, near: Orbit, event: Event) -> Branch | None:
    """Return the branch of an orbit next to an event: or the part next to it, if that does not end there."""
    settings = state.settings
    if settings.most_points > _NEXT_TO_IT:
        part = whole_branch(near, altered(settings, most_points=_NEXT_TO_IT))
        if (
            part is None
            or not _is_cut(part)
            or not any(meets(e, event, settings) for e in part.ends)
        ):
            return part
    return whole_branch(near, settings)


def _is_cut(branch: Branch) -> bool:
    """Tell whether a branch has an end at which it was cut short."""
    return any(end.reason in (EndReason.POINTS, EndReason.WORK) for end in branch.ends)


def _passes(branch: Branch, orbit: Orbit) -> bool:
    """Tell whether a branch passes an orbit; a symmetric one, which comes whole, is followed on its half."""
    return on_branch(orbit.as_half() if branch.system.half else orbit, branch)
