"""All period-1 orbits with a stick, proved: nothing that a simulation does is left out of the balls."""

from __future__ import annotations

import numpy as np
import pytest
from flint import arb

import contfric as cf
from contfric.certify.releases import census_search
from contfric.certify.releases.following import Follower, Returned
from contfric.certify.releases.stretch import LineInS, UndecidedError
from contfric.errors import ParameterError
from contfric.models.balls.build import ball_model
from contfric.models.balls.numbers import working

MODEL = cf.load_model("coulomb")
PARAMS = {"Omega": 0.5, "S": 0.32, "S0": 0.4, "h": 0.0, "zeta": 0.0}


def simulated(params: dict[str, float], phase: float) -> list[tuple[str, float]]:
    """Return the releases within a period after one on F+, from steps of the equation of motion alone."""
    omega, s, s0, h, zeta = (params[k] for k in ("Omega", "S", "S0", "h", "zeta"))

    def force(t: float) -> float:
        return float(np.cos(omega * t) + h * np.cos(3 * omega * t))

    def rate(t: float, x: float, v: float, sign: int) -> tuple[float, float]:
        return v, force(t) - x - 2 * zeta * v - sign * s

    t, x, v, sign, found = phase, s0 + force(phase), 0.0, -1, []
    step, end = 2e-3, phase + 2 * np.pi / omega
    while t < end:
        if sign == 0:
            t += step
            load = x - force(t)
            if abs(load) >= s0:
                found.append(("F+" if load > 0 else "F-", t))
                sign, v = (-1 if load > 0 else 1), 0.0
            continue
        k1 = rate(t, x, v, sign)
        k2 = rate(t + step / 2, x + step / 2 * k1[0], v + step / 2 * k1[1], sign)
        k3 = rate(t + step / 2, x + step / 2 * k2[0], v + step / 2 * k2[1], sign)
        k4 = rate(t + step, x + step * k3[0], v + step * k3[1], sign)
        moved = [
            step / 6 * (a + 2 * b + 2 * c + d) for a, b, c, d in zip(k1, k2, k3, k4, strict=True)
        ]
        if (v + moved[1]) * sign <= 0 and v * sign > 0:  # the stop lies within the step
            share = v / -moved[1]
            t, x, v = t + share * step, x + share * moved[0], 0.0
            load = x - force(t)
            sign = 0 if abs(load) < s0 else (-1 if load > 0 else 1)
            continue
        t, x, v = t + step, x + moved[0], v + moved[1]
    return found


def holds(found: list[Returned], surface: str, time: float) -> bool:
    return any(r.surface == surface and r.time.whole.overlaps(arb(time, 0.01)) for r in found)


def agrees(follower: Follower, params: dict[str, float], first: float, width: float) -> bool | None:
    """See that the balls hold what simulations do; return whether the set was split, None if undecided."""
    try:
        found = follower.follow(LineInS(arb(first), arb(width), arb(0)), splits=True)
    except UndecidedError:
        return None
    for share in (-1.0, -0.3, 0.5, 1.0):
        for surface, time in simulated(params, first + share * width):
            assert holds(found, surface, time), (params, first, width, surface, time)
    return any(not r.smooth for r in found)


def test_no_solution_is_left_out() -> None:
    rng = np.random.default_rng(7)
    decided = 0
    for _ in range(3):
        limit = float(rng.uniform(0.2, 0.5))
        values = {"Omega": rng.uniform(0.35, 0.7), "S": limit * rng.uniform(0.4, 0.9), "S0": limit}
        values |= {"h": rng.choice([0.0, 0.1]), "zeta": rng.choice([0.0, 0.05])}
        params = {name: float(value) for name, value in values.items()}
        with working(100):
            follower = Follower(ball_model(MODEL, params))
            period = float(follower.balls.period.mid())
            for first in rng.uniform(0.0, period, 5).tolist():
                width = period * 10.0 ** rng.uniform(-6.0, -2.6)
                decided += agrees(follower, params, first, width) is not None
    assert decided > 9


def test_no_solution_is_left_out_at_a_jump() -> None:
    def releases(params: dict[str, float], phase: float) -> list[str]:
        return [surface for surface, _ in simulated(params, phase)]

    split = 0
    with working(100):
        for omega, low, high in ((0.5, 0.95, 1.37), (0.47, 1.5, 1.7)):
            params = PARAMS | {"Omega": omega}
            follower = Follower(ball_model(MODEL, params))
            ends, before = [low, high], releases(params, low)
            assert before != releases(params, high)
            while ends[1] - ends[0] > 2e-6:
                middle = sum(ends) / 2
                ends[releases(params, middle) != before] = middle
            split += bool(agrees(follower, params, sum(ends) / 2, 2e-5))
    assert split == 2


def test_the_derivative_of_a_return_is_that_of_secants() -> None:
    with working(100):
        follower = Follower(ball_model(MODEL, MODEL.mapping(MODEL.vector(PARAMS))))
        phase, width, checked = 0.7, 1e-7, 0
        found = follower.follow(LineInS(arb(phase), arb(width), arb(0)), splits=False)
        low, high = (
            follower.follow(LineInS(arb(phase + s * width), arb(0), arb(0)), splits=False)
            for s in (-1, 1)
        )
        for all_, a, b in zip(found, low, high, strict=True):
            secant = (b.time.whole - a.time.whole) / (arb(phase + width) - arb(phase - width))
            assert all_.slope.overlaps(secant)
            assert all_.slope.rad() < 1e-4
            checked += 1
    assert checked


@pytest.mark.parametrize("omega", [0.541, pytest.param(0.5, marks=pytest.mark.slow)])
def test_the_orbits_are_those_of_the_search(omega: float) -> None:
    params = PARAMS | {"Omega": omega}
    proved = cf.certify_census("coulomb", params)
    assert proved.proved, proved.why
    searched = cf.census("coulomb", params, periods=1, stops=6)
    sticking = [o for o in searched if any(mode == "stick" for mode, _ in o.itinerary)]
    assert sorted(one.orbit.name for one in proved.orbits) == sorted(o.name for o in sticking)
    for one in proved.orbits:
        assert one.orbit.converged
        assert one.orbit.system.half == one.symmetric
        mu = max(abs(one.orbit.multipliers))
        # of a symmetric orbit that of the half, squared, as releases on F+ are a period apart
        assert abs(abs(float(one.multiplier.mid())) - mu) < 1e-6 * (1 + mu)
        assert one.stable == one.orbit.stable
        assert len(str(proved).splitlines()) == 1 + len(proved.orbits)


@pytest.mark.slow
def test_where_bridges_are_no_orbit_takes_their_place() -> None:
    # between the end of 1a and that of 2a
    found = cf.certify_census("coulomb", PARAMS | {"Omega": 0.4918})
    assert found.proved, found.why
    assert [one.orbit.name for one in found.orbits] == ["2s"]


def test_what_is_not_decided_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(census_search, "_MOST", 70)
    found = cf.certify_census("coulomb", PARAMS)
    assert not found.proved
    assert found.strips
    assert "undecided" in str(found)
    assert found.why.startswith("phases ")
    # the orbits are in what is left, or proved
    assert all(strip.first < strip.last for strip in found.strips)


def test_other_models_are_refused() -> None:
    with pytest.raises(ParameterError, match="offered for the model 'coulomb'"):
        cf.certify_census("belt", {})
