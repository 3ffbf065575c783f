"""Equal limits of friction: where the load does not reach them any more, what moves comes to rest.

Nothing jumps there. Just beyond, slides are as short as the root of the distance, and go as far as its 3/2th
power.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf


@pytest.mark.parametrize("seed", range(8))
def test_indices_balance_where_motions_come_to_rest(seed: int) -> None:
    """One orbit on one side, one set of places of rest on the other."""
    rng = np.random.default_rng(seed)
    friction, omega = rng.uniform(0.9, 1.2), rng.uniform(0.2, 0.6)
    params = {"Omega": omega, "S": friction, "S0": friction, "zeta": rng.uniform(0.0, 0.1)}
    place = friction - 1.0  # the load at its largest is 1 + h, for h above -1/9
    orbit = cf.find_orbit("coulomb", {**params, "h": place + 0.05}, longest=1000)
    width = 10.0 ** rng.uniform(-2.5, -2.0)
    found = cf.explore(orbit, "h", (place - width, place + max(0.06, width)))
    ends = [end for branch in found.branches for end in branch.ends if end.reason.name == "REST"]
    assert len(ends) == 1 and ends[0].bifurcation is not None
    assert abs(ends[0].bifurcation.params["h"] - place) < 1e-8
    balances = found.verify(restarts=0).balances
    assert [b.below for b in balances] == [1] and [b.above for b in balances] == [1]
