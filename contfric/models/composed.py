"""Models whose modes are made when they are visited: structures with many contacts.

Everything that an engine looks up by the name of a mode is a mapping that makes what is missing. A mode gets
a number, and a place in the tables of the flow and of the simulation, when its number is first asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from contfric.models.composition import Composition, composition_of
from contfric.models.definition import Model
from contfric.models.made import Made
from contfric.models.parts import Domain, FloatArray, Mode

if TYPE_CHECKING:
    from contfric.flow.interface import CompiledFlow
    from contfric.models.growing import GrowingFlow

#: A domain and a surface through which it is left.
Exit = tuple[str, str]


class ComposedModel(Model):
    """A model whose modes are made when they are visited (:mod:`contfric.models.composition`).

    ``modes`` and ``domains`` are those that were visited, in that order: one domain a mode.
    """

    @cached_property
    def composition(self) -> Composition:
        """What modes are made from."""
        return composition_of(self.definition)

    @property
    def composed(self) -> bool:
        """Whether modes are made when they are visited."""
        return True

    # -------------------------------------------------------------------------------- look-ups

    @cached_property
    def mode_by_name(self) -> dict[str, Mode]:
        """Modes by their names, visited or not."""
        return Made(self.composition.mode, self.composition.is_mode)

    @cached_property
    def domain_by_name(self) -> dict[str, Domain]:
        """Domains by their names, visited or not."""
        return Made(self.composition.domain, self.composition.is_mode)

    @cached_property
    def mode_index(self) -> dict[str, int]:
        """Numbers of the modes, by their names; whose number is asked for is visited."""
        found = Made(self._visit, self.composition.is_mode)
        found.update({mode.name: k for k, mode in enumerate(self.modes)})
        return found

    def was_visited(self, name: str) -> bool:
        """Return whether a mode has a number."""
        return name in self.mode_index.keys()  # noqa: SIM118  ("in" says whether it can have one)

    def _visit(self, name: str) -> int:
        object.__setattr__(self, "modes", (*self.modes, self.mode_by_name[name]))
        object.__setattr__(self, "domains", (*self.domains, self.domain_by_name[name]))
        if "_growing" in self.__dict__:
            self._growing.add(name)
        return len(self.modes) - 1

    def mode_order(self, name: str) -> int:
        """Return the place of a mode in words that are compared: the same whatever was visited."""
        return self.composition.order(name)

    def domain_order(self, name: str) -> int:
        """Return the place of a domain in signatures that are compared."""
        return self.composition.order(name)

    def domains_of(self, mode: str) -> tuple[Domain, ...]:
        """Return the domains of a mode."""
        return (self.domain_by_name[mode],)

    @cached_property
    def sections(self) -> frozenset[tuple[str, str]]:
        """Pairs (declared mode, surface) that lead from one part of a mode to another: none."""
        return frozenset()

    @cached_property
    def section_sides(self) -> dict[tuple[str, str], int]:
        """The side from which each section is crossed."""
        return {}

    # ------------------------------------------------------------------------------ transitions

    @cached_property
    def transitions(self) -> Mapping[Exit, str]:  # type: ignore[override]
        """What follows each (domain, surface) where that is one domain, whatever else holds there."""

        def has(key: object) -> bool:
            return self._leads(key) and len(self.composition.ways(key[0])[key[1]]) == 1  # type: ignore[index]

        return Made(lambda key: self.composition.ways(key[0])[key[1]][0].mode, has)

    @cached_property
    def targets(self) -> Mapping[Exit, tuple[str, ...]]:  # type: ignore[override]
        """Every domain that can follow each (domain, surface)."""
        ways = self.composition.ways
        return Made(lambda key: tuple(w.mode for w in ways(key[0])[key[1]]), self._leads)

    def _leads(self, key: Any) -> bool:
        name, surface = key
        return self.composition.is_mode(name) and surface in self.composition.ways(name)

    def exits_of(self, domain: str) -> Iterator[tuple[str, str]]:
        """Yield (surface, domain that follows), for all ways out of a domain but resets."""
        for surface, ways in self.composition.ways(domain).items():
            for way in ways:
                yield surface, way.mode

    def exit_sides(self, mode: str, surface: str, after: str) -> dict[str, int]:
        """Return the sides of other surfaces where a mode is left through one into the following mode."""
        own = {s: side for s, side in self.composition.sides(mode).items() if s != surface}
        ways = self.composition.ways(mode).get(surface, ())
        return own | next((dict(w.where) for w in ways if w.mode == after), {})

    def rests_on(self, surface: str) -> bool:
        """Return whether some mode moves on a surface."""
        return surface in self.composition.rested_on

    def bounds_of(self, mode: str) -> tuple[str, ...]:
        """Return the surfaces that bound a mode, in their order."""
        ways = self.composition.ways(mode)
        return tuple(s.name for s in self.surfaces if s.name in ways)

    def domain_at(self, signs: Mapping[str, int], mode: str = "") -> str | None:
        """Return the domain that a state with these signs is in, or leaves to from rest."""
        return self.composition.mode_at(signs)

    @cached_property
    def mirror_domain(self) -> dict[str, str]:
        """Image of each domain under the symmetry; empty if the model has none."""
        if self.symmetry is None:
            return {}
        images = self.symmetry.surfaces
        return Made(lambda name: self.composition.image(name, images), self.composition.is_mode)

    # ------------------------------------------------------------------------------------- flow

    @cached_property
    def _growing(self) -> GrowingFlow:
        from contfric.models.growing import GrowingFlow

        return GrowingFlow(self.definition, [mode.name for mode in self.modes])

    @cached_property
    def flow(self) -> CompiledFlow:
        """The compiled flow of the modes that were visited; it grows with them."""
        return self._growing.flow

    def state_and_rate(
        self, mode: int, t: float, y: FloatArray, vector: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the state on the surfaces of a mode next to one, and its rate along the mode."""
        none, nothing = np.empty(0, dtype=np.int64), np.empty((0, 0))
        state, rate = y.copy(), np.empty(len(y))
        if self.modes[mode].sliding:
            self._growing.onto(mode, t, y, vector, none, state, nothing)
        self._growing.field(mode, t, state, vector, none, rate, nothing)
        return state, rate

    @property
    def integrated(self) -> dict[str, str]:
        """Modes that are integrated numerically: none, as a structure is composed of affine ones."""
        return {}
