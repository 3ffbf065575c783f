"""Lyapunov exponents against what is known otherwise.

Multipliers of the boundary-value problem (elimination, no simulation), Den Hartog's closed form, the sum
rule, finite differences of the simulation, and the two-orbit estimate.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric import Motion
from contfric.chaos.exponents import lyapunov_dimension
from tests.two_orbits import two_orbit_estimate

#: Stable orbits, with their names: sticks or none, symmetric or not, one period or two, with and without
#: damping and third harmonic; and near a fold (0.5419), where the solution settles slowly.
STABLE = {
    "1a": {"Omega": 0.5, "S": 0.32, "S0": 0.4},
    "1a near its fold": {"Omega": 0.5418, "S": 0.32, "S0": 0.4},
    "2s": {"Omega": 0.48, "S": 0.32, "S0": 0.4},
    "2s, long sticks": {"Omega": 0.3, "S": 0.05, "S0": 0.4},
    "0s": {"Omega": 0.7, "S": 0.1, "S0": 0.1},
    "0s, damped": {"Omega": 0.7, "S": 0.1, "S0": 0.1, "zeta": 0.1},
    "0s, third harmonic": {"Omega": 0.7, "S": 0.1, "S0": 0.12, "h": 0.1},
    "2a of two periods": {"Omega": 0.5, "S": 0.06, "S0": 0.4},
    "2a": {"Omega": 0.4888, "S": 0.32, "S0": 0.4},
    "four sticks": {"Omega": 0.2, "S": 0.1, "S0": 0.4},
}
#: Chaotic solutions in the domains of Figs. 8 to 11 of the reference, one with damping, one with h.
CHAOTIC = (
    {"Omega": 0.35, "S": 0.05, "S0": 0.4},
    {"Omega": 0.3, "S": 0.1, "S0": 0.3},
    {"Omega": 0.5, "S": 0.02, "S0": 0.4},
    {"Omega": 0.4, "S": 0.1, "S0": 0.8},
    {"Omega": 0.35, "S": 0.05, "S0": 0.4, "zeta": 0.002},
    {"Omega": 0.3, "S": 0.1, "S0": 0.4, "h": 0.05},
)


def case_name(params: dict[str, float]) -> str:
    return ", ".join(f"{k}={v}" for k, v in params.items())


@pytest.mark.parametrize("name", STABLE)
def test_periodic_motion_has_the_exponents_of_its_multipliers(name: str) -> None:
    params = STABLE[name]
    found = cf.lyapunov_exponent("coulomb", params)
    orbit = cf.find_orbit("coulomb", params)  # solved by elimination, on its half if symmetric
    assert found.motion is Motion.PERIODIC
    assert found.converged
    assert found.periods == orbit.periods
    sizes = np.abs(orbit.multipliers)
    kept = sizes > 0.0
    expected = np.log(sizes[kept]) / orbit.period
    # near a fold the multiplier itself is known to about 1e-11
    np.testing.assert_allclose(found.exponents[kept], expected, rtol=0.0, atol=1e-9)
    assert np.all(found.exponents[~kept] == -np.inf)
    assert abs(found.largest - expected[0]) <= 10.0 * found.error + 1e-13


def test_sticks_leave_no_second_exponent() -> None:
    assert cf.lyapunov_exponent("coulomb", STABLE["1a"]).exponents[1] == -np.inf
    chaotic = cf.lyapunov_exponent("coulomb", CHAOTIC[0], periods=600)
    assert chaotic.exponents[1] == -np.inf
    assert chaotic.dimension == 1.0


@pytest.mark.parametrize(("omega", "s"), [(0.7, 0.1), (0.8, 0.3), (1.4, 0.2), (0.6, 0.05)])
def test_den_hartog(omega: float, s: float) -> None:
    """Sum of the exponents from the determinant of the half-period map, in closed form.

    Den Hartog's orbit (zeta = h = 0): V = 1/(1 - Omega^2), U = sin(pi/Omega) / (Omega (1 +
    cos(pi/Omega))), x_max = sqrt(V^2 - S^2 U^2); the determinant is
    (Omega^2 x_max - S) / (Omega^2 x_max + S).
    """
    found = cf.lyapunov_exponent("coulomb", {"Omega": omega, "S": s, "S0": s})
    big_v = 1.0 / (1.0 - omega**2)
    big_u = np.sin(np.pi / omega) / (omega * (1.0 + np.cos(np.pi / omega)))
    x_max = np.sqrt(big_v**2 - (s * big_u) ** 2)
    half = (omega**2 * x_max - s) / (omega**2 * x_max + s)
    assert found.motion is Motion.PERIODIC
    assert np.sum(found.exponents) == pytest.approx(np.log(half) / (np.pi / omega), abs=1e-10)


@pytest.mark.parametrize("seed", range(12))
def test_sum_rule_without_sticks(seed: int) -> None:
    """Volumes contract by the divergence, -2 zeta, and at each reversal by a_after / a_before.

    The accelerations on both sides of a stop are those of the equation of motion; the saltation
    matrix has their quotient as its determinant.
    """
    rng = np.random.default_rng(seed)
    S = rng.uniform(0.02, 0.15)
    params = {
        "Omega": rng.uniform(0.55, 1.3),
        "S": S,
        "S0": S,
        "h": rng.uniform(-0.1, 0.1),
        "zeta": rng.uniform(0.01, 0.2),
    }
    found = cf.lyapunov_exponent("coulomb", params)
    orbit = cf.find_orbit("coulomb", params)
    assert "stick" not in {mode for mode, _ in orbit.itinerary}
    ratios = []
    for (mode, _), (time, x, _) in zip(orbit.itinerary, orbit.ends, strict=True):
        w, h = params["Omega"], params["h"]
        load = x - np.cos(w * time) - h * np.cos(3 * w * time)
        s = 1.0 if mode == "slide+" else -1.0
        ratios.append((-load + s * S) / (-load - s * S))
    expected = -2.0 * params["zeta"] + np.sum(np.log(ratios)) / orbit.period
    assert found.motion is Motion.PERIODIC
    assert np.sum(found.exponents) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("params", CHAOTIC, ids=case_name)
@pytest.mark.parametrize("periods", [2, 6])
def test_growth_is_that_of_neighbouring_motions(params: dict[str, float], periods: int) -> None:
    """Central differences of the simulation over a few periods of a chaotic solution, joint for joint."""
    start, step = 1.0 + 0.9 * params["S0"], 1e-7

    def joint(x: float) -> tuple[float, np.ndarray]:
        trajectory = cf.simulate("coulomb", params, state=[x, 0.0], periods=periods + 3)
        last = int(np.argmax(trajectory.cycles >= periods))
        period = 2.0 * np.pi / params["Omega"]
        time = float(trajectory.cycles[last] * period + trajectory.times[last])
        return time, np.array([time, *trajectory.states[last]])

    found = cf.lyapunov_exponent(
        "coulomb", params, state=[start, 0.0], periods=periods, transient=0
    )
    time, _ = joint(start)
    apart = (joint(start + step)[1] - joint(start - step)[1]) / (2.0 * step)
    # error of the difference: rounding over the step, and its square times growth to the third power
    assert found.largest * time == pytest.approx(np.log(np.linalg.norm(apart)), abs=1e-5)


@pytest.mark.parametrize("params", CHAOTIC, ids=case_name)
def test_chaotic_exponent_agrees_with_two_orbits(params: dict[str, float]) -> None:
    """Within four of the errors that both give for themselves: one in 10^4 would differ more."""
    start = [1.0 + 0.9 * params["S0"], 0.0]
    found = cf.lyapunov_exponent("coulomb", params, state=start, periods=2000, tolerance=0.0)
    estimate = two_orbit_estimate("coulomb", params, state=start, periods=600)
    assert found.motion is Motion.CHAOTIC
    assert abs(found.largest - estimate.value) < 4.0 * np.hypot(found.error, estimate.error)


def test_chaos_at_a_realistic_ratio() -> None:
    """Section 6 of the reference: S0 = 0.3 has a positive exponent even at S = 0.265, S0/S = 1.13."""
    found = cf.lyapunov_exponent("coulomb", {"Omega": 0.475, "S": 0.265, "S0": 0.3}, confirm=5000)
    assert found.motion is Motion.CHAOTIC
    assert found.converged
    # and none at S = 0.295, where every start settles
    grid = {"Omega": np.linspace(0.45, 0.5, 11), "S": [0.295]}
    assert not cf.lyapunov_map("coulomb", grid, {"S0": 0.3}, starts=3, confirm=5000).chaotic.any()


def test_two_orbits_of_a_periodic_motion() -> None:
    params = STABLE["2s, long sticks"]
    estimate = two_orbit_estimate("coulomb", params, periods=100)
    exact = cf.lyapunov_exponent("coulomb", params).largest
    assert abs(estimate.value - exact) < 4.0 * estimate.error + 1e-3 * abs(exact)


def test_rest_is_neutral_in_its_position() -> None:
    """S0 > 1 holds the mass at x = 0 for ever: displaced, it stays displaced; a velocity is lost."""
    found = cf.lyapunov_exponent("coulomb", {"S": 0.5, "S0": 1.2}, state=[0.1, 0.0])
    assert found.motion is Motion.HELD
    assert found.exponents.tolist() == [0.0, -np.inf]


@pytest.mark.parametrize(
    "params",
    [{"Omega": 1.0, "S": 0.3, "S0": 0.4}, {"Omega": 0.7, "S": 0.01, "S0": 0.02, "zeta": -0.1}],
)
def test_growth_without_bound_has_no_exponent(params: dict[str, float]) -> None:
    """At resonance the amplitude grows as t (1/2 - 2 S/pi) if S < pi/4; negative damping as e^(0.1 t)."""
    found = cf.lyapunov_exponent("coulomb", params, periods=600)
    assert found.motion is Motion.UNBOUNDED
    assert np.isnan(found.exponents).all()
    assert np.isnan(found.dimension)


@pytest.mark.parametrize(
    ("exponents", "dimension"),
    [
        ([-0.1, -0.2], 0.0),
        ([0.1, -np.inf], 1.0),
        ([0.1, -0.4], 1.25),
        ([0.0, -np.inf], 1.0),
        ([0.3, -0.3], 2.0),
        ([0.3, 0.1], 2.0),
        ([0.9, 0.0, -14.5], 2.0 + 0.9 / 14.5),  # Lorenz's attractor has 2.06
        ([np.nan, np.nan], np.nan),
    ],
)
def test_lyapunov_dimension(exponents: list[float], dimension: float) -> None:
    np.testing.assert_allclose(lyapunov_dimension(np.array(exponents)), dimension)
