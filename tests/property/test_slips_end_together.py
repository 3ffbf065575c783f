"""Many contacts: where slips of several contacts end just after another event, the diagram goes on."""

from __future__ import annotations

import pytest
from rubbing_row import ten_contacts

import contfric as cf

#: Random structures, and a range of Omega in which two slips vanish within 3e-6 of another change.
_SCENES = {4: (0.9785, 0.9825), 14: (0.9445, 0.9460), 3: (0.9290, 0.9301)}


@pytest.mark.parametrize("seed", [*_SCENES])
def test_a_curve_of_orbits_goes_through_the_range(seed: int) -> None:
    """Damping and friction leave one orbit at each Omega: a diagram that ends inside has lost a branch."""
    low, high = _SCENES[seed]
    orbit = cf.find_orbit(ten_contacts(seed), {"Omega": high - 1e-4}, periods=1)
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
