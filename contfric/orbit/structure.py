"""What a model's definition says of its modes: their domains, the surfaces that bound them, their images."""

from __future__ import annotations

from functools import cache

from contfric.models.definition import Model


@cache
def mode_bounds(model: Model) -> dict[str, tuple[str, ...]]:
    """Surfaces that bound each mode: resets, and those through which a transition changes the mode."""
    bounds: dict[str, set[str]] = {mode.name: set() for mode in model.modes}
    for (name, surface), targets in model.targets.items():
        mode = model.domain_by_name[name].mode
        if surface in model.reset_by_surface or model.domain_by_name[targets[0]].mode != mode:
            bounds[mode].add(surface)
    return {
        mode: tuple(s.name for s in model.surfaces if s.name in found)
        for mode, found in bounds.items()
    }


def mode_domains(model: Model, mode: str) -> list[str]:
    """Return the domains of one mode."""
    return [d.name for d in model.domains if d.mode == mode]


def inside_sign(model: Model, mode: str, surface: str) -> int:
    """Return the sign of (observable - level) inside a mode, 0 if the mode lies on both sides."""
    signs = {model.domain_by_name[d].signs[surface] for d in mode_domains(model, mode)}
    return signs.pop() if len(signs) == 1 else 0


def exit_domains(model: Model, mode: str, surface: str, following: str) -> list[str]:
    """Return the domains of a mode from which a surface leads into the following mode."""
    return [
        name
        for name in mode_domains(model, mode)
        if any(
            model.domain_by_name[target].mode == following
            for target in model.targets.get((name, surface), ())
        )
    ]


@cache
def mirror_mode(model: Model) -> dict[str, str]:
    """Image of each mode under the symmetry."""
    return {d.mode: model.domain_by_name[model.mirror_domain[d.name]].mode for d in model.domains}
