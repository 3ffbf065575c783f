"""Candidates for what follows a sliding event: orbits of other itineraries, at the event itself.

The motion at the event solves the equations of several itineraries
(:mod:`contfric.events.incident.incident`), over one period or several
(:mod:`contfric.events.incident.sequences`). Each is a candidate, unless the local conditions exclude it
(:mod:`contfric.events.incident.conditions`). The segments that come in have length zero, and those that are
held have their pins.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.linear import tangent_of
from contfric.bvp.system import Itinerary, build_system
from contfric.errors import NotationError
from contfric.events.bifurcation import Bifurcation
from contfric.events.incident.conditions import Relation, possible, relation_of
from contfric.events.incident.incident import Incident, edited_whole, incident_forms
from contfric.events.incident.sequences import MOST_SEQUENCES, count, lengths, necklaces
from contfric.events.incident.unit import Form, Unit
from contfric.events.outcomes.outcomes import Successor
from contfric.orbit.canonical.sections import canonical, is_smooth, joints_left
from contfric.orbit.canonical.slides import SAME_SOLUTION
from contfric.orbit.clock import clocked
from contfric.orbit.itinerary.itineraries import half_of
from contfric.orbit.orbit import Orbit


@dataclass(frozen=True, eq=False)
class Candidate:
    """A proposal of what follows an event.

    Attributes
    ----------
    reason : what would happen there, in words
    orbit : the orbit at the event, of the new itinerary; None if there is no such itinerary
    refusal : why there is no orbit
    away : how its joints move where it is singular at the event and has to start near it; else None
    rest : whether that is because nothing moves any more
    itineraries : of the units that it consists of
    share : how the parameter moves with the joints, where that is known
    """

    reason: str
    orbit: Orbit | None
    refusal: str = ""
    away: FloatArray | None = None
    rest: bool = False
    itineraries: frozenset[Itinerary] = frozenset()
    share: float = 0.0

    @property
    def has_hold(self) -> bool:
        """Whether it lies on a bridge."""
        return self.orbit is not None and bool(self.orbit.system.holds)


def candidates(bifurcation: Bifurcation) -> Iterator[Candidate]:
    """Yield what can follow a sliding event over the shortest period of its motion."""
    return sequences_of(incident_forms(bifurcation))


def sequences_of(
    incident: Incident, active: int | None = None, most_periods: int = 1, held: bool = True
) -> Iterator[Candidate]:
    """Yield what can follow a sliding event, short orbits first.

    Every cyclic sequence of the forms of the motion's unit, up to rotation and symmetry, of at most
    ``most_periods`` periods.

    Parameters
    ----------
    active : index of the parameter that varies; without it local conditions are not asked
    most_periods : longest orbit; the shortest period of the solution at least
    held : whether orbits with holds are candidates; those that are not are said to be refused
    """
    for refusal in incident.refusals:
        yield Candidate(refusal.reason, None, refusal.why, rest=refusal.rest)
    unit, forms = incident.unit, incident.forms
    if not held and any(form.has_hold for form in forms):
        yield Candidate("orbits with holds", None, "bridges are switched off")
        forms = tuple(form for form in forms if not form.has_hold)
    if not forms:
        return
    longest = lengths(unit.periods, unit.half, most_periods)
    # one location has two outcomes over a period, and what arrives is one of them
    several = longest[-1] > 1 or len(forms) > _ONE_LOCATION
    relations = _relations(incident, forms, active) if several else None
    for length in longest:
        if count(len(forms), length) > MOST_SEQUENCES:
            why = f"{count(len(forms), length)} sequences: more than {MOST_SEQUENCES} are not tried"
            yield Candidate(f"orbits of {length} units", None, why)
            continue
        chosen = list(necklaces(len(forms), length))
        sides = [(True, True)] * len(chosen)
        if relations is not None:
            sides = possible(relations, chosen)
        for sequence, (below, above) in zip(chosen, sides, strict=True):
            reason = _reason(unit, forms, sequence)
            if below or above:
                yield _candidate(unit, tuple(forms[k] for k in sequence), reason)
            else:
                yield Candidate(reason, None, _LOCAL)


#: Forms of a unit with one location. With k of them there are 2^k and more, of which few are possible.
_ONE_LOCATION = 2
#: Why a sequence is refused that the local conditions exclude.
_LOCAL = "to first order it violates a condition on both sides of the event"


def _relations(
    incident: Incident, forms: tuple[Form, ...], active: int | None
) -> list[Relation] | None:
    """Return the linear relations of the forms; None if one is not clear."""
    model = incident.unit.model
    if active is None or incident.wide or model.composed:
        return None  # composed: the first sequence is right, and its relation the dearest part
    found = []
    for form in forms:
        relation = relation_of(form, active, incident.least)
        if relation is None:
            return None
        found.append(relation)
    return found


def _candidate(unit: Unit, forms: tuple[Form, ...], reason: str) -> Candidate:
    try:
        (form, *others) = forms
        orbit, away = unit.orbit(forms) if others else (form.orbit, form.away)
    except NotationError as error:
        return Candidate(reason, None, str(error))
    itineraries = frozenset(form.itinerary for form in forms)
    orbit, away = _without_sections(orbit, away)
    if not np.any(away):
        return Candidate(reason, orbit, itineraries=itineraries)
    return Candidate(reason, orbit, away=along_motion(orbit, away), itineraries=itineraries)


def _without_sections(orbit: Orbit, away: FloatArray) -> tuple[Orbit, FloatArray]:
    """Return an orbit, and how its joints move in time, without joints on sections among others."""
    plain = canonical(orbit)
    if plain is orbit:
        return orbit, away
    whole = orbit.as_whole()
    if is_smooth(orbit.model, whole.system.itinerary):
        return plain, np.zeros(len(plain.joints))  # nothing comes in
    if orbit.system.half:
        plain, away = plain.as_half(), np.concatenate((away, away))
    left = joints_left(orbit.model, whole.system.itinerary)
    return plain, away[left][: len(plain.joints)]


def _reason(unit: Unit, forms: tuple[Form, ...], sequence: tuple[int, ...]) -> str:
    """Return what happens in the units of a sequence, in words."""
    parts = []
    for k, index in enumerate(sequence):
        if forms[index].reason:
            part = "half" if unit.half else "turn"
            where = f"{part} {k + 1}: " if len(sequence) > 1 else ""
            parts.append(f"{where}{forms[index].reason}")
    text = "; ".join(parts) or "the outcome of the branch that arrives"
    turns = len(sequence) // 2 if unit.half and len(sequence) % 2 == 0 else len(sequence)
    return text if turns == 1 else f"over {turns} of its periods: {text}"


def edited_orbit(orbit: Orbit, outcomes: list[Successor]) -> tuple[Orbit, FloatArray | None]:
    """Return the same solution as an orbit of the edited itinerary, on its half if it is symmetric.

    And how its joints move away from the event, shape (N, 1 + n), where it is singular there.

    Raises
    ------
    NotationError
        If the transition graph has no such path.
    """
    edited, moves = edited_whole(orbit, outcomes)
    half = half_of(edited.model, edited.itinerary, edited.periods)
    if half is not None and edited.mirror_distance <= SAME_SOLUTION:
        part = build_system(edited.model, half, edited.periods, half=True)
        end = float(edited.joints[len(half), 0])
        joints = clocked(edited.model, edited.joints[: len(half)], end)
        edited, moves = replace(edited, system=part, joints=joints), moves[: len(half)]
    if not np.any(moves):
        return edited, None
    return edited, along_motion(edited, moves)


def along_motion(orbit: Orbit, away: FloatArray) -> FloatArray:
    """Return how joints move, states with times: where one part rests others go on, and a belt with it.

    What comes in has no length, and begins with the rate of the solution.
    """
    n = orbit.joints.shape[1] - 1
    moves = np.zeros(orbit.joints.shape)
    for k in np.flatnonzero(away):
        time, state = float(orbit.joints[k, 0]), orbit.joints[k, 1:]
        rate = orbit.flow.jacobian(orbit.system.itinerary[k][0], time, state, 0.0)[:, 1 + n]
        moves[k] = away[k] * np.concatenate([[1.0], rate])
    return moves


def directions(orbit: Orbit, active: int) -> Iterator[tuple[FloatArray | None, float]]:
    """Yield tangents that a first point may be solved normal to, best first.

    The direction of the curve itself; where rounding leaves more than one, the parameter is fixed.
    """
    with suppress(np.linalg.LinAlgError):
        yield tangent_of(orbit.system, orbit.joints, orbit.vector, active)
    yield None, 1.0
