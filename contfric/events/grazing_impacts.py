"""What can follow where a surface with a reset is grazed: an impact of speed zero comes in, or goes."""

from __future__ import annotations

from contfric.bvp.system import EventFunction, Margin
from contfric.errors import NotationError
from contfric.events.contact_outcomes import Joints
from contfric.events.standing_slides import runs_on
from contfric.events.touching import thrown_at
from contfric.events.zero_acceleration import touch_of
from contfric.orbit.orbit import Orbit
from contfric.orbit.section_joints import crossed_at_graze
from contfric.signature.edits import Edit, split


def grazing_impact(orbit: Orbit, location: EventFunction) -> tuple[Edit, Joints, str]:
    """Return the edit where a segment touches a surface with a reset, or ends on it without speed, and why.

    Raises
    ------
    NotationError
        If no orbit is near: the reset throws the solution elsewhere, or changes its mode.
    """
    itinerary, i = orbit.itinerary, location.segment
    mode, exit_ = itinerary[i]
    if thrown_at(orbit, location):
        raise NotationError(
            f"after the reset at {location.surface} the solution starts somewhere else: no orbit is near"
        )
    if location.margin is Margin.INTERIOR:
        edit = split(i, location.surface, (mode, exit_))
        reason = f"impact at the touch of {location.surface} in segment {i + 1}"
        return edit, {(i, 0): touch_of(orbit, i, location.surface)}, reason
    behind = (i + 1) % len(itinerary)
    whole = orbit.model.whole_mode
    reason = f"no impact on {location.surface} after segment {i + 1}"
    if pair := crossed_at_graze(orbit, i):
        return *_renamed(orbit, i, pair), reason
    if whole(itinerary[behind][0]) != whole(mode) or len(itinerary) < 2:
        raise NotationError(f"the impact after segment {i + 1} changes the mode: it must stay")
    return *runs_on(orbit, i, behind), reason


def impact_at_joint(orbit: Orbit, location: EventFunction) -> tuple[Edit, Joints, str]:
    """Return the edit where a section is crossed at the touch: the impact takes the place of the crossing.

    Raises
    ------
    NotationError
        If the segment ends on the surface itself.
    """
    i, surface = location.segment, location.surface
    mode, exit_ = orbit.itinerary[i]
    if (mode, exit_) not in orbit.model.sections:
        raise NotationError(f"the wall {surface} is met where segment {i + 1} ends")
    reason = f"impact at the touch of {surface} where segment {i + 1} ends"
    return *_renamed(orbit, i, (orbit.model.whole_mode(mode), surface)), reason


def _renamed(orbit: Orbit, i: int, pair: tuple[str, str]) -> tuple[Edit, Joints]:
    """Return the edit that gives a segment another mode and exit, and its joint."""
    return Edit(frozenset({i}), {}, {i: (pair,)}), {(i, 0): orbit.cycle[i]}
