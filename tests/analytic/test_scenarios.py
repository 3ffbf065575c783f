"""Persistence, non-smooth folds and jumps, against what is known of the events from elsewhere."""

from __future__ import annotations

import contfric as cf
from contfric.atlas.scenario import Scenario, scenario_of


def says(found: cf.Diagram, kind: str) -> list[Scenario | None]:
    return [found.scenario(e) for e in found.events if e.bifurcation.kind.value == kind]


def test_an_impact_annihilates_the_orbit_without() -> None:
    """Linear response and the orbit with an impact of low speed exist below the grazing (test_impact.py)."""
    found = cf.explore(cf.find_orbit("impact"), "A", (0.05, 1.0))
    assert says(found, "GS") == [Scenario.FOLD]
    assert says(found, "SN") == [None]


def test_gears_that_part_persist() -> None:
    """The stiffness of the mesh has a jump of its slope only: the response goes on through the grazing."""
    found = cf.explore(cf.find_orbit("gear-pair", {"W": 1.3}), "W", (1.0, 1.4))
    assert says(found, "GS") == [Scenario.PERSISTENCE]


def test_fig05_jumps_where_it_is_bridged() -> None:
    """The paper's orbit persists at its CS; at both SS motion jumps, and bridges alone join the branches."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    found = cf.explore(orbit, "Omega", (0.4, 0.6))
    assert says(found, "CS") == [Scenario.PERSISTENCE]
    assert says(found, "SS") == [Scenario.JUMP, Scenario.JUMP]
    bridges = [i for i, b in enumerate(found.branches) if b.bridge]
    for event in found.events:
        if event.bifurcation.kind.value == "SS":
            assert set(event.branches) & set(bridges)
            assert scenario_of(found, event) is Scenario.JUMP
