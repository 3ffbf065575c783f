"""Domains of a described model: every combination of sides that a mode can have."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

from contfric.models.definition import Domain, Surface
from contfric.models.described.description import Description, DomainText, ModeText
from contfric.models.described.evaluate import defaults, floats
from contfric.models.entries import EntryError

Sides = dict[str, int]


def ordered_surfaces(description: Description, levels: Mapping[str, float]) -> list[Surface]:
    """Return the surfaces, those of one observable together and from the highest level down.

    One is switching if the modes change across it: one moves on it, or each lies on one of its sides.
    """
    observables: list[str] = []
    for surface in description.surfaces:
        if surface.observable not in observables:
            observables.append(surface.observable)
    found = [
        surface
        for name in observables
        for surface in sorted(
            (s for s in description.surfaces if s.observable == name),
            key=lambda s: -levels[s.name],
        )
    ]
    known = [known_sides(mode, found) for mode in description.modes]
    for i, surface in enumerate(found):
        sides = {mode.get(surface.name) for mode in known}
        cut = surface.name not in description.resets and (0 in sides or sides == {1, -1})
        found[i] = replace(surface, switching=surface.switching or cut)
    return found


def engine_order(description: Description) -> list[Surface]:
    """Return the surfaces in the order in which the model has them, at the default parameters."""
    evaluator, params = floats(description), defaults(description)
    levels = {s.name: evaluator.value(s.level, params) for s in description.surfaces}
    return ordered_surfaces(description, levels)


def known_sides(mode: ModeText, surfaces: list[Surface]) -> Sides:
    """Return the sides that all regions of a mode share: those given, and those that follow from them."""
    regions = combinations(surfaces, mode.sides)
    return {
        s.name: regions[0][s.name]
        for s in surfaces
        if regions and len({region[s.name] for region in regions}) == 1
    }


def combinations(surfaces: list[Surface], fixed: Mapping[str, int]) -> list[Sides]:
    """Return all sides that are possible together with some that are fixed."""
    found: list[Sides] = [{}]
    groups = itertools.groupby(surfaces, key=lambda s: s.observable)
    for _, group in groups:
        names = [s.name for s in group]
        choices = [c for c in _heights(names) if all(fixed.get(n, c[n]) == c[n] for n in names)]
        # on a surface only where that is said
        choices = [c for c in choices if all(c[n] != 0 or fixed.get(n) == 0 for n in names)]
        found = [{**sides, **choice} for sides in found for choice in choices]
    return found


def is_possible(surfaces: list[Surface], sides: Mapping[str, int]) -> bool:
    """Tell whether a solution can be on all of some sides at once."""
    for _, group in itertools.groupby(surfaces, key=lambda s: s.observable):
        names = [s.name for s in group]
        if {name: sides[name] for name in names} not in _heights(names):
            return False
    return True


def _heights(names: list[str]) -> list[Sides]:
    """Return the sides from above the highest level to below the lowest one."""
    found = []
    for place in range(2 * len(names) + 1):
        found.append({n: (2 * i + 1 > place) - (2 * i + 1 < place) for i, n in enumerate(names)})
    return found


def domains_of(description: Description, surfaces: list[Surface]) -> tuple[Domain, ...]:
    """Return the domains of all modes, with the names that were given."""
    places: dict[str, set[tuple[int, ...]]] = {}
    found: list[Domain] = []
    order = [s.name for s in surfaces]
    led = {lead.mode for leads in description.leads.values() for lead in leads}
    by_mode = {mode.name: mode.sides for mode in description.modes}
    held_sides = {
        lift: by_mode[own.mode][lift] for own in description.chatters for lift, _ in own.ways
    }
    for mode in description.modes:
        regions = combinations(surfaces, {**mode.sides, **held_sides})
        if not regions:
            raise EntryError(("modes", mode.name, "in"), _impossible(mode, surfaces))
        places[mode.name] = {tuple(sides[name] for name in order) for sides in regions}
        for other, place in places.items():
            inside = place <= places[mode.name] or places[mode.name] <= place
            if other != mode.name and inside and not {mode.name, other} & led:
                sides = next(s for s in regions if tuple(s.values()) in place)
                raise EntryError(("modes", mode.name, "in"), _shared(mode, other, sides))
        known = {name for name in order if len({sides[name] for sides in regions}) == 1}
        hidden = description.phase if description.phase not in known else ""
        known |= {hidden} & {*order}
        for sides in regions:
            name = mode.name if known >= {*order} else _auto_name(mode, sides, surfaces, known)
            if sides.get(hidden) == -1:
                name += f"{',' if ':' in name else ':'}{hidden}-"
            found.append(Domain(name, mode.name, {n: sides[n] for n in order}, name))
    return _renamed(found, description.domains)


def _impossible(mode: ModeText, surfaces: list[Surface]) -> str:
    levels = ", ".join(f"{s.name} ({s.observable} = {s.level})" for s in surfaces)
    return f"mode '{mode.name}' can be nowhere: its sides contradict each other. Surfaces: {levels}"


def _shared(mode: ModeText, other: str, sides: Sides) -> str:
    where = ", ".join(f"{name} {side:+d}" for name, side in sides.items())
    return (
        f"modes '{other}' and '{mode.name}' share the region ({where}), and one of them holds nowhere else: "
        "give each a side of a surface that divides them. (Modes may overlap if each holds alone somewhere, "
        f"too: a solution stays in its mode. Else a reset has to lead to one of them: 'to: {mode.name}')"
    )


def _auto_name(mode: ModeText, sides: Sides, surfaces: list[Surface], known: set[str]) -> str:
    """Return the name of a region by the observables whose surfaces divide the mode."""
    parts = []
    for observable, group in itertools.groupby(surfaces, key=lambda s: s.observable):
        members = [s.name for s in group]
        if all(name in known for name in members):
            continue
        above = sum(sides[name] >= 0 for name in members)
        place = {0: "-", len(members): "+"}.get(above, "0" if len(members) == 2 else str(above))
        parts.append(f"{observable}{place}")
    return f"{mode.name}:{','.join(parts)}"


def _renamed(domains: list[Domain], named: tuple[DomainText, ...]) -> tuple[Domain, ...]:
    found = list(domains)
    for text in named:
        fits = [
            i
            for i, d in enumerate(domains)
            if d.mode == text.mode and all(d.signs[s] == v for s, v in text.sides.items())
        ]
        if len(fits) != 1:
            names = ", ".join(domains[i].name for i in fits) or "none"
            raise EntryError(
                ("domains", text.name),
                f"'in' of domain '{text.name}' must hold for one region of mode '{text.mode}', "
                f"it holds for: {names}",
            )
        d = domains[fits[0]]
        if found[fits[0]] is not d:
            raise EntryError(
                ("domains", text.name),
                f"'in' of domain '{text.name}' holds for the region of domain "
                f"'{found[fits[0]].name}': each region has one name",
            )
        found[fits[0]] = Domain(text.name, d.mode, d.signs, text.label or text.name)
    counts = Counter(d.name for d in found)
    twice = [name for name, count in counts.items() if count > 1]
    if twice:
        raise EntryError(("domains",), f"two domains have the name '{twice[0]}'")
    return tuple(found)
