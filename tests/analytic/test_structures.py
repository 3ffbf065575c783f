"""The bundled structures: each segment of their orbits compared with scipy, from matrices written here."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from by_scipy import misses
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import contfric as cf


def follow(orbit: cf.Orbit, acceleration: Any, count: int) -> int:
    """Integrate each segment of an orbit; return how many were compared."""

    def field_of(mode: str) -> Any:
        return lambda t, y: np.concatenate([y[count:], acceleration(mode, t, y)])

    assert misses(orbit, field_of) < 1e-8
    return len(orbit.itinerary)


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
    for (mode, _), begin in zip(orbit.itinerary, orbit.begins, strict=True):
        for letter, v in zip(mode, begin[3:], strict=True):
            if letter == "s":
                assert v == pytest.approx(p["vb"], abs=1e-11)


@pytest.mark.slow
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
    from contfric.orbit.canonical.repetition import shortest

    diagram = cf.explore(cf.find_orbit("pounding"), "w", (0.7, 0.95))
    assert len(diagram.branches) == 4  # two of them with one impact in two periods
    for branch in diagram.branches:
        orbit = branch[len(branch) // 2]
        assert shortest(orbit) is orbit
    assert not [b for b in diagram.bifurcations if b.kind is cf.Kind.BP]
    # and a touch at its own start is not one at which one more impact is proposed at, again and again
    assert all(len(b.proposals) < 20 for b in diagram.bifurcations)


@pytest.mark.slow
def test_a_drill_string_sticks_and_slips_as_an_integrator_says() -> None:
    """From the release to the next one, by scipy's own events."""
    w = 0.3
    start = [-0.25, -0.5, -0.75, -1.0, -w, -w, -w, -w]
    orbit = cf.find_orbit("drill-string", {"w": w}, state=start)
    p = orbit.params
    stiffness = p["k"] * (2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    stiffness[3, 3] = p["k"]
    mass = np.array([0.1, 0.1, 0.1, p["J"]])

    def forces(y: np.ndarray) -> np.ndarray:
        return -stiffness @ y[:4] - p["c"] * (y[4:] + w)

    def slips(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[4:], (forces(y) - [0, 0, 0, p["S"]]) / mass])

    def sticks(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[4:], forces(y) / mass * [1, 1, 1, 0]])

    def stops(t: float, y: np.ndarray) -> float:
        return float(y[7] + w) if t > 1e-3 else 1.0

    def lets_go(t: float, y: np.ndarray) -> float:
        return float(forces(y)[3] - p["S0"])

    stops.terminal = lets_go.terminal = True  # type: ignore[attr-defined]
    release = next(i for i, (mode, _) in enumerate(orbit.itinerary) if mode == "p")
    y, period = np.array(orbit.begins[release][1:]), 0.0
    for rates, event in ((slips, stops), (sticks, lets_go)):
        found = solve_ivp(
            rates, (0.0, 50.0), y, "DOP853", events=event, rtol=1e-12, atol=1e-13, max_step=0.05
        )
        period += found.t_events[0][0]
        y = found.y_events[0][0]
    assert orbit.stable
    assert period == pytest.approx(orbit.period, abs=1e-9)
    assert np.max(np.abs(y - orbit.begins[release][1:])) < 1e-9


def test_stuck_elements_let_go_where_the_linear_amplitude_is_their_limit() -> None:
    params = {"F": 0.05, "S": 0.05, "W": 1.2}
    stuck = cf.find_orbit("iwan", params, state=[0.05, 0.0, 0.05, 0.05, 0.05])
    p = stuck.params
    per_force = 1.0 / abs(p["k"] + 3.0 * p["kt"] - p["W"] ** 2 + 1j * p["c"] * p["W"])
    assert stuck.x_max == pytest.approx(p["F"] * per_force, rel=1e-12)
    diagram = cf.explore(stuck, "F", (0.02, 0.3), max_periods=1)
    assert len(diagram.branches) == 4  # none slips, one, two, three
    assert not diagram.loose_ends
    first = min(b.params["F"] for b in diagram.bifurcations)
    assert first == pytest.approx(p["S"] / p["kt"] / per_force, rel=1e-10)


def beam() -> tuple[np.ndarray, np.ndarray]:
    """Return natural frequencies over the first one, and the modes at the tip, from their equation."""
    near = np.pi * (np.arange(1, 13) - 0.5)
    roots = np.array(
        [brentq(lambda b: np.cos(b) + 1.0 / np.cosh(b), b - 0.5, b + 0.5, xtol=1e-15) for b in near]
    )
    return (roots / roots[0]) ** 2, 2.0 * (-1.0) ** np.arange(12)


