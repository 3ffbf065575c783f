"""Structures with a mode that oscillates within a short contact: what is converged solves the equations."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.bvp.linear import null_rows
from contfric.models.view import FlowView


def light_tip(seed: int) -> tuple[cf.Model, np.ndarray, float]:
    """Return two masses, the second far lighter; its motion without the stop, at t = 0, and fastest rate."""
    draw = np.random.default_rng(seed)
    mass = np.diag([1.0, 10.0 ** draw.uniform(-3.0, -2.0)])
    k = draw.uniform(50.0, 500.0)
    stiffness = np.array([[1.0 + k, -k], [-k, k]])
    damping = 0.05 * mass @ np.diag([1.0, 0.0]) + 1e-5 * stiffness
    w = float(draw.uniform(0.6, 1.6))
    wave = np.linalg.solve(stiffness - w**2 * mass + 1j * w * damping, [1.0, 0.0])
    stop = {"kind": "spring", "gap": "d - q2", "stiffness": draw.uniform(5.0, 20.0)}
    model = cf.Mechanism(
        mass,
        damping,
        stiffness,
        contacts={"stop": stop},
        force={"q1": "cos(W*t)"},
        parameters={"W": w, "d": 1.005 * abs(wave[1])},
        period="2*pi/W",
        name=f"light-tip-{seed}",
    )
    return model, np.append(wave, 1j * w * wave), float(np.sqrt(k / mass[1, 1]))


def missed(orbit: cf.Orbit) -> float:
    """Return how far the flow without derivatives ends from the joints and from the exit surfaces."""
    view, worst = FlowView(orbit.model, orbit.vector), 0.0
    for i, (mode, surface) in enumerate(orbit.itinerary):
        (t, *y), end = orbit.cycle[i], orbit.ends[i]
        reached = view.state(mode, t, np.array(y), end[0] - t)
        worst = max(worst, float(np.max(np.abs(reached - end[1:]))))
        worst = max(worst, abs(view.height(surface, end[0], end[1:])))
    return worst


def multipliers_by_transition(orbit: cf.Orbit) -> np.ndarray:
    """Return those of the product of transition matrices: the force of a spring is continuous."""
    view, turn = FlowView(orbit.model, orbit.vector), np.eye(4)
    for i, (mode, _) in enumerate(orbit.itinerary):
        (t, *y), end = orbit.cycle[i], orbit.ends[i]
        turn = view.jacobian(mode, t, np.array(y), end[0] - t)[:, 1:5] @ turn
    return np.linalg.eigvals(turn)


@pytest.mark.parametrize(
    "seed", [pytest.param(s, marks=[] if s in {4, 10} else pytest.mark.slow) for s in range(12)]
)
def test_converged_orbits_end_on_their_surfaces_whatever_oscillates_within_a_contact(
    seed: int,
) -> None:
    model, wave, fastest = light_tip(seed)
    start, amplitude = cf.find_orbit(model, {}, state=list(wave.real)), float(abs(wave[1]))
    found = cf.explore(start, "d", (0.995 * amplitude, 1.01 * amplitude), max_periods=1)
    short = 0
    for branch in found.branches:
        for orbit in branch:
            lasting = np.diff(np.append(orbit.cycle[:, 0], orbit.ends[-1, 0]))
            contacts = [
                d for (mode, _), d in zip(orbit.itinerary, lasting, strict=True) if "c" in mode
            ]
            # where the ends of a contact are one, its rows would divide zero by zero
            if not contacts or min(contacts) < 1e-3:
                continue
            short += any(d < 0.1 and d * fastest > 4.0 for d in contacts)
            # what its flow is held to: 50 units in the last place, for each radian
            largest = 1.0 + float(np.max(np.abs(orbit.cycle)))
            assert missed(orbit) < 1.1e-14 * (1.0 + fastest * orbit.period) * largest
            mine, other = orbit.multipliers, multipliers_by_transition(orbit)
            size = max(1.0, float(np.max(np.abs(other))))
            for value in mine[np.abs(mine) > 0.1]:
                assert np.min(np.abs(other - value)) < 1e-9 * size
    assert short


@pytest.mark.parametrize("seed", range(20))
def test_what_vanishes_in_equations_does_not_depend_on_their_sizes(seed: int) -> None:
    draw = np.random.default_rng(seed)
    n, nullity = int(draw.integers(4, 30)), int(draw.integers(1, 4))
    left, _ = np.linalg.qr(draw.normal(size=(n, n)))
    right, _ = np.linalg.qr(draw.normal(size=(n + 1, n + 1)))
    singular = np.append(10.0 ** draw.uniform(-3.5, 0.0, n + 1 - nullity), np.zeros(nullity - 1))
    matrix = left @ np.diag(singular) @ right[:n]
    scaled = 10.0 ** draw.uniform(-1.0, 5.0, (n, 1)) * matrix
    found = null_rows(scaled)
    assert len(found) == nullity
    assert np.max(np.abs(matrix @ found.T)) < 1e-10
    assert found @ found.T == pytest.approx(np.eye(nullity), abs=1e-12)


@pytest.mark.slow
def test_a_branch_of_a_stiff_beam_goes_on_where_its_slide_vanishes() -> None:
    """Its load has rates of 1e4: they made the events at 3.1842 look like a continuum, and branches end."""
    roots = np.array([1.875104, 4.694091, 7.854757, 10.995541, 14.137168, 17.27876]) ** 2
    support = {"kind": "friction", "kinetic": "S", "static": "S0"}
    support["velocity"] = "2*v1 - 2*v2 + 2*v3 - 2*v4 + 2*v5 - 2*v6"
    model = cf.Mechanism(
        np.eye(6),
        np.diag(0.04 * roots),
        np.diag(roots**2),
        contacts={"support": support},
        force={"q1": "cos(Omega*t)", "q2": "0.5*cos(Omega*t)"},
        parameters={"Omega": 3.2, "S": 0.3, "S0": 0.35},
        period="2*pi/Omega",
        name="stiff-beam",
    )
    diagram = cf.explore(cf.find_orbit(model), "Omega", (3.17, 3.21))
    assert not diagram.loose_ends
    reached = {round(float(v), 12) for b in diagram.branches for v in (b.values[0], b.values[-1])}
    assert {3.17, 3.21} <= reached
    assert not any(end.reason is cf.EndReason.CONTINUUM for b in diagram.branches for end in b.ends)
