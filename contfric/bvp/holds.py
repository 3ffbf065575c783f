"""Holds in the boundary-value problem: the condition at the start of a hold, and how it is left.

A hold has no exit condition; in its place stands its pin, a condition at its start:

* on a surface (SS): ``observable(z_i) = level``;
* after a touch (GS, AS): the exit of the segment before it is tangential, the rate of its observable
  along that segment vanishes at ``z_i``.

It is left at ``z_{i+1}`` along the departing mode, with an acceleration that must not be negative.
"""

from __future__ import annotations

from dataclasses import dataclass

from contfric.models.definition import Model
from contfric.signature.holds import (
    departing_mode,
    ends_rest,
    is_hold,
    known_hold,
    left_surface,
    pinned_surface,
)

#: In the array of pins: a segment that is no hold, and a hold after a touch; else the surface.
NO_PIN, TOUCH_PIN = -1, -2

Itinerary = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Hold:
    """One hold of an itinerary.

    Attributes
    ----------
    segment : its index
    pin : surface that it starts on; None after a touch
    after_rest : whether it follows a stick (AS)
    departs : mode in which it is left
    leaves : surface that it is left from
    """

    segment: int
    pin: str | None
    after_rest: bool
    departs: str
    leaves: str


def holds_of(model: Model, itinerary: Itinerary) -> tuple[Hold, ...]:
    """Return the holds of one turn.

    Raises
    ------
    ValueError
        If a hold comes first (the pin is a condition on the segment before it), follows another
        hold, or the model has no such hold.
    """
    found = []
    for index, (mode, exit_) in enumerate(itinerary):
        if not is_hold(exit_):
            continue
        before = itinerary[index - 1]
        if index == 0 or is_hold(before[1]) or not known_hold(exit_, model):
            raise ValueError(f"'{exit_}' cannot stand at place {index + 1} of {itinerary}")
        departs = departing_mode(model, before, (mode, exit_))
        found.append(
            Hold(
                index,
                pinned_surface(exit_),
                ends_rest(model, *before),
                departs,
                left_surface(model, mode, departs),
            )
        )
    return tuple(found)
