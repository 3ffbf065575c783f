"""Rings of equal parts under a travelling wave: contacts that change at the same time, to rounding."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.orbit.finding.simultaneous import in_order


def ring(size: int, wave: int, seed: int) -> cf.Model:
    """Return equal masses in a ring, Jenkins elements between neighbours: opposite ones slip together."""
    draw = np.random.default_rng(seed)
    turned = np.roll(np.eye(size), 1, axis=1)
    stiffness = np.eye(size) + draw.uniform(0.1, 0.3) * (2.0 * np.eye(size) - turned - turned.T)
    elements = {
        f"u{i}": {
            "kind": "jenkins",
            "displacement": f"q{i} - q{i % size + 1}",
            "stiffness": "kd",
            "limit": "S",
        }
        for i in range(1, size + 1)
    }
    return cf.Mechanism(
        np.eye(size),
        draw.uniform(0.1, 0.2) * stiffness,
        stiffness,
        contacts=elements,
        force={f"q{i + 1}": f"cos(w*t - {wave * i}*2*pi/{size})" for i in range(size)},
        parameters={"w": draw.uniform(0.7, 0.9), "kd": draw.uniform(0.3, 0.6), "S": 0.2},
        period="2*pi/w",
    )


@pytest.mark.parametrize(("size", "wave", "seed"), [(4, 1, 0), (6, 1, 1), (6, 2, 2), (6, 3, 3)])
def test_the_wave_travels_round(size: int, wave: int, seed: int) -> None:
    model = ring(size, wave, seed)
    orbit = cf.find_orbit(model)
    assert orbit.periods == 1 and orbit.admissible
    assert max(abs(orbit.multipliers)) < 1.0  # elements that yield only take energy away
    period = 2.0 * np.pi / orbit.params["w"]
    state, time = orbit.ends[0, 1:], float(orbit.ends[0, 0])
    found = cf.simulate(model, orbit.params, state=state, time=time, periods=1.0 + wave / size)
    later = found.sample(time + np.array([wave / size, 1.0]) * period)
    # the part before has done the same, a share of the period earlier
    displacements, velocities, stretches = (k * size + np.arange(size) for k in range(3))
    for block in (displacements, velocities, stretches):
        assert later[0][np.roll(block, -1)] == pytest.approx(state[block], abs=1e-8)
    assert later[1] == pytest.approx(state, abs=1e-9)


def test_the_order_of_simultaneous_events_is_that_of_their_surfaces() -> None:
    model = ring(6, 1, 4)
    found = cf.simulate(model, periods=300.0)
    ordered = in_order(found)
    apart = np.diff(found.times) + 2.0 * np.pi / found.params["w"] * np.diff(found.cycles)
    together = np.flatnonzero(np.abs(apart) < 1e-13)
    assert np.any(ordered.exits != found.exits)
    assert np.all(ordered.exits[together] < ordered.exits[together + 1])
    again = [model.targets[pair] for pair in ordered.itinerary[:-1]]
    assert all(mode in after for (mode, _), after in zip(ordered.itinerary[1:], again, strict=True))
    late = together[together > len(found) // 2]
    assert len(late) > 100
    assert in_order(ordered).itinerary == ordered.itinerary
