"""The inequalities that an orbit obeys: their kinds, and those that vanish with the length of a segment."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from contfric.bvp.holds import Hold, Itinerary
from contfric.models.definition import Model


class Margin(str, Enum):
    """The kinds of inequality that an orbit obeys."""

    INTERIOR = "interior"
    EXIT = "exit"
    JOINT = "joint"
    ENTRY = "entry"
    LASTING = "lasting"
    HELD = "held"


@dataclass(frozen=True)
class EventFunction:
    """What one margin of a system means: its kind, segment and surface."""

    __test__ = False  # not a test case of pytest
    margin: Margin
    segment: int
    surface: str


def lasting_segments(itinerary: Itinerary, holds: tuple[Hold, ...]) -> list[tuple[int, str]]:
    """Segments that no other margin keeps from shrinking through zero, each with the surface that it ends on.

    A hold after a touch of its limit, and the stick up to that touch: where it shrinks to nothing, the
    margin of the stop before it has a double zero. And the slide from one hold to the touch at which the
    next begins: where it shrinks to nothing, the acceleration with which the first is left has one.
    Of a hold in several modes the last part: it is left where another contact has just changed its state.
    """
    found: list[tuple[int, str]] = []
    left = _slides(itinerary, holds)
    for hold in holds:
        before = (hold.segment - 1) % len(itinerary)
        if hold.follows:
            found += [(hold.segment, hold.leaves)] if hold.until is None else []
        elif hold.after_rest:
            found.append((before, itinerary[before][1]))
            if hold.until is None:  # else the other contact meets its surface at the touch
                found.append((hold.segment, hold.leaves))
        elif hold.pin is None and before in left:
            found.append((before, itinerary[before][1]))
    return found


def _slides(itinerary: Itinerary, holds: tuple[Hold, ...]) -> dict[int, Hold]:
    """Return the slides from a hold to where the same contact comes to rest, each with that hold."""
    found = {(hold.segment + 1) % len(itinerary): hold for hold in holds if hold.until is None}
    return {i: hold for i, hold in found.items() if itinerary[i][1] == hold.leaves}


def double_zeros(
    model: Model, itinerary: Itinerary, half: bool, holds: tuple[Hold, ...]
) -> list[tuple[EventFunction, int]]:
    """Margins with a double zero where a segment that must last has no length, each with that segment.

    The load at the end of a hold after a touch of its limit, the load at the stop before that touch, and the
    acceleration with which a hold is left into a slide up to the touch of the next one.
    """
    pairs: list[tuple[EventFunction, int]] = []
    left = _slides(itinerary, holds)
    for hold in holds:
        before = (hold.segment - 1) % len(itinerary)
        if hold.after_rest:
            surface = itinerary[before][1]
            pairs.append((EventFunction(Margin.JOINT, hold.segment, surface), hold.segment))
            if before == 0 and half and model.symmetry is not None:  # its stop is a mirror image
                back = {image: name for name, image in model.symmetry.surfaces.items()}
                surface = back[surface]
            pairs.append(
                (EventFunction(Margin.JOINT, (before - 1) % len(itinerary), surface), before)
            )
        elif hold.pin is None and before in left:
            pairs.append(
                (EventFunction(Margin.EXIT, left[before].segment, left[before].leaves), before)
            )
    return pairs
