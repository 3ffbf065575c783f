"""At SS, AS and GS the flow jumps: the regular branch ends, and the solution goes elsewhere at once."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import contfric as cf
from contfric.orbit.solve import refine
from contfric.simulation.starts import signs_at

#: For each kind a scene in which a stable regular branch ends at it.
SCENES = {
    "SS": ({"Omega": 0.5, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    "GS": ({"Omega": 0.5, "S": 0.2, "S0": 0.4}, "S", (0.0, 0.4)),
    "AS": ({"Omega": 0.5, "S": 0.3, "S0": 0.4, "h": 0.28}, "h", (0.2385, 0.3)),
}
#: A simulation of 400 periods stays on a stable orbit to this.
FOLLOWED = 1e-9


@cache
def diagram(kind: str, bridges: bool = True) -> cf.Diagram:
    params, parameter, bounds = SCENES[kind]
    return cf.explore(cf.find_orbit("coulomb", params), parameter, bounds, bridges=bridges)


@pytest.mark.parametrize("kind", SCENES)
def test_without_bridges_the_jumps_are_loose_ends(kind: str) -> None:
    found = diagram(kind, bridges=False)
    assert not any(branch.bridge for branch in found.branches)
    assert found.loose_ends
    for loose in found.loose_ends:
        assert loose.end.reason.name in SCENES
        assert any(p.why == "bridges are switched off" for p in loose.end.bifurcation.proposals)


def start_domain(orbit: cf.Orbit) -> str:
    """The domain in which the first segment of the whole orbit starts."""
    t, *y = orbit.cycle[0]
    mode, signs = orbit.itinerary[0][0], signs_at(orbit.model, t, np.array(y), orbit.vector)
    return next(
        d.name
        for d in orbit.model.domains
        if d.mode == mode and all(d.signs[k] * signs[k] >= 0 for k in ("F+", "F-"))
    )


def stable_end(found: cf.Diagram, kind: str) -> tuple[cf.Branch, int]:
    """A regular branch that is stable up to an end of a kind, and which end it is."""
    for branch in found.branches:
        for side, end in enumerate(branch.ends):
            near = branch.stable[1:4] if side == 0 else branch.stable[-4:-1]
            if not branch.bridge and not branch.mirrored and end.reason.name == kind and near.all():
                return branch, side
    raise AssertionError(f"no stable branch ends at {kind}")


def beside(branch: cf.Branch, side: int, share: float) -> cf.Orbit:
    """The orbit of the branch's itinerary next to an end: inside if positive, beyond it if negative.

    Beyond a stop that has become tangential (GS) the equations have no solution: the tip itself there.
    """
    tip, event = branch[-side], branch.values[-side]
    inward = np.sign(branch.values[1 if side == 0 else -2] - event)
    width = abs(branch.values[-1] - branch.values[0])
    vector = tip.vector.copy()
    vector[branch.model.index_of(branch.parameter)] = event + inward * share * width
    solved = refine(cf.Orbit(branch.system, tip.joints, vector, np.inf))
    assert solved.converged or share < 0.0
    return solved if solved.converged else replace(solved, joints=tip.joints)


def leaves(orbit: cf.Orbit, periods: int = 400) -> float:
    """How far from the stops of an orbit the solution gets that starts on it."""
    start = orbit.cycle[0]
    path = cf.simulate(
        "coulomb",
        orbit.params,
        state=[start[1], 0.0],
        time=float(start[0]),
        periods=periods,
        domain=start_domain(orbit),
    )
    stops = path.states[[exit_ == "v" for _, exit_ in path.itinerary], 0]
    return float(np.max(np.min(np.abs(stops[:, None] - orbit.stops[None, :]), axis=1)))


@pytest.mark.parametrize("kind", SCENES)
def test_the_flow_jumps_beyond_the_event_and_not_before(kind: str) -> None:
    """Before the event its orbit is followed for ever; however little beyond it, the solution leaves it."""
    found = diagram(kind)
    branch, side = stable_end(found, kind)
    for share in (1e-4, 1e-6):
        inside, beyond = beside(branch, side, share), beside(branch, side, -share)
        assert inside.admissible and inside.stable
        assert leaves(inside) < FOLLOWED
        assert not beyond.admissible
        assert leaves(beyond) > 1e-5, (branch, share, leaves(beyond))
    far, near = (leaves(beside(branch, side, -share)) for share in (1e-4, 1e-6))
    assert near > 0.3 * far  # a jump: a hundred times nearer it is as large
