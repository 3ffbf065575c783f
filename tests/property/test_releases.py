"""Releases of contacts in random structures: the field is continuous there, if the friction force is."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.bvp.assembly import following_modes
from contfric.bvp.passages import Passage, passage_at

CONTACTS = 3


def structure(seed: int, static: float = 1.0) -> cf.Mechanism:
    """Return random masses on springs, all of which rub; the force is on the first."""
    draw = np.random.default_rng(seed)
    beside = np.diag(draw.uniform(0.3, 0.7, CONTACTS - 1), 1)
    beside = beside + beside.T
    stiffness = np.diag(draw.uniform(0.8, 1.2, CONTACTS) + beside.sum(axis=1)) - beside
    rubs = {}
    for k in range(1, CONTACTS + 1):
        force = float(draw.uniform(0.5, 1.5))
        rubs[f"b{k}"] = {"kind": "friction", "velocity": f"v{k}", "kinetic": f"{force:.4f}*S"}
        if static != 1.0:
            rubs[f"b{k}"]["static"] = f"{static * force:.4f}*S"
    return cf.Mechanism(
        np.diag(draw.uniform(0.8, 1.2, CONTACTS)),
        0.05 * stiffness,
        stiffness,
        contacts=rubs,
        force={"q1": "cos(Omega*t)"},
        parameters={"Omega": float(draw.uniform(0.5, 0.8)), "S": 0.2},
        period="2*pi/Omega",
    )


def joints_of(orbit: cf.Orbit) -> set[tuple[str, str, str]]:
    """Return the modes before and after each joint of an orbit, with the surface between."""
    system = orbit.system
    after = following_modes(orbit.model, system.itinerary, system.half)
    return {(mode, exit_, to) for (mode, exit_), to in zip(system.itinerary, after, strict=True)}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("static", [1.0, 1.3])
def test_the_field_jumps_at_a_release_where_the_static_force_is_larger(seed, static) -> None:
    """A contact at its limit has the force of one that slides, unless the static one is larger."""
    model = structure(seed, static)
    orbit = cf.find_orbit(model)
    releases = 0
    for mode, exit_, to in joints_of(orbit):
        released = [k for k in range(CONTACTS) if mode[k] == "s" and to[k] != "s"]
        if released and exit_[-1] in "+-":
            releases += 1
            expected = Passage.CONTINUOUS if static == 1.0 else Passage.JUMP
            assert passage_at(model, mode, exit_, to) is expected
        elif any(a + b in ("np", "pn") for a, b in zip(mode, to, strict=True)):
            assert passage_at(model, mode, exit_, to) is Passage.JUMP  # friction is reversed
    stuck = [k for k in range(CONTACTS) if all(mode[k] == "s" for mode, _ in orbit.itinerary)]
    sticks = [k for k in range(CONTACTS) if any(mode[k] == "s" for mode, _ in orbit.itinerary)]
    assert bool(releases) is (sticks != stuck)
