"""The engine does not notice whether a solution is a closed form or integrated."""

from __future__ import annotations

from dataclasses import replace

import coulomb_integrated
import numpy as np
import pytest

import contfric as cf

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


@pytest.fixture(scope="module")
def orbits():
    closed = cf.load_model("coulomb")
    integrated = replace(closed, flow_factory=coulomb_integrated.compiled_flow)
    return [cf.find_orbit(model, PARAMS) for model in (closed, integrated)]


def facts(branch: cf.Branch) -> tuple[object, ...]:
    """What is the same whatever the order of the branches and the direction they are run in."""
    # in the middle: at an event itself rounding decides on which side of a surface a joint is
    middle = branch[len(branch) // 2]
    return (
        len(middle.itinerary),
        sorted(map(str, middle.itinerary)),
        sorted(e.reason.name for e in branch.ends),
    )


def test_orbit(orbits):
    closed, integrated = orbits
    assert integrated.signature == closed.signature
    assert integrated.x_max == pytest.approx(closed.x_max, abs=1e-11)
    assert np.abs(np.abs(integrated.multipliers) - np.abs(closed.multipliers)).max() < 1e-10


def test_diagram_of_figure_5(orbits):
    closed, integrated = (cf.explore(orbit, "Omega", (0.40, 0.60)) for orbit in orbits)
    assert len(integrated.branches) == len(closed.branches)
    assert len(integrated.loose_ends) == len(closed.loose_ends) == 0
    found, expected = (
        sorted((b.kind.value, b.params["Omega"]) for b in diagram.bifurcations)
        for diagram in (integrated, closed)
    )
    assert [kind for kind, _ in found] == [kind for kind, _ in expected]
    assert np.array([w for _, w in found]) == pytest.approx([w for _, w in expected], abs=1e-9)
    assert sorted(map(facts, integrated.branches)) == sorted(map(facts, closed.branches))
