"""Sections of a plane: which are asked for, and the one-parameter diagram of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress

import numpy as np

from contfric.atlas.diagram import Diagram
from contfric.atlas.explore import explore
from contfric.atlas.plane.state import PlaneExploration
from contfric.atlas.starts.seeds import Seeds
from contfric.continuation.points import MOST_POINTS, settings_of
from contfric.continuation.trace import follow_orbit
from contfric.curves.ranges import PlaneRanges
from contfric.errors import ContfricError, ParameterError, mapping_of, real_number, shown
from contfric.events.bifurcation import EndReason
from contfric.orbit.finding.find import find_orbit
from contfric.orbit.orbit import Orbit


def sections_of(
    orbit: Orbit, box: PlaneRanges, sections: Mapping[str, Sequence[float]] | None
) -> list[tuple[str, float]]:
    """Return the sections as (parameter that is fixed, value)."""
    if sections is None:
        second = box.names[1]
        return [(second, orbit.params[second])]
    found = []
    example = f"{{'{box.names[1]}': [{box.low[1]:g}]}}"
    for name, values in mapping_of("sections", sections, example).items():
        if name not in box.names:
            raise ParameterError(f"sections are values of {' and '.join(box.names)}, got '{name}'")
        if isinstance(values, str) or np.ndim(values) != 1:
            raise ParameterError(
                f"sections are lists of values, such as {example}; got {shown(values)} for '{name}'"
            )
        for given in values:
            value = real_number(f"the section of '{name}'", given)
            k = box.names.index(name)
            if not box.low[k] <= value <= box.high[k]:
                raise ParameterError(
                    f"the section {name} = {value:g} is outside of its range "
                    f"({box.low[k]:g}, {box.high[k]:g})"
                )
            found.append((name, value))
    return found


def section_diagram(
    state: PlaneExploration, orbit: Orbit, fixed: str, value: float, seeds: Seeds | None
) -> Diagram | None:
    """Return the diagram of a section, from the first start that has one; None if none has."""
    varies = next(n for n in state.box.names if n != fixed)
    k = state.box.names.index(varies)
    state.say(f"section {fixed} = {value:g}")
    for start in _starts(state, orbit, fixed, value):
        try:
            diagram = explore(
                start,
                varies,
                (float(state.box.low[k]), float(state.box.high[k])),
                bridges=False,
                max_periods=state.max_periods,
                seeds=seeds,
            )
        except ContfricError:
            continue
        if EndReason.INTERRUPTED.value in diagram.notes:
            raise KeyboardInterrupt
        return diagram
    return None


def _starts(state: PlaneExploration, orbit: Orbit, fixed: str, value: float) -> Iterator[Orbit]:
    """Yield orbits on a section: those that simulations converge to, then the plane's own continued to it."""
    box = state.box
    varies = next(n for n in box.names if n != fixed)
    k = box.names.index(varies)
    params = {**orbit.params, fixed: value}
    bottom, top, _, _ = orbit.model.limits(varies, params)
    low, high = max(box.low[k], bottom), min(box.high[k], top)
    for share in (0.5, 0.3, 0.7, 0.1, 0.9):
        with suppress(ContfricError):
            there = {**params, varies: float(low + share * (high - low))}
            found = find_orbit(orbit.model, there, longest=4000)
            # an orbit of more periods would raise max_periods for its whole section
            if found.periods <= state.max_periods:
                yield found
    with suppress(ContfricError):
        yield from _continued(orbit, fixed, value)


def _continued(orbit: Orbit, fixed: str, value: float) -> Iterator[Orbit]:
    """Yield an orbit continued to a section; nothing if its branch ends before."""
    here = orbit.params[fixed]
    if here == value:
        yield orbit
        return
    bounds = min(here, value), max(here, value)
    branch = follow_orbit(orbit, settings_of(orbit, fixed, bounds, None, True, MOST_POINTS))
    there = branch[int(np.argmin(np.abs(branch.values - value)))]
    if there.params[fixed] == value and there.admissible:
        yield there
