"""Events of structures with many contacts: which orders of the changes are tried, and when it is enough.

Where nothing jumps, the return map is continuous and piecewise smooth. Two contacts that change at once
change in the other order after the event, and k pairs that do so at once (by symmetry, most often) have
``2^k`` orders. The one in which all are exchanged is tried first. The sum of the indices of all orbits is the
same on both sides of an event: where it is for the branches that are known, others could only come in pairs
beyond that, and are not sought.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.matching import same_event
from contfric.continuation.branch import Branch
from contfric.events.incident.candidates import Candidate
from contfric.orbit.orbit import Orbit

#: Why other orders of the changes are not tried.
GOES_ON = "the sum of the indices is the same on both sides: others could only come in pairs"


def composes(orbit: Orbit) -> bool:
    """Tell whether what follows events of an orbit is composed of the changes of single contacts."""
    return orbit.model.composed and orbit.model.filippov


def in_order(candidates: Iterable[Candidate]) -> Iterator[Candidate]:
    """Yield candidates: short orbits first, symmetric ones, of these that in which most contacts change."""
    found = list(candidates)
    yield from (c for c in found if c.orbit is None)
    solved = [c for c in reversed(found) if c.orbit is not None]
    yield from sorted(solved, key=_complexity)


def _complexity(candidate: Candidate) -> tuple[int, bool]:
    orbit = candidate.orbit
    return (0, False) if orbit is None else (orbit.periods, not orbit.system.half)


def goes_on(state: Exploration, event: Event) -> bool:
    """Tell whether the indices of the branches at an event have the same sum on both of its sides."""
    sums, sides = {-1: 0, 1: 0}, 0
    for number in event.branches:
        branch = state.branches[number]
        for first in _ends_at(branch, event, state.settings.width):
            index, side = _next_to_end(branch, first, state.settings.parameter)
            if index is None:
                return False
            sums[side] += index
            sides += 1
    return sides > 1 and sums[-1] == sums[1]


def _ends_at(branch: Branch, event: Event, width: float) -> Iterator[int]:
    """Yield the point (0 or -1) at which a branch ends at an event; a short one has another end nearby."""
    for point, end in zip((0, -1), branch.ends, strict=True):
        own = end.bifurcation
        if own is None:
            continue
        same = any(own is member for member in event.members)
        if same or same_event(own, event.bifurcation, branch.parameter, width):
            yield point


def _next_to_end(branch: Branch, end: int, parameter: str) -> tuple[int | None, int]:
    """Return the index of the orbits of a branch next to one of its ends, and the side that they are on."""
    values, multipliers = branch.params[parameter], branch.multipliers
    near = 1 if end == 0 else -2
    if multipliers is None or len(values) < 2:
        return None, 1
    real = multipliers[near][np.abs(multipliers[near].imag) == 0.0].real
    side = 1 if values[near] > values[end] else -1
    return (-1) ** int(np.sum(real > 1.0)), side
