"""Structures with contacts of all kinds, drawn at random, against stepping from event to event."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.errors import ModelError
from tests.random_structures import drawn


def loaded(seed: int, fading: bool) -> tuple[cf.Model, Any, Any]:
    """Return the first structure from a seed on whose contacts are not refused."""
    made, stepped, state = drawn(seed, fading)
    try:
        return made(), stepped, state
    except ModelError as why:
        known = ("locks with", "depend on each other", "act along one", "share their loads")
        assert any(words in str(why) for words in known), str(why)
        return loaded(seed + 1000, fading)


def check_solution(seed: int, fading: bool) -> None:
    model, stepped, state = loaded(seed, fading)
    found = cf.simulate(model, state=list(state), periods=3)
    end = 3.0 * stepped.period
    reached, events = stepped.run(0.0, state, end, stepped.begun(0.0, state))
    assert events > 0
    assert np.max(np.abs(found.last[2] - reached)) < 1e-8


@pytest.mark.parametrize("seed", range(8))
def test_solutions_are_those_of_stepping(seed: int) -> None:
    check_solution(seed, fading=False)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8, 20))
def test_solutions_with_friction_that_fades(seed: int) -> None:
    check_solution(seed, fading=True)


#: Two masses of which one rubs on the other, and on the ground: what follows an event is asked of the flow.
RUBBING = {
    "mass": np.diag([0.7755, 0.6625]),
    "damping": 0.1303 * np.eye(2),
    "stiffness": [[1.2406, -0.2336], [-0.2336, 1.6826]],
    "contacts": {
        "c1": {
            "kind": "friction",
            "velocity": "v2 - v1 + 0.48",
            "kinetic": "0.349*(1 + 0.26*cos(Omega*t + 2.18))",
        },
        "c2": {"kind": "friction", "velocity": "v1 + 0.239", "kinetic": 0.187, "static": 0.244},
        "c3": {"kind": "spring", "gap": "0.484 + q2", "stiffness": 0.625},
    },
    "force": {
        "q1": "0.642*(0.276*cos(3*Omega*t) - 1.339*cos(Omega*t) - 0.64*sin(Omega*t) - 0.296)"
    },
    "parameters": {"Omega": 0.7936},
}
#: Two contacts coupled by the masses, which come to rest at the same time.
COUPLED = {
    "mass": [
        [1.5831, 0.2649, 0.5316, 0.2492, -0.2509],
        [0.2649, 1.5771, 0.292, 0.4668, -0.0941],
        [0.5316, 0.292, 1.5567, 0.1713, -0.1958],
        [0.2492, 0.4668, 0.1713, 1.7657, -0.1073],
        [-0.2509, -0.0941, -0.1958, -0.1073, 1.2754],
    ],
    "stiffness": [
        [1.4776, 0.07, -0.1698, -0.1471, 0.0169],
        [0.07, 0.795, 0.0784, 0.0423, 0.13],
        [-0.1698, 0.0784, 1.0137, 0.0753, 0.0673],
        [-0.1471, 0.0423, 0.0753, 1.4783, 0.0883],
        [0.0169, 0.13, 0.0673, 0.0883, 0.9538],
    ],
    "contacts": {
        "c1": {
            "kind": "friction",
            "velocity": "v4 - 0.151",
            "kinetic": "0.162*(1 + 0.36*cos(Omega*t + 4.12))",
        },
        "c2": {
            "kind": "friction",
            "velocity": "v2 - 0.143",
            "kinetic": "0.131*(1 + 0.53*cos(Omega*t + 5.08))",
        },
    },
    "force": {
        "q1": "1.316*(0.368*cos(Omega*t) - 1.741*sin(Omega*t) + 0.343*cos(3*Omega*t) - 0.024)",
        "q5": "-1.316*(2.081*cos(Omega*t) + 0.175*sin(Omega*t) + 0.385*cos(3*Omega*t) + 0.766)",
    },
    "parameters": {"Omega": 1.6557},
}
COUPLED["damping"] = 0.12344 * np.array(COUPLED["stiffness"])


@pytest.mark.parametrize("scene", [RUBBING, COUPLED], ids=["rubbing", "coupled"])
def test_diagrams_are_the_same_from_any_branch(scene: dict[str, Any]) -> None:
    """They stopped with a KeyError; the second had a CS or an SS, by which contact was asked first."""
    orbit = cf.find_orbit(cf.Mechanism(period="2*pi/Omega", name="random", **scene))
    omega = orbit.params["Omega"]
    diagram = cf.explore(orbit, "Omega", (0.9 * omega, 1.1 * omega), max_periods=2)
    assert len(diagram.events) >= 1
    assert diagram.verify(restarts=2).passed
