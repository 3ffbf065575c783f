"""What is met on the way is one of a continuum: a diagram goes on without it, and ends with what it has."""

from __future__ import annotations

import numpy as np
import pytest
import restarts

import contfric as cf
from contfric.atlas.leaving import crossings
from contfric.continuation.trace import follow_orbit


@pytest.mark.parametrize("seed", range(4))
def test_an_orbit_without_a_unique_continuation_ends_no_exploration(monkeypatch, seed) -> None:
    """Without damping orbits next to an event may be a continuum: any of those that are tried is made one."""
    rng, lost = np.random.default_rng(seed), []

    def follow(orbit, *rest, **more):
        if not lost or rng.random() < 0.5:
            lost.append(orbit)
            raise cf.ConvergenceError("the orbit has no unique continuation", orbit)
        return follow_orbit(orbit, *rest, **more)

    monkeypatch.setattr(crossings, "follow_orbit", follow)
    scene = restarts.scene(*[(51, 39), (34, 61)][seed % 2])
    params = {k: v * rng.uniform(0.99, 1.01) for k, v in scene.params.items()}
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    found = cf.explore(orbit, scene.vary, scene.range, max_periods=2)
    assert lost
    assert found.complete
    assert len(found.branches) > 1
