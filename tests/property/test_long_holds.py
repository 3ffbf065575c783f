"""Holds that go on while another contact changes its state: solutions of the inclusion, and complete."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness.verification import verify
from contfric.bvp.holds import Hold
from contfric.signature import parse_signature
from contfric.signature.holds import is_hold
from contfric.signature.reduced import canonical_itinerary, reduced_itinerary

#: Scenes drawn (with the largest static over the kinetic limit) with holds that begin at a touch of rest (GS)
#: or of the limit (AS), and go through two modes or three.
SEEDS = ((78, 6, 1.6), (79, 51, 2.6), (79, 39, 2.6), (78, 33, 1.6), (79, 24, 2.6), (79, 58, 2.6))
#: What a state may differ by from one that is simulated, and a load from its limit.
MOTION = 1e-9
NAMES = ("low", "high")


@cache
def drawn(of: int, seed: int, most: float) -> cf.Diagram:
    """Explore two masses on friction, the first of which is driven."""
    r = np.random.default_rng([of, seed])
    k = r.uniform(0.5, 1.5)
    kinetic = [r.uniform(0.1, 0.3) for _ in NAMES]
    static = [s * r.uniform(1.05 if most < 2.0 else 1.3, most) for s in kinetic]
    force, w = r.uniform(0.5, 1.2), r.uniform(0.3, 0.9)
    stiffness = np.array([[1.0 + k, -k], [-k, 1.0 + k]])
    limits = dict(zip(("S1", "S2", "T1", "T2"), (*kinetic, *static), strict=True))
    model = cf.Mechanism(
        np.eye(2),
        0.04 * stiffness,
        stiffness,
        contacts={
            name: {"kind": "friction", "velocity": f"v{i}", "kinetic": f"S{i}", "static": f"T{i}"}
            for i, name in enumerate(NAMES, 1)
        },
        force={"q1": "F*cos(w*t)"},
        parameters={"w": w, "F": force, "k": k, **limits},
        period="2*pi/w",
    )
    return cf.explore(cf.find_orbit(model), "w", (0.85 * w, 1.15 * w), max_periods=1)


def long_holds(diagram: cf.Diagram) -> list[tuple[cf.Orbit, Hold, Hold]]:
    """Return orbits along the bridges with such holds, with the first and the last part of each."""
    found = []
    for branch in (b for b in diagram.branches if not b.mirrored):
        for point in branch[1 : -1 : max(1, len(branch) // 4)]:
            whole = point.as_whole()
            found += [(whole, *hold) for hold in whole.system.ends_of_holds if hold[0] != hold[1]]
    return found


def load(orbit: cf.Orbit, contact: int, joint: np.ndarray) -> float:
    """Return the force on a mass at rest without its friction."""
    p, (t, q1, q2, v1, v2) = orbit.params, joint
    k, q, v = p["k"], (q1, q2), (v1, v2)
    spring = (1.0 + k) * q[contact] - k * q[1 - contact]
    damper = 0.04 * ((1.0 + k) * v[contact] - k * v[1 - contact])
    return float((p["F"] * np.cos(p["w"] * t) if contact == 0 else 0.0) - spring - damper)


@pytest.mark.parametrize("scene", SEEDS)
def test_it_is_a_solution_of_the_inclusion(scene: tuple[int, int, float]) -> None:
    """Glued for the time of the hold, the mass moves as in a simulation, and might be let go all along."""
    found = long_holds(drawn(*scene))
    assert found
    for orbit, first, last in found:
        contact = NAMES.index(first.leaves)
        begin, end = orbit.begins[first.segment], orbit.ends[last.segment]
        kinetic, static = (orbit.params[f"{name}{contact + 1}"] for name in ("S", "T"))
        lasts = (end[0] - begin[0]) / orbit.period * orbit.periods
        glued = {**orbit.params, f"T{contact + 1}": 1e3}
        start = begin[1:].copy()
        start[2 + contact] = 0.0
        path = cf.simulate(
            orbit.model, glued, state=start, time=float(begin[0]), periods=float(lasts)
        )
        assert np.max(np.abs(path.last[2] - end[1:])) < MOTION
        assert len(path) == last.segment - first.segment  # what the other mass meets meanwhile
        times = np.linspace(begin[0], begin[0] + 0.999999 * (end[0] - begin[0]), 200)
        side = np.sign(load(orbit, contact, end))
        loads = side * np.array(
            [load(orbit, contact, z) for z in np.column_stack([times, path.sample(times)])]
        )
        assert kinetic - MOTION < np.min(loads) and np.max(loads) < static + MOTION
        v = f"v{contact + 1}"
        moved = orbit.flow.rate(last.departs, v, float(end[0]), end[1:])
        assert np.isclose(side * moved, side * load(orbit, contact, end) - kinetic, atol=MOTION)


@pytest.mark.parametrize("scene", SEEDS[:2])
def test_the_diagram_is_the_same_from_every_branch(scene: tuple[int, int, float]) -> None:
    """No end is loose, and indices balance where a hold begins to go on, and where it is a stick."""
    diagram = drawn(*scene)
    held = verify(diagram, 3)
    assert not diagram.loose_ends
    assert all(restart.same for restart in held.restarts), [str(r) for r in held.restarts]
    assert held.balances and all(balance.holds for balance in held.balances)


@pytest.mark.parametrize("scene", SEEDS)
def test_its_signature_is_read_back(scene: tuple[int, int, float]) -> None:
    """The modes of its parts follow from the domains before and behind it, and it counts as one hold."""
    for orbit, _, _ in long_holds(drawn(*scene)):
        signature = orbit.signature
        again = parse_signature(str(signature), orbit.model)
        assert reduced_itinerary(again) == canonical_itinerary(orbit.itinerary, orbit.model)
        parts = sum(is_hold(exit_) for _, exit_ in orbit.itinerary)
        assert signature.holds == len(orbit.system.ends_of_holds) < parts
