"""Orbits that go on inside of one mode, where they meet no surface of the model.

Without excitation such an orbit has no joint. Where a branch ends as it leaves the last surface that it met,
the orbit lies in one mode, and the rate of a state in that mode is a section of what follows
(:func:`contfric.models.deriving.phases.with_phase`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from contfric.atlas.diagram import LooseEnd
from contfric.bvp.system import build_system
from contfric.orbit.orbit import Orbit

#: Share of a period below which a segment has vanished at an event: they are located to rounding or its root.
_VANISHED = 1e-6
#: A reset that moves a state by less than this (relative to 1 + its size) is that of a wall that is touched.
_TOUCHED = 1e-6


def with_section(orbit: Orbit, loose: Sequence[LooseEnd]) -> Orbit | None:
    """Return an orbit in a model with a section where a loose end goes on in one mode; None if none does."""
    from contfric.models.deriving.phases import with_phase

    model = orbit.model
    if not model.autonomous or model.phase:
        return None
    for mode in dict.fromkeys(_modes_of(loose)):
        divided = with_phase(model, mode)
        if divided is not None:
            own = orbit.system
            system = build_system(divided, own.itinerary, orbit.periods, half=own.half)
            return replace(orbit, system=system)
    return None


def _modes_of(loose: Sequence[LooseEnd]) -> Iterator[str]:
    """Yield the modes in which orbits at loose ends lie with all of their length."""
    for bifurcation in (item.end.bifurcation for item in loose):
        if bifurcation is None:
            continue
        at = bifurcation.orbit.as_whole()
        long = at.durations > _VANISHED * at.period
        modes = {pair[0] for pair, lasts in zip(at.itinerary, long, strict=True) if lasts}
        moved, size = np.abs(at.begins[:, 1:] - at.cycle[:, 1:]), 1.0 + np.abs(at.cycle[:, 1:])
        if len(modes) == 1 and not np.any(moved > _TOUCHED * size):
            yield next(iter(modes))
