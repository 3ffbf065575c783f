"""Searches for an orbit that take long say how far they are."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf

#: Aperiodic, as a study of tests/contracts/test_study.py is.
APERIODIC = {"Omega": 0.35, "S": 0.1, "S0": 0.4}


def test_a_long_simulation_says_how_far_it_is():
    said: list[str] = []
    with pytest.raises(cf.AperiodicError) as raised:
        cf.find_orbit("coulomb", APERIODIC, longest=1000, progress=said.append)
    assert "simulating: 200 periods without an orbit, then 800 more" in said
    with pytest.raises(cf.AperiodicError) as silent:
        cf.find_orbit("coulomb", APERIODIC, longest=1000)
    assert np.array_equal(raised.value.result.times, silent.value.result.times)


def test_starts_and_candidates_are_counted():
    params = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
    said: list[str] = []
    found = cf.solve_orbit("coulomb", "2s", params, progress=said.append)
    assert np.array_equal(found.joints, cf.solve_orbit("coulomb", "2s", params).joints)
    starts = [text for text in said if text.startswith("simulating from start ")]
    assert starts[:2] == ["simulating from start 1 of 150", "simulating from start 2 of 150"]
    assert said[150].startswith("solving: candidate 1 of ")


def test_a_simulation_says_how_many_events_it_has():
    said: list[str] = []
    found = cf.simulate("coulomb", APERIODIC, periods=100_000, progress=said.append)
    numbers = [int(text.removesuffix(" events")) for text in said]
    assert numbers == sorted(set(numbers))
    assert 0 < numbers[0] <= numbers[-1] <= len(found)


@pytest.mark.parametrize(
    "call",
    [
        lambda: cf.find_orbit("coulomb", progress="loud"),
        lambda: cf.solve_orbit("coulomb", "1a", {"S": 0.32}, progress="loud"),
        lambda: cf.simulate("coulomb", progress="loud"),
    ],
)
def test_what_hears_is_a_function(call):
    with pytest.raises(cf.ParameterError, match="progress is a function of one text"):
        call()
