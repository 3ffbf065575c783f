"""How each segment of an itinerary begins: after a reset, on its own exit surface, or as any other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contfric.bvp.holds import Hold
from contfric.models.definition import Model
from contfric.models.mode_domains import mirror_mode, mode_domains
from contfric.signature.holds import is_hold, left_surface, mirror_exit

Itinerary = tuple[tuple[str, str], ...]


def joints_before(model: Model, itinerary: Itinerary, half: bool) -> Itinerary:
    """Return the mode before each segment of a turn, and the surface through which it is entered."""
    last = mode, surface = itinerary[-1]
    if half and model.symmetry is not None:
        inverse = {image: name for name, image in model.symmetry.surfaces.items()}
        last = mirror_mode(model)[mode], mirror_exit(surface, inverse)
    return last, *itinerary[:-1]


def beginnings(
    model: Model,
    itinerary: Itinerary,
    exits: list[str],
    joints: Itinerary,
    held: dict[int, Hold],
) -> dict[str, NDArray[np.int64]]:
    """How holds are left and segments begin: ``departs``, ``resets`` and ``returns`` of a layout."""
    modes, before, entered = (
        [m for m, _ in itinerary],
        [m for m, _ in joints],
        [s for _, s in joints],
    )
    departs, resets, returns = (np.full(len(itinerary), empty) for empty in (-1, -1, 0))
    for i, row in enumerate(zip(modes, before, exits, entered, strict=True)):
        if i in held:
            departs[i] = model.mode_index[held[i].departs if held[i].until is None else modes[i]]
            continue
        returns[i] = _returns(model, *row)
        if model.reset_at(row[1], row[3]) is not None:
            resets[i] = model.surface_index[row[3]]
    if np.all(
        returns
    ):  # each exit only said to be as high as the one before: one has to say how high
        returns[-1] = 0
    for i, mode in enumerate(before):
        if mode in model.chatter_by_mode and i not in held:
            returns[i] |= 2
    return {"departs": departs, "resets": resets, "returns": returns}


def _returns(model: Model, mode: str, before: str, exit_: str, entered: str) -> int:
    """Tell whether a segment begins on the surface that it ends on: it came there, or rested on it."""
    if is_hold(entered):  # it may end as another contact changes
        return int(exit_ == left_surface(model, before, mode))
    if model.mode_by_name[mode].sliding:
        return 0
    rest = model.rests_on(exit_)
    reset = model.reset_at(before, entered)
    if rest and not model.filippov:  # rest is left, and a stop reversed, with an acceleration
        return 0
    if reset is not None and exit_ in reset.lands:
        return 1
    if reset is not None and (exit_ == entered or model.changed_by(reset, exit_)):
        return 0  # thrown off the surface that it rested on
    rested = model.domain_by_name[mode_domains(model, before)[0]].signs.get(exit_) == 0
    return int(exit_ == entered or rested)


def entry_rows(
    model: Model, itinerary: Itinerary, joints: Itinerary, domains: tuple[str, ...]
) -> list[tuple[int, ...]]:
    """Rows of the entry margins: surfaces that a reset may lead across, and that bound the mode after it."""
    rows: list[tuple[int, ...]] = []
    for i, (before, surface) in enumerate(joints):
        reset = model.reset_at(before, surface)
        if reset is None or itinerary[i][0] in model.chatter_by_mode:
            continue  # what holds at rest on a wall need not hold before the impacts have come to rest
        led = {
            target
            for (_, met), found in model.targets.items()
            if met == surface
            for target in found
        }
        landed = [d for d in mode_domains(model, itinerary[i][0]) if d in led]
        for k, other in enumerate(model.surfaces):
            signs = {
                model.domain_by_name[d].signs[other.name] for d in (domains[i : i + 1] or landed)
            }
            free = model.changed_by(reset, other.name) and other.name not in reset.lands
            free = free and other.name not in model.wraps
            free = free and other.name not in model.fixed_sides
            if free and len(signs) == 1:
                rows.append((i, k, signs.pop(), 1))
    return rows
