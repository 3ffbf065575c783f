"""Orbits of random starts against 50 digits: the first cases of ``benchmarks/stress/orbits.py``.

The whole run is there; here are as many as take seconds, and that an orbit that is off is told.
"""

from __future__ import annotations

from dataclasses import replace

import agreement
import chain
import condition
import numpy as np
import orbits
import pytest
from mpmath import mp

import contfric as cf

PARAMS = {
    "with sticks": {"Omega": 0.5, "S": 0.32, "S0": 0.4},
    "at resonance": {"Omega": 1.0, "S": 0.85, "S0": 0.9},
    "next to the resonance of the third harmonic": {"Omega": 1 / 3, "S": 0.2, "S0": 0.3, "h": 0.2},
    "critically damped": {"Omega": 0.3, "S": 0.05, "S0": 0.3, "zeta": 1.0},
    "never at rest": {"Omega": 3.0, "S": 0.05, "S0": 0.05, "zeta": 0.1},
    "47 periods": {"Omega": 0.727557301185343, "S": 0.004061728723695903, "S0": 0.5916376916550578},
}


def test_random_orbits() -> None:
    report = orbits.run(count=8, seed=11)
    assert not report.failed, report.failed
    assert report.passed["orbit: joints and multipliers"] >= 6
    assert report.passed["state at a late time"] >= 6


@pytest.mark.parametrize("name", PARAMS)
def test_an_orbit_that_is_off_is_told(name: str) -> None:
    orbit = cf.find_orbit("coulomb", PARAMS[name])
    with mp.workdps(chain.DIGITS):
        exact = chain.solve(orbit)
        assert agreement.compare(orbit, exact).fine
        assert agreement.admissible(exact) == ""
        # neither explained, by five times the worst that rounding may do, nor below what is asked
        size = 1.0 + float(abs(orbit.joints).max())
        off = 5.0 * (float(max(condition.sensitivity(exact))) + agreement.ASKED * size)
        assert off < 1e-8
        moved = replace(orbit, joints=orbit.joints + np.array([off, -off, 0.0]))
        assert not agreement.compare(moved, exact).fine


def test_what_is_not_admissible_is_told() -> None:
    """The orbit of 2s above its range: its stick would have a negative duration."""
    orbit = cf.solve_orbit("coulomb", "2s", PARAMS["with sticks"])
    wrong = replace(orbit, joints=orbit.joints[:, :] * 1.0)
    wrong.joints[0, 0] += 2.0 * (orbit.ends[0, 0] - orbit.cycle[0, 0])
    with mp.workdps(chain.DIGITS):
        exact = chain.solve(orbit)
        assert agreement.admissible(exact) == ""
        assert "lasts" in agreement.admissible(exact.moved(chain.joints_of(wrong)))
