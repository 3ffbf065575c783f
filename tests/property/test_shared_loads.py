"""Friction contacts that act on each other: which stick and which slide, in numbers and along solutions."""

from __future__ import annotations

import itertools
import pickle
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.errors import ModelError
from contfric.models.structures.complementarity import ContactsAtRest


def rest_of(rng: np.random.Generator, ratio: float) -> ContactsAtRest:
    """Return up to six contacts at rest with a random positive definite mobility."""
    k = int(rng.integers(1, 7))
    root = rng.normal(size=(k, k))
    kinetic = rng.uniform(0.0, 1.0, k)
    free = rng.normal(size=k) * rng.choice([0.3, 1.0, 3.0])
    mobility = root @ root.T + 0.05 * np.eye(k)
    return ContactsAtRest(mobility, free, np.array([-kinetic, kinetic]), kinetic * ratio)


def all_solutions(rest: ContactsAtRest) -> list[str]:
    """Return all states of the contacts that obey every condition, by trying them all.

    Which stick is tried one by one, the directions of those that slide at once.
    """
    k, found = len(rest.free), []
    for sticks in itertools.product([True, False], repeat=k):
        stuck = np.array(sticks)
        sense = np.array(list(itertools.product([-1.0, 1.0], repeat=k - sum(sticks))))
        force = np.zeros((len(sense), k))
        force[:, ~stuck] = np.where(sense > 0.0, rest.pulls[1][~stuck], -rest.pulls[1][~stuck])
        block = rest.mobility[np.ix_(stuck, stuck)]
        held = (rest.free + force @ rest.mobility.T)[:, stuck]
        force[:, stuck] = -np.linalg.solve(block, held.T).T
        moved = rest.free + force @ rest.mobility.T
        holds = np.all(np.abs(force[:, stuck]) <= rest.static[stuck] + 1e-12, axis=1)
        slides = np.all(moved[:, ~stuck] * sense <= 1e-12, axis=1)
        for signs in sense[holds & slides]:
            letters = iter("n" if sign > 0.0 else "p" for sign in signs)
            found.append("".join("s" if there else next(letters) for there in sticks))
    return found


def test_states_are_those_of_enumeration(cases: int = 400) -> None:
    rng = np.random.default_rng(15)
    several = 0
    for case in range(cases):
        rest = rest_of(rng, 1.0 if case % 2 else float(rng.uniform(1.0, 1.6)))
        letters, every = rest.states(" " * len(rest.free)), all_solutions(rest)
        if case % 2:  # exactly one where static and kinetic limits agree
            assert every == [letters]
            continue
        several += len(every) > 1
        assert letters in every
        stuck = "s" * len(rest.free)
        assert letters == stuck or stuck not in every
    assert several > cases // 20


def structure(seed: int, static: float = 1.0) -> tuple[cf.Model, Any]:
    """Return masses with two to four contacts along random directions, and what moves them."""
    rng = np.random.default_rng(seed)
    n = 3 + seed % 3
    k = min(2 + seed % 3, n)
    root = rng.normal(size=(n, n))
    mass, stiffness = np.diag(rng.uniform(0.5, 2.0, n)), root @ root.T + np.eye(n)
    while np.linalg.matrix_rank(along := rng.integers(-1, 2, size=(k, n)).astype(float)) < k:
        pass
    limit, belt = rng.uniform(0.1, 0.5, k), rng.uniform(-0.4, 0.4, k) * (rng.random(k) < 0.5)
    push, omega = 1.5 * rng.normal(size=(n, 2)), float(rng.uniform(0.6, 1.5))
    contacts = {
        f"b{j + 1}": {
            "kind": "friction",
            "velocity": " + ".join(f"{w}*v{i + 1}" for i, w in enumerate(along[j]) if w)
            + f" - ({belt[j]})",
            "kinetic": f"S{j + 1}",
            **({"static": f"{static}*S{j + 1}"} if static > 1.0 else {}),
        }
        for j in range(k)
    }
    model = cf.Mechanism(
        mass,
        0.05 * stiffness,
        stiffness,
        contacts=contacts,
        force={
            f"q{i + 1}": f"{a}*cos(Omega*t) + {b}*sin(Omega*t)" for i, (a, b) in enumerate(push)
        },
        parameters={"Omega": omega, **{f"S{j + 1}": float(s) for j, s in enumerate(limit)}},
        period="2*pi/Omega",
        name=f"shared-{seed}",
    )
    return model, (mass, 0.05 * stiffness, stiffness, along, belt, limit, push, omega)


