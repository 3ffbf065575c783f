"""Exponents of integrated models: against multipliers of solved orbits, roots, other integrators, sums.

Models with impacts (the tangent map goes through the reset), without excitation, of Filippov's kind, with a
kink; and whatever a solution can do instead of having exponents.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import contfric as cf
from contfric import Motion
from tests.two_orbits import two_orbit_estimate

#: Integrated models from end to end: minutes of processor time, run by `make test-all`.
pytestmark = pytest.mark.slow

JERK = Path(__file__).parents[1] / "models" / "jerk.yaml"
#: Stable orbits: model, parameters, initial state and time (None: the default). Of Popp's oscillator with
#: and without stick; of the belt with and without; of the dead band with slides on its edges and without.
ORBITS: dict[str, tuple[str, dict[str, float], list[float] | None, float]] = {
    "bang-bang": ("bang-bang", {}, None, 0.0),
    "impact": ("impact", {}, None, 0.0),
    "impact, no impacts": ("impact", {"A": 0.05}, None, 0.0),
    "impact-friction": ("impact-friction", {"k": 5.2}, [-0.08, 0.0], -1.5),
    "popp": ("popp", {}, None, 0.0),
    "popp, two periods": ("popp", {"omega": 1.72}, None, 0.0),
    "popp, stick": ("popp", {"omega": 0.8}, None, 0.0),
    "belt": ("belt", {}, None, 0.0),
    "belt, no stick": ("belt", {"vb": 5.0}, None, 0.0),
    "dead-band": ("dead-band", {}, None, 0.0),
    "dead-band, no slides": ("dead-band", {"alpha": 2.5}, [0.5, 0.0], 0.0),
    "coulomb-yaml": ("coulomb-yaml", {}, None, 0.0),
    "lugre": ("lugre", {}, None, 0.0),
}
#: Chaotic solutions, one of each kind: model, parameters, periods.
CHAOTIC: dict[str, tuple[str, dict[str, float], int]] = {
    "popp": ("popp", {"omega": 1.69, "F": 0.1}, 600),  # below its grazing-sliding at 1.70780
    "impact": ("impact", {"w": 2.8, "d": 0.0}, 600),
    "bang-bang": ("bang-bang", {"A": 100.0}, 150),
    "lugre": ("lugre", {"Omega": 0.5, "S": 0.372, "S0": 0.4}, 200),
}


@pytest.mark.parametrize("name", ORBITS)
def test_periodic_motion_has_the_exponents_of_its_multipliers(name: str) -> None:
    """Per unit of time; of an autonomous model the multipliers without the trivial one."""
    model, params, state, time = ORBITS[name]
    found = cf.lyapunov_exponent(model, params, state=state, time=time)
    orbit = cf.find_orbit(model, params, state=state, time=time)
    assert found.motion is Motion.PERIODIC and found.converged
    sizes = np.abs(orbit.multipliers)
    assert len(sizes) == len(found.exponents) - int(orbit.model.autonomous)
    kept = np.append(sizes > 0.0, False)[: len(found.exponents)]
    expected = np.log(sizes[sizes > 0.0]) / orbit.period
    # all of two states; of three the smallest comes from a product, and is less exact (docs/lyapunov.md)
    np.testing.assert_allclose(found.exponents[kept][:2], expected[:2], rtol=0.0, atol=1e-9)
    assert np.all(found.exponents[~kept] == -np.inf)
    assert found.spectrum[0] == 0.0  # a shift along the flow
    assert len(found.spectrum) == len(sizes) + 1


# ------------------------------------------------------------------------- impacts, independently


def dop853_growth(
    params: dict[str, float], state: list[float], periods: int
) -> tuple[float, float]:
    """Return the time of the first joint after some periods of the impact oscillator, and ln |(dt, dy)|.

    By scipy: the variational equation along the motion, and at an impact the map of perturbations written
    with the saltation matrix ``S = R_y + (f+ - R_y f-) n^T / (n . f-)`` (R: the reset).
    """
    A, w, k, c, d, e = (params[name] for name in ("A", "w", "k", "c", "d", "e"))

    def field(t: float, y: Any) -> np.ndarray:
        return np.array([y[1], A * np.cos(w * t) - c * y[1] - k * y[0]])

    def both(t: float, z: Any) -> np.ndarray:
        slopes = np.array([[0.0, 1.0], [-k, -c]]) @ z[2:4]
        return np.concatenate([field(t, z), slopes])

    def wall(t: float, z: Any) -> float:
        return float(d - z[0])

    def stop(t: float, z: Any) -> float:
        return float(z[1])

    wall.terminal = stop.terminal = True  # type: ignore[attr-defined]
    wall.direction = -1.0  # type: ignore[attr-defined]
    # the perturbation that contfric begins with: a millionth of the other state (chaos/tangent.py)
    t, z = 0.0, np.array([*state, 1.0, 1e-6 * np.sin(4.0)])
    reset = np.diag([1.0, -e])
    while True:
        short = solve_ivp(both, (t, t + 1e-3), z, method="DOP853", rtol=1e-13, atol=1e-15)
        t, z = short.t[-1], short.y[:, -1]  # off the surface that it starts on
        done = solve_ivp(
            both, (t, t + 1e3), z, method="DOP853", rtol=1e-13, atol=1e-15, events=(wall, stop)
        )
        t, z = done.t[-1], done.y[:, -1]
        hit = len(done.t_events[0]) > 0
        normal = np.array([1.0, 0.0]) if hit else np.array([0.0, 1.0])
        before = field(t, z[:2])
        later = -(normal @ z[2:]) / (normal @ before)
        over = t >= periods * 2.0 * np.pi / w
        if hit:
            after = field(t, reset @ z[:2])
            jump = reset + np.outer(after - reset @ before, normal) / (normal @ before)
            behind = jump @ z[2:]  # at one time
            z = np.concatenate([reset @ z[:2], behind])
            before = after
        if over:
            return t, float(np.log(np.linalg.norm([later, *(z[2:] + before * later)])))


@pytest.mark.parametrize("periods", [8, 20])
def test_growth_over_impacts_is_that_of_another_integrator(periods: int) -> None:
    """A chaotic solution from the same start, joint for joint: no statistics.

    From a start without chatter, of which scipy misses impacts.
    """
    params = {"A": 1.0, "w": 2.8, "k": 1.0, "c": 0.1, "d": 0.0, "e": 0.8}
    state = [-0.5, 0.4]
    found = cf.lyapunov_exponent("impact", params, state=state, periods=periods, transient=0)
    time, growth = dop853_growth(params, state, periods)
    assert found.largest * time == pytest.approx(growth, abs=1e-7)


def test_areas_shrink_by_damping_and_by_restitution() -> None:
    """The determinant of the saltation matrix at a fixed wall is e^2: one impact in each period."""
    found = cf.lyapunov_exponent("impact", {"e": 0.7, "c": 0.15})
    assert found.motion is Motion.PERIODIC and found.periods == 1
    orbit = cf.find_orbit("impact", {"e": 0.7, "c": 0.15})
    impacts = [surface for _, surface in orbit.itinerary].count("wall")
    assert impacts > 0
    expected = -0.15 + 2.0 * impacts * np.log(0.7) / orbit.period
    assert np.sum(found.exponents) == pytest.approx(expected, abs=1e-10)


# ------------------------------------------------------------------------- chaos


@pytest.mark.slow
@pytest.mark.parametrize("name", CHAOTIC)
def test_chaotic_exponent_agrees_with_two_orbits(name: str) -> None:
    """Within four of the errors that both give for themselves."""
    model, params, periods = CHAOTIC[name]
    found = cf.lyapunov_exponent(model, params, periods=2 * periods, tolerance=0.0)
    estimate = two_orbit_estimate(model, params, periods=periods)
    assert found.motion is Motion.CHAOTIC
    assert abs(found.largest - estimate.value) < 4.0 * np.hypot(found.error, estimate.error)


def test_declared_coulomb_has_the_exponents_of_the_closed_form() -> None:
    """A small map of periodic solutions, and a chaotic solution within the errors."""
    grid, fixed = {"Omega": [0.42, 0.5, 0.7], "S": [0.25, 0.32]}, {"S0": 0.4}
    closed, declared = (
        cf.lyapunov_map(name, grid, fixed, periods=200) for name in ("coulomb", "coulomb-yaml")
    )
    assert np.array_equal(closed.motions, declared.motions)
    assert np.array_equal(closed.periods, declared.periods)
    assert closed.where(Motion.PERIODIC).all()
    np.testing.assert_allclose(declared.values, closed.values, rtol=0.0, atol=1e-9)
    chaos = {"Omega": 0.35, "S": 0.05, "S0": 0.4}
    both = [
        cf.lyapunov_exponent(name, chaos, periods=400, tolerance=0.0)
        for name in ("coulomb", "coulomb-yaml")
    ]
    assert all(found.motion is Motion.CHAOTIC for found in both)
    assert abs(both[0].largest - both[1].largest) < 4.0 * np.hypot(both[0].error, both[1].error)


# ------------------------------------------------------------------------- without excitation


@cache
def jerk() -> cf.Model:
    return cf.load_model(JERK)


def follow(state: list[float], periods: int = 600, **params: float) -> cf.LyapunovExponents:
    return cf.lyapunov_exponent(jerk(), params, state=state, periods=periods, tolerance=0.0)


def test_autonomous_chaos_is_told_from_cycles() -> None:
    """Sprott's equation has the exponents (0.0550, 0, -2.0720) at a = 2.017; their sum is -a."""
    chaos = follow([0.0, 0.0, 1.0], periods=20_000)
    assert chaos.motion is Motion.CHAOTIC
    assert abs(chaos.largest - 0.0550) < 4.0 * chaos.error + 5e-5
    np.testing.assert_array_equal(chaos.spectrum, [chaos.exponents[0], 0.0, chaos.exponents[1]])
    assert np.sum(chaos.spectrum) == pytest.approx(-2.017, abs=1e-3)
    cycle = follow([0.02, 0.0, 0.01], periods=3000, a=2.06)
    assert cycle.motion is Motion.PERIODIC and cycle.converged
    assert cycle.largest < 0.0 == cycle.spectrum[0]
    assert np.sum(cycle.spectrum) == pytest.approx(-2.06, abs=1e-5)


