"""Candidates for what follows a sliding event: orbits of edited words, at the event itself.

Events come in groups: by symmetry two stops reach a boundary at once. Every combination of the outcomes
at the places of a group is a candidate, the symmetric ones and the mirror pairs. The edited word is a
closed walk of the transition graph, and the orbit at the event solves its equations: the segments that
come in have length zero, and those that are held have their pins.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from contfric.continuation.events import Bifurcation, Kind, kind_of_margin
from contfric.continuation.outcomes import Origin, Outcome, RestsForEver, outcome_at, places_of
from contfric.errors import NotationError
from contfric.models.definition import FloatArray
from contfric.orbit.clock import clocked
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

    Words that are mirror images of one already given are left out: their branches are mirrored. An
    orbit that has become several times one of fewer periods is followed as that: each of its copies
    could take its own outcome, and what leaves the shorter orbit is found there.
    """
    seen: set[frozenset[Word]] = set()
    copies = shorter_orbits(bifurcation.orbit.as_whole())
    if not copies:
        yield from _combinations(bifurcation, seen)
    for copy in copies:
        reason = f"the orbit has become one of {copy.periods} period(s), run through several times"
        if _is_new(copy, seen):
            yield Candidate(reason, copy)
        tests = nearly_vanishing(copy, bifurcation.kind)
        yield from _combinations(replace(bifurcation, orbit=copy, tests=tests), seen)


def wider_candidates(bifurcation: Bifurcation) -> Iterator[Candidate]:
    """Yield what can follow if margins that are nearly zero vanish at the event as well.

    Where several conditions fail together the equations are so nearly singular that the place is good
    to half of the digits only.
    """
    near = nearly_vanishing(bifurcation.orbit, bifurcation.kind)
    if set(bifurcation.tests) < set(near):
        yield from _combinations(replace(bifurcation, tests=near), set())


def nearly_vanishing(orbit: Orbit, kind: Kind) -> tuple[Test, ...]:
    """Return the margins that vanish at an event of a kind, if it is located to half of the digits."""
    return tuple(
        test
        for test, value in zip(orbit.system.tests, orbit.margins, strict=True)
        if abs(value) < _NEARLY and kind_of_margin(orbit.system, test, orbit) is kind
    )


def _combinations(bifurcation: Bifurcation, seen: set[frozenset[Word]]) -> Iterator[Candidate]:
    """Yield the orbits of every combination of the outcomes at the places of a group."""
    orbit = bifurcation.orbit.as_whole()
    found: list[Outcome] = []
    for place in places_of(bifurcation):
        try:
            found.append(outcome_at(orbit, place, bifurcation.kind))
        except NotationError as error:
            rest = isinstance(error, RestsForEver)
            yield Candidate(f"change at segment {place.segment + 1}", None, str(error), rest=rest)
    sizes = list(range(len(found), 0, -1))
    if len(found) > _MOST_PLACES:
        sizes = [len(found), 1]
        why = f"{len(found)} places at once: only all of them and each alone are tried"
        yield Candidate("other combinations of places", None, why)
    for size in sizes:
        for chosen in combinations(found, size):
            reason = "; ".join(outcome.reason for outcome in chosen)
            try:
                edited, away = edited_orbit(orbit, list(chosen))
            except NotationError as error:
                yield Candidate(reason, None, str(error))
                continue
            if _is_new(edited, seen):
                yield Candidate(reason, edited, away=away)


def _is_new(orbit: Orbit, seen: set[frozenset[Word]]) -> bool:
    key = _up_to_mirror(orbit)
    new = key not in seen
    seen.add(key)
    return new


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
    cycle = clocked(orbit.model, cycle, float(cycle[0, 0]) + orbit.period)
    moves = away if speeds else None
    try:
        system = build_system(orbit.model, word, orbit.periods)
    except ValueError as error:
        raise NotationError(str(error)) from None
    edited = Orbit(system, cycle, orbit.vector.copy(), np.inf, Status.CONVERGED)
    part = _on_half(edited, word)
    return part, moves if moves is None else moves[: part.system.segments]


def shorter_orbits(orbit: Orbit) -> list[Orbit]:
    """Return the copies of an orbit of fewer periods that a motion runs through; none in general.

    The copies are the same motion, but may have different words: one with a hold where another has a
    stick. They are recognised by their slides, as a rest of length zero may be in one and not in another.
    """
    slides = _slides(orbit)
    for turns in range(orbit.periods, 1, -1):
        count, rest = divmod(len(slides), turns)
        if rest or orbit.periods % turns or not _repeats(orbit, slides, count, turns):
            continue
        cuts = [slides[k * count] for k in range(turns)]
        return [_copy(orbit, a, b, turns) for a, b in zip(cuts, [*cuts[1:], cuts[0]], strict=True)]
    return []


def _slides(orbit: Orbit) -> list[int]:
    """Return the segments that are slides of some length, joined over a touch of rest."""
    sliding = {mode.name for mode in orbit.model.modes if mode.sliding}
    return [
        i
        for i, (mode, _) in enumerate(orbit.word)
        if mode not in sliding and orbit.ends[i, 0] - orbit.cycle[i, 0] > _SAME_MOTION
    ]


def _repeats(orbit: Orbit, slides: list[int], count: int, turns: int) -> bool:
    """Tell whether the slides repeat themselves after a part of the period."""
    starts = orbit.cycle[slides]
    ahead = np.roll(starts, -count, axis=0)
    ahead[len(starts) - count :, 0] += orbit.period
    ahead[:, 0] -= orbit.period / turns
    return bool(np.max(np.abs(ahead - starts)) < _SAME_MOTION)


def _copy(orbit: Orbit, first: int, after: int, turns: int) -> Orbit:
    """Return the part of a cycle from one slide to its image as an orbit."""
    count = len(orbit.word)
    places = range(first, after if after > first else after + count)
    word = tuple(orbit.word[i % count] for i in places)
    cycle = np.array([orbit.cycle[i % count] for i in places])
    cycle = clocked(orbit.model, cycle, float(cycle[0, 0]) + orbit.period / turns)
    system = build_system(orbit.model, word, orbit.periods // turns)
    copy = Orbit(system, cycle, orbit.vector.copy(), np.inf, Status.CONVERGED)
    return _on_half(copy, word)


def _on_half(orbit: Orbit, word: Word) -> Orbit:
    half = half_of(orbit.model, word, orbit.periods)
    if half is None or orbit.mirror_distance > _SAME_MOTION:
        return orbit
    part = build_system(orbit.model, half, orbit.periods, half=True)
    joints = clocked(orbit.model, orbit.joints[: len(half)], float(orbit.joints[len(half), 0]))
    return replace(orbit, system=part, joints=joints)


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
    with suppress(np.linalg.LinAlgError):
        yield tangent_of(orbit.system, orbit.joints, orbit.vector, active)
    yield None, 1.0
