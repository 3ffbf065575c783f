"""Families of orbits at one value of the parameter in an exploration, and what meets their ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving.crossings import whole_branch
from contfric.atlas.leaving.faults import fault_of
from contfric.atlas.matching import SAME_SOLUTION, stops_apart
from contfric.continuation.families.continuum import is_continuum
from contfric.continuation.families.vertical import family_near
from contfric.continuation.points import Settings, next_to
from contfric.continuation.trace import follow_family
from contfric.events.bifurcation import TERMINAL, End, Kind
from contfric.events.incident.candidates import candidates
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

#: Where an orbit near an event is looked for, relative to the range.
SHARES = (1e-4, -1e-4, 1e-3, -1e-3, 1e-6, -1e-6)
#: The same on both sides of the end of a family, where equations are singular: the farthest first.
_BOTH = (1e-3, -1e-3, 1e-4, -1e-4)
#: Lengths of a segment at which the second of two branches of one itinerary is looked for, in those of the
#: first.
_LONGER = (3.0, 10.0, 30.0)
#: How much farther from the end it is traced from, if it can be.
_FARTHER = (30.0, 10.0, 3.0)


def follow_family_at(state: Exploration, event: Event, orbit: Orbit, reason: str) -> bool:
    """Follow the family of orbits at one value of the parameter that begins at an event, if one does."""
    within = event.bifurcation.accuracy * state.settings.width
    family = family_near(orbit, orbit.model.index_of(state.settings.parameter), within)
    if family is None:
        return False
    if state.knows(event, reason, family.orbit):
        return True
    branch = follow_family(family, state.settings, state.progress)
    if branch is None or fault_of(branch, state.settings.width):
        return False
    kinds = TERMINAL if event.bifurcation.kind in TERMINAL else frozenset({Kind.BP})
    ends = [end for end in branch.ends if meets(end, event, state.settings, kinds)]
    if not ends:
        return False
    state.accept(event, reason, branch, ends)
    return True


def follow_beside_family(state: Exploration, event: Event) -> None:
    """Follow what meets the end of a family on either side of its value: up to two branches of one itinerary.

    There the equations left over begin with a quadratic form in the distances of the stop and of the
    parameter: each of its two lines is a branch on one side, and both may be of one itinerary.
    """
    families = [state.branches[i] for i in event.branches if is_continuum(state.branches[i])]
    own = [end.bifurcation for branch in families for end in branch.ends]
    known = [b for b in event.members if any(b is end for end in own)]
    if not known:
        return
    event.bifurcation = known[0]  # better located than where others meet it
    for candidate in candidates(known[0]):
        if candidate.orbit is None or candidate.has_hold:
            continue
        for share in _BOTH:
            near = _next_in_family(state, candidate.orbit, share)
            if near is None or state.known(near) is not None:
                continue
            branch = whole_branch(shortest(near), state.settings)
            if branch is None:
                continue
            ends = [end for end in branch.ends if meets(end, event, state.settings)]
            if ends and not fault_of(branch, state.settings.width):
                state.accept(event, candidate.reason, branch, ends)


def _next_in_family(state: Exploration, orbit: Orbit, share: float) -> Orbit | None:
    """Return an admissible orbit of an itinerary next to the end of a family, on one side of its value.

    The two lines are two lengths of the segment that vanishes, in proportion to the distance: if the one that
    Newton finds is negative the other one is looked for from a segment that is longer.
    """
    guess = next_to(orbit, state.settings, share)
    if guess is None:
        return None
    found = refine(guess)
    lasts = found.durations
    k = int(np.argmin(lasts[: len(orbit.joints)]))  # the other half lasts as long
    if found.converged and not found.admissible and lasts[k] < 0.0:
        for times in _LONGER:
            joints = orbit.joints.copy()
            joints[k, 0] += times * lasts[k]
            joints[(k + 1) % len(joints), 0] -= times * lasts[k]
            found = refine(replace(guess, joints=joints))
            if found.converged and found.admissible:
                break
    if not (found.converged and found.admissible):
        return None
    for times in _FARTHER:  # along the line: near its end steps lead to the other one
        vector = orbit.vector + times * (found.vector - orbit.vector)
        joints = orbit.joints + times * (found.joints - orbit.joints)
        farther = refine(Orbit(orbit.system, joints, vector, np.inf))
        lasts = farther.durations[k] > 0.5 * times * found.durations[k]
        if farther.converged and farther.admissible and lasts:
            return farther
    return found


def meets(end: End, event: Event, settings: Settings, kinds: frozenset[Kind] = TERMINAL) -> bool:
    """Tell whether a branch ends at an event, by whatever name it calls it.

    A stop that comes in there is one of the new orbit only.
    """
    a, b = end.bifurcation, event.bifurcation
    if a is None or a.kind not in kinds:
        return False
    gap = abs(a.params[settings.parameter] - b.params[settings.parameter])
    if gap > max(a.accuracy, b.accuracy) * settings.width:
        return False
    apart = stops_apart(a.orbit, b.orbit) < SAME_SOLUTION
    return apart or a.outline.apart(b.outline) < SAME_SOLUTION  # or its mirror image


def solved_next_to(orbit: Orbit, settings: Settings, guessed: bool = False) -> Iterator[Orbit]:
    """Yield orbits that are solved next to one at which its branch may be singular, nearer and nearer.

    Joints move by the root of what the parameter changes by, at most. What Newton's method finds farther away
    is another orbit of the itinerary, which no event need join to this one.

    Parameters
    ----------
    guessed : the orbit is a solution nearby, which may be anywhere
    """
    size = 1.0 + float(np.abs(orbit.joints).max())
    for share in SHARES:
        guess = next_to(orbit, settings, share)
        solved = None if guess is None else refine(guess)
        if solved is None or not (solved.converged and solved.admissible):
            continue
        moved = float(np.abs(solved.joints - orbit.joints).max())
        if guessed or moved <= max(SAME_SOLUTION, abs(share)) ** 0.5 * size:
            yield shortest(solved)
