"""The inequalities that an orbit obeys: their kinds, and those that vanish with the length of a segment."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from contfric.bvp.holds import Hold, Itinerary
from contfric.models.definition import Model
from contfric.signature.holds import is_hold


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


def begun_by_another(
    model: Model, itinerary: Itinerary, before: Itinerary, i: int, leaves: str
) -> bool:
    """Tell whether a segment begins as another contact changes than the one that leaves a surface.

    Parameters
    ----------
    before : mode and exit of the segment before each
    """
    mode, exit_ = before[i]
    if is_hold(exit_) or exit_ == leaves or model.reset_at(mode, exit_) is not None:
        return False
    return model.lies_on(mode, leaves) == model.lies_on(itinerary[i][0], leaves)


def lasting_segments(
    model: Model, itinerary: Itinerary, joints: Itinerary, holds: tuple[Hold, ...]
) -> list[tuple[int, str]]:
    """Segments that no other margin keeps from shrinking through zero, each with the surface that it ends on.

    A hold after a touch of its limit, and the stick up to that touch: where it shrinks to nothing, the
    margin of the stop before it has a double zero. And the slide from one hold to the touch at which the
    next begins: where it shrinks to nothing, the acceleration with which the first is left has one.
    Of a hold in several modes the last part: it is left where another contact has just changed its state.
    And a slide up to a touch of rest that begins where another contact does.

    Parameters
    ----------
    joints : mode and exit of the segment before each
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
        elif hold.pin is None and (
            before in left or begun_by_another(model, itinerary, joints, before, hold.leaves)
        ):
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
    acceleration with which a hold is left into a slide up to the touch of the next one. Where a slide up to a
    touch of rest begins as another contact changes, the velocity there.
    """
    pairs: list[tuple[EventFunction, int]] = []
    left = _slides(itinerary, holds)
    for hold in holds:
        before = (hold.segment - 1) % len(itinerary)
        if hold.follows:
            continue
        touches = hold.pin is None and before not in left
        if hold.after_rest or touches:
            surface = itinerary[before][1]
            if hold.after_rest:
                pairs.append((EventFunction(Margin.JOINT, hold.segment, surface), hold.segment))
            if before == 0 and half and model.symmetry is not None:  # its stop is a mirror image
                back = {image: name for name, image in model.symmetry.surfaces.items()}
                surface = back[surface]
            pairs.append(
                (EventFunction(Margin.JOINT, (before - 1) % len(itinerary), surface), before)
            )
        elif hold.pin is None:
            pairs.append(
                (EventFunction(Margin.EXIT, left[before].segment, left[before].leaves), before)
            )
    return pairs
