"""Whether solutions come to states at which a model is at fault: a few simulations tell.

States are drawn in a region that is wider than what motion visits. A fault at one of them is an error if some
simulation meets such a fault, else a warning.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from contfric.errors import ContfricError
from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic

if TYPE_CHECKING:
    from contfric.orbit.simulation import Trajectory

#: Simulations: one from the start by default, and from states that are drawn in the region.
_STARTS = 12
#: Periods (units of time without an excitation) and events of each: transients are what is asked for.
_PERIODS, _EVENTS = 100.0, 400
#: Samples of each in which it may be out of its mode, and how far beyond a surface no rounding is.
_SAMPLES, _BEYOND = 200, 1e-6
#: What is said of a fault that no simulation meets, and of one that some do, where no ranges are given.
NOT_MET = (
    ". None of {count} simulations came to such a state: if solutions never do, this is no fault, and ranges "
    "of the states say so (spread: {{{state}: [lowest, highest]}})"
)
DRAWN = (
    ". {met} of {count} simulations from starts in the spread came to such states. Where these mean nothing, "
    "give ranges (spread: {{{state}: [lowest, highest]}})"
)


def report_fault(report: ModelReport, probe: Probe, topic: Topic, message: str) -> None:
    """Report what is wrong at a sampled state: an error if simulations meet such faults, else a warning."""
    ends = _ends(probe)
    said = {"met": sum(ends), "count": len(ends), "state": probe.model.states[-1]}
    if ends and not any(ends):
        report.warn(topic, message + NOT_MET.format(**said))
    else:
        report.error(
            topic, message + (DRAWN.format(**said) if ends and not probe.model.ranges else "")
        )


@lru_cache(maxsize=1)  # the same simulations for every fault of a model
def _ends(probe: Probe) -> tuple[bool, ...]:
    """Return of each simulation whether it came to where motion cannot go on; nothing if none could start."""
    from contfric.orbit.simulation import SimulationEnd, simulate

    model, draw = probe.model, np.random.default_rng(probe.seed)
    low, high = model.region(probe.vector)
    found: list[bool] = []
    for k in range(_STARTS):
        state = None if k == 0 else draw.uniform(low, high)
        try:
            motion = simulate(
                model, dict(probe.params), state=state, periods=_PERIODS, events=_EVENTS
            )
        except ContfricError:  # beyond a wall, or in no domain
            continue
        found.append(motion.end is SimulationEnd.IMPOSSIBLE or _is_outside(probe, motion))
    return tuple(found)


def _is_outside(probe: Probe, motion: Trajectory) -> bool:
    """Tell whether a simulation leaves the region of its mode, where nothing follows."""
    model, rows = probe.model, motion.columns(_SAMPLES)
    states = np.column_stack([rows[name] for name in model.states])
    for t, y, mode in zip(rows["t"].tolist(), states, rows["mode"], strict=True):
        domains = model.domains_of(model.whole_mode(mode))
        for surface in (s.name for s in model.surfaces if s.name not in model.settled_sides):
            side = {d.signs[surface] for d in domains}
            if side in ({1}, {-1}) and probe.height(surface, t, y) * side.pop() < -_BEYOND:
                return True
    return False
