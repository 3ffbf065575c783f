"""What leaves a bifurcation: branches from BP and PD, and starts after a crossing-sliding event.

**BP and PD.** At a branch point of a symmetric orbit the problem on the *whole* cycle, at fixed
parameters, has a null vector phi that is antisymmetric; at a period doubling the problem on the cycle
run through twice has one that changes sign after one turn. The branch that leaves is tangent to
``(phi, 0)``; its first point is solved normal to phi, a small distance away (H. B. Keller, 1977).

**CS.** The stick at the stop has length zero, so the orbit at the event solves the problems of both
words: with the stick and without. For a group of stops every combination of swaps is a candidate.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from contfric.continuation.events import Bifurcation
from contfric.continuation.points import Point, Settings
from contfric.continuation.side import first_point
from contfric.errors import NotationError
from contfric.models.definition import FloatArray
from contfric.orbit.linear import assembled
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.system import build_system
from contfric.orbit.words import half_of, mirror_pairs
from contfric.signature import is_closed_walk, swap_stops

#: Distance from the branch point to the first point of the branch that leaves, in the scaled product:
#: the square root of it is well above the accuracy of a state at a singular point, and the branch is
#: still a parabola there.
LEAVE = 1e-3
#: Where the branch ends sooner than that, the start is taken nearer.
NEARER = (LEAVE, 1e-4, 1e-5)


@dataclass(frozen=True, eq=False)
class Departure:
    """A place and direction to start a branch from, and what it comes from.

    ``origin`` is the orbit at the event itself, the first point of the new branch.
    """

    orbit: Orbit
    point: Point
    origin: Point
    reason: str


def null_vector(orbit: Orbit) -> FloatArray:
    """Return the unit null vector of a system that is singular at fixed parameters, shape (N, m).

    By the singular value decomposition of the assembled Jacobian; done once a branch point.
    """
    count, m = orbit.joints.shape
    full = assembled(orbit.system, orbit.joints, orbit.vector)
    vector: FloatArray = np.linalg.svd(full)[2][-1].reshape(count, m)
    return vector / float(np.sqrt(np.sum(vector**2) / count))


def leave_branch_point(
    orbit: Orbit, settings: Settings, reason: str, distance: float = LEAVE
) -> Departure | None:
    """Return a start on the branch that leaves a singular orbit along its null vector."""
    phi = null_vector(orbit)
    origin = first_point(orbit, settings)
    moved = replace(orbit, joints=orbit.joints + distance * phi)
    point = first_point(moved, settings, phi, 0.0)
    if point is None:
        return None
    # the tangent points away from the branch point
    away = point.joints - orbit.joints
    if float(np.sum(away * point.tangent)) < 0.0:
        point = point.reversed()
    if origin is None:
        origin = replace(point)
    origin.joints, origin.value = orbit.joints, settings_value(orbit, settings)
    point.arc = distance
    return Departure(orbit, point, origin, reason)


def settings_value(orbit: Orbit, settings: Settings) -> float:
    """Return the value of the varying parameter."""
    return float(orbit.vector[orbit.model.index_of(settings.parameter)])


def swapped_orbits(bifurcation: Bifurcation) -> Iterator[tuple[Orbit, str]]:
    """Yield the orbits of all words that meet at a crossing-sliding event, with the reason for each.

    Words that are mirror images of one already given are left out: their branches are mirrored.
    """
    orbit = bifurcation.orbit.as_whole()
    stops = _stops_of(bifurcation)
    seen: set[frozenset[tuple[tuple[str, str], ...]]] = set()
    for size in range(len(stops), 0, -1):
        for chosen in combinations(stops, size):
            events = dict(chosen)
            try:
                word = swap_stops(orbit.system.word, events, orbit.model)
            except NotationError:
                continue
            key = _up_to_mirror(orbit, word)
            if key in seen or not is_closed_walk(word, orbit.model):
                continue
            seen.add(key)
            places = ", ".join(f"stop {joint + 1} at {surface}" for joint, surface in chosen)
            yield _swapped(orbit, events), f"swap stick and reversal at {places}"


def _stops_of(bifurcation: Bifurcation) -> list[tuple[int, str]]:
    """Return (segment, surface) of every stop of the whole orbit that is at the event."""
    orbit = bifurcation.orbit
    stops = [(test.segment, test.surface) for test in bifurcation.tests]
    if orbit.system.half and orbit.model.symmetry is not None:
        n = len(orbit.system.word)
        image = orbit.model.symmetry.surfaces
        stops += [(segment + n, image[surface]) for segment, surface in stops]
    return stops


def _up_to_mirror(
    orbit: Orbit, word: tuple[tuple[str, str], ...]
) -> frozenset[tuple[tuple[str, str], ...]]:
    from contfric.signature import canonical_word

    words = {canonical_word(word, orbit.model)}
    if orbit.model.symmetry is not None:
        words.add(canonical_word(mirror_pairs(orbit.model, word), orbit.model))
    return frozenset(words)


def _swapped(orbit: Orbit, events: dict[int, str]) -> Orbit:
    """Return the same cycle with sticks of length zero put in or taken out."""
    model, word = orbit.model, orbit.system.word
    count = len(word)
    pairs: list[tuple[str, str]] = []
    joints: list[FloatArray] = []
    sliding = {m.name for m in model.modes if m.sliding}
    stick = next(iter(sliding))
    dropped = {(i + 1) % count for i in events if word[(i + 1) % count][0] in sliding}
    for i, pair in enumerate(word):
        if i in dropped:
            continue
        joints.append(orbit.joints[i])
        pairs.append(pair)
        if i in events and (i + 1) % count not in dropped:
            joints.append(orbit.ends[i])
            pairs.append((stick, events[i]))
    new = np.array(joints)
    system = build_system(model, tuple(pairs), orbit.periods)
    swapped = Orbit(system, new, orbit.vector.copy(), np.inf, Status.CONVERGED)
    half = half_of(model, system.word, orbit.periods)
    if half is not None and swapped.symmetric:
        part = build_system(model, half, orbit.periods, half=True)
        return replace(swapped, system=part, joints=new[: len(half)])
    return swapped
