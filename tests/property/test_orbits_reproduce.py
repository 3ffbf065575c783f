"""Every orbit of whole diagrams, handed to the simulator: it comes back, with the same signature.

The simulation shares the flow with the boundary-value problem, but neither its equations, nor the
order of its segments, nor its joints: the itinerary is found anew, event by event. An unstable orbit
multiplies what rounding there is in its initial state by its multiplier mu, so the tolerance is
1e-11 * max(1, |mu|). The two end points of a branch lie on an event, where the itinerary is ambiguous, and
are left out.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.signature.cyclic import rotated

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))

from full_form import full_form

DIAGRAMS = {
    "fig05": ({"Omega": 0.5, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    "in S": ({"Omega": 0.5, "S": 0.3, "S0": 0.4}, "S", (0.03, 0.39)),
    "in h": ({"Omega": 0.5, "S": 0.3, "S0": 0.4}, "h", (-0.3, 0.3)),
    "in zeta": ({"Omega": 0.5, "S": 0.3, "S0": 0.4}, "zeta", (-0.1, 1.3)),
    "in S0": ({"Omega": 0.6, "S": 0.3, "S0": 0.35}, "S0", (0.3, 0.8)),
    "large limits": ({"Omega": 0.6, "S": 0.3, "S0": 0.5}, "Omega", (0.35, 0.9)),
    "three periods": ({"Omega": 0.4, "S": 0.1, "S0": 0.25}, "Omega", (0.2, 0.9)),
    "third harmonic, damped": (
        {"Omega": 0.4, "S": 0.1, "S0": 0.25, "h": 0.3, "zeta": 0.05},
        "Omega",
        (0.2, 0.5),
    ),
}
each_diagram = pytest.mark.parametrize("name", DIAGRAMS)


@cache
def branches(name: str) -> tuple[cf.Branch, ...]:
    params, parameter, bounds = DIAGRAMS[name]
    # bridges are no solutions, and lead to orbits with multipliers of a thousand: see test_bridges
    diagram = cf.explore(cf.find_orbit("coulomb", params), parameter, bounds, bridges=False)
    assert diagram.complete and diagram.branches
    return diagram.branches


def orbits(name: str, every: int = 1) -> Iterator[cf.Orbit]:
    for branch in branches(name):
        for i in range(1, len(branch) - 1, every):
            orbit = branch[i]
            # a step that meets an event by chance ends on it to rounding: ambiguous as the end is
            if float(np.min(orbit.margins)) > 1e-13:
                yield orbit


def section(orbit: cf.Orbit) -> tuple[int, float]:
    """(segment, time) inside the longest slide, away from its ends."""
    spans = orbit.ends[:, 0] - orbit.cycle[:, 0]
    slides = [k for k, (mode, _) in enumerate(orbit.itinerary) if mode != "stick"]
    longest = max(slides, key=lambda k: spans[k])
    return longest, float(orbit.cycle[longest, 0] + 0.4 * spans[longest])


def turn(orbit: cf.Orbit, time: float, state: np.ndarray) -> cf.orbit.simulation.Trajectory:
    return cf.simulate(
        orbit.model, orbit.params, state=state, time=time, periods=float(orbit.periods)
    )


@each_diagram
def test_every_orbit_reproduces_itself_and_its_itinerary(name: str) -> None:
    """Measured: 2e-14 at worst, 8e-12 |mu| near an event at which the flow jumps (in h).

    Where an exit is met almost tangentially, with a rate r, its time is good to rounding / r only:
    the branch in h comes within 1e-6 of such an end (a stick that vanishes as its release becomes
    tangential), where r is about 1e-4.
    """
    count = 0
    for orbit in orbits(name):
        first, time = section(orbit)
        state = orbit.state(time)
        run = turn(orbit, time, state)
        gap = float(np.max(np.abs(run.last[2] - state)))
        mu = float(np.max(np.abs(orbit.multipliers)))
        exits = [t.margin.value == "exit" for t in orbit.system.tests]
        rate = min(1.0, float(np.min(orbit.margins[exits])))
        assert gap < max(1e-11, 1e-13 / rate) * max(1.0, mu), (orbit, gap, mu, rate)
        assert run.itinerary == rotated(orbit.itinerary, first), orbit
        assert orbit.admissible, orbit.violations()
        count += 1
    assert count > 50


def domains_passed(
    run: cf.orbit.simulation.Trajectory, start: np.ndarray, time: float
) -> list[str]:
    """Domains in the order in which a simulation visits them, from dense samples of its segments."""
    model = run.model
    vector = model.vector(run.params)
    period = 2 * np.pi / run.params["Omega"]
    none, nothing = np.empty(0, dtype=np.int64), np.empty((0, 0))
    y = np.empty(2)
    seen: list[str] = []
    clock = run.times + run.cycles * period
    ends = [*clock, time + period * round((run.last[0] * period + run.last[1] - time) / period)]
    starts = [time, *clock]
    states = [start, *run.states]
    modes = [*run.modes, [m.name for m in model.modes].index(run.last[3])]
    for mode, t0, t1, y0 in zip(modes, starts, ends, states, strict=True):
        t = t0 + (t1 - t0) * np.linspace(0, 1, 1202)[1:-1]
        for now in t:
            model.flow.flow(mode, t0, y0, now - t0, vector, none, y, nothing)
            f = np.cos(vector[0] * now) + vector[3] * np.cos(3 * vector[0] * now)
            u = y[0] - f
            position = "+" if u > vector[2] else "-" if u < -vector[2] else "0"
            domain = "stick" if mode == 2 else f"x{position}v{'+-'[mode]}"
            if not seen or seen[-1] != domain:
                seen.append(domain)
    return seen[:-1] if len(seen) > 1 and seen[0] == seen[-1] else seen


@each_diagram
def test_signature_is_the_one_that_the_simulation_visits(name: str) -> None:
    """All seven domains, by their definition. What is shorter than a sample is not seen, as happens
    near T; such orbits must be few."""
    differ, count = [], 0
    for orbit in orbits(name, every=9):
        if np.min(orbit.margins) < 1e-3:
            continue  # next to an event a domain is as short as one likes
        _, time = section(orbit)
        state = orbit.state(time)
        seen = domains_passed(turn(orbit, time, state), state, time)
        expected = list(orbit.signature.segments)
        if not any(seen == expected[k:] + expected[:k] for k in range(len(expected))):
            differ.append((orbit, seen, expected))
        count += 1
    assert count > 5
    assert len(differ) <= 0.05 * count + 1, differ


@each_diagram
def test_multipliers_are_those_of_the_simulated_return_map(name: str) -> None:
    """Central differences of the stroboscopic map at a time inside a slide; trace and determinant,
    which are smooth where eigenvalues are not. Next to an event the map bends: left out."""
    step, count = 1e-6, 0
    for orbit in orbits(name, every=4):
        if np.min(orbit.margins) < 1e-3:
            continue
        _, time = section(orbit)
        state = orbit.state(time)
        slope = np.empty((2, 2))
        for k in range(2):
            offset = np.zeros(2)
            offset[k] = step
            ahead, behind = (turn(orbit, time, state + s * offset).last[2] for s in (1, -1))
            slope[:, k] = (ahead - behind) / (2 * step)
        mu = orbit.multipliers
        size = 1.0 + float(np.max(np.abs(mu)))
        # rounding 1e-15 / 1e-6, and the third derivative of the map times 1e-12
        assert abs(np.trace(slope) - np.sum(mu)) < 1e-6 * size, orbit
        assert abs(np.linalg.det(slope) - np.prod(mu)) < 1e-6 * size**2, orbit
        if any(mode == "stick" for mode, _ in orbit.itinerary):
            assert mu[1] == 0.0, "a stick forgets where it came from"
        count += 1
    assert count > 5


@each_diagram
def test_full_form_is_the_same_orbit(name: str) -> None:
    """One segment for each of the seven domains: the same joints, the same multipliers."""
    longer = count = 0
    for orbit in orbits(name, every=3):
        away = float(np.min(np.abs(orbit.multipliers - 1.0)))
        if away < 1e-4 or np.min(orbit.margins) < 1e-4:
            continue  # at a fold, a branch point or an event the problem is singular, or nearly so
        full = full_form(orbit)
        assert full.converged, orbit
        # rounding is divided by the distance from the singular case
        limit = 1e-13 / min(1.0, away)
        scale = 1.0 + float(np.max(np.abs(orbit.joints)))
        nearest = np.abs(orbit.cycle[:, None] - full.joints[None, :]).max(axis=2).min(axis=1)
        assert np.max(nearest) < limit * scale, orbit
        size = (1.0 + float(np.max(np.abs(orbit.multipliers)))) ** 2
        assert abs(np.sum(full.multipliers) - np.sum(orbit.multipliers)) < 100 * limit * size
        assert abs(np.prod(full.multipliers) - np.prod(orbit.multipliers)) < 100 * limit * size
        assert full.system.segments == len(orbit.signature.segments)
        longer += full.system.segments > len(orbit.itinerary)
        count += 1
    assert count > 5 and longer > count / 2
