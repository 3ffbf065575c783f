"""Events of a simulation that fall together, put into one order.

The contacts of a structure with equal parts, such as the blades of a wheel under a travelling wave, change at
the same time. Which of them comes first is rounding, and another one in each period. Where the changes
commute, they are put into the order of the surfaces; so a solution repeats its events, and those of
the second half of its period are the images of those of the first.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.models.definition import Model
from contfric.simulation.simulate import Trajectory

#: Time between two events, relative to 1 + their time, that is rounding.
_TOGETHER = 1e-12


def in_order(trajectory: Trajectory) -> Trajectory:
    """Return a trajectory whose simultaneous events are in the order of their surfaces where that may be."""
    model, times, cycles = trajectory.model, trajectory.times, trajectory.cycles
    period = model.view(model.vector(trajectory.params)).period
    apart = np.diff(times) + period * np.diff(cycles)
    together = np.abs(apart) <= _TOGETHER * (1.0 + np.abs(times[1:]))
    pairs = np.flatnonzero(together).tolist()
    if not pairs or model.autonomous or trajectory.last[3] not in model.mode_index:
        return trajectory
    modes = np.append(trajectory.modes, model.mode_index[trajectory.last[3]])
    exits = trajectory.exits.copy()
    swapped = True
    while swapped:
        swapped = False
        for k in pairs:
            if exits[k] > exits[k + 1]:
                between = _between(model, modes[k : k + 3].tolist(), exits[k : k + 2].tolist())
                if between is not None:
                    exits[k], exits[k + 1], modes[k + 1] = exits[k + 1], exits[k], between
                    swapped = True
    return replace(trajectory, modes=modes[:-1], exits=exits)


def _between(model: Model, modes: list[int], exits: list[int]) -> int | None:
    """Return the mode between two events in the other order; None if that does not lead to the same mode."""
    before, _, after = (model.modes[mode].name for mode in modes)
    first, second = (model.surfaces[surface].name for surface in exits)
    if {first, second} & {reset.surface for reset in model.resets}:
        return None
    whole, between = model.whole_mode(after), _following(model, before, second) - {before}
    found = [mode for name in between for mode in _parts(model, name, before)]
    found = [mode for mode in found if whole in _following(model, mode, first)]
    return model.mode_index[found[0]] if len(found) == 1 else None


def _parts(model: Model, mode: str, before: str) -> set[str]:
    """Return a mode, or its part on the side of the phase that the mode before is on."""
    domains = model.domains_of(model.whole_mode(before))
    sides = {d.signs.get(model.phase) for d in domains if d.own_mode == before} | {None}
    return {d.own_mode for d in model.domains_of(mode) if d.signs.get(model.phase) in sides}


def _following(model: Model, mode: str, surface: str) -> set[str]:
    """Return the modes that may follow one at a surface, whole where a section divides them."""
    return {
        model.whole_mode(model.domain_by_name[after].own_mode)
        for domain in model.domains_of(model.whole_mode(mode))
        if domain.own_mode == mode and (domain.name, surface) in model.targets
        for after in model.targets[domain.name, surface]
    }
