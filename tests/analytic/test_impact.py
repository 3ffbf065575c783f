"""Forced oscillator and a wall: orbits of one impact in closed form, multipliers, grazing.

Between impacts ``x = p(t) + free motion`` with the forced response p. An orbit of one impact a period T
that meets the wall at phase s with speed u leaves it with ``-e u``; after T it is back::

    (g - p(s), u - p'(s)) = M (g - p(s), -e u - p'(s)),      M the free solution over T,

two linear equations for u and (with cos and sin of the phase) for s. The product of its multipliers is
``e^2 exp(-2 zeta T)``: the free motion contracts areas by the one factor, the impact with its saltation by
the other (di Bernardo et al., Piecewise-smooth Dynamical Systems, Springer 2008, section 6.2).
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import contfric as cf
from contfric.signature import parse_signature
from tests.two_orbits import two_orbit_estimate

impact = cf.load_model(Path(__file__).parents[1] / "models" / "moving_wall.yaml")

OMEGA, ZETA, E = 1.7, 0.1, 0.7
PARAMS = {"f": 1.0, "Omega": OMEGA, "zeta": ZETA, "wall": 0.2, "e": E}
STATE = [0.0, 0.1]


def response(t: float) -> tuple[float, float]:
    """Forced response and its rate."""
    z = 1.0 / complex(1.0 - OMEGA**2, 2.0 * ZETA * OMEGA)
    turn = complex(math.cos(OMEGA * t), math.sin(OMEGA * t))
    return (z * turn).real, (1j * OMEGA * z * turn).real


def free(d: float) -> np.ndarray:
    w, e = math.sqrt(1.0 - ZETA**2), math.exp(-ZETA * d)
    c, s = math.cos(w * d), math.sin(w * d) / w
    return e * np.array([[c + ZETA * s, s], [-s, c - ZETA * s]])


def closed_form(wall: float, turns: int) -> list[float]:
    """Speeds of the impacts of all orbits of one impact in a number of periods."""
    m = free(turns * 2.0 * math.pi / OMEGA)
    period = 2.0 * math.pi / OMEGA

    def speed(s: float) -> float:  # from the first equation
        x, v = response(s)
        return ((wall - x) * (1.0 - m[0, 0]) + m[0, 1] * v) / (-E * m[0, 1])

    def gap(s: float) -> float:  # the second one
        x, v = response(s)
        u = speed(s)
        return (u - v) - m[1, 0] * (wall - x) - m[1, 1] * (-E * u - v)

    grid = np.linspace(0.0, period, 400)
    values = [gap(s) for s in grid]
    return [
        speed(brentq(gap, grid[i], grid[i + 1], xtol=1e-15))
        for i in range(len(grid) - 1)
        if values[i] * values[i + 1] < 0.0
    ]


@cache
def orbit() -> cf.Orbit:
    return cf.find_orbit(impact, PARAMS, state=STATE)


@cache
def diagram() -> cf.Diagram:
    return cf.explore(orbit(), "wall", (-0.27, 1.0))


def test_orbit_of_one_impact_in_closed_form() -> None:
    found = orbit()
    at = [i for i, (_, exit_) in enumerate(found.itinerary) if exit_ == "wall"]
    assert len(at) == 1
    speed = found.ends[at[0], 2]
    assert min(abs(speed - u) for u in closed_form(PARAMS["wall"], found.periods)) < 1e-12


def test_product_of_multipliers_is_that_of_the_saltation() -> None:
    for branch in diagram().branches[:1]:
        for found in (branch[3], branch[len(branch) // 2], branch[-4]):
            product = np.prod(found.multipliers)
            assert product.real == pytest.approx(
                E**2 * math.exp(-2 * ZETA * found.period), rel=1e-9
            )
            assert abs(product.imag) < 1e-12


@pytest.mark.parametrize("moving", [0.0, 0.1])
def test_multipliers_agree_with_differences_of_the_return_map(moving: float) -> None:
    params = {**PARAMS, "a": moving}
    found = cf.find_orbit(impact, params, state=STATE)
    time = float(found.cycle[0, 0] + 0.4 * (found.ends[0, 0] - found.cycle[0, 0]))
    middle, h = found.state(time), 1e-6

    def mapped(y: np.ndarray) -> np.ndarray:
        return cf.simulate(impact, params, state=y, time=time, periods=found.periods).last[2]

    assert np.max(np.abs(mapped(middle) - middle)) < 1e-12
    columns = [(mapped(middle + h * d) - mapped(middle - h * d)) / (2 * h) for d in np.eye(2)]
    brute = np.linalg.eigvals(np.column_stack(columns))
    np.testing.assert_allclose(
        np.sort_complex(found.multipliers), np.sort_complex(brute), atol=1e-8
    )


def test_jacobian_agrees_with_differences() -> None:
    from contfric.bvp.blocks import linearise
    from contfric.bvp.linear import assembled

    found = cf.find_orbit(impact, {**PARAMS, "a": 0.1}, state=STATE)
    system, h = found.system, 1e-6
    exact = assembled(system, found.joints, found.vector)

    def residual(joints: np.ndarray) -> np.ndarray:
        n, m = joints.shape
        a, b = np.empty((n, m, m)), np.empty((n, m, m))
        c, r = np.empty((n, m, len(found.vector))), np.empty((n, m, 1))
        which = np.arange(len(found.vector))
        at = system.functions(), system.layout, joints, found.vector, which
        linearise(*at, 1, a, b, c, r, np.empty((m, m)))
        return -r.ravel()

    for k in range(found.joints.size):
        up, down = found.joints.copy(), found.joints.copy()
        up.flat[k] += h
        down.flat[k] -= h
        difference = (residual(up) - residual(down)) / (2 * h)
        np.testing.assert_allclose(exact[:, k], difference, atol=2e-8)


def test_grazing_impact_joins_the_motion_without_impact() -> None:
    """It grazes where the wall stands at the amplitude of the linear response."""
    amplitude = 1.0 / math.hypot(1.0 - OMEGA**2, 2.0 * ZETA * OMEGA)
    found = [b for b in diagram().of_kind("GS") if abs(b.params["wall"] - amplitude) < 1e-6]
    assert len(found) == 1 and found[0].params["wall"] == pytest.approx(amplitude, abs=1e-10)
    node = next(n for n in diagram().nodes if n.bifurcation is found[0])
    names = sorted(diagram().branches[i].name for i in node.branches)
    assert names == ["0a, 2seg", "0a, 2seg, 1imp"]


def test_nothing_is_left_loose() -> None:
    assert [str(end) for end in diagram().loose_ends] == []
    ends = {str(end) for branch in diagram().branches for end in branch.ends}
    assert "grazing impact: the wall is just touched" in ends


def test_branch_points_are_orbits_of_the_simulation() -> None:
    branch = diagram().branches[0]
    assert branch.stable is not None
    for k in np.flatnonzero(branch.stable)[1::40]:
        found = branch[int(k)]
        time = float(found.cycle[0, 0]) + 1e-3
        walked = cf.simulate(
            impact, found.params, state=found.state(time), time=time, periods=found.periods
        )
        assert np.max(np.abs(walked.last[2] - found.state(time))) < 1e-9
        assert len(walked) == len(found.itinerary)


def test_signature_names_the_impact() -> None:
    signature = orbit().signature
    assert str(signature) == "up -> impact@wall -> down"
    again = parse_signature(str(signature), impact, periods=orbit().periods)
    assert again == signature and again.impacts == 1
    found = cf.solve_orbit(impact, again, PARAMS)
    assert np.sort(found.stops) == pytest.approx(np.sort(orbit().stops), abs=1e-9)
    with pytest.raises(cf.errors.NotationError, match="impact@wall"):
        parse_signature("up -> impact@floor -> down", impact)


def test_exponents_are_those_of_the_multipliers() -> None:
    found = cf.lyapunov_exponent(impact, PARAMS, state=STATE)
    expected = np.log(np.abs(orbit().multipliers)) / orbit().period
    np.testing.assert_allclose(found.exponents, expected, rtol=1e-9)


def test_exponent_of_chaos_agrees_with_two_orbits() -> None:
    params = {**PARAMS, "wall": -0.3}
    found = cf.lyapunov_exponent(impact, params, state=[-2.0, 0.1], periods=20_000, tolerance=0.05)
    assert found.motion.name == "CHAOTIC"
    # the sum is the mean contraction: damping, and ln e^2 at each impact
    estimate = two_orbit_estimate(impact, params, state=[-2.0, 0.1], periods=400)
    assert abs(found.largest - estimate.value) < 4.0 * math.hypot(found.error, estimate.error)


def test_chatter_is_named() -> None:
    pressed = {
        **PARAMS,
        "wall": -0.5,
        "f": 0.0,
        "e": 0.5,
    }  # the spring presses the mass to the wall
    ended = cf.simulate(impact, pressed, state=[-1.0, 0.1], periods=50)
    assert ended.end.name == "CHATTER"
    with pytest.raises(cf.errors.ConvergenceError, match="chatter"):
        cf.find_orbit(impact, pressed, state=[-1.0, 0.1])
