"""Many contacts: where slips of several contacts end just after another event, the diagram goes on."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf

_MASSES, _DAMPING = 20, 0.02
#: Random structures, and a range of Omega in which two slips vanish within 3e-6 of another change.
_SCENES = {4: (0.9785, 0.9825), 14: (0.9445, 0.9460), 3: (0.9290, 0.9301)}


def _structure(seed: int) -> cf.Model:
    """Return masses on springs of their own and between neighbours, ten of them rubbing."""
    draw = np.random.default_rng(seed)
    beside = np.diag(draw.uniform(0.6, 1.4, _MASSES - 1) * 0.5, 1)
    beside = beside + beside.T
    stiffness = np.diag(draw.uniform(0.8, 1.2, _MASSES) + beside.sum(axis=1)) - beside
    mass = np.diag(draw.uniform(0.8, 1.2, _MASSES))
    rubs = {
        f"b{i}": {
            "kind": "friction",
            "velocity": f"v{i}",
            "kinetic": f"{draw.uniform(0.5, 1.5):.4f}*S",
        }
        for i in sorted(int(i) for i in draw.choice(np.arange(1, _MASSES + 1), 10, replace=False))
    }
    return cf.Mechanism(
        mass,
        _DAMPING * stiffness,
        stiffness,
        contacts=rubs,
        force={"q1": "cos(Omega*t)"},
        parameters={"Omega": 1.0, "S": 0.03},
        period="2*pi/Omega",
    )


@pytest.mark.parametrize("seed", [*_SCENES])
def test_a_curve_of_orbits_goes_through_the_range(seed: int) -> None:
    """Damping and friction leave one orbit at each Omega: a diagram that ends inside has lost a branch."""
    low, high = _SCENES[seed]
    orbit = cf.find_orbit(_structure(seed), {"Omega": high - 1e-4}, periods=1)
    found = cf.explore(orbit, "Omega", (low, high), max_step=0.01, max_periods=1)
    assert found.loose_ends == ()
    ends = [end.reason for branch in found.branches for end in branch.ends]
    assert ends.count(cf.EndReason.RANGE) in (2, 4)  # with the mirror image
    spans = sorted((float(b.values.min()), float(b.values.max())) for b in found.branches)
    assert spans[0][0] == pytest.approx(low) and max(s[1] for s in spans) == pytest.approx(high)
    covered = low
    for first, last in spans:
        assert first <= covered + 1e-8
        covered = max(covered, last)
    for event in found.bifurcations:
        assert event.accuracy < 1e-4
