"""Holds after a touch of the limit where the load has a second maximum of the same height.

A hold begins at the first of them. At h = -1/9 the two become one, and the bridge ends there.
"""

from __future__ import annotations

import numpy as np

import contfric as cf

#: Where two maxima of cos t + h cos 3t become one.
PLACE = -1.0 / 9.0
PARAMS = {"Omega": 0.09731693683522122, "S": 0.1869600545674701, "S0": 0.21919897417757248}
RANGE = (-0.1161, -0.1)


def bridge_below() -> cf.Branch:
    """Return a bridge with two mirrored holds after touches, below the place."""
    orbit = cf.find_orbit("coulomb", {**PARAMS, "h": 0.0, "zeta": 0.0}, longest=1000)
    found = cf.explore(orbit, "h", (-0.1487, 0.0796), max_branches=3)
    return next(b for b in found.branches if b.bridge and b.values.min() < RANGE[0])


def test_a_bridge_ends_where_maxima_of_equal_height_become_one() -> None:
    """Whatever the start and the step: no step takes it on to the later maximum, and back."""
    rng = np.random.default_rng(9)
    bridge = bridge_below()
    inside = np.flatnonzero((bridge.values > RANGE[0]) & (bridge.values < -0.1125))
    for _ in range(40):
        orbit = bridge[int(rng.choice(inside))]
        step = float(np.exp(rng.uniform(np.log(0.003), np.log(0.02))))
        branch = cf.continue_orbit(orbit, "h", RANGE, max_step=step)
        (event,) = [end.bifurcation for end in branch.ends if end.bifurcation is not None]
        assert event.kind is cf.Kind.AS
        assert event.accuracy <= 1e-5
        assert abs(event.params["h"] - PLACE) < event.accuracy * (RANGE[1] - RANGE[0])
        phases = branch.joints[:, orbit.system.holds[0].segment, 0] * PARAMS["Omega"]
        assert np.all(np.diff(phases * np.sign(phases[-1] - phases[0])) >= -1e-9)


def test_a_diagram_goes_on_there_whatever_its_step() -> None:
    """Diagrams in random steps have the same branches, and no loose end, on both sides of the place."""
    rng = np.random.default_rng(14)
    orbit = cf.find_orbit("coulomb", {**PARAMS, "h": 0.0, "zeta": 0.0}, longest=1000)
    names = set()
    for step in (0.01, *np.exp(rng.uniform(np.log(0.004), np.log(0.02), 3))):
        found = cf.explore(
            orbit, "h", (-0.1487094461569871, 0.07962247999486496), max_step=float(step)
        )
        assert not found.loose_ends
        (there,) = [e for e in found.events if abs(e.bifurcation.params["h"] - PLACE) < 1e-6]
        sides = sorted(found.branches[k].values.mean() - PLACE for k in there.branches)
        assert len(sides) == 2 and sides[0] < 0.0 < sides[1]
        names.add(tuple(sorted(branch.name for branch in found.branches)))
    assert len(names) == 1
