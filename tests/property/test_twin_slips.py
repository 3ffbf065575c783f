"""Two slips that vanish at once, as a contact off its centre makes them: diagrams go on, without twins."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.matching import inner_orbit, on_branch
from contfric.bvp.conserved import conserved
from contfric.orbit.itinerary.one_way import only_grows

MASSES, CONTACTS = 6, 5


def chain(seed: int) -> tuple[cf.Model, float]:
    """Random masses and springs; of five contacts the last one never slips."""
    draw = np.random.default_rng(seed)
    beside = np.diag(draw.uniform(0.6, 1.4, MASSES - 1) * 0.5, 1)
    beside = beside + beside.T
    stiffness = np.diag(draw.uniform(0.8, 1.2, MASSES) + beside.sum(axis=1)) - beside
    mass = np.diag(draw.uniform(0.8, 1.2, MASSES))
    which = np.sort(draw.choice(np.arange(1, MASSES + 1), CONTACTS, replace=False))
    limits = draw.uniform(0.5, 1.5, CONTACTS)
    limits[-1] *= 40.0
    rubs = {
        f"b{k}": {"kind": "friction", "velocity": f"v{i}", "kinetic": f"{limit:.4f}*S"}
        for k, (i, limit) in enumerate(zip(which, limits, strict=True), start=1)
    }
    low = float(np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real.min()))
    model = cf.Mechanism(
        mass,
        0.02 * stiffness,
        stiffness,
        contacts=rubs,
        force={"q1": "0.2*cos(Omega*t)"},
        parameters={"Omega": 1.06 * low, "S": 0.03},
        period="2*pi/Omega",
    )
    return model, low


@pytest.mark.parametrize("seed", [2, pytest.param(1, marks=pytest.mark.slow)])
def test_a_diagram_goes_on_where_two_slips_vanish_at_once(seed: int) -> None:
    model, low = chain(seed)
    orbit = cf.find_orbit(model, periods=1, at={"b5": 0.02})
    bounds = 0.9 * low, 1.12 * low
    diagram = cf.explore(orbit, "Omega", bounds, max_step=0.02, max_periods=1)
    assert not diagram.loose_ends
    own = [branch for branch in diagram.branches if not branch.mirrored]
    assert min(b.values.min() for b in own) == pytest.approx(bounds[0])
    assert max(b.values.max() for b in own) == pytest.approx(bounds[1])
    # the events at which slips vanish are known from the branch without them, and from that with them
    known = [b for b in diagram.bifurcations if b.kind is cf.Kind.AS]
    assert known
    assert all(b.accuracy < 1e-5 for b in known)
    for event in (end.bifurcation for branch in own for end in branch.ends):
        here = None if event is None else event.params["Omega"]
        assert here is None or any(
            abs(here - b.params["Omega"]) < 1e-9 for b in diagram.bifurcations
        )
    for one, other in combinations(own, 2):
        assert not on_branch(inner_orbit(one), other)
    # nothing grows along what all modes conserve, the place of the contact that never slips
    for branch in own:
        itinerary = branch.system.itinerary
        assert len(conserved(model, itinerary)) >= 1
        assert only_grows(model, itinerary) == ()
