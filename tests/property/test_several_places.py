"""Events at which several slides of no length come in at once: how far each of them opens."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.leaving.several_locations import Opening, opening_together
from contfric.events.bifurcation import TERMINAL
from contfric.events.incident.candidates import sequences_of
from contfric.events.incident.incident import Incident, incident_forms
from contfric.events.incident.unit import Form

#: A static limit far above the kinetic one: rest may be left where its acceleration falls through zero.
SCENE = {"Omega": 0.2935828642, "S": 0.122850703873, "S0": 0.49363345839, "h": 0.143075872}


def events(seed: int) -> Iterator[tuple[Incident, int]]:
    """Yield the sliding events of a small random diagram, and the index of the parameter."""
    rng = np.random.default_rng(seed)
    params = {name: value * (1.0 + rng.uniform(-0.05, 0.05)) for name, value in SCENE.items()}
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    h = params["h"]
    diagram = cf.explore(orbit, "h", (h - 0.03, h + 0.03), max_periods=1, max_branches=12)
    active = orbit.model.index_of("h")
    for node in diagram.nodes:
        if node.bifurcation.kind in TERMINAL and not node.mirrored:
            yield incident_forms(node.bifurcation), active


def opened(incident: Incident) -> Iterator[Form]:
    """Yield the forms in which a slide of no length comes in."""
    return (form for form in incident.forms if np.any(form.away))


def test_places_that_are_alike_open_alike() -> None:
    """An orbit that is run through k times has its place k times, and each opens as far as the others."""
    asked = 0
    for seed in range(2, 4):
        for incident, active in events(seed):
            for form in opened(incident):
                for copies in (2, 3):
                    orbit, away = incident.unit.orbit((form,) * copies)
                    ways = [way.at(np.max(np.abs(away))) for way in opening_together(orbit, active)]
                    assert len(ways) == 2
                    wanted = away
                    for way, sign in zip(
                        ways, np.sign([w[:, 0] @ wanted for w in ways]), strict=True
                    ):
                        np.testing.assert_allclose(sign * way[:, 0], wanted, atol=1e-6)
                        np.testing.assert_allclose(way[:, 1:], 0.0, atol=1e-6)
                    asked += 1
    assert asked >= 6


def test_one_place_needs_no_proportion() -> None:
    """Where one place is singular, or none, nothing is proposed."""
    for incident, active in events(1):
        for candidate in sequences_of(incident):
            if candidate.orbit is not None and not candidate.orbit.system.half:
                places = 0 if candidate.away is None else int(np.sum(candidate.away[:, 0] > 0.0))
                assert places > 1 or not list(opening_together(candidate.orbit, active))


#: In its events one half of an orbit stops tangentially, and a slide of no length comes in in the other.
MIXED = {"Omega": 0.224148285, "S": 0.40331387, "S0": 0.88561545, "h": 0.276719682, "zeta": 1e-7}


@pytest.mark.parametrize("seed", [0, 2])
def test_places_of_different_orders(seed: int) -> None:
    """A root and a third root of the parameter: the bridge with one hold is found from either side of it."""
    rng = np.random.default_rng(seed)
    params = {name: value * (1.0 + rng.uniform(-0.01, 0.01)) for name, value in MIXED.items()}
    orbit = cf.find_orbit("coulomb", params, longest=1000)
    diagram = cf.explore(orbit, "h", (0.165, 0.424))
    plain = next(b for b in diagram.branches if b.name == "2s")
    again = cf.explore(plain[len(plain) // 2], "h", (0.165, 0.424))
    assert any("1hold" in b.name for b in diagram.branches)
    assert sorted(b.name for b in again.branches) == sorted(b.name for b in diagram.branches)


def test_orders_differ() -> None:
    """Half as far away the places open in another proportion, as their orders say."""
    freedoms = np.zeros((2, 4, 3))
    freedoms[0, 1, 0] = freedoms[1, 3, 0] = 1.0
    way = Opening(freedoms, np.array([-2.0, 5.0]), np.array([2.0, 3.0]))
    for distance in (1e-2, 1e-4):
        moved = way.at(distance)[:, 0]
        assert np.max(np.abs(moved)) == pytest.approx(distance, rel=1e-12)
        assert (moved[1] / 2.0) ** 2 == pytest.approx((moved[3] / 5.0) ** 3, rel=1e-9)
        assert moved[1] < 0.0 < moved[3]


@pytest.mark.slow
def test_bridge_of_four_periods_with_two_openings() -> None:
    """Two of its four periods begin with a slide of no length at the event: it is found from either side."""
    orbit = cf.find_orbit("coulomb", {**SCENE, "zeta": 0.0}, longest=1000)
    diagram = cf.explore(orbit, "h", (0.000257954805, 0.283842482943), max_branches=1000)
    at_event = [n for n in diagram.events if abs(n.bifurcation.params["h"] - 0.1388625) < 1e-4]
    assert any(
        "6hold" in diagram.branches[i].name and diagram.branches[i].system.periods == 4
        for node in at_event
        for i in node.branches
    )
    assert not any("without any width" in p.why for node in at_event for p in node.proposals)
