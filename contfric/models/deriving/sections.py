"""Sections: surfaces that divide modes whose field is one and the same.

A model whose cycles may be smooth declares the surface of its stops (``v = 0``) with a mode on each side.
The field is the same on both: nothing happens there, and an orbit that comes to touch it does not change.
Such modes are one mode to the engine, and the surface is transparent. It only serves to find and to fix
cycles that meet no other surface (:mod:`contfric.orbit.canonical.sections`).
"""

from __future__ import annotations

import ast
import itertools
import random
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any

from contfric.errors import ModelError
from contfric.models.definition import Domain, Surface
from contfric.models.described.description import Description, ModeText
from contfric.models.described.evaluate import Sampler, defaults, floats
from contfric.models.described.regions import domains_of, engine_order, is_possible
from contfric.models.language.grammar import parse
from contfric.remember.derived import derived

#: Functions with kinks: what they are on either side of a surface only formulas tell.
_KINKED = frozenset({"abs", "sign", "where", "min", "max"})
#: States at which two expressions must agree to be the same, and places on a surface at which a field that
#: jumps there is seen to.
_POINTS, _PLACES = 8, 40
#: Rounding in an identity of expressions of moderate size, relative to 1 + the values.
_SAME = 1e-9
#: Near a surface: a smooth field changes by about as much over it, one that jumps by far more.
_NEARBY, _JUMP = 1e-9, 1e-5


def joined_modes(description: Description) -> Mapping[str, str]:
    """Return, for each mode, the first mode that is one with it: itself, most often.

    Two modes are one where their fields are the same formulas, no reset, no kink of one and no motion on a
    surface lies between them, and the surfaces that end them, and the resets that act in them, are the same.
    """
    return _joined(_Key(description))


class _Key:
    """A description that is equal to others with the same motion: titles and quantities join nothing."""

    def __init__(self, description: Description) -> None:
        self.description, self.motion = description, description.motion

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self.motion == other.motion

    def __hash__(self) -> int:
        return hash(self.motion)


@lru_cache(maxsize=64)
def _joined(key: _Key) -> dict[str, str]:
    """Return what was joined: sought once, as formulas that look different take a while to tell apart."""
    if len(key.description.modes) < 2:
        return {mode.name: mode.name for mode in key.description.modes}
    return derived("joined", key.motion, lambda: _sought(key.description))


def _sought(description: Description) -> dict[str, str]:
    first = {mode.name: mode.name for mode in description.modes}
    surfaces = engine_order(description)
    domains = domains_of(description, surfaces)
    if len({tuple(d.signs.items()) for d in domains}) < len(domains):
        # modes overlap: which of them motion is in is part of its state, none are joined but by the phase
        return {**first, **_halves(description)}
    places = {tuple(d.signs.items()): d.mode for d in domains}
    lies_on = {m.name: {s for s, side in m.sides.items() if side == 0} for m in description.modes}
    acts = description.acts.items()
    mapped = {m.name: {s for s, named in acts if m.name in named} for m in description.modes}
    fields, apart, going_on = _Fields(description), _kinks_of_resets(description), True
    while going_on:
        going_on = False
        for a, b in itertools.combinations(description.modes, 2):
            alike = lies_on[a.name] == lies_on[b.name] and mapped[a.name] == mapped[b.name]
            if first[a.name] == first[b.name] or not alike:
                continue
            both = {name for name, lead in first.items() if lead in (first[a.name], first[b.name])}
            between = _between(description, domains, places, surfaces, both, (a.name, b.name))
            if between and not between & apart and fields.agree(a, b, between):
                lead = next(name for name in first if name in both)
                first.update(dict.fromkeys(both, lead))
                going_on = True
    return first


