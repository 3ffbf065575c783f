"""The domains of each mode, the surfaces that bound them, and their images.

Modes of one field are one mode (:attr:`contfric.models.definition.Model.joined`). The name of a part of it
stands in words only where a segment ends on the section between two parts: it says from which side.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from contfric.models.definition import Model
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.described.regions import is_possible
from contfric.models.lazy_mapping import Made


@cache
def mode_bounds(model: Model) -> Mapping[str, tuple[str, ...]]:
    """Surfaces that bound each mode: resets, and those through which a transition changes the mode."""
    if isinstance(model, ComposedModel):
        return Made(model.bounds_of, model.composition.is_mode)
    found = _bounds(model, {d.name: d.mode for d in model.domains})
    return found | {part: found[whole] for part, whole in model.joined.items()}


@cache
def cut_bounds(model: Model) -> Mapping[str, tuple[str, ...]]:
    """Surfaces that bound each mode as it was declared, sections among them: a simulation stops there."""
    if isinstance(model, ComposedModel):
        return Made(model.cuts_of, model.composition.is_mode)
    return {mode: (*bounds, *open_ends(model, mode)) for mode, bounds in _met(model).items()}


@cache
def _met(model: Model) -> dict[str, tuple[str, ...]]:
    """Return the surfaces at which each mode as it was declared is mapped, or left for another one."""
    return _bounds(model, {d.name: d.own_mode for d in model.domains})


def open_ends(model: Model, mode: str) -> tuple[str, ...]:
    """Return surfaces that a mode lies on one side of, with nothing on the other: a solution ends there.

    Not those beyond another level of the same observable, which is met first. Chatter lies on its wall, and
    ends where the wall lets go.
    """
    if mode in model.chatter_by_mode:
        return ()
    own, found = [d for d in model.domains if d.own_mode == mode], []
    for surface in (s.name for s in model.surfaces if s.name not in _met(model)[mode]):
        sides = {d.signs[surface] for d in own}
        if surface in model.fixed_sides or len(sides) != 1 or sides == {0}:
            continue
        beyond = ({**d.signs, surface: -d.signs[surface]} for d in own)
        if any(is_possible(list(model.surfaces), signs) for signs in beyond):
            found.append(surface)
    return tuple(found)


def _bounds(model: Model, modes: dict[str, str]) -> dict[str, tuple[str, ...]]:
    bounds: dict[str, set[str]] = {mode.name: set() for mode in model.modes}
    for (name, surface), targets in model.targets.items():
        mapped = model.maps_at(model.domain_by_name[name], surface)
        if mapped or modes[targets[0]] != modes[name]:
            bounds[modes[name]].add(surface)
    for domain in model.domains:
        bounds[modes[domain.name]] |= {
            r.surface for r in model.resets if model.ends_at(domain, r.surface)
        }
    return {
        mode: tuple(s.name for s in model.surfaces if s.name in found)
        for mode, found in bounds.items()
    }


@cache
def mode_domains(model: Model, mode: str) -> tuple[str, ...]:
    """Return the domains of one mode."""
    return tuple(d.name for d in model.domains_of(model.whole_mode(mode)))


@cache
def inside_sign(model: Model, mode: str, surface: str) -> int:
    """Return the sign of (observable - level) inside a mode, 0 if the mode lies on both sides."""
    signs = {d.signs.get(surface, 0) for d in model.domains_of(model.whole_mode(mode))}
    return signs.pop() if len(signs) == 1 else 0


def ending_sides(
    model: Model, mode: str, surface: str, following: str, inside: tuple[str, ...]
) -> dict[str, int]:
    """Return the sides of surfaces where a mode is left through one into the following mode, as far as known.

    Parameters
    ----------
    inside : the domains in which the segment may end
    """
    if isinstance(model, ComposedModel):
        return model.exit_sides(mode, surface, following)
    if mode in model.chatter_by_mode:  # at rest on a wall, on whichever side of a section
        return {}
    found = {}
    for name in model.surface_by_name.keys() - model.fixed_sides.keys():
        signs = {model.domain_by_name[d].signs[name] for d in inside}
        if len(signs) == 1:
            found[name] = signs.pop()
    return found


def is_section(model: Model, mode: str, surface: str) -> bool:
    """Tell whether a segment of a mode that ends on a surface ends on a section, where nothing changes."""
    return (mode, surface) in model.sections


@cache
def exit_domains(model: Model, mode: str, surface: str, following: str) -> tuple[str, ...]:
    """Return the domains of a mode from which a surface leads into the following mode."""
    if isinstance(model, ComposedModel):
        return (mode,) if model.follows(mode, surface, following) else ()
    side = model.section_sides.get((mode, surface), 0)
    whole = model.whole_mode(mode if side else following)
    return tuple(
        name
        for name in mode_domains(model, mode)
        if side in (0, model.domain_by_name[name].signs[surface])
        and any(
            model.domain_by_name[target].mode == whole
            for target in model.targets.get((name, surface), ())
        )
    )


@cache
def mirror_mode(model: Model) -> Mapping[str, str]:
    """Image of each mode under the symmetry; that of a part of a mode is the whole image."""
    if isinstance(model, ComposedModel):
        images = model.mirror_domain
        return Made(lambda mode: model.whole_mode(images[mode]), images.__contains__)
    found = {d.mode: model.domain_by_name[model.mirror_domain[d.name]].mode for d in model.domains}
    return found | {part: found[whole] for part, whole in model.joined.items()}