def stepped(parts: Any, q: np.ndarray, v: np.ndarray, end: float, steps: int) -> np.ndarray:
    """Return the state at the end by Moreau's time stepping: a projection of the impulses a step."""
    mass, damping, stiffness, along, belt, limit, push, omega = parts
    h = end / steps
    inverse = np.linalg.inv(mass + h * damping + h * h * stiffness)
    mobility, impulse = along @ inverse @ along.T, np.zeros(len(limit))
    for step in range(steps):
        t = (step + 1) * h
        force = push @ np.array([np.cos(omega * t), np.sin(omega * t)])
        free = inverse @ (mass @ v + h * (force - stiffness @ q))
        apart = along @ free - belt
        for _ in range(2000):
            before = impulse.copy()
            for j in range(len(limit)):
                new = impulse[j] - (apart[j] + mobility[j] @ impulse) / mobility[j, j]
                impulse[j] = min(max(new, -h * limit[j]), h * limit[j])
            if np.max(np.abs(impulse - before)) < 1e-15 * h:
                break
        v = free + inverse @ along.T @ impulse
        q = q + h * v
    return np.concatenate([q, v])


@pytest.mark.parametrize("seed", range(6))
def test_solutions_are_those_of_tiny_steps(seed: int) -> None:
    model, parts = structure(seed)
    n, rng = len(parts[0]), np.random.default_rng(seed + 99)
    q, v = rng.normal(size=n), rng.normal(size=n) * (seed % 2)  # every other one begins at rest
    found = cf.simulate(model, state=[*q, *v], periods=1)
    assert len(found) >= 3
    end = 2.0 * np.pi / parts[-1]
    coarse, fine = (stepped(parts, q, v, end, steps) for steps in (1500, 3000))
    wrong, less = (np.max(np.abs(state - found.last[2])) for state in (coarse, fine))
    assert less < 0.05 and less < 0.65 * wrong  # the method is of first order
    extrapolated = 2.0 * fine - coarse
    assert np.max(np.abs(extrapolated - found.last[2])) < 0.35 * less


