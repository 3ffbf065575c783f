"""Checks by simulation whether every mode is reached, and whether the model fails at states on the way.

States are drawn in a region that is wider than what motion visits. A fault at one of them is an error if some
simulation meets such a fault, else a warning.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from contfric.errors import ContfricError
from contfric.models.check.probe import FEW_MODES, Probe
from contfric.models.check.report import ModelReport, Topic

if TYPE_CHECKING:
    from contfric.simulation.simulate import Trajectory

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


def check_reached(report: ModelReport, probe: Probe) -> None:
    """Check that motion can come into every mode from another one, and say where no simulation does."""
    model = probe.model
    typed = {d.name: model.domain_by_name[model.shown(d.name)].own_mode for d in model.domains}
    modes = dict.fromkeys(typed.values())
    if len(modes) == 1:
        return
    # what is wrong is said: then simulations tell nothing
    unvisited = _unvisited(probe) if report.ok else set()
    for mode in modes:
        report.count(Topic.REACHED)
        entered = any(
            typed[source] != mode and any(typed[target] == mode for target in targets)
            for (source, _), targets in model.targets.items()
        )
        if not entered:
            report.warn(
                Topic.REACHED,
                f"nothing leads into mode '{mode}' from another one: a solution is in it only if it starts "
                "there. Correct the sides of the modes, or lead a reset to it ('to: ...')",
            )
        elif mode in unvisited:
            report.note(
                Topic.REACHED,
                f"none of {len(_motions(probe))} simulations came into mode '{mode}' at these parameters. If "
                "some should, correct its sides, or the surface or reset that leads to it",
            )


def check_resets_met(report: ModelReport, probe: Probe) -> None:
    """Say at which resets no simulation arrives; where an angle begins again nobody wrote one."""
    resets = {r.surface for r in probe.model.resets if not r.wraps}
    motions = _motions(probe) if resets and report.ok else ()
    if not motions:
        return
    names = [surface.name for surface in probe.model.surfaces]
    met = {names[k] for motion in motions for k in np.unique(motion.exits)}
    for surface in (name for name in names if name in resets - met):
        report.note(
            Topic.RESETS,
            f"none of {len(motions)} simulations came to the reset at '{surface}' at these parameters. If "
            "some should, correct its surface, or the modes that lie next to it",
        )


def _unvisited(probe: Probe) -> set[str]:
    """Return the modes that no simulation comes into.

    None of many, which are combinations of contacts, and none that is derived: nobody meant it to be visited.
    """
    model = probe.model
    motions = _motions(probe) if len(model.modes) <= FEW_MODES else ()
    if not motions:
        return set()
    visited = {m.last[3] for m in motions if m.last[3] and len(m.modes)}
    visited |= {model.modes[k].name for motion in motions for k in np.unique(motion.modes[1:])}
    joined = {model.whole_mode(name) for name in visited}
    unvisited = (m for m in model.modes if model.whole_mode(m.name) not in joined)
    return {m.name for m in unvisited if not m.derived}


@lru_cache(maxsize=1)  # the same simulations for every fault of a model
def _ends(probe: Probe) -> tuple[bool, ...]:
    """Return of each simulation whether it came to where motion cannot go on; nothing if none could start."""
    from contfric.simulation.simulate import SimulationEnd

    return tuple(
        motion.end is SimulationEnd.IMPOSSIBLE or _is_outside(probe, motion)
        for motion in _motions(probe)
    )


@lru_cache(maxsize=1)
def _motions(probe: Probe) -> tuple[Trajectory, ...]:
    """Return simulations from the start by default, and from states that are drawn."""
    from contfric.simulation.simulate import simulate

    model, draw = probe.model, np.random.default_rng(probe.seed)
    low, high = model.region(probe.vector)
    found: list[Trajectory] = []
    for k in range(_STARTS):
        state = None if k == 0 else draw.uniform(low, high)
        try:
            motion = simulate(
                model, dict(probe.params), state=state, periods=_PERIODS, events=_EVENTS
            )
        except ContfricError:  # beyond a wall, or in no domain
            continue
        found.append(motion)
    return tuple(found)


def _is_outside(probe: Probe, motion: Trajectory) -> bool:
    """Tell whether a simulation leaves the region of its mode, where nothing follows."""
    model, rows = probe.model, motion.columns(_SAMPLES)
    states = np.column_stack([rows[name] for name in model.states])
    for t, y, mode in zip(rows["t"].tolist(), states, rows["mode"], strict=True):
        domains = model.domains_of(model.whole_mode(mode))
        for surface in (s.name for s in model.surfaces if s.name not in model.fixed_sides):
            side = {d.signs.get(surface, 0) for d in domains}
            if side in ({1}, {-1}) and probe.height(surface, t, y) * side.pop() < -_BEYOND:
                return True
    return False
