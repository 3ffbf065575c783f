"""Jumps and poles of fields and observables where no surface marks them.

A field that jumps (a sawtooth written as ``atan(tan(t))``, a condition on time) is integrated across the jump
as if there were none: orbits are wrong, or called aperiodic. Fields and observables are followed along time
and along each state, as far as the mode goes; where they change most over one sample the interval is halved.
What does not shrink with it is a jump. So are maps of resets, between states that meet their surface.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from itertools import pairwise

import numpy as np

from contfric.base.arrays import FloatArray, with_entries
from contfric.models.check.probe import ON, Probe
from contfric.models.check.report import ModelReport, Topic
from contfric.models.check.structure import arrivals
from contfric.models.definition import Domain
from contfric.models.parts import Reset

#: States that are tried, those of each mode from which lines are followed, and samples of a line.
_TRIED, _STATES, _SAMPLES = 100, 2, 160
#: Intervals of a line that are looked into: those of the largest changes.
_INTERVALS = 3
#: Change (relative to the values) that is looked into, and what is left of it at a jump: steep functions of
#: slope 1e8 and more count as jumps, which arithmetic could not tell from them.
_LOOKED_INTO, _LEFT = 1e-4, 1e-6
#: Halvings: to the resolution of the arithmetic.
_HALVINGS = 52

#: This share of a line next to a jump is on one side of it, and near it.
_ASIDE = 1e-9
#: A line in a mode: its point (t, y) at a place.
Line = Callable[[float], tuple[float, FloatArray]]
Sides = frozenset[tuple[str, int]]


def check_continuity(report: ModelReport, probe: Probe) -> None:
    """Check that no field and no observable jumps inside of a mode."""
    pole = _without_values(report, probe)
    gentle = _gentle_modes(probe)
    for mode in probe.model.modes:
        for name, line, low, high in lines_in(probe, mode.name):
            report.count(Topic.CONTINUITY)
            if mode.name in gentle:
                continue
            found = jump_along(partial(_values_on, probe, mode.name, line), low, high)
            if found is None:
                continue
            k, at, by = found
            what = _names(probe)[k]
            t, y = line(at)
            where = ", ".join(f"{s} = {v:.6g}" for s, v in zip(probe.model.states, y, strict=True))
            where = f"along {name}, at t = {t:.9g}, {where}"
            if name != "t" and not math.isfinite(by):  # motion that comes there ends, and says so
                if not pole:
                    report.warn(
                        Topic.CONTINUITY,
                        f"{what} in mode '{mode.name}' has a pole {where}: a solution that comes there "
                        "cannot be followed. If none does, this is no fault",
                    )
                pole = True
                continue
            report.error(
                Topic.CONTINUITY,
                f"{what} in mode '{mode.name}' jumps by {by:.3g} {where}: it is integrated as if it were "
                "smooth. Make the place a surface, with a mode on each side (of time: an observable such "
                "as sin(2*pi*t/T) that changes its sign there)",
            )
            return


def _gentle_modes(probe: Probe) -> set[str]:
    """Return the modes in which nothing jumps, by their formulas: no place of these has to be tried."""
    formulas = probe.formulas
    if formulas is None:
        return set()
    from contfric.models.language.formulas import is_gentle

    if not all(is_gentle(value, formulas.moving) for value in formulas.observables()):
        return set()
    # modes of a structure differ in few of their rates
    gentle = cache(lambda rate: is_gentle(formulas.read(("modes",), rate), formulas.moving))
    return {m.name for m in formulas.description.modes if all(map(gentle, m.field))}


def check_jumps_through(report: ModelReport, probe: Probe) -> None:
    """Check that no observable jumps through the level of its surface: such a crossing is not located."""
    for surface in _may_jump(probe):
        for t, y in probe.states(_STATES):
            lines = (partial(_at_state, t, y, k) for k in range(len(y)))
            ends = zip(*probe.model.region(probe.vector, 2.0), strict=True)
            for name, line, (low, high) in zip(probe.model.states, lines, ends, strict=True):
                report.count(Topic.CONTINUITY)
                found = jump_along(partial(_height_on, probe, surface, line), low, high)
                if found is None or not math.isfinite(found[2]):
                    continue
                step = _ASIDE * (high - low)
                sides = [probe.height(surface, *line(found[1] + s * step)) for s in (-1.0, 1.0)]
                if sides[0] * sides[1] < 0.0:
                    report.error(
                        Topic.CONTINUITY,
                        f"the observable of '{surface}' jumps by {found[2]:.3g} through its level along "
                        f"{name}, at {probe.shown(*line(found[1]))}: no solution is ever on that surface. "
                        "Use an observable that is continuous and vanishes there",
                    )
                    return


def _may_jump(probe: Probe) -> list[str]:
    """Return the surfaces whose observables are not made of continuous functions."""
    formulas = probe.formulas
    if formulas is None:
        return [s.name for s in probe.model.surfaces]
    from contfric.models.language.formulas import cannot_jump

    return [name for name, h in formulas.heights().items() if not cannot_jump(h, formulas.moving)]


def _height_on(probe: Probe, surface: str, line: Line, place: float) -> FloatArray:
    """Return (observable - level) of a surface at a place of a line, whatever mode holds there."""
    return np.array([probe.height(surface, *line(place))])


def check_kinks_in_time(report: ModelReport, probe: Probe) -> None:
    """Warn of observables of surfaces that have a kink in time within a mode: rates locate crossings."""
    names = list(dict.fromkeys(s.observable for s in probe.model.surfaces))
    if probe.period == 0.0:
        return
    smooth = _is_smooth_in_time(probe, names)
    for mode in probe.model.modes:
        for name, line, low, high in lines_in(probe, mode.name):
            if name != "t":
                continue
            report.count(Topic.CONTINUITY)
            if smooth:
                continue
            found = jump_along(partial(_rates_on, probe, mode.name, names, line), low, high)
            if found is not None:
                report.warn(
                    Topic.CONTINUITY,
                    f"the rate of the observable '{names[found[0]]}' in mode '{mode.name}' jumps at "
                    f"t = {found[1]:.9g}: crossings near such a kink are missed, or found where none is. "
                    "Make the place a surface, with a mode on each side",
                )
                return


def _is_smooth_in_time(probe: Probe, names: list[str]) -> bool:
    """Tell whether formulas say that some observables have no kinks in time."""
    formulas = probe.formulas
    if formulas is None:
        return False
    from contfric.models.language.formulas import is_smooth

    pairs = zip(formulas.description.observables, formulas.observables(), strict=True)
    return all(is_smooth(value, (formulas.t,)) for o, value in pairs if o.name in names)


def _rates_on(
    probe: Probe, mode: str, names: list[str], line: Line, place: float
) -> FloatArray | None:
    """Return the rates of observables by time alone at a place of a line; None outside of the mode."""
    t, y = line(place)
    if not probe.is_in(mode, probe.signs(t, y)):
        return None
    return np.array([probe.flow.gradient(name, t, y)[0] for name in names])


def _without_values(report: ModelReport, probe: Probe) -> bool:
    """Say in which mode a formula has no value at some states (a root of a negative level), if in any."""
    for mode in probe.model.modes:
        tried = (probe.in_region(mode.name, t, y) for t, y in probe.states(_TRIED))
        places = [place for place in tried if place is not None]
        without = [place for place in places if not probe.is_defined(mode.name, *place)]
        if not without:
            continue
        _, y = without[0]
        where = ", ".join(f"{s} = {v:.6g}" for s, v in zip(probe.model.states, y, strict=True))
        text = f"the formulas of mode '{mode.name}' have no value at {where}"
        if len(without) == len(places):
            report.error(Topic.CONTINUITY, f"{text}, nor at any other state that was tried")
        else:
            report.warn(
                Topic.CONTINUITY,
                f"{text} (one of {len(without)} such among {len(places)}): a solution that comes there "
                "cannot be followed. If none does, this is no fault",
            )
        return True
    return False


def lines_in(probe: Probe, mode: str) -> Iterator[tuple[str, Line, float, float]]:
    """Yield (what changes, line, first place, last place) through a few states of a mode."""
    low, high = probe.model.region(probe.vector, 2.0)
    for time, state in probe.places(mode, _TRIED, probe.share(_STATES)):
        if probe.period > 0.0:
            yield "t", partial(_at_time, state), time, time + probe.period
        for k, name in enumerate(probe.model.states):
            yield name, partial(_at_state, time, state, k), low[k], high[k]


def _at_time(y: FloatArray, time: float) -> tuple[float, FloatArray]:
    return time, y


def _at_state(t: float, y: FloatArray, k: int, value: float) -> tuple[float, FloatArray]:
    return t, with_entries(y, k, value)


def check_reset_jumps(report: ModelReport, probe: Probe) -> None:
    """Check that no reset jumps between states that meet its surface in one mode."""
    continuous = _continuous_resets(probe)
    for reset in probe.model.resets:
        known: dict[Sides, tuple[float, FloatArray]] = {}
        for domain, t, y in arrivals(probe, reset):
            side = (
                reset.surface,
                domain.signs[reset.surface],
            )  # motion comes from it: the rate has its sign
            here = known.setdefault(_real_sides(probe, reset, domain.signs) | {side}, (t, y))
            if here[1] is y:
                continue
            report.count(Topic.CONTINUITY)
            if reset.surface in continuous:
                continue
            found = jump_along(partial(_behind, probe, reset, domain, here, (t, y)), 0.0, 1.0)
            if found is None:
                continue
            state = probe.model.states[found[0]]
            report.error(
                Topic.CONTINUITY,
                f"'{state}' after the reset at '{reset.surface}' jumps by {found[2]:.3g} between states "
                f"that meet it in mode '{domain.own_mode}': a branch would end where an orbit comes there. "
                "A reset has to be continuous within a mode; only modes may jump",
            )
            return


def _continuous_resets(probe: Probe) -> set[str]:
    """Return the surfaces whose resets are made of continuous functions: nothing has to be tried there."""
    formulas = probe.formulas
    if formulas is None:
        return set()
    from contfric.models.language.formulas import cannot_jump

    return {
        surface.name
        for surface, image in zip(formulas.description.surfaces, formulas.resets(), strict=True)
        if all(cannot_jump(value, formulas.moving) for value in image)
    }


def _behind(
    probe: Probe,
    reset: Reset,
    domain: Domain,
    a: tuple[float, FloatArray],
    b: tuple[float, FloatArray],
    share: float,
) -> FloatArray | None:
    """Return the state after a reset from between two states; None where that is in another domain."""
    t, y = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
    if not domain.signs[reset.surface] * probe.rate(domain.own_mode, reset.surface, t, y) < 0.0:
        return None
    if _real_sides(probe, reset, probe.signs(t, y)) != _real_sides(probe, reset, domain.signs):
        return None
    return probe.reset(reset.surface, t, y).copy()


def _real_sides(probe: Probe, reset: Reset, signs: Mapping[str, int]) -> Sides:
    """Return on which sides of surfaces a state is; those at which nothing changes apart."""
    left_out = {reset.surface, *probe.model.section_surfaces}
    return frozenset((s, v) for s, v in signs.items() if s not in left_out)


def jump_along(
    values: Callable[[float], FloatArray | None], low: float, high: float
) -> tuple[int, float, float] | None:
    """Return (which value jumps, where, by how much) along a line; None if nothing does.

    Parameters
    ----------
    values : what may jump, at a place of the line; None where that does not count
    """
    # an irrational share: samples do not fall onto the places that people choose
    places = low + (high - low) * (np.arange(_SAMPLES) + 0.381966) / _SAMPLES
    found = [values(float(s)) for s in places]
    known = [v for v in found if v is not None]
    if not known:
        return None
    size = 1.0 + np.max(np.abs(np.where(np.isfinite(known), known, 0.0)), axis=0)
    suspicion = _suspicion(found, size)
    for k in np.argsort(suspicion)[::-1][:_INTERVALS]:
        if suspicion[k] < _LOOKED_INTO:
            return None
        jump = _halved(values, (float(places[k]), float(places[k + 1])), size)
        if jump is not None:
            return jump
    return None


def _suspicion(values: list[FloatArray | None], size: FloatArray) -> FloatArray:
    """Return how far the change over each interval is from the mean of its neighbours."""
    outside = np.full(len(size), np.nan)
    steps = np.diff([outside if v is None else v for v in values], axis=0)
    around = np.vstack([steps[1:2], steps, steps[-2:-1]])
    mean = 0.5 * (around[:-2] + around[2:])
    apart = np.abs(steps - np.where(np.isfinite(mean), mean, 0.0)) / size
    poles = ~np.isfinite(apart) & np.array(
        [[a is not None and b is not None] for a, b in pairwise(values)]
    )
    return np.asarray(np.max(np.where(poles, np.inf, np.nan_to_num(apart)), axis=1))


def _names(probe: Probe) -> list[str]:
    """Return what :func:`_values_on` has, in words."""
    rates = [f"the rate of '{s}'" for s in probe.model.states]
    return [*rates, *(f"the observable '{c}'" for c in probe.model.observable_index)]


def _values_on(probe: Probe, mode: str, line: Line, place: float) -> FloatArray | None:
    """Return rates and observables at a place of a line; None outside of the mode."""
    t, y = line(place)
    if not probe.is_in(mode, probe.signs(t, y)):
        return None
    observed = [probe.flow.observe(name, t, y) for name in probe.model.observable_index]
    return np.array([*probe.field(mode, t, y), *observed])


def _change(a: FloatArray | None, b: FloatArray | None, size: FloatArray) -> float:
    """Return the largest relative change between two places; 0 where one is outside of the mode."""
    if a is None or b is None:
        return 0.0
    with np.errstate(invalid="ignore"):  # a pole
        change = np.max(np.abs(a - b) / size)
    return float(change) if np.isfinite(change) else np.inf


def _halved(
    values: Callable[[float], FloatArray | None], ends: tuple[float, float], size: FloatArray
) -> tuple[int, float, float] | None:
    """Return the jump inside of an interval, if its change does not shrink with it."""
    (a, b), before, after = ends, values(ends[0]), values(ends[1])
    for _ in range(_HALVINGS):
        middle = 0.5 * (a + b)
        there = values(middle)
        if there is None or middle in (a, b):
            break
        if _change(before, there, size) >= _change(there, after, size):
            b, after = middle, there
        else:
            a, before = middle, there
    if before is None or after is None or b - a > 1e3 * ON * (1.0 + abs(a)):
        return None
    change = np.abs(before - after) / size
    k = int(np.argmax(np.where(np.isfinite(change), change, np.inf)))
    return None if change[k] < _LEFT else (k, 0.5 * (a + b), float(abs(before[k] - after[k])))
