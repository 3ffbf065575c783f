"""Symmetric orbits of a driven pendulum that pass the upright position on both sides."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.leaving.families import solved_next_to
from contfric.continuation.points import settings_of
from contfric.events.incident.candidates import candidates

#: A pendulum whose symmetric oscillation reaches the top, and how far parameters are moved (relative).
PENDULUM = {"A": 0.465475689, "W": 0.598549604, "c": 0.258974202, "mu": 0.100688116}
MOVED = 0.03

#: Steps of half a turn, and what is left of their error, which is of the first order where the speed changes
#: its sign; solutions part by a few tens on the way.
STEPS, STEPPED = 20_000, 1e-2
#: What a state moves by at most, as a parameter does by a thousandth of its range.
FAR = 0.1


def stepped(p: Mapping[str, float], time: float, state: np.ndarray, lasts: float) -> np.ndarray:
    """Return the state after a time by Heun's method, with the angle as it grows."""

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        friction = p["c"] * y[1] + p["mu"] * np.sign(y[1])
        return np.array([y[1], p["A"] * np.cos(p["W"] * t) - np.sin(y[0]) - friction])

    h, y = lasts / STEPS, np.array(state)
    for k in range(STEPS):
        t = time + k * h
        a = rate(t, y)
        y = y + 0.5 * h * (a + rate(t + h, y + h * a))
    return y


def through_the_top(seed: int) -> tuple[float, cf.Orbit]:
    """Return where a symmetric oscillation reaches the top, and an orbit just before that."""
    rng = np.random.default_rng([618, seed])
    params = {
        name: value * float(1.0 + MOVED * rng.uniform(-1, 1)) for name, value in PENDULUM.items()
    }
    begun = cf.find_orbit("pendulum", params, longest=1000)
    grown = cf.continue_orbit(begun, "A", (0.3, 1.3))
    top = float(grown.values[-1])
    assert grown.ends[-1].reason is cf.EndReason.GS and grown[-1].symmetric
    return top, grown[int(np.argmin(np.abs(grown.values - 0.99 * top)))]


@pytest.mark.parametrize("seed", range(3))
def test_a_symmetric_oscillation_goes_on_where_both_sides_reach_the_top(seed: int) -> None:
    """An angle begins a new turn on both sides at once; solutions near it do so on one side only."""
    top, near = through_the_top(seed)
    diagram = cf.explore(near, "A", (0.97 * top, 1.03 * top), max_periods=1)
    assert not diagram.loose_ends, diagram.loose_ends
    beyond = [b for b in diagram.branches if b.values.max() > 1.02 * top and b[-1].symmetric]
    assert beyond, "the symmetric branch ends at the top"
    orbit = beyond[0][len(beyond[0]) // 2]
    time = 0.5 * float(orbit.joints[0, 0] + orbit.joints[1, 0])
    first = orbit.state(time)
    last = stepped(orbit.params, time, first, 0.5 * orbit.period)
    angle = np.remainder(first[0] + last[0] + np.pi, 2.0 * np.pi) - np.pi
    assert abs(angle) < STEPPED and abs(first[1] + last[1]) < STEPPED


def test_what_is_solved_next_to_an_event_is_near_it() -> None:
    """Far from where both sides reach the top other orbits have the itineraries that are proposed there."""
    asked = 0
    for seed in range(3):
        top, near = through_the_top(seed)
        diagram = cf.explore(near, "A", (0.97 * top, 1.03 * top), max_periods=1)
        ends = [end for branch in diagram.branches for end in branch.ends]
        event = next(end.bifurcation for end in reversed(ends) if end.reason is cf.EndReason.GS)
        assert event is not None and abs(event.params["A"] - top) < 1e-6
        proposed = [c.orbit for c in candidates(event) if c.orbit is not None]
        settings = settings_of(near, "A", (0.3 * top, 1.3 * top), None, True, 100)
        for orbit in (event.orbit, *proposed):
            first = orbit.as_whole().state(0.0)
            for solved in solved_next_to(orbit, settings):
                moved = np.abs(solved.as_whole().state(0.0) - first)
                moved[0] = abs((moved[0] + np.pi) % (2.0 * np.pi) - np.pi)
                assert moved.max() < FAR
                asked += 1
    assert asked
