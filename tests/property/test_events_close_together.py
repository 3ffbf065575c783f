"""Two stops of a nearly symmetric orbit reach a boundary one just after the other: what is between is there.

With S0 just above S bridges are narrow: both stops of a symmetric orbit switch within a few 1e-9 of the
range. The events are known to 1e-11, and told apart; regular orbits between them are shorter than 1e-7.
"""

from __future__ import annotations

import numpy as np
import pytest
import restarts

import contfric as cf
from contfric.atlas.completeness.balance import balances
from contfric.events.bifurcation import Kind

SCENE = restarts.scene(51, 155)
BOUNDS = (0.03, 0.18)


@pytest.mark.parametrize("seed", range(4))
def test_indices_balance_where_both_halves_switch(seed: int) -> None:
    rng = np.random.default_rng(seed)
    params = {k: v * rng.uniform(0.995, 1.005) for k, v in SCENE.params.items()}
    params["S0"] = params["S"] * (1.0 + 10.0 ** rng.uniform(-1.75, -1.4))
    orbit = cf.find_orbit("coulomb", params | {"h": 0.0655}, longest=1000)
    found = cf.explore(orbit, "h", BOUNDS)
    switches = [b for b in found.bifurcations if b.kind is Kind.SS]
    assert switches
    assert np.diff(sorted(b.params["h"] for b in switches)).max() < 1e-8 * found.width
    assert not found.loose_ends
    held = found.verify(restarts=3)
    assert held.passed, str(held)


@pytest.mark.parametrize("seed", range(2))
def test_a_regular_branch_between_two_events_is_there(seed: int) -> None:
    # the one of a half switched and the other one not: 4e-11 to 1e-10 of the range wide
    rng = np.random.default_rng(seed)
    scene = restarts.scene(651, 2)
    params = scene.params | {"S": scene.params["S"] * rng.uniform(0.9995, 1.0005)}
    params["S0"] = params["S"] * (1.0 + 10.0 ** rng.uniform(-2.7, -2.5))
    orbit = cf.find_orbit("coulomb", params | {"h": 0.29}, longest=1000)
    found = cf.explore(orbit, "h", (0.2, 0.36))
    places = np.sort([b.params["h"] for b in found.bifurcations if b.kind is Kind.SS])
    k = int(np.argmin(np.diff(places)))
    assert places[k + 1] - places[k] < 1.5e-10 * found.width
    between = [b for b in found.branches if not (b.bridge or b.mirrored or b.symmetric)]
    ends = [sorted(e.bifurcation.params["h"] for e in b.ends if e.bifurcation) for b in between]
    known = 1e-12 * found.width
    assert any(np.allclose(pair, places[k : k + 2], rtol=0.0, atol=known) for pair in ends)
    assert not [str(balance) for balance in balances(found) if not balance.holds]
