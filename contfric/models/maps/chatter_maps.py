"""Look-up of a model's chatter: where impacts that come to rest lead, and what throws off a wall."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

from contfric.models.maps.section_maps import SectionMaps

if TYPE_CHECKING:
    from contfric.models.parts import Chatter, Domain


class ChatterMaps(SectionMaps):
    """The part of a model that tells where impacts lead that come to rest, or begin at rest."""

    if TYPE_CHECKING:
        chatters: tuple[Chatter, ...]

    def domains_of(self, mode: str) -> tuple[Domain, ...]:
        """Return the domains of a mode."""
        return self._domains_by_mode.get(self.whole_mode(mode), ())

    @cached_property
    def _domains_by_mode(self) -> dict[str, tuple[Domain, ...]]:
        found: dict[str, list[Domain]] = {}
        for domain in self.domains:
            found.setdefault(domain.mode, []).append(domain)
        return {mode: tuple(own) for mode, own in found.items()}

    @cached_property
    def _side_of(self) -> dict[tuple[str, str], int]:
        """The side of each surface that a declared mode lies on; 0 if on both, or on it."""
        sides: dict[tuple[str, str], set[int]] = {}
        for domain in self.domains:
            for surface, sign in domain.signs.items():
                sides.setdefault((domain.own_mode, surface), set()).add(sign)
        return {key: signs.pop() if len(signs) == 1 else 0 for key, signs in sides.items()}

    @cached_property
    def chatter_at(self) -> dict[tuple[str, str], Chatter]:
        """Chatter that impacts in a mode, at a surface, may lead to."""
        return {(flight, own.surface): own for own in self.chatters for _, flight in own.ways}

    @cached_property
    def fixed_sides(self) -> dict[str, int]:
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

    def thrown_off(self, asked: Mapping[str, int], before: str) -> Iterator[dict[str, int]]:
        """Yield the sides in flight, where what rests on a wall in a mode is thrown off it at another one."""
        own = self.chatter_by_mode.get(before)
        if own is not None and asked.get(own.surface) == 0:
            for _, flight in own.ways:
                yield {**asked, own.surface: self._side_of[flight, own.surface]}

    def rest_after(self, domain: Domain, wall: str) -> list[Domain]:
        """Return the domains at rest on a wall to which impacts lead, in flight or thrown off another one."""
        own = self.chatter_by_mode.get(domain.own_mode)
        flights = (domain.mode, *(flight for _, flight in (own.ways if own else ())))
        begun = [self.chatter_at.get((flight, wall)) for flight in flights]
        return [d for chatter in begun if chatter for d in self.domains_of(chatter.mode)]
