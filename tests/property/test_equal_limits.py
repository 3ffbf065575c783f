"""Static limit equal to the kinetic one: nothing jumps, and events are those of a system of Filippov.

There no load lets a mass either stay or leave. At a stop on the limit with a falling load a slide of
no length goes; at a touch of the limit a slip, at a touch of rest a stick. The solution is the same.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.events.local.jumps import nothing_jumps


def scene(seed: int) -> tuple[cf.Orbit, tuple[float, float]]:
    """Return an orbit of a slowly excited mass, and a range of h in which short slides come and go."""
    rng = np.random.default_rng([65, seed])
    omega, friction = rng.uniform(0.13, 0.3), rng.uniform(0.02, 0.08)
    middle, damping = rng.uniform(-0.2, 0.2), rng.uniform(0.0, 0.02)
    params = {"Omega": omega, "S": friction, "S0": friction, "h": middle, "zeta": damping}
    return cf.find_orbit("coulomb", params, longest=1000), (middle - 0.12, middle + 0.12)


@pytest.mark.parametrize("seed", range(6))
def test_a_diagram_does_not_depend_on_its_start_and_nothing_is_held(seed: int) -> None:
    orbit, bounds = scene(seed)
    found = cf.explore(orbit, "h", bounds)
    assert not found.loose_ends
    assert not any(branch.bridge for branch in found.branches)
    checked = found.verify(3)
    assert checked.passed, str(checked)


def test_short_slides_of_stops_on_the_limit_come_and_go_at_one_event() -> None:
    """From one side the slide goes nowhere, from the other it opens, and both branches meet there."""
    asked: set[str] = set()
    for seed in (1, 9):
        orbit, bounds = scene(seed)
        found = cf.explore(orbit, "h", bounds)
        for event in found.events:
            if event.bifurcation.kind is not cf.Kind.SS:
                continue
            assert len(event.branches) >= 2
            reasons = [str(p) for p in event.proposals if str(p).startswith("accepted")]
            assert len(reasons) == 1
            asked |= {word for word in ("goes nowhere", "before rest") if word in reasons[0]}
    assert asked == {"goes nowhere", "before rest"}


@pytest.mark.parametrize("seed", range(8))
def test_whether_anything_jumps_is_told_by_the_limits(seed: int) -> None:
    """At equal limits nothing does, however orbits move; with the least difference something does."""
    rng = np.random.default_rng(seed)
    friction = float(10.0 ** rng.uniform(-2.0, 0.0))
    params = {"Omega": rng.uniform(0.1, 1.4), "S": friction, "h": rng.uniform(-0.4, 0.4)}
    equal = cf.find_orbit("coulomb", {**params, "S0": friction, "zeta": 0.05}, longest=1000)
    apart = friction * (1.0 + 10.0 ** rng.uniform(-8.0, -1.0))
    other = cf.find_orbit("coulomb", {**params, "S0": apart, "zeta": 0.05}, longest=1000)
    assert nothing_jumps(equal)
    assert not nothing_jumps(other)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", ["storeys", "braced-chain"])
def test_what_others_meet_while_a_contact_rests_is_no_limit_of_its_rest(
    name: str, seed: int
) -> None:
    """Contacts that slip pass their loads, and a clock ticks, while another contact rests."""
    rng = np.random.default_rng([66, seed])
    defaults = cf.load_model(name).defaults
    params = {key: value * float(rng.uniform(0.9, 1.1)) for key, value in defaults.items()}
    equal = cf.find_orbit(name, {**params, "S0": params["S"]}, longest=1000)
    apart = params["S"] * (1.0 + 10.0 ** float(rng.uniform(-8.0, -1.0)))
    other = cf.find_orbit(name, {**params, "S0": apart}, longest=1000)
    assert nothing_jumps(equal)
    assert not nothing_jumps(other)