@pytest.mark.parametrize("seed", [4, 6])
def test_diagrams_have_no_loose_ends(seed: int) -> None:
    model, parts = structure(seed)
    omega = parts[-1]
    diagram = cf.explore(cf.find_orbit(model), "Omega", (0.9 * omega, 1.1 * omega), max_periods=1)
    assert not diagram.loose_ends
    events = [b for b in diagram.bifurcations if b.kind in ("CS", "SS", "GS", "AS")]
    assert len(events) >= 4 and all(event.contacts for event in events)
    for branch in diagram.branches:
        orbit = branch[len(branch) // 2]
        if not orbit.stable:
            continue
        joint = orbit.ends[-1]
        again = cf.find_orbit(model, orbit.params, state=joint[1:], time=float(joint[0]))
        assert abs(again.x_max - orbit.x_max) < 1e-8


def test_static_friction_above_kinetic() -> None:
    found = 0
    for seed in range(4):
        model, _ = structure(seed, static=1.2)
        orbit = cf.find_orbit(model)
        assert orbit.residual < 1e-12 and np.min(orbit.margins) > -1e-9
        found += len(orbit.itinerary) > 4
    assert found >= 2


def test_models_come_back_with_their_surfaces(tmp_path: Any) -> None:
    model, _ = structure(5)
    orbit = cf.find_orbit(model)
    assert len(model.surfaces) > len(model.composition.declared)  # type: ignore[attr-defined]
    again = pickle.loads(pickle.dumps(model))
    assert [s.name for s in again.surfaces] == [s.name for s in model.surfaces]
    state = orbit.ends[-1]
    one, other = (
        cf.simulate(m, orbit.params, state=state[1:], time=float(state[0]), periods=2)
        for m in (model, again)
    )
    assert one.itinerary == other.itinerary
    np.testing.assert_array_equal(one.states, other.states)
    cf.save(orbit, tmp_path / "orbit.npz")
    from contfric.models.reading.files import model_of

    model_of.cache_clear()
    loaded = cf.load(tmp_path / "orbit.npz")
    assert loaded.itinerary == orbit.itinerary and loaded.model is not model
    np.testing.assert_allclose(loaded.multipliers, orbit.multipliers, atol=1e-10)


def test_forces_and_work_of_contacts() -> None:
    model, (mass, damping, _, along, belt, _, push, omega) = structure(4)
    orbit = cf.find_orbit(model)
    power = sum(orbit.quantity(f"work(b{j + 1})") for j in range(len(along)))
    times = np.linspace(0.0, orbit.period, 4001)
    states = np.array([orbit.state(float(t)) for t in times])
    n = len(mass)
    v = states[:, n:]
    force = np.array([np.cos(omega * times), np.sin(omega * times)]).T @ push.T
    given = np.trapezoid(np.sum(v * force, axis=1) - np.sum(v * (v @ damping), axis=1), times)
    drive = sum(belt[j] * orbit.quantity(f"mean(force(b{j + 1}))") for j in range(len(along)))
    assert abs(power - given - drive * orbit.period) < 1e-4 * (1.0 + abs(given))


def test_what_cannot_be_told_apart_is_refused() -> None:
    def chain(**more: Any) -> cf.Model:
        brace = {"kind": "friction", "velocity": "v2 - v1", "kinetic": "S"}
        contacts = {"floor": {**brace, "velocity": "v1"}, "brace": brace, **more.pop("others", {})}
        return cf.Mechanism(
            np.eye(2),
            0.1 * np.eye(2),
            np.eye(2),
            contacts=contacts,
            force={"q1": "cos(t)"},
            parameters={"S": 0.3},
            period="2*pi",
            **more,
        )

    assert chain().composed
    third = {"kind": "friction", "velocity": "v2", "kinetic": "S"}
    with pytest.raises(ModelError, match="'third' locks with 'floor', 'brace'"):
        chain(others={"third": third})
    wall = {"kind": "impact", "gap": "1 - q2", "restitution": 0.5}
    with pytest.raises(ModelError, match=r"'floor' and 'brace' depend on each other .* impacts"):
        chain(others={"wall": wall})
    bent = {"kind": "friction", "velocity": "v2 - v1", "kinetic": "S*(1 + (v2 - v1)**2)"}
    with pytest.raises(ModelError, match="affine"):
        chain(others={"brace": bent})


def test_with_springs_jenkins_elements_and_a_normal_force_of_time() -> None:
    stiffness = np.array([[3.0, -1.0, 0.0], [-1.0, 3.0, -1.0], [0.0, -1.0, 2.0]])
    grip = {"kind": "friction", "velocity": "v1", "kinetic": "S*(1 + 0.3*cos(Omega*t))"}
    model = cf.Mechanism(
        ["m", 1.0, 0.7],
        0.04 * stiffness,
        stiffness,
        contacts={
            "grip": grip,
            "brace": {"kind": "friction", "velocity": "v2 - v1 - 0.1", "kinetic": "R"},
            "pad": {"kind": "jenkins", "displacement": "q3", "stiffness": "kd", "limit": "L"},
            "stop": {"kind": "spring", "gap": "0.5 - q2", "stiffness": "ks"},
        },
        force={"q1": "F*cos(Omega*t)", "q3": "F*sin(Omega*t)"},
        parameters={
            **{"m": 1.2, "Omega": 1.1, "F": 1.0, "S": 0.3},
            **{"R": 0.2, "kd": 1.5, "L": 0.3, "ks": 8.0},
        },
        period="2*pi/Omega",
        name="mixed",
    )
    diagram = cf.explore(cf.find_orbit(model), "Omega", (1.0, 1.2), max_periods=1)
    assert not diagram.loose_ends and len(diagram.bifurcations) >= 8
    orbit = cf.find_orbit(model)
    times = np.linspace(0.0, orbit.period, 8001)
    v = np.array([orbit.state(float(t))[3:6] for t in times])
    push = v[:, 0] * np.cos(1.1 * times) + v[:, 2] * np.sin(1.1 * times)
    given = np.trapezoid(push - np.sum(v * (v @ (0.04 * stiffness)), axis=1), times)
    given += 0.1 * orbit.period * orbit.quantity("mean(force(brace))")  # the belt drives, too
    lost = sum(orbit.quantity(f"work({c})") for c in ("grip", "brace", "pad", "stop"))
    assert abs(lost - given) < 1e-6


def test_braces_with_static_above_kinetic_friction_have_the_same_events_from_every_branch() -> None:
    """Where one brace stops as the other lets go, the stick after it has another limit."""
    chained = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    braces = {
        name: {"kind": "friction", "velocity": velocity, "kinetic": 0.05, "static": 0.06}
        for name, velocity in (("a", "v2 - v1"), ("b", "v3 - v2"))
    }
    model = cf.Mechanism(
        np.eye(3),
        0.05 * chained,
        chained,
        contacts=braces,
        force={"q3": "F*cos(W*t)"},
        parameters={"W": 1.1, "F": 0.6},
        period="2*pi/W",
    )

    def places(found: cf.Diagram) -> list[tuple[float, tuple[str, ...]]]:
        return sorted((round(b.params["F"], 8), b.contacts) for b in found.bifurcations if b.tests)

    first = cf.explore(cf.find_orbit(model), "F", (0.1, 0.7), max_periods=1)
    assert {contacts for _, contacts in places(first)} >= {("a",), ("b",), ("a", "b")}
    for branch in (first.branches[0], first.branches[-1]):
        again = cf.explore(branch[len(branch) // 2], "F", (0.1, 0.7), max_periods=1)
        assert places(again) == places(first)
