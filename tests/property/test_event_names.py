"""Events of random structures have one name, whichever branch a diagram is explored from."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from typed import typed

import contfric as cf

RANGE = (0.1, 1.7)


def random_contacts(draw: np.random.Generator, kinds: str) -> dict[str, dict[str, Any]]:
    """Return friction (f) or a Jenkins element (j) on the first masses."""

    def contact(kind: str, i: int) -> dict[str, Any]:
        if kind == "f":
            kinetic = f"{draw.uniform(0.1, 0.3):.4f}*s"
            return {"kind": "friction", "velocity": f"v{i}", "kinetic": kinetic}
        stiffness, limit = f"{draw.uniform(0.8, 2):.4f}", f"{draw.uniform(0.2, 0.6):.4f}*s"
        return {"kind": "jenkins", "displacement": f"q{i}", "stiffness": stiffness, "limit": limit}

    return {"abc"[i]: contact(kind, i + 1) for i, kind in enumerate(kinds)}


def random_structure(seed: int, kinds: str) -> cf.Model:
    """Return a chain of two masses at least with contacts on the first ones."""
    draw = np.random.default_rng([seed, {"jj": 0, "fj": 1, "j": 3, "ff": 4, "jjj": 5}[kinds]])
    size = max(2, len(kinds))
    k = draw.uniform(0.7, 1.5, size + 1)
    contacts, beside = random_contacts(draw, kinds), np.diag(k[1:-1], 1)
    return cf.Mechanism(
        np.diag(draw.uniform(0.7, 1.5, size)),
        0.2 * np.eye(size) - 0.05 * (np.eye(size, k=1) + np.eye(size, k=-1)),
        np.diag(k[:-1] + k[1:]) - beside - beside.T,
        contacts=contacts,
        force={"q1": "F*cos(W*t)"},
        parameters={"W": float(draw.uniform(0.5, 1.2)), "F": 1.0, "s": 1.0},
        period="2*pi/W",
        name=f"names-{kinds}-{seed}",
    )


def names(found: cf.Diagram) -> list[tuple[float, str, tuple[str, ...]]]:
    return sorted(
        (round(b.params["F"], 6), b.kind.value, b.contacts)
        for b in found.bifurcations
        if b.kind is not cf.Kind.T
    )


slow = pytest.mark.slow


@pytest.mark.parametrize(
    ("kinds", "seed"),
    [
        *(pytest.param("j", seed, marks=slow) for seed in range(4)),
        *(pytest.param("jj", seed, marks=slow) for seed in range(5)),
        *(pytest.param("fj", seed, marks=slow) for seed in (0, 3)),
        ("ff", 0),
        *(pytest.param("ff", seed, marks=slow) for seed in (1, 2, 3)),
        *(pytest.param("jjj", seed, marks=slow) for seed in (1, 2)),
    ],
)
def test_events_have_the_same_names_from_every_branch(kinds: str, seed: int) -> None:
    model = random_structure(seed, kinds)
    first = cf.explore(cf.find_orbit(model, {"F": 1.4}), "F", RANGE, max_periods=1)
    assert names(first)
    for branch in first.branches[:3]:
        again = cf.explore(branch[len(branch) // 2], "F", RANGE, max_periods=1)
        assert names(again) == names(first)


@pytest.mark.parametrize("force", [0.3195, 0.33])
def test_a_contact_that_creeps_ends_at_the_limit_of_its_load(force: float) -> None:
    """A simulation has ever shorter slips of the second mass, to one side; the orbit has none."""
    model = random_structure(0, "ff")
    orbit = cf.find_orbit(model, {"F": force}, state=[-0.13, 0.065, 0.0, 0.0])
    assert orbit.admissible
    assert {surface for _, surface in orbit.itinerary} == {"a", "a+", "a-"}
    draw = np.random.default_rng([0, 4])
    draw.uniform(size=3)  # the springs
    limit = float(random_contacts(draw, "ff")["b"]["kinetic"][:-2])
    assert limit - 1e-5 < orbit.quantity("max(abs(force(b)))") < limit


def test_a_contact_that_sticks_for_good_does_not_end_a_diagram() -> None:
    """After the event at which one of two contacts stops slipping the other one goes on, down to its limit.

    All rests where the force on the first mass is at most the limit of that; the other contact then
    carries nothing. Where the second contact stops, its load just reaches the limit.
    """
    model = random_structure(0, "ff")
    found = cf.explore(cf.find_orbit(model, {"F": 1.4}), "F", RANGE, max_periods=1)
    draw = np.random.default_rng([0, 4])
    draw.uniform(size=3)  # the springs
    law = {name: float(c["kinetic"][:-2]) for name, c in random_contacts(draw, "ff").items()}
    places = {b.contacts: b.params["F"] for b in found.bifurcations if b.kind is cf.Kind.AS}
    assert places["a",] == pytest.approx(law["a"], abs=1e-9)
    stuck = next(b for b in found.branches if abs(b.values.max() - places["b",]) < 1e-9)
    orbit = stuck[int(np.argmax(stuck.values))]
    assert all(mode[1] == "s" for mode, _ in orbit.itinerary)
    assert orbit.quantity("max(abs(force(b)))") == pytest.approx(law["b"], abs=1e-8)


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 4))]
)
def test_a_slider_that_begins_to_slip_grazes_its_limit(seed: int) -> None:
    """Also where the touch lies on the section of the stuck motion, whose joint meets the limit."""
    model = random_structure(seed, "j")
    orbit = cf.find_orbit(model, {"F": 1.4})
    down = cf.continue_orbit(orbit, "F", RANGE)
    event = min(down.bifurcations, key=lambda b: b.params["F"])
    assert event.kind is cf.Kind.GS
    assert event.contacts == ("a",)


#: A hopper on a leg that is stiffer on its way up: it hops where that gives more than damping takes.
HOPPER = """
name: hopper
states: [y, v]
parameters: {g: 1.0, k: 20.0, up: 22.0, c: 1.0}
autonomous: true
surfaces:
  ground: {observable: y, level: 1}
  bottom: {observable: v}
