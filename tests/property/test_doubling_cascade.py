"""A period-doubling cascade, followed to period 16, against simulation."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import contfric as cf

#: Found by exploring random scenes: 0a doubles four times while Omega falls.
PARAMS = {
    "Omega": 0.34021955393372116,
    "S": 0.2585814798565343,
    "S0": 0.787685498824335,
    "h": -0.11316399305071922,
}
BOUNDS = (0.252, 0.428)


@cache
def diagram() -> cf.Diagram:
    orbit = cf.find_orbit("coulomb", PARAMS)
    return cf.explore(orbit, "Omega", BOUNDS, max_periods=16, bridges=False)


@pytest.mark.parametrize("periods", [2, 4, 8, 16])
def test_a_doubled_branch_leaves_and_simulation_settles_on_it(periods: int) -> None:
    branches = [b for b in diagram().branches if b.system.periods == periods and not b.mirrored]
    assert branches
    stable = [(b, i) for b in branches for i in range(2, len(b) - 2) if b.stable[i]]
    branch, index = stable[len(stable) // 2]
    orbit = branch[index]
    found = cf.find_orbit("coulomb", orbit.params, state=orbit.state(0.3), time=0.3)
    assert found.periods == periods
    assert np.max(np.abs(np.sort(found.stops) - np.sort(orbit.stops))) < 1e-8


def test_every_doubling_joins_an_orbit_and_its_double() -> None:
    """With multiplier -1 there; beyond max_periods nothing is followed, and the event says so."""
    found = diagram()
    told = 0
    for node in found.nodes:
        if node.bifurcation.kind != "PD":
            continue
        assert abs(np.min(np.abs(node.bifurcation.orbit.multipliers + 1.0))) < 1e-7
        periods = {found.branches[i].system.periods for i in node.branches}
        simple = node.bifurcation.orbit.periods
        if simple < 16:
            assert periods == {simple, 2 * simple}, node
        else:
            told += any("max_periods = 16" in p.why for p in node.bifurcation.proposals)
    assert told > 0