@pytest.mark.parametrize(
    "params",
    [
        {"a": 1.0, "d": 3.0},  # a focus that attracts more slowly than its third direction
        {"a": 3.0, "d": 4.0},  # a node next to a focus: surfaces are met no more
        {"a": 50.0, "d": 100.0, "k": 60.0},  # one direction is forgotten at once
        {"a": 1.0, "d": 3.0, "F": 0.5},
    ],
)
def test_motion_that_comes_to_rest_has_the_exponents_of_the_equilibrium(
    params: dict[str, float],
) -> None:
    found = follow([1.0, 0.0, 0.1], q=0.0, **params)
    values = {"k": 1.0, **params}
    roots = np.roots([1.0, values["a"], values["d"], values["k"]]).real
    assert found.motion is Motion.HELD
    np.testing.assert_allclose(found.exponents, np.sort(roots)[::-1], rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(found.spectrum, found.exponents)


def test_an_equilibrium_that_repels_is_one_all_the_same() -> None:
    found = follow([0.0, 0.0, 0.0])
    assert found.motion is Motion.HELD
    roots = np.roots([1.0, 2.017, 0.0, 1.0]).real
    np.testing.assert_allclose(found.exponents, np.sort(roots)[::-1], rtol=0.0, atol=1e-9)


# ------------------------------------------------------------------------- no exponents


@pytest.mark.parametrize(
    ("state", "params", "motion"),
    [
        (
            [3.0, 3.0, 0.0],
            {},
            Motion.UNBOUNDED,
        ),  # in a finite time, as a power of what is left of it
        ([0.0, 1.0, 1.0], {"a": -1.0, "k": 0.0, "q": 0.0}, Motion.UNBOUNDED),  # as an exponential
        ([0.0, 1.0, 0.0], {"a": 0.0, "k": 0.0, "q": 0.0}, Motion.UNCUT),  # on and on
        ([0.0, 1.0, 0.0], {"k": 0.0, "q": 0.0, "s": 1.0, "r": 2.0}, Motion.BROKEN),  # root of < 0
    ],
)
def test_what_has_no_exponents_is_named(
    state: list[float], params: dict[str, float], motion: Motion
) -> None:
    found = follow(state, **params)
    assert found.motion is motion
    assert np.isnan(found.exponents).all() and np.isnan(found.spectrum).all()


def test_a_map_of_all_kinds_of_motions_is_not_lost() -> None:
    """Escapes, rests and cycles stand next to each other, and breakdowns where a root has no value."""
    grid = {"a": [-1.0, 1.0, 2.06], "d": [0.0, 3.0]}
    start = [0.02, 0.0, 0.01]
    lmap = cf.lyapunov_map(jerk(), grid, state=start, tile=2, periods=3000)
    assert lmap.complete
    names = [[list(Motion)[code].name for code in row] for row in lmap.motions[..., 0]]
    assert names == [["UNBOUNDED", "UNBOUNDED"], ["UNBOUNDED", "HELD"], ["PERIODIC", "HELD"]]
    assert np.array_equal(np.isnan(lmap.values), lmap.where(Motion.UNBOUNDED))
    assert not lmap.chaotic.any()
    limited = cf.lyapunov_map(jerk(), grid, {"s": 1e-9, "r": 5.0}, state=start)
    assert limited.complete
    assert limited.counts()[Motion.BROKEN] > 0
    assert np.array_equal(np.isnan(limited.values), limited.absent())


@pytest.mark.parametrize("e", [0.05, 0.5])
def test_impacts_that_accumulate(e: float) -> None:
    """The spring presses the mass against the stop; the flights before are of any length."""
    params = {"w": 0.5, "e": e, "d": 0.0}
    found = cf.lyapunov_exponent("impact", params)
    assert found.motion is Motion.CHATTER
    assert np.isnan(found.exponents).all()
    assert cf.simulate("impact", params).end.name == "CHATTER"


def test_negative_damping_wins_beyond_the_unstable_cycle() -> None:
    """It grows until the levels +-1 of its surfaces are rounding compared with the speed."""
    found = cf.lyapunov_exponent("dead-band", {"alpha": 2.5}, state=[1.0, 0.0])
    assert found.motion is Motion.UNBOUNDED


def test_friction_holds_a_mass_that_the_wall_does_not_reach() -> None:
    found = cf.lyapunov_exponent("impact-friction", {"b": 3.0}, state=[0.1, 0.0])
    assert found.motion is Motion.HELD
    assert found.exponents.tolist() == [0.0, -np.inf]


def test_softening_escapes_in_a_finite_time_and_a_large_force_does_not() -> None:
    assert cf.lyapunov_exponent("bang-bang", {"ep": -1.0, "A": 5.0}).motion is Motion.UNBOUNDED
    huge = cf.lyapunov_exponent("bang-bang", {"A": 1e6}, periods=20, transient=10)
    assert np.isfinite(huge.largest)
