"""Holds in the boundary-value problem: the condition at the start of a hold, and how it is left.

A hold has no exit condition; in its place stands its pin, a condition at its start:

* on a surface (SS): ``observable(z_i) = level``;
* after a touch (GS, AS): the exit of the segment before it is tangential, the rate of its observable
  along that segment vanishes at ``z_i``.

A hold that goes on after another contact has changed its state is another hold, which begins where that
contact meets its surface: its pin is what would be the exit of the one before it (docs/bridges.md).

It is left at ``z_{i+1}`` along the departing mode, with an acceleration that must not be negative.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from contfric.models.definition import Model
from contfric.signature.holds import (
    departing_mode,
    departing_on,
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
    follows : whether it goes on with the one before it; its pin is then the surface of another contact
    until : that of the one that goes on with it; None if it is left at its end
    """

    segment: int
    pin: str | None
    after_rest: bool
    departs: str
    leaves: str
    follows: bool = False
    until: str | None = None


def holds_of(model: Model, itinerary: Itinerary) -> tuple[Hold, ...]:
    """Return the holds of one turn.

    Raises
    ------
    ValueError
        If a hold comes first (the pin is a condition on the segment before it), or the model has no such
        hold.
    """
    found: list[Hold] = []
    for index, (mode, exit_) in enumerate(itinerary):
        if not is_hold(exit_):
            continue
        before = itinerary[index - 1]
        follows = is_hold(before[1])
        if index == 0 or not known_hold(exit_, model, follows):
            raise ValueError(f"'{exit_}' cannot stand at place {index + 1} of {itinerary}")
        if follows:
            last = found[-1]
            departs, leaves = departing_on(model, last.departs, last.leaves, mode), last.leaves
            found[-1] = replace(last, until=pinned_surface(exit_))
        else:
            departs = departing_mode(model, before, (mode, exit_))
            leaves = left_surface(model, mode, departs)
        after_rest = not follows and ends_rest(model, *before)
        found.append(Hold(index, pinned_surface(exit_), after_rest, departs, leaves, follows))
    return tuple(found)
