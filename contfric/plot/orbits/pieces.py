"""An orbit cut where it enters another domain, and the surfaces seen along it.

Everything here derives from the model's observables, levels and domains.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.arrays import FloatArray

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit


@dataclass(frozen=True)
class DomainPiece:
    """Part of an orbit inside one domain: times (k,) and states (k, n), both ends included.

    After an impact the first two rows are the states before and after it, at the same time.
    ``exit`` is the surface through which it leaves; ``segment`` counts the orbit's own segments.
    """

    domain: str
    segment: int
    times: FloatArray
    states: FloatArray
    exit: str


def pieces_of(orbit: Orbit, points: int = 400) -> list[DomainPiece]:
    """Cut one period of an orbit at its joints and where it crosses a surface in between."""
    found: list[DomainPiece] = []
    for i, ((mode, exit_), joint, start, end) in enumerate(
        zip(orbit.itinerary, orbit.cycle, orbit.begins, orbit.ends, strict=True)
    ):
        struck = not np.array_equal(joint, start)
        count = max(9, int(np.ceil(points * (end[0] - start[0]) / orbit.period)))
        times = np.linspace(start[0], end[0], count)
        states = np.array([start[1:], *(orbit.state(t) for t in times[1:-1]), end[1:]])
        cuts = [*_crossings(orbit, mode, times, states), (float(end[0]), exit_)]
        before = float(start[0])
        for time, surface in cuts:
            inside = (times > before) & (times < time)
            own = np.array([before, *times[inside], time])
            first = start[1:] if before == start[0] else orbit.state(before)
            last = end[1:] if time == end[0] else orbit.state(time)
            middle = 0.5 * (before + time)
            domain = _domain(orbit, mode, middle)
            rows = [first, *states[inside], last]
            if struck and before == start[0]:
                own, rows = np.array([before, *own]), [joint[1:], *rows]
            found.append(DomainPiece(domain, i, own, np.array(rows), surface))
            before = time
    return found


def _crossings(
    orbit: Orbit, mode: str, times: FloatArray, states: FloatArray
) -> list[tuple[float, str]]:
    """Return times at which transparent surfaces are crossed inside a segment, in order."""
    found: list[tuple[float, str]] = []
    for surface in orbit.model.surfaces:
        if surface.switching and surface.name not in orbit.model.section_surfaces:
            continue
        observable, limit = surface.observable, orbit.flow.level(surface.name)
        seen = [orbit.flow.observe(observable, t, y) for t, y in zip(times, states, strict=True)]
        gap = np.array(seen) - limit
        # a sample on the surface (a joint, or the middle of a solution) has no side
        sided = np.flatnonzero(np.abs(gap) >= 1e-9 * (1.0 + abs(limit)))
        for k in np.flatnonzero(gap[sided[:-1]] * gap[sided[1:]] < 0.0):
            low, high = sided[k : k + 2]
            start, lasts = float(times[low]), float(times[high] - times[low])
            met = orbit.flow.first(mode, observable, limit, start, states[low], lasts, on=False)
            if met is not None:
                found.append((start + met[0], surface.name))
    return sorted(found)


def _domain(orbit: Orbit, mode: str, time: float) -> str:
    """Return the domain of a mode in which the orbit is at a time."""
    state = orbit.state(time)
    model = orbit.model
    own = [d for d in model.domains if d.mode == model.whole_mode(mode)]
    side = {
        s.name: np.sign(orbit.flow.height(s.name, time, state))
        for s in model.surfaces
        if not s.switching or s.name in model.section_surfaces
    }
    fitting = [d for d in own if all(d.signs[name] == sign for name, sign in side.items())]
    return (fitting or own)[0].name


def rest_limits(orbit: Orbit, piece: DomainPiece) -> tuple[float, float] | None:
    """Return the displacements between which the piece could rest when it begins.

    The two surfaces that bound a sliding domain are met along the first state by Newton's method
    (exact at once where the observable is affine). None if the domain has not two such bounds.
    """
    model = orbit.model
    found: list[float] = []
    for surface in model.surfaces:
        rests = model.domain_by_name[piece.domain].signs[surface.name] == 0
        if surface.switching or surface.name in model.section_surfaces or rests:
            continue
        state = piece.states[0].copy()
        time = float(piece.times[0])
        for _ in range(4):
            gap = orbit.flow.height(surface.name, time, state)
            slope = orbit.flow.gradient(surface.observable, time, state)[1]
            if slope == 0.0:
                return None
            state[0] -= gap / slope
        found.append(float(state[0]))
    return (min(found), max(found)) if len(found) == 2 else None


def rest_bounds(orbit: Orbit, observable: str) -> Iterator[tuple[float, float]]:
    """Yield the intervals of an observable inside which the model can stay on a surface."""
    model = orbit.model
    drawn = [s for s in model.surfaces if not s.switching and s.name not in model.section_surfaces]
    own = [s for s in drawn if s.observable == observable and s.name not in model.wraps]
    for domain in model.domains:
        if not model.mode_by_name[domain.mode].sliding:
            continue
        above = [orbit.flow.level(s.name) for s in own if domain.signs[s.name] < 0]
        below = [orbit.flow.level(s.name) for s in own if domain.signs[s.name] > 0]
        if above and below:
            yield max(below), min(above)
