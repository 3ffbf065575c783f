"""Conditions that every orbit of an itinerary obeys, decided without a simulation; what became of it.

* **Displacement.** On one side of the stop surface the displacement grows, on the other it falls, at
  rest it stays. Over a period it returns; so an itinerary whose segments all lie on one side (or on none)
  has no orbit.
* **Turns.** A sliding mode is left where the observable of its exit grows through the level. On a
  section of dimension one that is a set of phases, the **arcs** of the exit. An orbit meets the arcs of
  its exits one after the other, so that it needs at least the number of periods that going from
  each to the next takes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from contfric.errors import number_and
from contfric.models.definition import Model
from contfric.models.mode_domains import inside_sign
from contfric.signature import ReducedItinerary
from contfric.signature.reduced import ReducedPair
from contfric.signature.walks import show

#: Phases (in periods; the first from 0 to 1) at which an exit can be met: open arcs (first, last).
Arcs = tuple[tuple[float, float], ...]
#: Arcs are open: at their ends the exit is met with a rate of zero. An orbit nearer to that (in
#: periods) is no orbit to working precision.
_INSIDE = 1e-9


class Fate(str, Enum):
    """What became of an itinerary; the text says what it means."""

    ONE_WAY = "excluded: the displacement never returns"
    TURNS = "excluded: its exits cannot be met in so few periods"
    NOT_WALKED = "followed by no start (heuristic: the grid may be too coarse)"
    NOT_CLOSED = "followed, but no orbit of this many periods"
    FOUND = "followed by an orbit"


@dataclass(frozen=True)
class ClosedItinerary:
    """A closed itinerary (up to rotation and mirror image) over a number of periods, and its fate."""

    itinerary: ReducedItinerary
    periods: int
    fate: Fate
    orbits: int = 0

    def __str__(self) -> str:
        return (
            f"{show(self.itinerary)} over {number_and(self.periods, 'period')}: {self.fate.value}"
        )


def returns(model: Model, itinerary: ReducedItinerary) -> bool:
    """Return whether the displacement can return: the itinerary moves both ways, or either.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> returns(load_model("coulomb"), (("slide+", "v"), ("stick", "F-")))
    False
    """
    surface = model.stop_surface
    if not surface:
        return True
    moving = {mode for mode, _ in itinerary if not model.mode_by_name[mode].sliding}
    sides = {inside_sign(model, mode, surface) for mode in moving}
    return 0 in sides or {1, -1} <= sides


def least_periods(itinerary: ReducedItinerary, arcs: Mapping[ReducedPair, Arcs]) -> float:
    """Return the fewest periods in which an itinerary's exits can be met; inf if one cannot be met.

    The phases ``phi_1 <= phi_2 <= .. <= phi_k <= phi_1 + p`` must lie on the arcs of the exits in turn.
    From phi_1 on, each is taken as early as possible: then phi_k is a non-decreasing function of
    phi_1, constant or of slope 1, that jumps where a phase reaches the end of its arc. So
    ``phi_k - phi_1`` is least at the end of an arc.

    Examples
    --------
    >>> arcs = {("stick", "F+"): ((0.0, 0.5),), ("stick", "F-"): ((0.5, 1.0),)}
    >>> least_periods((("stick", "F+"), ("stick", "F-")) * 2, arcs)
    2.0
    """
    chain = [arcs[pair] for pair in itinerary if pair in arcs]
    if not chain:
        return 1.0
    if not all(chain):
        return math.inf
    lasts = {(last - _INSIDE) % 1.0 for arc in chain for _, last in arc}
    least = math.inf
    for start in (phi for phi in lasts if _next_on(chain[0], phi) == phi):
        phase = start
        for arc in chain[1:]:
            phase = _next_on(arc, phase)
        least = min(least, math.ceil(phase - start))
    return max(1.0, float(least))


def _next_on(arc: Arcs, phase: float) -> float:
    """Return the first phase inside of an arc that is not before a phase."""
    whole = math.floor(phase)
    best = math.inf
    for first, last in arc:
        for turn in (whole - 1, whole, whole + 1):
            # half as far inside: a phase that was put to the end of this arc is on it
            if phase <= last + turn - 0.5 * _INSIDE:
                best = min(best, max(phase, first + turn + _INSIDE))
    return best


def fates_before(
    model: Model,
    itineraries: Sequence[ReducedItinerary],
    periods: int,
    arcs: Mapping[ReducedPair, Arcs],
) -> dict[tuple[ReducedItinerary, int], Fate | None]:
    """Return the fate of each (itinerary, periods) that a necessary condition rules out, else None."""
    fates: dict[tuple[ReducedItinerary, int], Fate | None] = {}
    for itinerary in itineraries:
        back, least = returns(model, itinerary), least_periods(itinerary, arcs)
        for turns in range(1, periods + 1):
            fate = None if turns >= least else Fate.TURNS
            fates[itinerary, turns] = fate if back else Fate.ONE_WAY
    return fates
