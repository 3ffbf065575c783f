"""Along a branch the turn changes with the parameter: segments add up to the turn of their own point."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.continuation.locating.vanishing_together import _lasts, _rates
from contfric.continuation.points import settings_of
from contfric.continuation.start import start_of
from contfric.continuation.trace import trace_side


@pytest.mark.parametrize(("name", "omega", "half"), [("1a", 0.5, False), ("2s", 0.48, True)])
def test_segments_add_up_to_the_turn_of_their_own_point(
    name: str, omega: float, half: bool
) -> None:
    orbit = cf.solve_orbit("coulomb", name, {"Omega": omega, "S": 0.32, "S0": 0.4})
    settings = settings_of(orbit, "Omega", (0.4, 0.6), None, True, 1000)
    orbit, start = start_of(orbit, settings)
    assert orbit.system.half is half
    active = orbit.model.index_of("Omega")
    side = trace_side(orbit, start, settings)
    values = side.rows.values
    assert np.ptp(values) > 0.01
    for k, value in enumerate(values):
        lasts = _lasts(side.rows.point(k), orbit, active)
        turn = (np.pi if half else 2.0 * np.pi) / value
        assert lasts.sum() == pytest.approx(turn, rel=1e-13)
        assert lasts.min() > -1e-9
        point, step = side.rows.point(k), 1e-5
        ahead, behind = (point.along(orbit, active, s).durations for s in (step, -step))
        change = (ahead - behind)[: len(lasts)] / (2.0 * step)
        assert _rates(point, orbit, active) == pytest.approx(change, abs=1e-8 * (1.0 + turn))
