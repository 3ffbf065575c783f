"""Impacts and other resets in a signature: what stands between two domains.

``free+ -> impact@wall -> free-``
    the solution in ``free+`` meets the surface ``wall``, where its state is mapped, and goes on in
    ``free-``: from the wall, or through it.
``rest -> reset@threshold``
    the same where the state after it is somewhere else, off the surface: a firing, a tick of a clock.

It takes no time and is not a segment. It is written because the domains before and after it do not tell: both
may be the same, or joined by another surface as well. In a reduced itinerary it is the exit of the segment
before it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from contfric.models import Model
from contfric.signature.holds import is_hold, mirror_exit

_IMPACT, _RESET = "impact@", "reset@"


def impact_at(model: Model, surface: str) -> str:
    """Return the name of the reset at a surface: an impact, where the state stays on it.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> impact_at(load_model("impact"), "wall")
    'impact@wall'
    """
    return f"{_IMPACT if model.reset_by_surface[surface].stays else _RESET}{surface}"


def is_impact(name: str) -> bool:
    """Return whether a name in a signature is that of an impact or another reset."""
    return name.startswith((_IMPACT, _RESET))


def struck_surface(impact: str) -> str:
    """Return the surface that a reset is at."""
    return impact.partition("@")[2]


def stays_on(model: Model, impact: str) -> bool:
    """Return whether the state stays on the surface of a reset: an impact."""
    return model.reset_by_surface[struck_surface(impact)].stays


def is_event(name: str) -> bool:
    """Return whether a name in a signature is that of no domain: a hold or an impact."""
    return is_hold(name) or is_impact(name)


def mirror_name(name: str, images: Mapping[str, str]) -> str:
    """Return the mirror image of a name in a signature, from those of domains and surfaces."""
    if is_impact(name):
        kind, _, surface = name.partition("@")
        return f"{kind}@{images[surface]}"
    return mirror_exit(name, images)


def impact_fault(model: Model, segments: Sequence[str], index: int) -> str | None:
    """Return what is wrong with the impact at a place of a walk; None if nothing is."""
    impact = segments[index]
    surface = struck_surface(impact)
    if surface not in model.reset_by_surface or impact != impact_at(model, surface):
        valid = ", ".join(impact_at(model, s) for s in model.reset_by_surface) or "none"
        return f"model '{model.name}' has no '{impact}'; its impacts and resets are: {valid}"
    before, after = segments[index - 1], segments[(index + 1) % len(segments)]
    if before not in model.domain_by_name or after not in model.domain_by_name:
        return f"'{impact}' must stand between two domains"
    possible = model.targets.get((before, surface), ())
    if after not in possible:
        return (
            f"'{impact}' cannot lead from {before} to {after}; after it can come: "
            f"{', '.join(possible) or 'nothing'}"
        )
    return None
