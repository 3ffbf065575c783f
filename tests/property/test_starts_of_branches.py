"""Where a branch begins at an event: what lies between the event and the first point that is solved for.

Relays that slide begin to slip where a load touches its limit (AS). The equations of the new orbit are
singular there, and are first solved at some distance. A fold may be nearer, 1e-6 in the parameter from the
event.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf

ABOUT = {"zeta": 0.05, "w": 10.0, "lam": 0.05, "k": 1.0, "sigma": -1.0, "rho": 1.0}


def relay(index: int) -> tuple[cf.Orbit, tuple[float, float]]:
    """Return an orbit of a random relay that slides, and a range of ``w``."""
    rng = np.random.default_rng([131, index])
    params = {
        n: float(p * (1.0 + m))
        for (n, p), m in zip(ABOUT.items(), rng.uniform(-0.2, 0.2, 6), strict=True)
    }
    return cf.find_orbit("relay-sliding", params, longest=1000), (
        0.9 * params["w"],
        1.15 * params["w"],
    )


@pytest.mark.parametrize(
    "index", [12, pytest.param(7, marks=pytest.mark.slow), pytest.param(15, marks=pytest.mark.slow)]
)
def test_a_branch_has_the_events_that_it_has_from_its_middle(index: int) -> None:
    orbit, bounds = relay(index)
    found = cf.explore(orbit, "w", bounds, max_periods=1)
    begun = 0
    for branch in found.branches:
        begun += any("starts here" in str(end) for end in branch.ends)
        alone = cf.continue_orbit(branch[len(branch) // 2], "w", bounds)
        for kind in (cf.Kind.SN, cf.Kind.AS, cf.Kind.GS):
            one, other = (
                sorted(b.params["w"] for b in each.bifurcations if b.kind is kind)
                for each in (branch, alone)
            )
            assert one == pytest.approx(other, abs=1e-9)
    assert begun


def test_a_slide_along_the_displacement_has_no_extrema_of_rounding() -> None:
    slid = 0
    for index in range(3):
        orbit, bounds = relay(index)
        branch = cf.continue_orbit(orbit, "w", bounds)
        for point in branch[:: max(1, len(branch) // 8)]:
            slid += any(mode == "slide" for mode, _ in point.itinerary)
            stops = point.stops
            assert np.abs(stops - np.roll(stops, 1)).min() > 1e-10
    assert slid
