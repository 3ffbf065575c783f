"""Names of a model and their positions in the engine's tables, each looked up once."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contfric.models.parts import Domain, Mode, Observable, Parameter, Reset, Surface


class Lookup:
    """What a model is asked for by name."""

    if TYPE_CHECKING:
        parameters: tuple[Parameter, ...]
        observables: tuple[Observable, ...]
        surfaces: tuple[Surface, ...]
        modes: tuple[Mode, ...]
        domains: tuple[Domain, ...]
        resets: tuple[Reset, ...]

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
