"""Models whose modes are made when they are visited: structures with many contacts.

Everything that an engine looks up by the name of a mode is a mapping that makes what is missing. A mode gets
a number, and a place in the tables of the flow and of the simulation, when its number is first asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.definition import Model
from contfric.models.lazy_mapping import Made
from contfric.models.parts import Domain, Mode, Observable, Surface

if TYPE_CHECKING:
    from contfric.flow.interface import CompiledFlow
    from contfric.models.deriving.visited_modes import Composition
    from contfric.models.described.description import Description
    from contfric.models.generated.table_flow import CodedFlow

#: A domain and a surface through which it is left.
Exit = tuple[str, str]


class Parts(Made[str]):
    """A mapping of parts of modes to modes: there are some even before one is asked for."""

    def __init__(self, model: ComposedModel) -> None:
        super().__init__(model.composition.parts.whole, self._is_part)
        self._model = model

    def _is_part(self, name: object) -> bool:
        composition = self._model.composition
        return composition.is_mode(name) and composition.parts.is_divided(str(name))

    def __bool__(self) -> bool:
        return bool(self._model.phase)


class Sections(Set[Exit]):
    """Pairs (part of a mode, surface of the phase): of all modes that it divides; visited ones are listed."""

    def __init__(self, model: ComposedModel) -> None:
        self._model = model

    def __contains__(self, pair: object) -> bool:
        part, surface = cast("Exit", pair)
        return bool(surface) and surface == self._model.phase and part in self._model.joined

    def __iter__(self) -> Iterator[Exit]:
        model = self._model
        return ((m.name, model.phase) for m in model.modes if m.name in model.joined)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __bool__(self) -> bool:
        return bool(self._model.phase)


class ComposedModel(Model):
    """A model whose modes are made when they are visited (:mod:`contfric.models.deriving.visited_modes`).

    ``modes`` and ``domains`` are those that were visited, in that order: one domain a mode. Modes in which an
    orbit may stay are divided by the phase (:mod:`contfric.models.deriving.phases`), others are not.
    """

    @cached_property
    def composition(self) -> Composition:
        """What modes are made from."""
        # other models need none of it
        from contfric.models.deriving.visited_modes import composition_of

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
        if "coded" in self.__dict__:
            self.coded.add(self.composition.text(name), self.composition.loads_in(name))
        return len(self.modes) - 1

    @cached_property
    def surface_by_name(self) -> dict[str, Surface]:
        """Surfaces by their names; the limits of shared loads are made when they are asked for."""
        found = Made(self._surface, self._is_surface)
        found.update({s.name: s for s in self.surfaces})
        return found

    @cached_property
    def surface_index(self) -> dict[str, int]:
        """Positions of the surfaces, by their names."""
        found = Made(self._see, self._is_surface)
        found.update({s.name: k for k, s in enumerate(self.surfaces)})
        return found

    def _surface(self, name: str) -> Surface:
        number = self.surface_index[name]  # it makes the surface, if that is a new one
        return self.surfaces[number]

    def _is_surface(self, name: object) -> bool:
        if name in self.composition.declared:
            return True
        return isinstance(name, str) and self.composition.limit(name) is not None

    def _see(self, name: str) -> int:
        """Make a surface; its image under the symmetry comes with it."""
        surface, formula = self.composition.surface(name)
        object.__setattr__(self, "surfaces", (*self.surfaces, surface))
        if surface.observable not in self.observable_index:
            seen = Observable(surface.observable, formula)
            object.__setattr__(self, "observables", (*self.observables, seen))
            self.observable_index[seen.name] = len(self.observables) - 1
        if "coded" in self.__dict__:
            self.coded.see(surface, formula)
        place = len(self.surfaces) - 1
        self.surface_index[name], self.surface_by_name[name] = place, surface
        limit = self.composition.limit(name)
        if self.symmetry is not None and limit is not None:
            images = cast("dict[str, str]", self.symmetry.surfaces)
            image = self.composition.image_of(limit, images).name
            images[name], images[image] = image, name
            self.surface_index[image]
        return place

    def mode_order(self, name: str) -> int:
        """Return the place of a mode in itineraries that are compared: the same whatever was visited."""
        return self.composition.order(name)

    def domain_order(self, name: str) -> int:
        """Return the place of a domain in signatures that are compared."""
        return self.composition.order(name)

    def domains_of(self, mode: str) -> tuple[Domain, ...]:
        """Return the domains of a mode: those of its parts, if the phase divides it."""
        if not self.composition.parts.is_divided(mode):
            return (self.domain_by_name[mode],)
        part = self.composition.parts.part
        return tuple(self.domain_by_name[part(mode, side)] for side in (1, -1))

    @cached_property
    def joined(self) -> dict[str, str]:
        """The mode that each mode is a part of, for modes that the phase divides."""
        return Parts(self)

    @cached_property
    def sections(self) -> Sections:  # type: ignore[override]
        """Pairs (part of a mode, surface) that lead from one part of a mode to the other."""
        return Sections(self)

    @cached_property
    def section_sides(self) -> dict[tuple[str, str], int]:
        """The side from which each section is crossed."""
        return Made(lambda pair: self.composition.parts.side(pair[0]), self.sections.__contains__)

    def section_pair(self, mode: str, surface: str) -> tuple[str, str]:
        """Return (mode, surface) of a section: no other mode crosses it."""
        return mode, surface

    def section_pairs(self, mode: str, surface: str) -> dict[int, tuple[str, str]]:
        """Return (mode, surface) of a section that divides a mode, by the side from which it is crossed."""
        if (mode, surface) not in self.sections:
            return {}
        return {side: (self.composition.parts.part(mode, side), surface) for side in (1, -1)}

    def shown(self, domain: str) -> str:
        """Return the domain that stands for one in labels: the first part of its mode."""
        return self.composition.parts.whole(domain) if domain in self.joined else domain

    @property
    def phase_parts(self) -> frozenset[str]:
        """The second parts of modes that were visited."""
        return frozenset(m.name for m in self.modes if self.composition.parts.side(m.name) < 0)

    # ------------------------------------------------------------------------------ transitions

    @cached_property
    def transitions(self) -> Mapping[Exit, str]:  # type: ignore[override]
        """What follows each (domain, surface) where that is one domain, whatever else holds there."""

        def has(key: object) -> bool:
            if not self._leads(key):
                return False
            name, surface = cast("Exit", key)
            if key in self.sections:
                return True
            alone = len(self.composition.ways(name)[surface]) == 1
            return alone or self.composition.limit(surface) is not None  # others may let go with it

        return Made(lambda key: self._led_to(key)[0], has)

    @cached_property
    def targets(self) -> Mapping[Exit, tuple[str, ...]]:  # type: ignore[override]
        """Every domain that can follow each (domain, surface)."""
        return Made(self._led_to, self._leads)

    def _led_to(self, key: Exit) -> tuple[str, ...]:
        if key in self.sections:
            return (self._beyond(key[0]),)
        return tuple(way.mode for way in self.composition.ways(key[0])[key[1]])

    def _beyond(self, part: str) -> str:
        """Return the other part of a mode that the phase divides."""
        return self.composition.parts.part(part, -self.composition.parts.side(part))

    def _leads(self, key: Any) -> bool:
        name, surface = key
        if key in self.sections:
            return True
        return self.composition.is_mode(name) and surface in self.composition.ways(name)

    def exits_of(self, domain: str) -> Iterator[tuple[str, str]]:
        """Yield (surface, domain that follows), for all ways out of a domain but resets."""
        for surface, ways in self.composition.ways(domain).items():
            for way in ways:
                yield surface, way.mode
        if (domain, self.phase) in self.sections:
            yield self.phase, self._beyond(domain)

    def exit_sides(self, mode: str, surface: str, after: str) -> dict[str, int]:
        """Return the sides of other surfaces where a mode is left through one into the following mode."""
        own = {s: side for s, side in self.composition.sides(mode).items() if s != surface}
        way = self.composition.way(mode, surface, after)
        found = own | (dict(way.where) if way else {})
        for name in found:  # made, if it was not yet
            self.surface_index[name]
        return found

    def follows(self, mode: str, surface: str, after: str) -> bool:
        """Return whether a mode can follow another one through a surface."""
        if (mode, surface) in self.sections:
            return self.whole_mode(after) == self.whole_mode(mode)
        return self.composition.way(mode, surface, self.whole_mode(after)) is not None

    def rests_on(self, surface: str) -> bool:
        """Return whether some mode moves on a surface."""
        return surface in self.composition.rested_on

    def bounds_of(self, mode: str) -> tuple[str, ...]:
        """Return the surfaces that bound a mode, in their order; a section does not."""
        ways = self.composition.ways(mode)
        return tuple(sorted(ways, key=self.surface_index.__getitem__))

    def cuts_of(self, mode: str) -> tuple[str, ...]:
        """Return the surfaces at which a simulation stops in a mode: the section, too."""
        return (*self.bounds_of(mode), *([self.phase] if mode in self.joined else []))

    def domain_at(self, signs: Mapping[str, int], mode: str = "") -> str | None:
        """Return the domain that a state with these signs is in, or leaves to from rest."""
        return self.composition.mode_at(signs)

    def domain_of(
        self, signs: Mapping[str, int], t: float, y: FloatArray, vector: FloatArray
    ) -> str | None:
        """Return the domain that a state is in, or leaves to from rest."""
        found = self.composition.mode_at(signs, (self.mapping(vector), t, y.tolist()))
        return found if signs.get(self.phase) != 0 else self.part_at(found, t, y, vector)

    def part_at(self, mode: str, t: float, y: FloatArray, vector: FloatArray) -> str:
        """Return the part of a mode that a state is in; on the section, that which it leads to."""
        if mode not in self.joined:
            return mode
        view = self.view(vector)
        height = view.height(self.phase, t, y)
        seen = self.surface_by_name[self.phase].observable
        return self.composition.parts.part(
            mode, 1 if (height or view.rate(mode, seen, t, y)) > 0.0 else -1
        )

    @cached_property
    def mirror_domain(self) -> dict[str, str]:
        """Image of each domain under the symmetry; empty if the model has none."""
        if self.symmetry is None:
            return {}
        return Made(self._image, self.composition.is_mode)

    def _image(self, name: str) -> str:
        assert self.symmetry is not None
        whole = self.composition.image(name, self.symmetry.surfaces)
        side = self.composition.parts.side(name)
        return (
            self.composition.parts.part(whole, side * self.symmetry.sense(self.phase))
            if side
            else whole
        )

    # ------------------------------------------------------------------------------------- flow

    @cached_property
    def coded(self) -> CodedFlow:
        """The flow of the modes that were visited, in that order: the first is that in which none acts."""
        from contfric.models.generated.formula_tables import Forms
        from contfric.models.generated.table_flow import CodedFlow

        found = CodedFlow(Forms(self.description))
        for surface in self.surfaces[len(self.composition.declared) :]:
            found.see(*self.composition.surface(surface.name))
        for mode in self.modes[1:]:
            found.add(self.composition.text(mode.name), self.composition.loads_in(mode.name))
        return found

    @cached_property
    def flow(self) -> CompiledFlow:
        """The compiled flow of the modes that were visited; it grows with them."""
        return self.coded.flow

    def state_and_rate(
        self, mode: int, t: float, y: FloatArray, vector: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the state on the surfaces of a mode next to one, and its rate along the mode."""
        none, nothing = np.empty(0, dtype=np.int64), np.empty((0, 0))
        state, rate = y.copy(), np.empty(len(y))
        if self.modes[mode].sliding:
            self.coded.onto(mode, t, y, vector, none, state, nothing)
        self.coded.field(mode, t, state, vector, none, rate, nothing)
        return state, rate

    @property
    def integrated(self) -> dict[str, str]:
        """Modes that are integrated numerically: none, as a structure is composed of affine ones."""
        return {}


