"""The oscillator of Fig. 5, declared by its equations: the same diagram through numerical flows."""

from __future__ import annotations

from dataclasses import replace

import pytest

import contfric as cf
from contfric.bvp.system import build_system
from contfric.orbit.solve import refine

PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


@pytest.fixture(scope="module")
def diagrams() -> tuple[cf.Diagram, cf.Diagram]:
    closed, declared = (
        cf.explore(cf.find_orbit(name, PARAMS), "Omega", (0.4, 0.6))
        for name in ("coulomb", "coulomb-yaml")
    )
    return closed, declared


def test_all_bifurcations_agree(diagrams: tuple[cf.Diagram, cf.Diagram]) -> None:
    closed, declared = (
        sorted(
            (b.kind.value, str(b.orbit.signature), b.params["Omega"])
            for b in (n.bifurcation for n in d.nodes)
        )
        for d in diagrams
    )
    assert len(closed) == 12
    assert [b[:2] for b in declared] == [b[:2] for b in closed]
    for (*_, have), (*_, want) in zip(declared, closed, strict=True):
        assert have == pytest.approx(want, abs=1e-9)


def test_branches_and_their_graph_agree(diagrams: tuple[cf.Diagram, cf.Diagram]) -> None:
    closed, declared = diagrams
    assert declared.loose_ends == closed.loose_ends == ()
    assert len(declared.branches) == len(closed.branches)
    assert sorted(dict(declared.graph.degree).values()) == sorted(
        dict(closed.graph.degree).values()
    )
    ends = [
        sorted((b.params["Omega"].min(), b.params["Omega"].max()) for b in d.branches)
        for d in diagrams
    ]
    for have, want in zip(*ends, strict=True):
        assert have == pytest.approx(want, abs=1e-9)


def test_multipliers_agree(diagrams: tuple[cf.Diagram, cf.Diagram]) -> None:
    """At the middle of each branch, solved anew with the flow of the other model."""
    model = cf.load_model("coulomb-yaml")
    for branch in diagrams[0].branches:
        orbit = branch[len(branch) // 2]
        own = orbit.system
        system = build_system(model, own.itinerary, own.periods, own.half)
        again = refine(replace(orbit, system=system))
        assert again.converged
        assert again.x_max == pytest.approx(orbit.x_max, abs=1e-9)
        if not branch.bridge:  # a bridge has an infinite one
            found, wanted = (sorted(abs(o.multipliers)) for o in (again, orbit))
            assert found == pytest.approx(wanted, abs=1e-8)
