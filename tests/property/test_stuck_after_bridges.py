"""Where a contact slips no more after a bridge: what follows, and slides whose length is rounding."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.models.definition import Model


def _chain(rng: np.random.Generator) -> Model:
    """Return two masses of which the first rubs and the second is driven."""
    k, c, mu = rng.uniform(0.8, 1.2), rng.uniform(0.02, 0.05), rng.uniform(0.35, 0.45)
    return cf.Mechanism(
        np.eye(2),
        c * np.eye(2),
        [[k + 1.0, -1.0], [-1.0, 1.0]],
        contacts={
            "brake": {
                "kind": "friction",
                "velocity": "v1",
                "kinetic": mu,
                "static": mu * rng.uniform(1.1, 1.3),
            }
        },
        force={"q2": "cos(w*t)"},
        parameters={"w": 1.6},
        period="2*pi/w",
    )


@pytest.mark.parametrize("seed", range(3))
def test_either_half_of_a_bridge_leads_to_the_orbit_that_never_slips(seed: int) -> None:
    start = cf.find_orbit(_chain(np.random.default_rng(seed)))
    diagram = cf.explore(start, "w", (1.4, 2.2))
    names = sorted(b.name for b in diagram.branches)
    bridge = next(b for b in diagram.branches if b.bridge)
    stuck = next(b for b in diagram.branches if b[1].resting)
    assert bridge.ends[-1].reason is stuck.ends[0].reason
    orbit = bridge[len(bridge) // 2]
    for half in (orbit, orbit.mirror()):
        again = cf.explore(half, "w", (1.4, 2.2))
        assert sorted(b.name for b in again.branches) == names


@pytest.mark.parametrize("seed", range(3, 6))
def test_work_is_known_where_a_slide_vanishes(seed: int) -> None:
    diagram = cf.explore(cf.find_orbit(_chain(np.random.default_rng(seed))), "w", (1.4, 2.2))
    lasts = np.inf
    for branch in diagram.branches:
        assert np.all(np.isfinite(branch.quantity("work(brake)")))
        lasts = min([lasts, *(np.min(o.ends[:, 0] - o.cycle[:, 0]) for o in branch)])
    assert lasts < 1e-9  # there are such slides
    stuck = next(b for b in diagram.branches if b[1].resting)
    assert not np.any(stuck.quantity("work(brake)"))
