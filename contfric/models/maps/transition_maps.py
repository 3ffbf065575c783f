"""Look-up of a model's transitions: the domain that follows each (domain, surface), and mirror images.

A domain is a mode with the sides of all surfaces. Where modes overlap several domains have the same sides:
motion stays in the mode that it is in while that holds.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

from contfric.base.attributes import kept
from contfric.errors import ParameterError
from contfric.models.maps.chatter_maps import ChatterMaps
from contfric.models.maps.overlapping import nearest, turned_back
from contfric.models.parts import across, led

if TYPE_CHECKING:
    from contfric.base.arrays import FloatArray
    from contfric.models.parts import Departure, Domain, Reset, Surface, Symmetry


class TransitionMaps(ChatterMaps):
    """The part of a model that derives its transitions from its domains, departures and resets."""

    if TYPE_CHECKING:
        name: str
        states: tuple[str, ...]
        departures: tuple[Departure, ...]
        symmetry: Symmetry | None
        kinks: tuple[str, ...]
        turned: frozenset[tuple[str, str]]
        turned_at_times: frozenset[tuple[str, str]]

    @property
    def composed(self) -> bool:
        """Whether modes are made when they are visited (:mod:`contfric.models.deriving.growing_model`)."""
        return False

    def mode_order(self, name: str) -> int:
        """Return the place of a mode in itineraries that are compared."""
        return self._mode_places[name]

    @cached_property
    def _mode_places(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.mode_by_name)}

    def domain_order(self, name: str) -> int:
        """Return the place of a domain in signatures that are compared."""
        return self._domain_places[name]

    @cached_property
    def _domain_places(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.domain_by_name)}

    def exits_of(self, domain: str) -> Iterable[tuple[str, str]]:
        """Return (surface, domain that follows), for all ways out of a domain but resets."""
        return self._exits_by_domain.get(domain, ())

    @cached_property
    def _exits_by_domain(self) -> dict[str, list[tuple[str, str]]]:
        found: dict[str, list[tuple[str, str]]] = {}
        for (source, surface), target in self.transitions.items():
            found.setdefault(source, []).append((surface, target))
        for own in self.chatters:
            for domain in self.domains_of(own.mode):
                found[domain.name] = [
                    (lift, target)
                    for lift, _ in own.ways
                    for target in self.targets[domain.name, lift]
                ]
        return found

    def is_at_rest(self, mode: str) -> bool:
        """Return whether nothing moves in a mode but time: as many states are held as are free."""
        found = self.mode_by_name[mode]
        return found.sliding and 2 * found.rank <= len(self.states)

    def lies_on(self, mode: str, surface: str) -> bool:
        """Return whether a mode moves on a surface."""
        own = self.domains_of(self.whole_mode(mode))
        return all(domain.signs.get(surface) == 0 for domain in own)

    def rests_on(self, surface: str) -> bool:
        """Return whether some mode moves on a surface; at rest on a wall a mass is there after chatter."""
        return any(
            domain.signs[surface] == 0
            for domain in self.domains
            if domain.own_mode not in self.chatter_by_mode
        )

    def cuts(self, surface: str) -> bool:
        """Return whether motion is cut at a surface: it is switching, or has a reset."""
        if surface in self.kinks or not surface:
            return False
        return self.surface_by_name[surface].switching or surface in self.reset_by_surface

    @cached_property
    def wraps(self) -> frozenset[str]:
        """Surfaces at which an angle begins again: joints of orbits that turn, and nothing else."""
        return frozenset(reset.surface for reset in self.resets if reset.wraps)

    @cached_property
    def angles(self) -> tuple[int, ...]:
        """Indices of the states that are the same a turn (2 pi) later."""
        changed = {name for reset in self.resets if reset.wraps for name in reset.changes}
        return tuple(i for i, state in enumerate(self.states) if state in changed)

    @cached_property
    def transitions(self) -> dict[tuple[str, str], str]:
        """Next domain for each possible (domain, surface); what is absent cannot happen.

        Resets are left out: what follows one depends on the state (:attr:`targets`).
        """
        found: dict[tuple[str, str], str] = {}
        for domain in self.domains:
            for surface in self.surfaces:
                target = self._next_domain(domain, surface)
                if target is not None and target != domain.name:
                    found[domain.name, surface.name] = target
        return found

    @cached_property
    def targets(self) -> dict[tuple[str, str], tuple[str, ...]]:
        """Every domain that can follow each (domain, surface): one, but for a reset, or where it turns."""
        found: dict[tuple[str, str], tuple[str, ...]] = {
            key: (target, *turned_back(self, *key, target))
            for key, target in self.transitions.items()
        }
        for domain in self.domains:
            for reset in self.resets:
                landed = self._domains_after(domain, reset)
                if landed and self.maps_at(domain, reset.surface):
                    found[domain.name, reset.surface] = landed
        for own in self.chatters:  # what is one mode may be left to on either side of its section
            for domain in self.domains_of(own.mode):
                for lift, flight in own.ways:
                    found[domain.name, lift] = tuple(d.name for d in self.domains_of(flight))
        return found

    def undecided(self) -> Iterator[tuple[Domain, str, tuple[str, ...]]]:
        """Yield (domain, surface, modes) where motion could go on in several modes."""
        for domain in self.domains:
            for surface in self.surfaces:
                found = [
                    self.domain_by_name[d]
                    for d in self.targets.get((domain.name, surface.name), ())
                ]
                mapped = self.maps_at(domain, surface.name)
                slid = self.slid_before(domain, surface.name)
                for target in found:
                    landed = self._domains_by_signs[self._chosen_at(domain, surface, target)]
                    fits = {d.mode for d in nearest(landed, domain.own_mode, self._side_of)}
                    fits |= {d.mode for d in landed if d.mode == domain.mode}
                    named = {
                        d.own_mode
                        for d in found
                        if d.signs == target.signs
                        or (
                            slid
                            and all(s in slid or d.signs[s] == v for s, v in target.signs.items())
                        )
                    }
                    several = len(named) > 1 if mapped else len(fits) > 1
                    if several and not (not mapped and domain.mode in fits):
                        yield domain, surface.name, tuple(sorted(named if mapped else fits))
                        break

    def _chosen_at(self, domain: Domain, surface: Surface, target: Domain) -> tuple[int, ...]:
        """Return the sides at which it is chosen in which mode motion goes on.

        Motion that turns back at a surface has entered a mode beyond it.
        """
        if not surface.switching and domain.own_mode != target.own_mode:
            through = {**domain.signs, surface.name: -domain.signs[surface.name]}
            beyond = self.domain_at(through, domain.own_mode)
            if beyond is not None and self.domain_by_name[beyond].own_mode == target.own_mode:
                target = self.domain_by_name[beyond]
        return tuple(target.signs[s.name] for s in self.surfaces)

    def maps_at(self, domain: Domain, surface: str) -> bool:
        """Return whether a reset acts on motion that meets a surface.

        It does in the modes that it names, or else in those that lie on one side of the surface: a mode that
        leaves the surface out passes it unchanged.
        """
        reset = self.reset_by_surface.get(surface)
        if reset is None or self._side_of[domain.own_mode, surface] == 0:
            return False
        return not reset.modes or domain.own_mode in reset.modes

    def reset_at(self, mode: str, surface: str) -> Reset | None:
        """Return the reset that acts where motion in a mode ends at a surface; None if it passes."""
        reset = self.reset_by_surface.get(surface)
        return None if reset is None or (reset.modes and mode not in reset.modes) else reset

    def ends_at(self, domain: Domain, surface: str) -> bool:
        """Return whether motion meets a reset that acts in other modes only, and no mode holds beyond it.

        Motion that a reset does not map passes its surface, as it passes any other.
        """
        bounded = surface in self.reset_by_surface and self._side_of[domain.own_mode, surface] != 0
        passes = (domain.name, surface) in self.transitions
        return bounded and not passes and not self.maps_at(domain, surface)

    def changed_by(self, reset: Reset, surface: str) -> bool:
        """Return whether a reset may change the sign at a surface."""
        return self.surface_by_name[surface].observable in reset.changes

    def _fixed_by(self, reset: Reset) -> list[str]:
        """Return the surfaces whose sides a reset cannot change; it leads onto none of them."""
        free = (s.name for s in self.surfaces if not self.changed_by(reset, s.name))
        return [name for name in free if name not in reset.lands]

    def _domains_after(self, domain: Domain, reset: Reset) -> tuple[str, ...]:
        """Return the domains that a reset can map to: they differ in what it changes.

        Where several modes hold, the one that the reset names goes on, or else the mode before it.
        """
        asked = {name: domain.signs[name] for name in self._fixed_by(reset)} | reset.sides
        if reset.surface in reset.sides:
            asked[reset.surface] *= domain.signs[reset.surface]
        landed = self._domains_landed(reset.surface).get(
            tuple(asked[name] for name in sorted(asked)), []
        )
        landed = [*landed, *self._departed(asked), *self._led_away(asked, reset, domain)]
        for sides in self.thrown_off(asked, domain.own_mode):
            landed += self._domains_landed(reset.surface).get(
                tuple(sides[n] for n in sorted(sides)), []
            )
        landed = [d for d in landed if not reset.ways or d.name in reset.ways]
        landed = led(landed, reset.leads, domain.own_mode)
        if reset.stays and not reset.changes:  # it only says the mode
            labels = {d.own_mode for d in landed if not self._side_of[d.own_mode, reset.surface]}
            landed += across(landed, reset.surface, labels, self.domains)
        resting = self.rest_after(domain, reset.surface)
        return tuple(dict.fromkeys(d.name for d in (*landed, *resting)))

    def _departed(self, asked: Mapping[str, int]) -> list[Domain]:
        """Return the domains in which motion leaves the surfaces that it slid on before a reset.

        Sliding may hold for some images and end for others: what a reset changes has any side.
        """
        found = []
        for departure in self.departures:
            leaves = {**asked, **departure.leaves}
            if any(asked.get(s) != 0 for s in departure.leaves):
                continue
            if any(asked.get(s, side) != side for s, side in departure.where.items()):
                continue
            wanted = {**departure.where, **leaves}
            found += [d for d in self.domains if all(d.signs[s] == v for s, v in wanted.items())]
        return found

    def _led_away(self, asked: Mapping[str, int], reset: Reset, before: Domain) -> list[Domain]:
        """Return the domains of modes that a reset names next to surfaces that motion slid on before."""
        slid = {s for s, side in asked.items() if side == 0 and s not in reset.lands}
        leads = [lead for lead in reset.leads if not lead.after or before.own_mode in lead.after]
        return [
            d
            for d in self.domains
            if slid
            and any(
                d.own_mode == own.mode and own.where.items() <= d.signs.items() for own in leads
            )
            and all(d.signs[s] == side or (s in slid and d.signs[s]) for s, side in asked.items())
        ]

    def slid_before(self, domain: Domain, surface: str) -> set[str]:
        """Return the surfaces that motion slid on before a reset, which is on none of their sides then."""
        reset = self.reset_at(domain.own_mode, surface)
        if reset is None or domain.own_mode in self.chatter_by_mode:
            return set()  # thrown off a wall, or against it: the side a little after tells
        return {s for s, v in domain.signs.items() if v == 0 and not self.changed_by(reset, s)}

    @kept
    def _domains_landed(self, surface: str) -> dict[tuple[int, ...], list[Domain]]:
        """Return the domains that lie on no surface of what a reset changes, by the sides of all others."""
        reset = self.reset_by_surface[surface]
        free = [s.name for s in self.surfaces if self.changed_by(reset, s.name)]
        asked = sorted({*self._fixed_by(reset), *reset.sides})
        found: dict[tuple[int, ...], list[Domain]] = {}
        for domain in self.domains:
            if all(domain.signs[name] != 0 for name in free if reset.lands.get(name) != 0):
                key = tuple(domain.signs[name] for name in asked)
                found.setdefault(key, []).append(domain)
        return found

    def _next_domain(self, domain: Domain, surface: Surface) -> str | None:
        sign = domain.signs[surface.name]
        if sign == 0 or self.maps_at(domain, surface.name):
            return None
        mode = domain.own_mode
        through = {**domain.signs, surface.name: -sign}
        resting_at = self.chatter_by_mode.get(mode)
        flight = dict(resting_at.ways).get(surface.name) if resting_at is not None else None
        if resting_at is not None and flight is not None:  # the wall lets go
            side = self._side_of[flight, resting_at.surface]
            return self._domain_with({**domain.signs, resting_at.surface: side}, flight)
        if not surface.switching:
            target = self.domain_at(through, mode)
            entered = "" if target is None else self.domain_by_name[target].own_mode
            if entered != mode and (entered, surface.name) in self.turned:
                return self.domain_at(domain.signs, entered)
            return target
        resting = self.domain_at({**domain.signs, surface.name: 0}, mode)
        beyond = self.domain_at(through, mode)
        whole = beyond is not None and self.domain_by_name[beyond].own_mode == mode
        if resting is None or (resting == domain.name and whole):
            return beyond  # what leaves rest there goes back, what comes in one mode on both sides passes
        return resting

    def _resolve_at_rest(self, signs: Mapping[str, int], mode: str) -> str | None:
        staying = self._domain_with(signs, mode)
        if staying is not None:
            return staying
        for departure in self.departures:
            if all(signs[name] == value for name, value in departure.where.items()):
                return self._domain_with({**signs, **departure.leaves}, mode)
        return None

    def domain_at(self, signs: Mapping[str, int], mode: str = "") -> str | None:
        """Return the domain that a state with these signs is in, or leaves to from rest.

        Where modes overlap, motion stays in the ``mode`` that it is in if that holds there.
        """
        if any(signs[s.name] == 0 for s in self.surfaces if s.switching):
            return self._resolve_at_rest(signs, mode)
        return self._domain_with(signs, mode)

    def domain_of(
        self, signs: Mapping[str, int], t: float, y: FloatArray, vector: FloatArray
    ) -> str | None:
        """Return the domain that a state with these signs is in, or leaves to from rest."""
        return self.domain_at(signs)

    def _domain_with(self, signs: Mapping[str, int], mode: str = "") -> str | None:
        fits = self._domains_by_signs.get(tuple(signs[s.name] for s in self.surfaces), ())
        whole = self.whole_mode(mode)
        same = [d.name for d in fits if d.own_mode == mode] or [
            d.name for d in fits if d.mode == whole
        ]
        return same[0] if same else nearest(fits, mode, self._side_of)[0].name if fits else None

    @cached_property
    def _domains_by_signs(self) -> dict[tuple[int, ...], tuple[Domain, ...]]:
        """Domains by the sides of all surfaces: several where modes overlap."""
        found: dict[tuple[int, ...], tuple[Domain, ...]] = {}
        for domain in self.domains:
            key = tuple(domain.signs[s.name] for s in self.surfaces)
            found[key] = (*found.get(key, ()), domain)
        return found

    @cached_property
    def mirror_domain(self) -> dict[str, str]:
        """Image of each domain under the symmetry; empty if the model has none."""
        if self.symmetry is None:
            return {}
        image: dict[str, str] = {}
        modes: dict[
            str, set[str]
        ] = {}  # the image of a mode holds wherever a domain of it has its image
        for domain in self.domains:
            fits = {d.own_mode for d in self._mirrored(domain)}
            modes[domain.own_mode] = modes.get(domain.own_mode, fits) & fits
        for domain in self.domains:
            fit = modes[domain.own_mode]
            fit = fit & self.symmetry.modes.get(domain.own_mode, fit) or fit
            target = next((d.name for d in self._mirrored(domain) if d.own_mode in fit), None)
            if target is None:
                raise ParameterError(f"model {self.name}: domain {domain.name} has no mirror image")
            image[domain.name] = target
        return image

    def _mirrored(self, domain: Domain) -> tuple[Domain, ...]:
        """Return the domains in which the image of a domain under the symmetry lies."""
        assert self.symmetry is not None
        symmetry = self.symmetry
        signs = {symmetry.surfaces[s]: symmetry.sense(s) * v for s, v in domain.signs.items()}
        return self._domains_by_signs.get(tuple(signs[s.name] for s in self.surfaces), ())
