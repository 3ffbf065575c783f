"""A contact that slips a little is not at rest in between, however little it slips."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rubbing_row import ten_contacts

import contfric as cf
from contfric.events.bifurcation import ACCURACY
from contfric.events.incident.incident import incident_forms
from contfric.events.local.zero_acceleration import only_comes_back
from contfric.models.mode_domains import inside_sign

SAMPLES = 2001


def heights(orbit: cf.Orbit, i: int, surface: str, sign: int) -> Any:
    """Return how far a segment is from a surface, at many times."""
    flow, start = orbit.flow, orbit.begins[i]
    observable, begin = orbit.model.surface_by_name[surface].observable, float(start[0])
    times = np.linspace(0.0, float(orbit.ends[i, 0]) - begin, SAMPLES)
    states = [flow.state(orbit.itinerary[i][0], begin, start[1:], float(t)) for t in times]
    level = flow.level(surface)
    found = [
        flow.observe(observable, begin + float(t), y) for t, y in zip(times, states, strict=True)
    ]
    return sign * (np.array(found) - level)


def test_a_segment_comes_back_where_nothing_inside_is_a_minimum() -> None:
    told = []
    for seed in range(6):
        draw = np.random.default_rng(seed)
        static, omega = draw.uniform(0.3, 0.6), draw.uniform(0.12, 0.5)
        params = {"Omega": omega, "S": static * draw.uniform(0.7, 1.0), "S0": static, "h": 0.02}
        orbit = cf.find_orbit("coulomb", params).as_whole()
        for i, (mode, _) in enumerate(orbit.itinerary):
            for surface in orbit.model.surface_by_name:
                sign = inside_sign(orbit.model, mode, surface)
                if not sign:
                    continue
                rises = np.sign(np.diff(heights(orbit, i, surface, sign)))
                turns = rises[np.flatnonzero(rises[1:] != rises[:-1])]
                farthest = len(turns) > 0 and bool(np.all(turns > 0.0))
                assert only_comes_back(orbit, i, surface) == farthest
                told.append(farthest)
    assert told.count(True) >= 6 and told.count(False) >= 6


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "above", "below"), [(4, 0.97996, 0.97994), (3, 0.94436, 0.94434)])
def test_a_slip_that_is_about_to_vanish_opens_few_forms(
    seed: int, above: float, below: float
) -> None:
    orbit = cf.find_orbit(ten_contacts(seed), {"Omega": above}, periods=1)
    branch = cf.continue_orbit(orbit, "Omega", (below, above + 1e-5))
    events = [end.bifurcation for end in branch.ends if end.bifurcation is not None]
    assert len(events) == 1 and events[0].kind == "CS" and events[0].accuracy > ACCURACY
    incident = incident_forms(events[0])
    assert len(incident.forms) <= 4  # two contacts change in either order, in each half
    assert not any("touched" in form.reason for form in incident.forms)
