"""Candidates for what follows a sliding event: orbits of edited words, at the event itself.

Events come in groups: by symmetry two stops reach a boundary at once. Every combination of the outcomes
at the places of a group is a candidate, the symmetric ones and the mirror pairs. The edited word is a
closed walk of the transition graph, and the orbit at the event solves its equations: the segments that
come in have length zero, and those that are held have their pins.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from contfric.continuation.events import Bifurcation, kind_of_margin
from contfric.continuation.outcomes import Origin, Outcome, RestsForEver, outcome_at, places_of
from contfric.errors import NotationError
from contfric.models.definition import FloatArray
from contfric.orbit.holds import with_holds_behind
from contfric.orbit.linear import tangent_of
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.system import Test, Word, build_system
from contfric.orbit.words import half_of, mirror_pairs
from contfric.signature import canonical_word
from contfric.signature.edits import Edit, apply_edit, edited_pieces

#: Margins this small (nondimensional) may vanish with an event of a nearly singular system: the root of
#: rounding.
_NEARLY = 1e-6
#: Most places of such a group: the combinations double with each.
_MOST_PLACES = 6
#: Parts of a cycle that agree to this (nondimensional) are the same motion: the root of rounding again.
_SAME_MOTION = 1e-5


@dataclass(frozen=True, eq=False)
class Candidate:
    """A proposal of what follows an event.

    Attributes
    ----------
    reason : what would happen there, in words
    orbit : the orbit at the event, of the new word; None if there is no such word
    refusal : why there is none
    away : how its joints move where it is singular at the event and has to start beside it; else None
    rest : whether there is none because nothing moves any more
    """

    reason: str
    orbit: Orbit | None
    refusal: str = ""
    away: FloatArray | None = None
    rest: bool = False

    @property
    def has_hold(self) -> bool:
        """Whether it lies on a bridge."""
        return self.orbit is not None and bool(self.orbit.system.holds)


def candidates(bifurcation: Bifurcation) -> Iterator[Candidate]:
    """Yield what can follow a sliding event, all places of a group first.

    Words that are mirror images of one already given are left out: their branches are mirrored.
    """
    yield from _candidates(bifurcation, set())


def wider_candidates(bifurcation: Bifurcation) -> Iterator[Candidate]:
    """Yield what can follow if margins that are nearly zero vanish at the event as well.

    Where an orbit of several periods comes to one of fewer, all its copies meet the event at once, and
    the equations are so nearly singular that the place is good to half of the digits only.
    """
    orbit = bifurcation.orbit
    near = tuple(
        test
        for test, value in zip(orbit.system.tests, orbit.margins, strict=True)
        if abs(value) < _NEARLY and kind_of_margin(orbit.system, test, orbit) is bifurcation.kind
    )
    known = set(bifurcation.tests)
    if known < set(near) and len(near) <= _MOST_PLACES:
        yield from _candidates(replace(bifurcation, tests=near), set())


def _candidates(bifurcation: Bifurcation, seen: set[frozenset[Word]]) -> Iterator[Candidate]:
    orbit = bifurcation.orbit.as_whole()
    found: list[tuple[Test, Outcome]] = []
    for place in places_of(bifurcation):
        try:
            found.append((place, outcome_at(orbit, place, bifurcation.kind)))
        except NotationError as error:
            rest = isinstance(error, RestsForEver)
            yield Candidate(f"change at segment {place.segment + 1}", None, str(error), rest=rest)
    for size in range(len(found), 0, -1):
        for chosen in combinations(found, size):
            reason = "; ".join(outcome.reason for _, outcome in chosen)
            try:
                edited, away = edited_orbit(orbit, [outcome for _, outcome in chosen])
            except NotationError as error:
                yield Candidate(reason, None, str(error))
                continue
            key = _up_to_mirror(edited)
            if key not in seen:
                seen.add(key)
                yield Candidate(reason, edited, away=away)


def _up_to_mirror(orbit: Orbit) -> frozenset[Word]:
    words = {canonical_word(orbit.word, orbit.model)}
    if orbit.model.symmetry is not None:
        words.add(canonical_word(mirror_pairs(orbit.model, orbit.word), orbit.model))
    return frozenset(words)


def edited_orbit(orbit: Orbit, outcomes: list[Outcome]) -> tuple[Orbit, FloatArray | None]:
    """Return the same motion as an orbit of the edited word, on its half if it is symmetric.

    And how its joints move away from the event, shape (N, 1 + n), where it is singular there.

    Raises
    ------
    NotationError
        If the transition graph has no such walk.
    """
    edit = Edit()
    joints: dict[Origin, FloatArray] = {}
    speeds: dict[Origin, float] = {}
    for outcome in outcomes:
        edit |= outcome.edit
        joints.update(outcome.joints)
        speeds.update(outcome.away)
    word = apply_edit(orbit.word, edit, orbit.model)
    origins = [origin for origin, _ in edited_pieces(orbit.word, edit)]
    starts = [joints[o] if o in joints else orbit.cycle[o[0]] for o in origins]
    away = np.zeros((len(word), starts[0].shape[0]))
    away[:, 0] = [speeds.get(origin, 0.0) for origin in origins]
    _, away = _rotated(word, away, 0.0)
    word, cycle = _rotated(word, np.array(starts), orbit.period)
    turns = _turns(word, cycle, orbit)
    count = len(word) // turns
    word, cycle, away = word[:count], cycle[:count], away[:count]
    moves = away if speeds else None
    try:
        system = build_system(orbit.model, word, orbit.periods // turns)
    except ValueError as error:
        raise NotationError(str(error)) from None
    edited = Orbit(system, cycle, orbit.vector.copy(), np.inf, Status.CONVERGED)
    half = half_of(orbit.model, word, system.periods)
    if half is not None and edited.symmetric:
        part = build_system(orbit.model, half, system.periods, half=True)
        return replace(edited, system=part, joints=cycle[: len(half)]), (
            None if moves is None else moves[: len(half)]
        )
    return edited, moves


def _turns(word: Word, cycle: FloatArray, orbit: Orbit) -> int:
    """Return how often a cycle runs through an orbit of fewer periods: once, in general."""
    for turns in range(min(orbit.periods, len(word)), 1, -1):
        part, rest = divmod(len(word), turns)
        if rest or orbit.periods % turns or word != word[:part] * turns:
            continue
        shift = np.zeros_like(cycle)
        shift[:, 0] = np.repeat(np.arange(turns), part) * (orbit.period / turns)
        if np.max(np.abs(cycle - shift - np.tile(cycle[:part], (turns, 1)))) < _SAME_MOTION:
            return turns
    return 1


def _rotated(word: Word, joints: FloatArray, period: float) -> tuple[Word, FloatArray]:
    """Return a cycle that starts with no hold."""
    k = with_holds_behind(word)
    joints = np.concatenate([joints[k:], joints[:k]])
    joints[len(joints) - k :, 0] += period
    return word[k:] + word[:k], joints


def directions(orbit: Orbit, active: int) -> Iterator[tuple[FloatArray | None, float]]:
    """Yield tangents that a first point may be solved normal to, best first.

    The direction of the curve itself; where rounding leaves more than one, the parameter is fixed.
    """
    yield tangent_of(orbit.system, orbit.joints, orbit.vector, active)
    yield None, 1.0
