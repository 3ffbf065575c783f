"""A location takes few solves: no trial follows rounding."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.base.tally import tally
from contfric.continuation.locating import change_of_sign

#: Rounding of a margin at a located event, several units in the last place of numbers of order 1.
ROUNDING = 1e-13
#: Branches with folds, tangencies, and sliding events at their ends.
STARTS = [
    ({"Omega": 0.5, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    ({"Omega": 0.48, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    ({"Omega": 0.5, "S": 0.32, "S0": 0.4, "h": 0.2, "zeta": 0.05}, "Omega", (0.3, 0.8)),
    ({"Omega": 0.415, "S": 0.098, "S0": 0.2}, "Omega", (0.3, 0.55)),
    ({"Omega": 0.56, "S": 0.315, "S0": 0.476}, "Omega", (0.4, 0.7)),
]


@pytest.mark.parametrize("params, parameter, bounds", STARTS)
def test_an_event_is_located_in_few_solves_to_its_rounding(
    monkeypatch: pytest.MonkeyPatch,
    params: dict[str, float],
    parameter: str,
    bounds: tuple[float, float],
) -> None:
    solves: list[int] = []
    located = change_of_sign._located

    def counted(*given: Any) -> Any:
        before = int(tally()[0])
        found = located(*given)
        solves.append(int(tally()[0]) - before)
        return found

    monkeypatch.setattr(change_of_sign, "_located", counted)
    branch = cf.continue_orbit(cf.find_orbit("coulomb", params), parameter, bounds)
    assert len(branch.bifurcations) > 1
    assert np.median(solves) <= 9  # 9 to 20 if trials follow rounding
    for event in branch.bifurcations:
        tests = event.orbit.system.tests
        for test in (t for t in event.tests if t in tests):
            assert abs(event.orbit.margins[tests.index(test)]) < ROUNDING
