"""Outcomes where a surface with a reset is grazed: an impact of zero speed appears or disappears.

Where the impact changes the mode (a rocking block changes its foot) two of them do, with no time between.
"""

from __future__ import annotations

from contfric.bvp.system import EventFunction, Margin
from contfric.errors import NotationError
from contfric.events.local.touching import thrown_at
from contfric.events.local.zero_acceleration import touch_of
from contfric.events.outcomes.contact_outcomes import Joints, crossed
from contfric.events.outcomes.standing_slides import runs_on
from contfric.models.definition import Model
from contfric.orbit.canonical.section_joints import crossed_at_graze
from contfric.orbit.orbit import Orbit
from contfric.signature.edits import Edit, split


def grazing_impact(orbit: Orbit, location: EventFunction) -> tuple[Edit, Joints, str]:
    """Return the edit where a segment touches a surface with a reset, or ends on it without speed, and why.

    Raises
    ------
    NotationError
        If no orbit is near: the reset throws the solution elsewhere, or it does not come back.
    """
    itinerary, i = orbit.itinerary, location.segment
    mode, exit_ = itinerary[i]
    if thrown_at(orbit, location):
        raise NotationError(
            f"after the reset at {location.surface} the solution starts somewhere else: no orbit is near"
        )
    if _changes_mode(orbit.model, mode, location.surface):
        edit, joints, _, reason = crossed(orbit, location)  # regular: rates jump by the impacts
        return edit, joints, reason
    if location.margin is Margin.INTERIOR:
        edit = split(i, location.surface, (mode, exit_))
        reason = f"impact at the touch of {location.surface} in segment {i + 1}"
        return edit, {(i, 0): touch_of(orbit, i, location.surface)}, reason
    following = (i + 1) % len(itinerary)
    reason = f"no impact on {location.surface} after segment {i + 1}"
    if pair := crossed_at_graze(orbit, i):
        return *_renamed(orbit, i, pair), reason
    whole = orbit.model.whole_mode
    if whole(itinerary[following][0]) != whole(mode) or len(itinerary) < 2:
        raise NotationError(f"the impact after segment {i + 1} changes the mode: it must stay")
    return *runs_on(orbit, i, following), reason


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


def _changes_mode(model: Model, mode: str, surface: str) -> bool:
    """Tell whether an impact leads to another mode, from wherever it happens."""
    whole = model.whole_mode(mode)
    after = {
        model.whole_mode(model.domain_by_name[target].own_mode)
        for domain in model.domains_of(whole)
        for target in model.targets.get((domain.name, surface), ())
    }
    return bool(after) and whole not in after


def _renamed(orbit: Orbit, i: int, pair: tuple[str, str]) -> tuple[Edit, Joints]:
    """Return the edit that gives a segment another mode and exit, and its joint."""
    return Edit(frozenset({i}), {}, {i: (pair,)}), {(i, 0): orbit.cycle[i]}