@pytest.mark.slow
def test_a_beam_of_twelve_modes_touches_where_the_linear_response_is_the_gap() -> None:
    frequencies, shape = beam()
    zeta, force, n = 0.02, 0.6, 12

    def response(w: float) -> np.ndarray:
        return shape * force / (frequencies**2 - w**2 + 2j * zeta * frequencies * w)

    touches = brentq(lambda w: abs(shape @ response(w)) - 1.0, 6.0, 6.2, xtol=1e-14)
    x = response(6.1)
    start = [*x.real, *(6.1j * x).real]
    orbit = cf.find_orbit("beam-stop", {"W": 6.1}, state=start)
    assert orbit.quantity("max(tip)") == pytest.approx(abs(shape @ x), rel=1e-11)
    diagram = cf.explore(orbit, "W", (6.1, 6.14), max_periods=1, max_step=0.2)
    grazing = next(b for b in diagram.bifurcations if b.kind is cf.Kind.GS)
    assert grazing.params["W"] == pytest.approx(touches, abs=1e-10)
    hitting = next(
        b for b in diagram.branches if len(b[0].itinerary) == 2 and b[0].itinerary[0][1] == "stop"
    )
    first = min((hitting[0], hitting[-1]), key=lambda orbit: orbit.params["W"])
    free = next(b for b in diagram.branches if b is not hitting)[-1]
    assert free.params["W"] == pytest.approx(first.params["W"], abs=1e-9)
    sizes = [
        np.sort(np.abs(o.multipliers)) for o in (free, first)
    ]  # the stop's stiffness adds nothing yet
    assert sizes[1] == pytest.approx(sizes[0], abs=1e-9)
    other = hitting[len(hitting) // 2]
    p = other.params

    def acceleration(mode: str, t: float, y: np.ndarray) -> np.ndarray:
        tip = shape @ y[:n]
        push = p["F"] * np.cos(p["W"] * t) - (p["ks"] * (tip - p["d"]) if mode == "c" else 0.0)
        return shape * push - frequencies**2 * y[:n] - 2.0 * zeta * frequencies * y[n:]

    assert follow(other, acceleration, n) == 2


def test_a_stick_lasts_until_waves_have_come_back() -> None:
    """Longer than a period of the excitation: other masses move on, and the load grows with them."""
    n, w = 20, 0.4
    stiffness = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    stiffness[-1, -1] = 1.0
    rubs = {"kind": "friction", "velocity": "v1", "kinetic": 0.2, "static": 0.25}
    model = cf.Mechanism(
        np.eye(n),
        0.03 * np.eye(n),
        stiffness,
        contacts={"pad": rubs},
        force={f"q{n}": "0.6*cos(w*t)"},
        parameters={"w": w},
        period="2*pi/w",
    )
    start = [*np.ones(n), *np.zeros(n)]
    found = cf.simulate(model, {}, state=start, periods=2)
    events = [exit_ != "phase" for _, exit_ in found.itinerary]  # a section is no event
    times = (found.times + found.cycles * 2.0 * np.pi / w)[events]
    first = times[1] - times[0]
    assert first > 2.0 * np.pi / w

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        a = -stiffness @ y[:n] - 0.03 * y[n:]
        a[-1] += 0.6 * np.cos(w * t)
        a[0] = 0.0
        return np.concatenate([y[n:], a])

    def load(t: float, y: np.ndarray) -> float:
        return 0.25 - abs(float(stiffness[0] @ y[:n]))

    load.terminal = True  # type: ignore[attr-defined]
    options = {"events": load, "rtol": 1e-12, "atol": 1e-13}
    stuck = solve_ivp(rates, (times[0], 40.0), found.states[0], "DOP853", **options)
    assert stuck.t_events[0][0] == pytest.approx(times[1], abs=1e-9)


def test_events_know_their_contacts() -> None:
    """At a joint that an event is about its contact rests; events of two contacts name both."""
    orbit = cf.find_orbit("storeys")
    floors, numbers = {"low": 0, "middle": 2, "high": 4}, set()
    for event in cf.explore(orbit, "W", (0.585, 0.6)).bifurcations:
        assert event.contacts
        numbers.add(len(event.contacts))
        for test in event.tests:
            assert test.surface.strip("+-").removeprefix("u_") in event.contacts
            if test.margin.value in ("joint", "exit") and test.surface in floors:
                joint, k = event.orbit.ends[test.segment][1:], floors[test.surface]
                assert abs(joint[6 + k] - (joint[5 + k] if k else 0.0)) < 1e-8
    assert numbers == {1, 2}
    smooth = cf.continue_orbit(cf.find_orbit("coulomb", {"Omega": 0.54}), "Omega", (0.5, 0.6))
    assert all(event.contacts == () for event in smooth.bifurcations)
