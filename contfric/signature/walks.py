"""Walks of the transition graph: which itineraries have one, and where a segment leads to."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache

from contfric.errors import NotationError
from contfric.models import Model
from contfric.models.deriving.growing_model import ComposedModel
from contfric.signature.holds import is_hold, without_holds
from contfric.signature.reduced import NEVER, ReducedItinerary, ReducedPair, fuses


def is_closed_walk(itinerary: Sequence[ReducedPair], model: Model) -> bool:
    """Return whether some closed walk through the domains of the model has this itinerary.

    Inside of a segment the walk may cross any transparent surface within its mode.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> is_closed_walk((("slide+", "v"), ("stick", "F+")), load_model("coulomb"))
    False
    """
    return _is_closed_walk(tuple(itinerary), model)


@cache
def _is_closed_walk(itinerary: ReducedItinerary, model: Model) -> bool:
    if any(is_hold(exit_) for _, exit_ in itinerary):
        try:
            itinerary = without_holds(itinerary, model)
        except NotationError:
            return False
    modes = [mode for mode, _ in itinerary]
    if len(itinerary) == 1 and itinerary[0][1] == NEVER:
        return _has_cycle(modes[0], model)
    surfaces = {surface for _, surface in itinerary}
    if not itinerary or not all(mode in model.mode_by_name for mode in modes):
        return False
    if not all(surface in model.surface_by_name for surface in surfaces):
        return False
    first = model.whole_mode(modes[0])
    for entry in (domain.name for domain in model.domains_of(first)):
        reached = {entry}
        for index, (mode, surface) in enumerate(itinerary):
            reached = entered(reached, surface, model, mode, modes[(index + 1) % len(itinerary)])
        if entry in reached:
            return True
    return False


def show(itinerary: Iterable[ReducedPair]) -> str:
    """Return an itinerary as text, such as ``slide+|v stick|F+``."""
    return " ".join(
        mode if surface == NEVER else f"{mode}|{surface}" for mode, surface in itinerary
    )


def entered(
    entries: Iterable[str], surface: str, model: Model, mode: str, next_mode: str
) -> set[str]:
    """Return the domains of the next mode that a segment can lead to from its entries."""
    if isinstance(model, ComposedModel):
        return {next_mode} if any(model.follows(d, surface, next_mode) for d in entries) else set()
    inside = _within(entries, model, mode)
    side = model.section_sides.get((mode, surface), 0)
    inside = {d for d in inside if side in (0, model.domain_by_name[d].signs.get(surface, 0))}
    targets = {t for d in inside for t in model.targets.get((d, surface), ())}
    return {t for t in targets if model.domain_by_name[t].mode == model.whole_mode(next_mode)}


def _within(entries: Iterable[str], model: Model, mode: str) -> set[str]:
    """Return all domains of a mode that can be reached from the entries without leaving it."""
    reached, steps = set(entries), _steps_within(model, mode)
    waiting = list(reached)
    while waiting:
        for target in steps.get(waiting.pop(), ()):
            if target not in reached:
                reached.add(target)
                waiting.append(target)
    return reached


@cache
def _steps_within(model: Model, mode: str) -> dict[str, list[str]]:
    """Return where each domain leads to without leaving a mode."""
    steps: dict[str, list[str]] = {}
    for start in (domain.name for domain in model.domains_of(model.whole_mode(mode))):
        for surface, target in model.exits_of(start):
            if fuses(model, mode, surface, model.domain_by_name[target].mode):
                steps.setdefault(start, []).append(target)
    return steps


def _has_cycle(mode: str, model: Model) -> bool:
    """Return whether a walk can go round within a mode without leaving it."""
    for start in (domain.name for domain in model.domains_of(mode)):
        for surface, target in model.exits_of(start):
            inside = model.domain_by_name[target].mode == mode and fuses(model, mode, surface, mode)
            if inside and start in _within({target}, model, mode):
                return True
    return False