modes:
  flight: {in: {ground: +}, field: {y: v, v: -g}}
  down: {in: {ground: -, bottom: -}, field: {y: v, v: k*(1 - y) - g - c*v}}
  rise: {in: {ground: -, bottom: +}, field: {y: v, v: up*(1 - y) - g - c*v}}
spread: {y: 1.2}
"""


@pytest.mark.parametrize("up", [22.0, 32.0])
def test_two_surfaces_that_one_tangency_meets_at_once_are_no_corner(tmp_path, up: float) -> None:
    """It takes off without speed: y = 1 is touched where v = 0 ends the rise, or the rise ends on y = 1.

    From rest at y = 1 and back: with r(k) = exp(-pi c/(2 w)), w^2 = k - c^2/4, the share of a height over the
    balance that is left half a turn later, (g/k (1 + r(k)) - g/up) r(up) = g/up.
    """

    def decay(k: float) -> float:
        return float(np.exp(-0.5 * np.pi / np.sqrt(k - 0.25)))

    def mismatch(k: float) -> float:
        lowest = (1.0 + decay(20.0)) / 20.0  # below y = 1
        return (lowest - 1.0 / k) * decay(k) - 1.0 / k

    at = brentq(mismatch, 21.0, 35.0, xtol=1e-13)
    orbit = cf.find_orbit(typed(tmp_path, HOPPER), {"up": up}, state=[1.3, 0.0])
    branch = cf.continue_orbit(orbit, "up", (20.5, 36.0))
    events = [b for b in branch.bifurcations if b.tests]
    assert [b.kind.value for b in events] == ["GS"]
    assert events[0].params["up"] == pytest.approx(at, abs=1e-9)
    found = cf.explore(orbit, "up", (20.5, 36.0))
    assert [n.bifurcation.kind.value for n in found.nodes] == ["GS"] and not found.loose_ends
    for one in found.branches:
        for event in one.bifurcations:
            joints = [(t.segment, t.margin.value) for t in event.tests]
            assert len({segment for segment, _ in joints}) == len(joints)  # each place once
