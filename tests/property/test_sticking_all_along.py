"""Where an element ceases to slip: the branch goes on with orbits along which it sticks, at the same offset.

Without slips a Jenkins element is a spring, so the closed form of a linear oscillator has the event: its
amplitude is the stretch at which the element slips.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import contfric as cf

NEAR = {"F": 0.9114, "k": 1.0209, "kt": 2.2701, "zeta": 0.02088, "muN": 0.9081}
#: How far parameters are moved (relative), and the range.
MOVED, RANGE = 0.05, (0.83, 1.56)


@pytest.mark.parametrize("seed", range(6))
def test_a_branch_goes_on_where_an_element_sticks_all_along(seed: int) -> None:
    rng = np.random.default_rng([616, seed])
    params = {name: float(v * rng.uniform(1 - MOVED, 1 + MOVED)) for name, v in NEAR.items()}

    def excess(w: float) -> float:
        stiffness = params["k"] + params["kt"] - w**2 + 2j * params["zeta"] * w
        return float(params["F"] / abs(stiffness) - params["muN"] / params["kt"])

    expected = brentq(excess, *RANGE)
    orbit = cf.find_orbit("jenkins", params | {"W": 1.43})
    diagram = cf.explore(orbit, "W", RANGE, max_periods=2)
    (event,) = diagram.of_kind("GS")
    assert event.params["W"] == pytest.approx(expected, rel=1e-9)
    assert sorted(len(b.system.itinerary) for b in diagram.branches) == [1, 2]
    held = diagram.verify(2)
    assert held.passed, str(held)


@pytest.mark.parametrize("seed", range(4))
def test_a_wall_that_no_longer_reaches_a_mass_leaves_it_at_rest(seed: int) -> None:
    """It pushes the mass to where it comes itself, and friction holds it there if the spring is soft."""
    rng = np.random.default_rng([617, seed])
    near = {"b": 0.7111, "m": 1.0688, "Ff": 0.8772, "omega": 0.901, "a": 0.8548, "e": 0.8864}
    params = {name: float(v * rng.uniform(0.95, 1.05)) for name, v in near.items()}
    expected = params["Ff"] / (params["a"] - params["b"])
    orbit = cf.find_orbit("impact-friction", params | {"k": 1.03 * expected})
    diagram = cf.explore(orbit, "k", (0.95 * expected, 1.06 * expected), max_periods=2)
    (event,) = diagram.of_kind("AS")
    assert event.params["k"] == pytest.approx(expected, rel=1e-9)
    balances = diagram.verify(1).balances
    assert [(b.below, b.above) for b in balances] == [(1, 1)] * len(balances) != []
