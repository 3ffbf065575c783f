"""Continues a bridge where the touch that pins its hold splits: pinned to the earlier touch.

See :mod:`contfric.events.split_touch`. The equations are singular there in the time of the pin, so that
the orbits of the other side are looked for next to the event.
"""

from __future__ import annotations

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving.crossings import whole_branch
from contfric.atlas.leaving.departures import ends_at
from contfric.continuation.points import next_to
from contfric.events.bifurcation import Decision, Kind
from contfric.events.split_touch import pinned_first, splits
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

#: Where an orbit of the other side is looked for, relative to the range: the pin moves by the root of it.
_SHARES = (1e-5, -1e-5, 1e-4, -1e-4, 1e-3, -1e-3)
_REASON = "the touch that the hold is pinned to becomes two, or two become one"


def follow_split(state: Exploration, event: Event) -> bool:
    """Follow a bridge through a location where a touch splits; return whether it goes on there."""
    orbit = event.bifurcation.orbit
    if event.bifurcation.kind is not Kind.AS or not splits(orbit):
        return False
    for share in _SHARES:
        nearby = _nearby_orbit(state, orbit, share)
        if nearby is None or state.known(nearby) is not None:
            continue
        branch = whole_branch(nearby, state.settings)
        if branch is None or not any(ends_at(e, event, state.settings) for e in branch.ends):
            continue
        state.accept(event, _REASON, branch)
        return True
    state.judge(event, _REASON, Decision.REFUSED, why="no orbit on the other side was found")
    return False


def _nearby_orbit(state: Exploration, orbit: Orbit, share: float) -> Orbit | None:
    """Return the orbit of the same itinerary at a parameter next to the event, pinned to the first touch."""
    guess = next_to(orbit, state.settings, share)
    if guess is None:
        return None
    solved = refine(pinned_first(orbit, guess.vector))
    return shortest(solved) if solved.converged and solved.admissible else None
