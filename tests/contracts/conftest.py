"""The orbit, branch and diagram of Fig. 5, which most of these tests look at: computed once."""

from __future__ import annotations

import pytest

import contfric as cf


@pytest.fixture(scope="session")
def orbit() -> cf.Orbit:
    return cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})


@pytest.fixture(scope="session")
def branch(orbit: cf.Orbit) -> cf.Branch:
    return cf.continue_orbit(orbit, "Omega", (0.4, 0.6))


@pytest.fixture(scope="session")
def diagram(orbit: cf.Orbit) -> cf.Diagram:
    return cf.explore(orbit, "Omega", (0.4, 0.6))
