"""Curves of sliding events of asymmetric orbits end where the orbits become symmetric, at the same point."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf

#: Draws of S0 and h in which the branch point of the symmetric orbit meets a sliding event in the plane.
SEEDS = range(4)
#: Half the range of Omega, and the distance in S, where the asymmetric branch has its event near the point.
BESIDE, ASIDE = 0.01, 1e-3


def meeting_points(
    rng: np.random.Generator,
) -> list[tuple[cf.SpecialPoint, dict[str, tuple[float, float]]]]:
    """Return where the curve of a branch point meets a sliding event, at random S0 and h."""
    s0 = rng.uniform(0.37, 0.43)
    start = {"Omega": 0.5, "S": 0.8 * s0, "S0": s0, "h": rng.uniform(0.03, 0.05)}
    branch = cf.continue_orbit(cf.find_orbit("coulomb", start), "Omega", (0.3, 0.7))
    box = {"Omega": (0.1, 0.7), "S": (0.02, s0)}
    points = [e for e in branch.bifurcations if e.kind is cf.Kind.BP]
    curves = [cf.continue_bifurcation(e, ("Omega", "S"), box) for e in points]
    return [(s, box) for c in curves for s in c.special if s.meets in (cf.Kind.CS, cf.Kind.AS)]


def asymmetric_events(special: cf.SpecialPoint) -> list[cf.Bifurcation]:
    """Return the events of the kind that meets, of asymmetric orbits a little aside in S."""
    there = special.params["S"]
    found = []
    for aside in (there - ASIDE, there + ASIDE):
        branch = cf.continue_orbit(special.orbit, "S", (min(there, aside), max(there, aside)))
        orbit = branch[int(np.argmin(np.abs(branch.values - aside)))]
        if abs(orbit.params["S"] - aside) > 1e-9:
            continue  # not on this side of the event
        omega = special.params["Omega"]
        diagram = cf.explore(orbit, "Omega", (omega - BESIDE, omega + BESIDE))
        found += [
            e
            for e in diagram.bifurcations
            if e.kind is special.meets and e.orbit.mirror_distance > 1e-6
        ]
    return found


@pytest.mark.parametrize("seed", SEEDS)
def test_both_curves_have_one_point(seed: int) -> None:
    """The end of the asymmetric orbits' curve is where the branch point's curve meets the same event."""
    checked = 0
    for special, box in meeting_points(np.random.default_rng(seed)):
        for event in asymmetric_events(special):
            curve = cf.continue_bifurcation(event, ("Omega", "S"), box)
            passed = [(s.name, *(round(s.params[name], 8) for name in box)) for s in curve.special]
            assert len(set(passed)) == len(passed)  # it does not come back on itself
            near = [
                end.special
                for end in curve.ends
                if end.special is not None
                and abs(end.special.params["S"] - special.params["S"]) < 1e-4
            ]
            assert [(s.name, s.located) for s in near] == [(f"{event.kind.value}-BP", True)]
            for name in box:
                assert near[0].params[name] == pytest.approx(special.params[name], abs=1e-10)
            checked += 1
    assert checked
