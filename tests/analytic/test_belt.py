"""Block on a belt: an autonomous model with a stick-slip cycle in closed form.

With ``x'' + x = S`` below the belt's speed V, released at ``x = S0``, a cycle without damping sticks for
``2 (S0 - S) / V`` and slips for ``2 (pi - arctan((S0 - S) / V))``; it slips along a circle about (S, 0), so
that ``x_max = S + r`` and ``x_min = S - r`` with ``r^2 = (S0 - S)^2 + V^2``.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import contfric as cf

belt = cf.load_model(Path(__file__).parents[1] / "models" / "belt_constant.yaml")

S, S0 = 0.3, 0.5


def period_of(v: float) -> float:
    return 2.0 * (S0 - S) / v + 2.0 * (math.pi - math.atan((S0 - S) / v))


@cache
def undamped() -> cf.Branch:
    return cf.continue_orbit(cf.find_orbit(belt, {"V": 0.2, "S": S, "S0": S0}), "V", (0.02, 2.0))


@cache
def damped() -> cf.Diagram:
    start = cf.find_orbit(belt, {"V": 0.1, "S": S, "S0": S0, "zeta": 0.05})
    return cf.explore(start, "V", (0.02, 1.0))


@pytest.mark.parametrize("v", [0.05, 0.2, 1.0])
def test_cycle_in_closed_form(v: float) -> None:
    orbit = cf.find_orbit(belt, {"V": v, "S": S, "S0": S0}, state=[0.0, v])
    radius = math.hypot(S0 - S, v)
    assert orbit.period == pytest.approx(period_of(v), rel=1e-14)
    assert orbit.x_max == pytest.approx(S + radius, abs=1e-14)
    assert orbit.x_min == pytest.approx(S - radius, abs=1e-14)
    assert set(orbit.itinerary) == {("slower", "belt"), ("stick", "F+")}
    assert orbit.multipliers.tolist() == [0.0] and orbit.stable


def test_period_along_the_branch() -> None:
    branch = undamped()
    exact = np.array([period_of(v) for v in branch.values])
    np.testing.assert_allclose(branch.period, exact, rtol=1e-12)
    np.testing.assert_allclose(branch.x_max, S + np.hypot(S0 - S, branch.values), rtol=1e-12)
    assert branch.turn_multipliers is not None
    assert branch.turn_multipliers.shape == (len(branch), 1)


def test_trajectory_runs_through_the_cycle() -> None:
    orbit = undamped()[3]
    times, states, names = orbit.trajectory()
    assert times[-1] - times[0] == pytest.approx(orbit.period)
    assert np.max(np.abs(states[-1] - states[0])) < 1e-13
    assert "stick" in names
    assert orbit.state(0.3) == pytest.approx(orbit.state(0.3 + orbit.period), abs=1e-12)


def touching_speed(zeta: float) -> float:
    """Speed at which a slip from release just touches the belt's speed again, from the closed form."""

    def gap(v: float) -> float:
        w = math.sqrt(1.0 - zeta * zeta)
        x0 = S0 - 2.0 * zeta * v - S  # released where x + 2 zeta V = S0

        def at(d: float) -> tuple[float, float]:
            c, s, e = math.cos(w * d), math.sin(w * d) / w, math.exp(-zeta * d)
            speed = e * ((c - zeta * s) * v - s * x0)
            return speed, -2.0 * zeta * speed - e * ((c + zeta * s) * x0 + s * v)

        top = brentq(lambda d: at(d)[1], math.pi, 2.2 * math.pi)  # speed is largest again
        return at(top)[0] - v

    return brentq(gap, 0.05, 0.6, xtol=1e-15)


def test_cycle_ends_where_it_reaches_the_belt_no_more() -> None:
    diagram = damped()
    (event,) = diagram.of_kind("GS")
    assert event.params["V"] == pytest.approx(touching_speed(0.05), abs=1e-9)
    assert diagram.branches[0].ends[1].reason is cf.EndReason.GS
    above = {"V": event.params["V"] * 1.001, "S": S, "S0": S0, "zeta": 0.05}
    with pytest.raises(cf.errors.ConvergenceError, match="equilibrium"):
        cf.find_orbit(belt, above)


def test_jump_of_the_belt_is_bridged() -> None:
    """Between slip that converges and the cycle lies an unstable one that is held: it goes to V = 0."""
    diagram = damped()
    assert not diagram.loose_ends
    cycle, held = diagram.branches
    assert held.bridge and not cycle.bridge
    assert held.ends[1].reason is cf.EndReason.RANGE
    assert held.x_max[-1] < cycle.x_max[np.argmin(cycle.values)]


def test_period_to_infinity_ends_a_branch() -> None:
    start = cf.find_orbit(belt, {"V": 0.2, "S": S, "S0": S0})
    branch = cf.continue_orbit(start, "V", (-1.0, 0.3), max_step=0.1)
    assert branch.ends[0].reason is cf.EndReason.PERIOD
    assert branch.period[0] > 1e4
    assert branch.values[0] == pytest.approx(2.0 * (S0 - S) / branch.period[0], rel=1e-3)


def test_orbit_solved_from_its_signature() -> None:
    known = undamped()[5]
    found = cf.solve_orbit(belt, known.signature, known.params)
    assert found.period == pytest.approx(known.period, rel=1e-12)


@pytest.mark.slow
def test_exponents_of_the_cycle_and_of_the_equilibrium() -> None:
    cycle = cf.lyapunov_exponent(belt, {"V": 0.1, "S": S, "S0": S0, "zeta": 0.05})
    assert cycle.motion.name == "PERIODIC" and np.all(np.isneginf(cycle.exponents))
    rest = cf.lyapunov_exponent(belt, {"V": 0.5, "S": S, "S0": S0, "zeta": 0.05})
    assert rest.motion.name == "HELD"
    np.testing.assert_allclose(rest.exponents, [-0.05, -0.05], rtol=1e-9)


def test_features_for_excited_models_refuse() -> None:
    with pytest.raises(cf.errors.ParameterError, match="no excitation"):
        cf.census(belt, {"V": 0.2})