def composed_from(description: Description) -> ComposedModel:
    """Build the model of a structure from its description.

    Raises
    ------
    EntryError
        If its modes are not affine: only these are made one by one.
    """
    from contfric.models.deriving.derive import as_described, level_of
    from contfric.models.deriving.visited_modes import composition_of
    from contfric.models.described.evaluate import Sampler, defaults, floats
    from contfric.models.described.regions import ordered_surfaces
    from contfric.models.entries import EntryError
    from contfric.models.language.not_affine import NotAffineError

    composition = composition_of(description.text)
    try:
        composition.check()
    except (NotAffineError, ArithmeticError) as reason:
        raise EntryError(
            ("contacts",),
            "contacts that share their loads, and more than can be listed, need affine forces, and "
            f"here is {reason}. Four friction contacts (five contacts of three states) or fewer on masses "
            "of their own may have any law",
        ) from None
    params, evaluator = defaults(description), floats(description)
    sampler = Sampler(evaluator, params)
    levels = {s.name: level_of(evaluator, s, params) for s in description.surfaces}
    surfaces = [
        replace(s, switching=s.name in composition.switching)
        for s in ordered_surfaces(description, levels)
    ]
    quiet = description.modes[0].name
    return ComposedModel(
        **as_described(description, sampler, surfaces),
        modes=(composition.mode(quiet),),
        domains=(composition.domain(quiet),),
        departures=(),
        filippov=composition.leaves_at_rest,
        phase=description.phase,
    )
