"""The bundled structures: each segment of their orbits compared with scipy, from matrices written here."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import contfric as cf


def follow(orbit: cf.Orbit, acceleration: object, count: int) -> int:
    """Integrate each segment of an orbit; return how many were compared."""
    checked = 0
    for i, (mode, _) in enumerate(orbit.word):
        (t0, *start), (t1, *end) = orbit.begins[i], orbit.ends[i]

        def rates(t: float, y: np.ndarray, mode: str = mode) -> np.ndarray:
            return np.concatenate([y[count:], acceleration(mode, t, y)])  # type: ignore[operator]

        found = solve_ivp(rates, (t0, t1), start, rtol=1e-11, atol=1e-12)
        assert np.max(np.abs(found.y[:, -1] - end)) < 1e-8
        checked += 1
    return checked


def held(mode: str, places: tuple[int, ...], forces: np.ndarray, kinetic: np.ndarray) -> np.ndarray:
    """Add friction to the forces on unit masses: none is left where one sticks."""
    found = forces.copy()
    for letter, place, size in zip(mode, places, kinetic, strict=True):
        found[place] = {"s": 0.0, "p": found[place] - size, "n": found[place] + size}[letter]
    return found


def test_ten_masses_with_three_contacts() -> None:
    orbit = cf.find_orbit("braced-chain", {"W": 0.5})
    p, n = orbit.params, 10
    stiffness = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    stiffness[-1, -1] = 1.0

    def acceleration(mode: str, t: float, y: np.ndarray) -> np.ndarray:
        force = -p["k"] * stiffness @ y[:n] - p["c"] * y[n:]
        force[-1] += p["F"] * np.cos(p["W"] * t)
        return held(mode, (2, 5, 8), force, np.full(3, p["S"]))

    assert follow(orbit, acceleration, n) == 12
    assert orbit.stable and orbit.admissible


def test_two_blocks_on_a_belt() -> None:
    orbit = cf.find_orbit("two-blocks", {"vb": 0.2})
    p = orbit.params
    stiffness = np.array([[1.0 + p["k"], -p["k"]], [-p["k"], 1.0 + p["k"]]])
    kinetic = p["S"] * np.array([1.0, p["beta"]])

    def acceleration(mode: str, t: float, y: np.ndarray) -> np.ndarray:
        return held(mode, (0, 1), -stiffness @ y[:2], kinetic)

    assert follow(orbit, acceleration, 2) >= 4
    for (mode, _), begin in zip(orbit.word, orbit.begins, strict=True):
        for letter, v in zip(mode, begin[3:], strict=True):
            if letter == "s":
                assert v == pytest.approx(p["vb"], abs=1e-11)


def test_a_blade_whose_damper_never_slips_is_linear() -> None:
    """Below the force at which the damper slips the response is that of three springs."""
    params = {"F": 0.01, "W": 0.7}
    orbit = cf.find_orbit("blade-damper", {"F": 0.15, "W": 0.7})
    p = orbit.params | params
    stiffness = np.array([[p["k"], -p["k"]], [-p["k"], p["k"] + p["kp"] + p["kd"]]])
    dynamic = stiffness - p["W"] ** 2 * np.diag([1.0, p["m"]]) + 1j * p["W"] * p["c"] * np.eye(2)
    x = np.linalg.solve(dynamic, [p["F"], 0.0])
    assert abs(x[1]) * p["kd"] < p["P"]  # it does not slip
    times = np.linspace(0.0, 2.0 * np.pi / p["W"], 5)
    model = orbit.model
    z = (x[1] * np.exp(1j * p["W"] * times)).real
    start = [*x.real, *(1j * p["W"] * x).real, z[0]]
    motion = cf.simulate(model, params, state=start, periods=3.0)
    assert motion.end is not None
    assert np.allclose(motion.last[2], start, atol=1e-11)


def test_an_orbit_that_grazes_is_not_followed_twice() -> None:
    """From the graze of an impact the orbit run through twice solves the equations, too: it is no branch."""
    from contfric.orbit.repetition import shortest

    diagram = cf.explore(cf.find_orbit("pounding"), "w", (0.7, 0.95))
    assert len(diagram.branches) == 3
    for branch in diagram.branches:
        orbit = branch[len(branch) // 2]
        assert shortest(orbit) is orbit
    assert not [b for b in diagram.bifurcations if b.kind is cf.Kind.BP]