def _halves(description: Description) -> dict[str, str]:
    """Return the modes above the phase, by those below it with the same field and sides else."""
    phase = description.phase
    found = {}
    for below in description.modes:
        if below.sides.get(phase) == -1:
            wanted = {**below.sides, phase: 1}, below.field
            found[below.name] = next(
                m.name
                for m in description.modes
                if (m.sides, m.field) == wanted and m.name == below.name[: len(m.name)]
            )
    return found


def _between(
    description: Description,
    domains: tuple[Domain, ...],
    places: Mapping[tuple[tuple[str, int], ...], str],
    surfaces: list[Surface],
    both: set[str],
    pair: tuple[str, str],
) -> set[str]:
    """Return the surfaces that divide two modes where all that is around them is one region; else none.

    Every surface that ends the region has to have it on one side: that is what a mode is.
    """
    own = [d for d in domains if d.mode in both]
    found: set[str] = set()
    for domain, surface in itertools.product(own, domains[0].signs):
        beyond = places.get(tuple({**domain.signs, surface: -domain.signs[surface]}.items()))
        on = places.get(tuple({**domain.signs, surface: 0}.items()))
        ends = surface in description.resets or on is not None
        if beyond is None and domain.signs[surface] and 0 in domain.signs.values():
            # what slides, and has no region there, leaves its surfaces
            ends = ends or is_possible(surfaces, {**domain.signs, surface: -domain.signs[surface]})
        if (ends or beyond not in (None, *both)) and len({d.signs[surface] for d in own}) > 1:
            return set()
        if {domain.mode, beyond} == set(pair):
            found.add(surface)
    return found


class _Fields:
    """The fields of modes, at some states and as formulas, each evaluated once."""

    def __init__(self, description: Description) -> None:
        self.description = description
        evaluator = floats(description)
        self.points = [
            (evaluator, params, t, y)
            for params in _parameters(description)
            for t, y in Sampler(evaluator, params).states(_POINTS)
        ]
        self.rates: dict[str, list[float]] = {}

    def of(self, mode: ModeText) -> list[float]:
        """Return the rates of all states along a mode."""
        if mode.name not in self.rates:
            self.rates[mode.name] = [
                evaluator.value(text, params, t, y)
                for evaluator, params, t, y in self.points
                for text in mode.field
            ]
        return self.rates[mode.name]

    def agree(self, a: ModeText, b: ModeText, between: set[str]) -> bool:
        """Tell whether two modes have one field, as it is on either side of what divides them."""
        if a.field == b.field and not has_kinks(self.description, a.field):
            return True
        for here, there in zip(self.of(a), self.of(b), strict=True):
            if abs(here - there) > _SAME * (1.0 + abs(here) + abs(there)):
                return False
        samplers = [Sampler(floats(self.description), p) for p in _parameters(self.description)]
        if any(_jumps(sampler, a, s) for sampler in samplers for s in between):
            return False
        return self._same_formulas(a.name, b.name)

    def _same_formulas(self, a: str, b: str) -> bool:
        """Tell whether the fields of two modes are the same formulas, resolved on their sides."""
        import sympy

        try:
            one, other = self._formulas[a], self._formulas[b]
        except ModelError:
            return False  # whoever builds the model says what is wrong, and where
        return all(
            x == y or sympy.expand(x - y) == 0
            for here, there in zip(one, other, strict=True)
            for x, y in zip(here, there, strict=True)
        )

    @cached_property
    def _formulas(self) -> dict[str, list[Any]]:
        """The fields of each mode on its pieces."""
        from contfric.models.generated.symbols import Formulas

        formulas = Formulas(self.description)
        fields, pieces = formulas.fields, len(formulas.pieces)
        return {
            mode.name: fields[k * pieces : (k + 1) * pieces]
            for k, mode in enumerate(self.description.modes)
        }


def _parameters(description: Description) -> list[dict[str, float]]:
    """Return the default parameters, and others: an equality at the defaults may be an accident."""
    draw, params = random.Random(1), defaults(description)
    moved = {name: value * (1.1 + 0.2 * draw.random()) for name, value in params.items()}
    return [params, {name: value or 0.1 + 0.1 * draw.random() for name, value in moved.items()}]


