"""A step that ends at the very event that ends a branch: what belongs to the event is not listed before."""

from __future__ import annotations

import numpy as np

import contfric as cf


def test_a_point_on_a_crossing_sliding_makes_no_tangency() -> None:
    """The orbit 0s does not depend on S0: points lie at offsets that are known, whatever the start."""
    rng, landed = np.random.default_rng(5), 0
    for _ in range(10):
        S = float(rng.uniform(0.1, 0.5))
        params = {"Omega": rng.uniform(0.3, 0.8), "S": S, "S0": S, "h": rng.uniform(-0.1, 0.2)}
        params["zeta"] = rng.uniform(0.0, 0.1)
        try:
            orbit = cf.solve_orbit("coulomb", "0s", params)
        except cf.ConvergenceError:
            continue
        branch = cf.continue_orbit(orbit, "S0", (S, 2.0 * S))
        event = branch.ends[1].bifurcation
        if event is None or event.kind is not cf.Kind.CS:
            continue
        at = event.params["S0"]
        wanted = [b.label for b in branch.bifurcations]
        for offset in (branch.values - branch.values[0])[2:5].tolist():
            if at - offset <= S:
                continue
            start = cf.solve_orbit("coulomb", "0s", params | {"S0": at - offset})
            found = cf.continue_orbit(start, "S0", (S, 2.0 * S))
            landed += int(np.sum(np.abs(found.values - at) < 1e-14 * at) > 1)
            assert [b.label for b in found.bifurcations] == wanted, start.params
    assert landed >= 3
