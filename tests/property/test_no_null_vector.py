"""Events at which the Jacobian of an orbit has entries that are no numbers."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.continuation.singular_points import switching

_START = {"Omega": 0.47, "S": 0.32, "S0": 0.4}


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_departure_without_a_null_vector_is_refused(
    wrong: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_numbers(system: object, joints: np.ndarray, vector: object) -> np.ndarray:
        return np.full((joints.size, joints.size), wrong)

    monkeypatch.setattr(switching, "assembled", no_numbers)
    orbit = cf.find_orbit("coulomb", _START)
    diagram = cf.explore(orbit, "Omega", (0.44, 0.5))
    told = [p.why for b in diagram.bifurcations for p in b.proposals]
    assert "its equations have no derivatives here" in told
