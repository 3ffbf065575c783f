"""Folds of what lies between two holds: no pivot of the chain is left there but that of the border."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.orbit.orbit import Orbit

PARAMS = {
    "Omega": 0.10782748445784951,
    "S": 0.0419858440449463,
    "S0": 0.10562633465765163,
    "h": 0.0,
    "zeta": 0.0,
}
RANGE = (-0.09444387654840478, 0.09627017562821895)


@pytest.fixture(scope="module")
def folding() -> list[cf.Branch]:
    """Bridges that fold, of one diagram."""
    diagram = cf.explore(cf.find_orbit("coulomb", PARAMS, longest=1000), "h", RANGE)
    return [
        branch
        for branch in diagram.branches
        if branch.bridge
        and not branch.mirrored
        and any(event.kind is cf.Kind.SN for event in branch.bifurcations)
    ]


def test_folds_are_located_whatever_the_step_and_the_time(folding: list[cf.Branch]) -> None:
    """Within rounding of the fold one step in ten was not solved, and its place was that before."""
    assert len(folding) >= 2
    rng = np.random.default_rng(0)
    period = 2.0 * np.pi / PARAMS["Omega"]
    for branch in folding:
        middle = branch[len(branch) // 2]
        places = []
        for _ in range(20):
            joints = middle.joints.copy()
            joints[:, 0] += period * rng.integers(0, 60)
            start = Orbit(middle.system, joints, middle.vector, middle.residual)
            step = float(10.0 ** rng.uniform(-3.0, -2.0))
            again = cf.continue_orbit(start, "h", RANGE, max_step=step)
            folds = [event for event in again.bifurcations if event.kind is cf.Kind.SN]
            assert all(event.located for event in folds), (branch, step)
            places.append([event.params["h"] for event in folds])
        # of phases of many periods the last digits are lost, and with them the place's
        assert np.ptp(np.array(places), axis=0).max() < 1e-10
