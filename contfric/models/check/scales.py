"""States whose sizes and times are far apart, or far from 1."""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np

from contfric.models.check.probe import Probe
from contfric.models.check.report import ModelReport, Topic
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.entries import EntryError
from contfric.models.reading.describe import read_plain
from contfric.models.shorthand.clocks import is_clock
from contfric.models.shorthand.structure_units import natural_units

#: Sizes of states, or times in which they change, that are this far apart: Newton's method and distances in
#: a diagram weigh all states alike.
_APART = 1e6
#: States, or times, this far from 1 ask for units: what is short or near is decided at a thousandth of 1.
_FAR = 50.0
#: States that are asked for their times.
_STATES = 40
#: An excitation that moves states by less moves none: it multiplies them, and they are at 0.
_NO_FORCE = 1e-12
#: Phases of an excitation at which its force is looked at.
_PHASES = 16


def check_scales(report: ModelReport, probe: Probe) -> None:
    """Check that states are of sizes, and change in times, that are not too far apart."""
    model = probe.model
    widths = np.abs(model.spread(model.mapping(probe.vector)))
    sizes = dict(zip(model.states, widths.tolist(), strict=True))
    report.count(Topic.SCALES)
    apart = _apart(report, sizes, "sizes ('spread')", "give it a unit in which it is of order 1")
    rates = [
        np.abs(probe.field(mode.name, *place))
        for mode in model.modes
        for place in probe.places(mode.name, _STATES)
    ]
    if not rates and not isinstance(model, ComposedModel):
        return
    report.count(Topic.SCALES)
    fastest = np.max(rates, axis=0) if rates else np.zeros(len(widths))
    times = {
        state: float(width / rate)
        for state, width, rate in zip(model.states, widths, fastest, strict=True)
        if rate > 0.0 and width > 0.0
    }
    if not apart:  # else these differ for that reason
        what = "times of change ('spread' over the largest rate)"
        _apart(report, times, what, "give their sizes in 'spread'")
    typical = min(times.values(), key=lambda v: abs(math.log(v)), default=1.0)
    _propose_units(report, probe, sizes, typical)


def _propose_units(
    report: ModelReport, probe: Probe, sizes: dict[str, float], typical: float
) -> None:
    """Say which units make states and times numbers of order 1, where they are far from it."""
    model, sizes = probe.model, dict(sizes)
    shift = probe.period / math.tau if probe.period else typical
    if "clock" in sizes:  # the time since the last tick: half a period is its spread
        shift = sizes["clock"] / math.pi
    for state, size in forced_sizes(probe).items():
        if sizes.get(state) == 1.0 and size > _NO_FORCE:  # nobody has said how large it is
            sizes[state] = size
    angles = {n[:-1] for n in model.reset_by_surface if n[:-1] in sizes}
    wanted = {n: v for n, v in sizes.items() if not is_clock(n) and n not in angles} | {"t": shift}
    # small states next to large ones are small by their nature: the high modes of a beam, bristles
    largest = max((n for n in wanted if n != "t"), key=wanted.__getitem__)
    far = {n: wanted[n] for n in (largest, "t") if not 1.0 / _FAR < wanted[n] < _FAR}
    if not far or not all(v > 0.0 for v in far.values()):
        return
    given = dict(model.units)
    if isinstance(
        model, ComposedModel
    ):  # velocities and stretches follow from the one unit of length
        names = model.composition.structure.coordinates
        wanted = dict.fromkeys(names, max(wanted[q] for q in names)) | {"t": wanted["t"]}
    units = {n: 1.0 for n, v in wanted.items() if v > 0.0} | given
    line = ", ".join(
        f"{n}: {_rounded(v * units[n])}"
        for n, v in wanted.items()
        if n in units and (n in given or v * units[n] < 0.1 or v * units[n] > 10.0)
    )
    named = ", ".join(f"{n} {v:.0e}" for n, v in far.items())
    report.warn(
        Topic.SCALES,
        f"states or times are far from 1 ({named}): orbits are told apart, and short segments from none, at "
        f"thousandths of 1, so that events may be missed. Say 'units: auto', or which. "
        f"Write units: {{{line}}}",
    )


def _rounded(value: float) -> str:
    """Return a number with one digit as YAML reads it.

    Examples
    --------
    >>> _rounded(0.000312), _rounded(27.0)
    ('3.0e-04', '30.0')
    """
    text = f"{value:.0e}"
    return f"{float(text):.1f}" if 0.1 <= value < 1e4 else text.replace("e", ".0e")


def forced_sizes(probe: Probe) -> dict[str, float]:
    """Return how far an excitation alone moves each state of the first mode that does not slide."""
    model, n = probe.model, len(probe.model.states)
    if isinstance(
        model, ComposedModel
    ):  # its mode, before others are visited, is the one that sticks
        with suppress(EntryError):
            found = natural_units(model.composition.structure, read_plain)
            return {state: found[state] for state in model.states if state in found}
        return {}
    moving = [mode.name for mode in model.modes if not mode.sliding]
    if not probe.period or not moving:
        return {}
    from scipy.linalg import matrix_balance

    rest = np.zeros(n)
    fields = [probe.field(moving[0], k * probe.period / _PHASES, rest) for k in range(_PHASES)]
    columns = [probe.field(moving[0], 0.0, e) for e in np.eye(n)]
    if not np.all(np.isfinite([*fields, *columns])):
        return {}
    force = np.max(np.abs(np.array(fields) - np.mean(fields, axis=0)), axis=0)
    system = 1j * math.tau / probe.period * np.eye(n) - (np.array(columns) - fields[0]).T
    balanced, _ = matrix_balance(system, permute=False)  # whatever the units are
    if not np.linalg.cond(balanced) < 1e12:
        return {}
    return dict(zip(model.states, np.abs(np.linalg.solve(system, force)).tolist(), strict=True))


def _apart(report: ModelReport, values: dict[str, float], what: str, advice: str) -> bool:
    """Note the smallest and the largest of some values where they are far apart; return whether they are."""
    known = {name: v for name, v in values.items() if 0.0 < v < math.inf}
    if not known:
        return False
    small, large = min(known, key=known.__getitem__), max(known, key=known.__getitem__)
    apart = known[large] > _APART * known[small]
    if apart:
        report.note(
            Topic.SCALES,
            f"{what} of '{small}' ({known[small]:.1g}) and '{large}' ({known[large]:.1g}) are far apart: "
            f"{advice}",
        )
    return apart
