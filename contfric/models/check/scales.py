"""Modes that nothing leads into, and states whose sizes and times are far apart."""

from __future__ import annotations

import math

import numpy as np

from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic

#: Sizes of states, or times in which they change, that are this far apart: Newton's method and distances in
#: a diagram weigh all states alike.
_APART = 1e6
#: States that are asked for their times.
_STATES = 40


def check_reached(report: ModelReport, probe: Probe) -> None:
    """Check that motion can come into every mode from another one."""
    model = probe.model
    if len(model.modes) == 1:
        return
    for mode in model.modes:
        report.count(Topic.REACHED)
        entered = any(
            model.domain_by_name[source].own_mode != mode.name
            and any(model.domain_by_name[target].own_mode == mode.name for target in targets)
            for (source, _), targets in model.targets.items()
        )
        if not entered:
            report.warn(
                Topic.REACHED,
                f"nothing leads into mode '{mode.name}' from another one: motion is in it only if it starts "
                "there. Correct the sides of the modes, or lead a reset to it ('to: ...')",
            )


def check_scales(report: ModelReport, probe: Probe) -> None:
    """Check that states are of sizes, and change in times, that are not too far apart."""
    model = probe.model
    widths = np.abs(model.spread(model.mapping(probe.vector)))
    sizes = dict(zip(model.states, widths.tolist(), strict=True))
    report.count(Topic.SCALES)
    _apart(report, sizes, "sizes ('spread')", "give it a unit in which it is of order 1")
    rates = [
        np.abs(probe.field(mode.name, *place))
        for mode in model.modes
        for t, y in probe.states(_STATES)
        if (place := probe.inside(mode.name, t, y)) is not None
    ]
    if not rates:
        return
    report.count(Topic.SCALES)
    fastest = np.max(rates, axis=0)
    times = {
        state: float(width / rate)
        for state, width, rate in zip(model.states, widths, fastest, strict=True)
        if rate > 0.0 and width > 0.0
    }
    typical = math.exp(float(np.mean([math.log(v) for v in times.values()]))) if times else 1.0
    if not 1.0 / _APART < typical < _APART:
        report.note(
            Topic.SCALES,
            f"states change in times of about {typical:.1g}: measure time in units of that",
        )


def _apart(report: ModelReport, values: dict[str, float], what: str, advice: str) -> None:
    known = {name: v for name, v in values.items() if 0.0 < v < math.inf}
    if not known:
        return
    small, large = min(known, key=known.__getitem__), max(known, key=known.__getitem__)
    if known[large] > _APART * known[small]:
        report.note(
            Topic.SCALES,
            f"{what} of '{small}' ({known[small]:.1g}) and '{large}' ({known[large]:.1g}) are far apart: "
            f"{advice}",
        )
