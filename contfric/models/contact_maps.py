"""What a model says of contact after chatter: where it begins, by which field it goes on, where it ends."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from contfric.models.section_maps import SectionMaps

if TYPE_CHECKING:
    from contfric.models.parts import Chatter, Domain, Reset


class ContactMaps(SectionMaps):
    """The part of a model that derives where contact after chatter leads."""

    if TYPE_CHECKING:
        chatters: tuple[Chatter, ...]

        def domains_of(self, mode: str) -> tuple[Domain, ...]:
            """Return the domains of a mode."""

        def maps_at(self, domain: Domain, surface: str) -> bool:
            """Return whether a reset acts on motion that meets a surface."""

        def _domains_after(self, domain: Domain, reset: Reset) -> tuple[str, ...]:
            """Return the domains that a reset can map to."""

    @cached_property
    def chatter_at(self) -> dict[tuple[str, str], Chatter]:
        """Chatter that impacts in a mode, at a surface, may lead to."""
        return {(flight, own.surface): own for own in self.chatters for _, flight in own.ways}

    @cached_property
    def settled_sides(self) -> dict[str, int]:
        """The side of each surface that only ends chatter: all domains have that, on whichever they are."""
        return {
            lift: self.domains_of(own.mode)[0].signs[lift]
            for own in self.chatters
            for lift, _ in own.ways
        }

    @cached_property
    def chatter_by_mode(self) -> dict[str, Chatter]:
        """Chatter by its modes."""
        return {own.mode: own for own in self.chatters}

    def contact_exits(self, domain: Domain) -> dict[str, tuple[str, ...]]:
        """Return the surfaces at which contact after chatter goes on in a segment of its own, and as what.

        The field changes there (a coil is switched), or a clock ticks: the wall is pressed on, by the field
        of the mode that follows, or lets go at once.
        """
        found: dict[str, tuple[str, ...]] = {}
        if domain.own_mode not in self.chatter_by_mode:
            return found
        walls = {own.surface for own in self.chatters}
        for name in (surface.name for surface in self.surfaces if surface.name not in walls):
            reset = self.reset_by_surface.get(name)
            ticks = reset is not None and self.maps_at(domain, name)
            after = self._domains_after(domain, reset) if reset is not None and ticks else ()
            passed = self.transitions.get((domain.name, name))
            behind = after if ticks else (passed,) if passed is not None else ()
            modes = {d: self.domain_by_name[d].own_mode for d in behind}
            own = [d for d, mode in modes.items() if mode in self.chatter_by_mode]
            found[name] = tuple(d for d in own if ticks or modes[d] != domain.own_mode)
        return {name: behind for name, behind in found.items() if behind}

    def let_go(self, resting: Sequence[str]) -> tuple[str, ...]:
        """Return the domains of flight in which motion goes on where the wall is not pressed in these."""
        modes = dict.fromkeys(self.domain_by_name[name].own_mode for name in resting)
        flights = [flight for mode in modes for _, flight in self.chatter_by_mode[mode].ways]
        return tuple(d.name for flight in dict.fromkeys(flights) for d in self.domains_of(flight))
