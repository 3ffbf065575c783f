"""All itineraries that the solution at an event solves: its regular outcomes, and those that are held.

At an event one motion solves the equations of several itineraries. The itineraries differ at **locations** of
the motion only: a stop on the limit, a touch inside of a stick, a stop without acceleration, a touch of rest
inside of a slide. At each location there are few local outcomes (:mod:`contfric.events.outcomes.outcomes`).
Which itineraries there are is a property of the motion, not of the branch that came to it. So they are
collected as a closure:

1. The motion is cut down to its shortest period, and to half of it if it is its own symmetry image. That is
   its **unit**. It is cut at the start of a slide of some length, which every itinerary has.
2. The itinerary of the branch that arrives, cut into units, gives the first **forms** of the unit.
3. Every margin that vanishes on an orbit of one form gives an outcome; the form with that outcome is a form,
   too. This is repeated until nothing new appears.

An orbit at the event is a cyclic sequence of forms (:mod:`contfric.events.incident.sequences`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.attributes import altered
from contfric.bvp.system import EventFunction, Itinerary, Margin, build_system
from contfric.errors import NotationError
from contfric.events.bifurcation import ACCURACY, Bifurcation, Kind
from contfric.events.incident.unit import Form, Unit, form_of, pieces, unit_of
from contfric.events.locations import TANGENTIAL, locations_of, normal_location, rests_at
from contfric.events.outcomes.outcomes import (
    NO_LENGTH_AT_TOUCH,
    RestsForEver,
    Successor,
    outcome_at,
)
from contfric.events.sliding_kinds import kind_of_margin
from contfric.orbit.canonical.section_joints import divided
from contfric.orbit.canonical.sections import named_by_ends
from contfric.orbit.canonical.slides import SAME_SOLUTION, SHORT, resting_modes, time_unit
from contfric.orbit.clock import clocked
from contfric.orbit.measured.samples import state_within
from contfric.orbit.orbit import Orbit, Status
from contfric.signature.edits import checked_itinerary, edited_pieces

#: Margins below this vanish at an event: it is located to about 1e-13.
_VANISHES = 1e-9
#: The same at an event that is located to half of the digits only.
_NEARLY = 1e-6
#: The most that an event may be missed by: beyond it is not nearly reached.
_FAR = 1e-5
#: Accuracy of an event that is known to the root of rounding, with some of its conditioning: what vanishes
#: there is not known to first order.
_TO_ITS_ROOT = 1e-7
#: Most forms of a unit: six locations with two outcomes each.
_MOST_FORMS = 64
#: Where in a segment it is asked how far something has moved, as shares of it. One is irrational (the golden
#: section's), as a segment may last whole periods of what it is a part of.
_SHARES = (0.236067977499790, 0.5, 1.0)


@dataclass(frozen=True)
class Refusal:
    """An outcome that is rejected, and why; whether because nothing moves any more."""

    reason: str
    why: str
    rest: bool = False


@dataclass(frozen=True)
class Name:
    """The kind of event that a step from some itineraries of the unit to others is."""

    kind: Kind
    before: frozenset[Itinerary]
    after: frozenset[Itinerary]


def kinds_between(names: Sequence[Name], followed: Set[Itinerary]) -> set[Kind]:
    """Return the kinds of the steps that lead from one followed itinerary to another by the fewest steps.

    Where several holds change at once, the itineraries with some of them changed need not be orbits.
    """
    steps: dict[Itinerary, list[tuple[Itinerary, Kind]]] = {}
    for name in names:
        for before, after in product(name.before, name.after):
            steps.setdefault(before, []).append((after, name.kind))
    kinds: set[Kind] = set()
    for start in followed:
        here, seen = {start: frozenset[Kind]()}, {start}
        while here:
            ahead: dict[Itinerary, frozenset[Kind]] = {}
            for itinerary, met in here.items():
                for after, kind in steps.get(itinerary, ()):
                    if after not in seen:
                        ahead[after] = ahead.get(after, frozenset()) | met | {kind}
            seen |= ahead.keys()
            here = ahead
            kinds.update(*(ahead[itinerary] for itinerary in ahead.keys() & followed))
    return kinds


@dataclass(frozen=True, eq=False)
class Incident:
    """The unit of the solution at an event, its forms, and the outcomes that are rejected.

    ``names`` say what the step from one form to another is called; margins below ``least`` count as zero.
    An event that is known roughly is ``wide``: what vanishes there is not known to first order.
    """

    unit: Unit
    forms: tuple[Form, ...]
    refusals: tuple[Refusal, ...]
    names: tuple[Name, ...]
    least: float
    wide: bool = False


def incident_forms(
    bifurcation: Bifurcation, wide: bool = False, others: Iterable[Bifurcation] = ()
) -> Incident:
    """Return all forms of the solution at a sliding event.

    Parameters
    ----------
    wide : bool
        Whether margins that nearly vanish count: where the location is known to half of the digits.
    others : iterable of Bifurcation
        The event as other branches have it: an outcome may lead from their forms to this one and not back.
    """
    orbit = bifurcation.orbit.as_whole()
    least = _NEARLY if wide or bifurcation.accuracy > ACCURACY else _VANISHES
    least = max(least, _missed(bifurcation)) if least == _NEARLY else least
    locations = locations_of(bifurcation)
    rests = rests_at(orbit, locations)
    unit = unit_of(orbit, rests)
    if not _moves(orbit):
        return Incident(
            unit, (), (Refusal("what moves", "nothing moves any more", True),), (), least
        )
    cut = divided(orbit, orbit.periods // bifurcation.outline.periods)
    collection, arrives = _started(cut or orbit, unit_of(cut, rests) if cut else unit, least)
    unit = collection.unit
    if cut is None:
        kinds = [(location, bifurcation.kind) for location in locations]
        collection.edit(orbit, arrives, np.zeros(len(orbit.itinerary)), "", kinds)
    for other in others:
        arrived = altered(other.orbit.as_whole(), vector=orbit.vector)
        with suppress(NotationError):  # its image in a symmetry is cut elsewhere
            collection.take(arrived, np.zeros(len(arrived.itinerary)), "")
    collection.close()
    return Incident(
        unit,
        tuple(collection.forms),
        tuple(collection.refusals),
        tuple(collection.names),
        least,
        wide or bifurcation.accuracy > _TO_ITS_ROOT,
    )


def _missed(bifurcation: Bifurcation) -> float:
    """Return by how much an event that is nearly reached is missed: twice its largest margin.

    What vanishes with these on another form has lengths as long as theirs.
    """
    orbit = bifurcation.orbit
    margins = dict(zip(orbit.system.tests, orbit.margins.tolist(), strict=True))
    left = [abs(margins[test]) for test in bifurcation.tests if test in margins]
    return min(_FAR, 2.0 * max(left, default=0.0))


def _moves(orbit: Orbit) -> bool:
    """Tell whether a solution has a slide of some length: in less the mass moves by the cube of it.

    Where one mass rests others are free to move, and may rest as well.
    """
    resting = resting_modes(orbit)
    lasts = orbit.durations
    for (mode, _), begin, last in zip(orbit.itinerary, orbit.begins, lasts, strict=True):
        if mode not in resting and last > SHORT * time_unit(orbit):
            start = float(begin[0]), begin[1:]
            moved = [orbit.flow.state(mode, *start, float(last * share)) for share in _SHARES]
            if np.abs(np.array(moved) - begin[1:]).max() > SAME_SOLUTION:
                return True
    return False


def _started(orbit: Orbit, unit: Unit, least: float) -> tuple[_Collection, frozenset[Itinerary]]:
    """Return a collection with the forms of the branch that arrives, and their itineraries.

    Where its solution repeats itself to rounding only, the whole orbit is the unit.
    """
    collection = _Collection(unit, least)
    try:
        return collection, collection.take(orbit, np.zeros(len(orbit.itinerary)), "")
    except NotationError:
        collection = _Collection(
            altered(unit, periods=orbit.periods, half=False, duration=orbit.period), least
        )
        return collection, collection.take(orbit, np.zeros(len(orbit.itinerary)), "")


class _Collection:
    """Forms while they are collected."""

    def __init__(self, unit: Unit, least: float) -> None:
        self.unit = unit
        self.least = least
        self.forms: list[Form] = []
        self.refusals: list[Refusal] = []
        self.names: list[Name] = []
        self._waiting: deque[Form] = deque()
        self._itineraries: set[Itinerary] = set()

    def take(self, orbit: Orbit, away: FloatArray, reason: str) -> frozenset[Itinerary]:
        """Take the units of an orbit as forms; return their itineraries."""
        taken = pieces(orbit, self.unit)
        for piece in taken:
            if piece.itinerary in self._itineraries:
                continue
            if len(self.forms) >= _MOST_FORMS:
                text = f"more than {_MOST_FORMS} itineraries at once: the others are not tried"
                self.refusals.append(Refusal("other outcomes", text))
                break
            form = form_of(orbit, away, self.unit, piece, reason)
            self._itineraries.add(form.itinerary)
            self.forms.append(form)
            self._waiting.append(form)
        return frozenset(piece.itinerary for piece in taken)

    def close(self) -> None:
        """Add what the outcomes at the locations of every form make of it."""
        while self._waiting:
            form = self._waiting.popleft()
            try:
                orbit = form.orbit.as_whole()
            except NotationError as error:
                self.refusals.append(Refusal(form.reason, str(error)))
                self.forms = [other for other in self.forms if other is not form]
                continue
            count = len(form.itinerary)
            locations = [p for p in vanishing(orbit, self.least) if p[0].segment < count]
            away = np.concatenate([form.away, form.away]) if self.unit.half else form.away
            self.edit(orbit, frozenset({form.itinerary}), away, form.reason, locations)

    def edit(
        self,
        orbit: Orbit,
        before: frozenset[Itinerary],
        away: FloatArray,
        reason: str,
        locations: list[tuple[EventFunction, Kind]],
    ) -> None:
        """Add the forms that follow from outcomes at locations of an orbit with the units ``before``."""
        for location, kind in locations:
            try:
                outcome = outcome_at(orbit, location, kind)
                edited, moves = edited_whole(orbit, [outcome], away)
                text = "; ".join(filter(None, (reason, outcome.reason)))
                after = self.take(edited, moves, text)
                self.names.append(Name(kind, before, after - before))
            except NotationError as error:
                rest = isinstance(error, RestsForEver)
                text = f"change at segment {location.segment + 1}"
                refusal = Refusal(text, str(error), rest)
                if refusal not in self.refusals:
                    self.refusals.append(refusal)


def vanishing(orbit: Orbit, least: float) -> list[tuple[EventFunction, Kind]]:
    """Return the locations of a whole orbit whose margins vanish, with the kind of each; no tangencies."""
    found: dict[EventFunction, Kind] = {}
    widest, sizes = max(least, TANGENTIAL), margin_sizes(orbit)
    for test, margin, size in zip(orbit.system.tests, orbit.margins.tolist(), sizes, strict=True):
        value = abs(margin) / size
        if not (value < widest and (value < least or not is_linear(test, orbit))):
            continue
        kind = kind_of_margin(orbit.system, test, orbit)
        if kind is not Kind.T:
            found.setdefault(normal_location(test, orbit), kind)
    for location in _vanished(orbit):
        found.setdefault(location, Kind.GS)
    return list(found.items())


def margin_sizes(orbit: Orbit) -> list[float]:
    """Return what each margin of an orbit is small against: of a height, the largest one over its surface.

    Heights have units, so that a height in metres may be a millionth of that in micrometres.
    """
    flow, surfaces = orbit.flow, orbit.model.surface_by_name
    places = [(float(end[0]), end[1:]) for end in orbit.ends]
    for i, lasts in enumerate(orbit.durations.tolist()):  # a velocity is zero at all joints
        later = _SHARES[0] * lasts
        places.append((float(orbit.begins[i, 0]) + later, state_within(orbit, i, later)))

    @cache
    def values(observable: str) -> FloatArray:
        return np.array([flow.observe(observable, t, y) for t, y in places])

    @cache
    def size(surface: str) -> float:
        heights = values(surfaces[surface].observable) - flow.level(surface)
        return float(np.max(np.abs(heights))) or 1.0

    heights = (Margin.JOINT, Margin.INTERIOR)
    return [size(t.surface) if t.margin in heights else 1.0 for t in orbit.system.tests]


def is_linear(test: EventFunction, orbit: Orbit) -> bool:
    """Tell whether a margin goes through zero at an event, and does not reach it with its root.

    The rate at an exit does where an orbit comes to the tangency; a hold may be left anywhere.
    """
    return test.margin is not Margin.EXIT or any(
        hold.segment == test.segment and hold.until is None for hold in orbit.system.holds
    )


def _vanished(orbit: Orbit) -> Iterator[EventFunction]:
    """Yield the holds at a touch of rest that are too short to be told from none.

    Their margins do not show it: they are of the order of the length, and its square is what is located.
    """
    lasts = orbit.durations
    for hold in orbit.system.holds:
        touches = hold.pin is None and not hold.after_rest and hold.until is None
        if touches and lasts[hold.segment] < NO_LENGTH_AT_TOUCH * time_unit(orbit):
            yield EventFunction(Margin.EXIT, hold.segment, hold.leaves)


def edited_whole(
    orbit: Orbit, outcomes: list[Successor], away: FloatArray | None = None
) -> tuple[Orbit, FloatArray]:
    """Return the same motion as an orbit of the edited itinerary, and how its joints move away, shape (N,).

    Parameters
    ----------
    away : how the joints of the orbit itself move

    Raises
    ------
    NotationError
        If the transition graph has no such path.
    """
    edit, joints, speeds = outcomes[0].edit, dict(outcomes[0].joints), dict(outcomes[0].away)
    for outcome in outcomes[1:]:
        edit |= outcome.edit
        joints |= outcome.joints
        speeds |= outcome.away
    pieces = edited_pieces(orbit.itinerary, edit)
    origins = [origin for origin, _ in pieces]
    itinerary = checked_itinerary(orbit.itinerary, pieces, orbit.model)
    itinerary = _crossing_as_before(orbit, itinerary, origins)
    starts = np.array([joints[o] if o in joints else orbit.cycle[o[0]] for o in origins])
    kept = np.zeros(len(orbit.itinerary)) if away is None else away
    moves = np.array([speeds.get(o, kept[o[0]] if o[1] < 0 else 0.0) for o in origins])
    first = next(k for k, (_, exit_) in enumerate(itinerary) if not exit_.startswith("hold@"))
    if first:
        itinerary, moves = itinerary[first:] + itinerary[:first], np.roll(moves, -first)
        starts = np.roll(starts, -first, axis=0)
        starts[-first:, 0] += orbit.period
    starts = clocked(orbit.model, starts, float(starts[0, 0]) + orbit.period)
    try:
        system = build_system(orbit.model, itinerary, orbit.periods)
    except ValueError as error:
        raise NotationError(str(error)) from None
    return altered(orbit, system=system, joints=starts, status=Status.CONVERGED), moves


def _crossing_as_before(
    orbit: Orbit, itinerary: Itinerary, origins: Sequence[tuple[int, int]]
) -> Itinerary:
    """Return an edited itinerary in which sections are crossed the way they were.

    A segment that takes over the exit of others takes over the part of the mode, too, that ended there.
    """
    model = orbit.model
    if not model.joined:
        return itinerary
    pairs = list(named_by_ends(itinerary, model))
    for k, (mode, exit_) in enumerate(pairs):
        following, put_in = origins[(k + 1) % len(origins)]
        ended = orbit.itinerary[following - 1]
        ends_there = put_in < 0 and ended in model.sections and ended[1] == exit_
        if ends_there and model.whole_mode(ended[0]) == model.whole_mode(mode):
            pairs[k] = ended
    return tuple(pairs)
