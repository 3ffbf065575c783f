"""Look-up by name, and the sections of a model: surfaces between two parts of one mode.

Across a section nothing changes. An orbit needs one joint at least. A model whose cycles may be smooth
therefore declares the surface of its stops (``v = 0``) with two modes of the same field. They are one mode
(:attr:`SectionMaps.joined`), and the surface is a section: transparent, but for cycles that meet nothing
else.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contfric.models.parts import Domain, Mode, Observable, Parameter, Reset, Surface


class SectionMaps:
    """The part of a model that looks up its names, and derives its sections from domains and transitions."""

    if TYPE_CHECKING:
        parameters: tuple[Parameter, ...]
        observables: tuple[Observable, ...]
        surfaces: tuple[Surface, ...]
        modes: tuple[Mode, ...]
        domains: tuple[Domain, ...]
        resets: tuple[Reset, ...]
        stop_surface: str
        phase: str

        @cached_property
        def transitions(self) -> dict[tuple[str, str], str]:
            """Next domain for each possible (domain, surface)."""

        @cached_property
        def targets(self) -> dict[tuple[str, str], tuple[str, ...]]:
            """The domains that may follow where several may, by (domain, surface)."""

        def cuts(self, surface: str) -> bool:
            """Return whether motion is cut at a surface."""

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters in the order of the engine's vectors."""
        return tuple(p.name for p in self.parameters)

    @cached_property
    def domain_by_name(self) -> dict[str, Domain]:
        """Domains by their names."""
        return {d.name: d for d in self.domains}

    @cached_property
    def mode_by_name(self) -> dict[str, Mode]:
        """Modes by their names."""
        return {m.name: m for m in self.modes}

    @cached_property
    def surface_by_name(self) -> dict[str, Surface]:
        """Surfaces by their names."""
        return {s.name: s for s in self.surfaces}

    @cached_property
    def mode_index(self) -> dict[str, int]:
        """Positions of the modes in the engine's tables, by their names."""
        return {m.name: k for k, m in enumerate(self.modes)}

    @cached_property
    def surface_index(self) -> dict[str, int]:
        """Positions of the surfaces, by their names."""
        return {s.name: k for k, s in enumerate(self.surfaces)}

    @cached_property
    def observable_index(self) -> dict[str, int]:
        """Positions of the observables, by their names."""
        return {o.name: k for k, o in enumerate(self.observables)}

    @cached_property
    def reset_by_surface(self) -> dict[str, Reset]:
        """Resets by the names of their surfaces."""
        return {r.surface: r for r in self.resets}

    def is_sliding(self, domain: str) -> bool:
        """Return whether motion in a domain stays on a surface (a stick)."""
        return self.mode_by_name[self.domain_by_name[domain].mode].sliding

    @cached_property
    def joined(self) -> dict[str, str]:
        """The mode that each mode is a part of, for modes that were declared and are one with others."""
        return {d.declared: d.mode for d in self.domains if d.declared}

    def whole_mode(self, mode: str) -> str:
        """Return the mode that a mode is a part of: itself, but where modes have one field."""
        return self.joined.get(mode, mode)

    @cached_property
    def sections(self) -> frozenset[tuple[str, str]]:
        """Pairs (declared mode, surface) that lead from one part of a mode to another: nothing changes."""
        return frozenset(
            (here.declared, surface)
            for (name, surface), target in self.transitions.items()
            if (here := self.domain_by_name[name]).declared
            and here.mode == self.domain_by_name[target].mode
            and here.declared != self.domain_by_name[target].declared
        )

    @cached_property
    def section_sides(self) -> dict[tuple[str, str], int]:
        """The side from which each section is crossed."""
        return {
            (d.declared, surface): d.signs[surface]
            for d in self.domains
            for mode, surface in self.sections
            if d.declared == mode
        }

    def section_pair(self, mode: str, surface: str) -> tuple[str, str]:
        """Return (mode, surface) of a section, the same for all modes that cross it from that side."""
        whole, side = self.joined[mode], self.section_sides[mode, surface]
        return next(
            pair
            for pair, other in self.section_sides.items()
            if pair[1] == surface and other == side and self.joined[pair[0]] == whole
        )

    def section_pairs(self, mode: str, surface: str) -> dict[int, tuple[str, str]]:
        """Return (mode, surface) of a section that divides a mode, by the side from which it is crossed."""
        whole = self.whole_mode(mode)
        return {
            side: self.section_pair(*pair)
            for pair, side in self.section_sides.items()
            if pair[1] == surface and self.joined[pair[0]] == whole
        }

    @cached_property
    def section_surfaces(self) -> frozenset[str]:
        """Surfaces that are sections, of some mode at least."""
        return frozenset(surface for _, surface in self.sections)

    def shown(self, domain: str) -> str:
        """Return the domain that stands for one in labels: the same on the first side of the phase."""
        return self._shown.get(domain, domain) if self.phase else domain

    @cached_property
    def _shown(self) -> dict[str, str]:
        place = {(d.mode, *d.signs.items()): d.name for d in reversed(self.domains)}
        first = {d.name: (d.mode, *{**d.signs, self.phase: 1}.items()) for d in self.domains}
        return {name: place.get(key, name) for name, key in first.items()}

    @cached_property
    def phase_parts(self) -> frozenset[str]:
        """The second parts of modes that the phase divides, as the engine calls them."""
        if not self.phase:
            return frozenset()
        others = {d.own_mode for d in self.domains if self.shown(d.name) != d.name}
        return frozenset(others - {d.own_mode for d in self.domains if d.signs[self.phase] > 0})

    def without_phase(self, cycle: Sequence[str]) -> list[str]:
        """Return a cycle of domains as labels show it; as it is where it has joints at the phase."""
        if not self.phase:
            return list(cycle)
        ends = zip(cycle, (*cycle[1:], *cycle[:1]), strict=True)
        if any(a != b and self.shown(a) == self.shown(b) for a, b in ends):
            return list(cycle)
        shown = [self.shown(name) for name in cycle]
        # a mode that the phase divides lies on one side of it, and leads to others on that side
        return list(cycle) if self._leads_on(cycle) and not self._leads_on(shown) else shown

    def _leads_on(self, cycle: Sequence[str]) -> bool:
        """Tell whether each domain of a cycle can follow the one before, but for resets and holds."""
        ends = zip(cycle, (*cycle[1:], *cycle[:1]), strict=True)
        known = (pair for pair in ends if all(name in self.domain_by_name for name in pair))
        return all(
            any(b == self.transitions.get(at) or b in self.targets.get(at, ()) for at in exits)
            for exits, b in (([(a, s.name) for s in self.surfaces], b) for a, b in known)
        )

    @property
    def stops_at_joints(self) -> bool:
        """Whether motion is cut wherever the displacement is stationary on the stop surface."""
        return self.cuts(self.stop_surface) and self.stop_surface not in self.section_surfaces