def has_kinks(description: Description, texts: Iterable[str]) -> bool:
    """Tell whether expressions use functions with kinks, in their named parts too."""
    parts, waiting, seen = description.names.parts, list(texts), set()
    while waiting:
        for node in ast.walk(parse(waiting.pop())):
            name = node.id if isinstance(node, ast.Name) else ""
            if name in _KINKED:
                return True
            if name in parts and name not in seen:
                seen.add(name)
                waiting.append(parts[name])
    return False


def _kinks_of_resets(description: Description) -> set[str]:
    """Return the surfaces at which the image of a reset jumps or has a kink: modes at their sides differ."""
    texts = [text for images in description.resets.values() for text in images.values()]
    if not has_kinks(description, texts):
        return set()
    from contfric.models.generated.symbols import Formulas
    from contfric.models.language.formulas import branches_of, kinks_in, vanishes

    formulas = Formulas(description)
    images = [value for image in formulas.resets() for value in image]
    found = {k for value in images for k in kinks_in(value, formulas.moving)}
    kinks = {part for kink in found for part in branches_of(kink)}
    return {
        name
        for name, height in formulas.heights().items()
        if any(vanishes(kink - height) or vanishes(kink + height) for kink in kinks)
    }


def _jumps(sampler: Sampler, mode: ModeText, surface: str) -> bool:
    """Tell whether the field of a mode is seen to jump where its formulas cross a surface."""
    evaluator, params = sampler.evaluator, sampler.params
    for t, y in sampler.states(_PLACES):
        place = sampler.landed(surface, t, y)
        if place is None:
            continue
        slope = sampler.gradient(surface, *place)
        size = max(map(abs, slope)) or 1.0
        sides = [
            [
                c + side * _NEARBY * g / size
                for c, g in zip((place[0], *place[1]), slope, strict=True)
            ]
            for side in (1.0, -1.0)
        ]
        up, down = (evaluator.field(mode.name, params, at[0], at[1:]) for at in sides)
        if any(abs(u - d) > _JUMP * (1.0 + abs(u)) for u, d in zip(up, down, strict=True)):
            return True
    return False


def join_domains(domains: tuple[Domain, ...], first: Mapping[str, str]) -> tuple[Domain, ...]:
    """Return the domains with the modes that are one; what was declared stays known."""
    joined = {lead for name, lead in first.items() if name != lead}
    return tuple(
        replace(d, mode=first[d.mode], declared=d.mode) if first[d.mode] in joined else d
        for d in domains
    )


def clear_surfaces(surfaces: list[Surface], domains: tuple[Domain, ...]) -> list[Surface]:
    """Return the surfaces; where all that meets one goes on in its own mode, it is not switching any more."""
    place: dict[tuple[tuple[str, int], ...], list[Domain]] = {}
    for domain in domains:
        place.setdefault(tuple(domain.signs.items()), []).append(domain)
    found = []
    for surface in surfaces:
        pairs = [(d, _behind(d, place.get(_beyond(d, surface.name), []))) for d in domains]
        crossed = any(
            e is not None and d.declared != e.declared and d.mode == e.mode for d, e in pairs
        )
        divides = any(e is not None and d.mode != e.mode for d, e in pairs)
        rested = any(d.signs[surface.name] == 0 for d in domains)
        clear = crossed and not divides and not rested
        found.append(replace(surface, switching=False) if clear else surface)
    return found


def _behind(domain: Domain, there: list[Domain]) -> Domain | None:
    """Return the domain that motion goes on in: of modes that overlap, its own."""
    return next((d for d in there if d.mode == domain.mode), there[-1] if there else None)


def _beyond(domain: Domain, surface: str) -> tuple[tuple[str, int], ...]:
    return tuple({**domain.signs, surface: -domain.signs[surface]}.items())
