"""Jenkins elements beside friction with a static limit: the one does not jump where the other does."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.events.bifurcation import Kind
from tests.random_structures import Contact, Stepped

#: The force down to which branches are followed: the element slips no more.
LEAST = 0.5


def structure(seed: int, size: float = 1.0) -> tuple[cf.Model, Stepped]:
    """Return two masses, one that rubs and one on a Jenkins element, under a force, and their equations."""
    draw = np.random.default_rng([7, seed])
    mass, coupling = np.diag(draw.uniform(0.8, 1.4, 2)), draw.uniform(0.05, 0.15)
    stiffness = np.diag(draw.uniform(0.8, 1.4, 2)) + coupling * np.array([[1, -1], [-1, 1]])
    damping = draw.uniform(0.02, 0.06) * np.eye(2)
    params = {
        "Omega": float(draw.uniform(0.6, 0.8)),
        "F": size,
        "S": float(draw.uniform(0.05, 0.1)),
    }
    force = {
        "q1": f"F*cos(Omega*t + {draw.uniform(0.0, 6.0)})",
        "q2": f"F*(cos(Omega*t) + {draw.uniform(0.1, 0.3)}*cos(2*Omega*t + {draw.uniform(0.0, 6.0)}))",
    }
    rubs = {"kind": "friction", "velocity": "v1", "kinetic": "S", "static": "1.3*S"}
    k = float(draw.uniform(0.8, 1.6))
    limit = k * float(draw.uniform(0.45, 0.6))
    slips = {"kind": "jenkins", "displacement": "q2", "stiffness": k, "limit": limit}
    model = cf.Mechanism(
        mass, damping, stiffness, contacts={"rub": rubs, "slip": slips}, force=force,
        parameters=params, period="2*pi/Omega", name="beside",
    )  # fmt: skip
    contacts = [Contact("friction", np.eye(2)[0], rubs), Contact("jenkins", np.eye(2)[1], slips)]
    return model, Stepped((mass, damping, stiffness), force, contacts, params)


@pytest.mark.parametrize("seed", range(3, 6))
def test_a_branch_goes_on_where_the_element_stops_slipping(seed: int) -> None:
    """All slips of the element vanish at once; its offset is conserved from there on."""
    model, _ = structure(seed)
    diagram = cf.explore(cf.find_orbit(model), "F", (LEAST, 1.0))
    assert not diagram.loose_ends
    (event,) = (e for e in diagram.events if e.bifurcation.kind is Kind.GS)
    slipping, sticking = (diagram.branches[i] for i in event.branches)
    assert sticking.params["F"].min() == LEAST
    (end,) = (end for end in slipping.ends if end.reason.name == "GS")
    assert "continuous" in end.message
    for branch in (slipping, sticking):
        # an orbit inside, stepped without contfric from where the mass slides and the element does not slip
        orbit = branch[len(branch) // 2]
        sliding = [mode[0] in "pn" and mode[1] == "s" for mode, _ in orbit.itinerary]
        i = int(np.argmax(np.where(sliding, orbit.durations, 0.0)))
        start = float(orbit.begins[i, 0] + 0.5 * orbit.durations[i])
        y = orbit.state(start)
        _, stepped = structure(seed, orbit.params["F"])
        modes = stepped.begun(start, y)
        back, _ = stepped.run(start, y, start + orbit.period, modes)
        assert np.max(np.abs(back - y)) < 1e-8
