"""Curves of NS against closed forms, and against a return map that is simulated."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from by_scipy import after
from scipy.integrate import solve_ivp
from typed import typed

import contfric as cf


def torus_of(orbit: cf.Orbit, parameter: str, bounds: tuple[float, float]) -> cf.Bifurcation:
    """Return the first NS of a branch."""
    branch = cf.continue_orbit(orbit, parameter, bounds)
    return next(b for b in branch.bifurcations if b.kind is cf.Kind.NS)


@pytest.mark.parametrize(("e", "d", "impacts"), [(0.9, 0.0, 1), (0.95, -0.1, 1), (0.85, 0.2, 0)])
def test_impacts_lose_what_negative_damping_gives(e: float, d: float, impacts: int) -> None:
    """The determinant of the return map is e^2 exp(-2 pi c / w) with one impact a period; without, no e."""
    start = {"w": 2.6, "c": 0.05, "e": e, "d": d}
    torus = torus_of(cf.find_orbit("impact", start), "c", (-0.3, 0.1))
    ranges = {"w": (2.4, 2.8), "c": (-0.3, 0.1)}
    curve = cf.continue_bifurcation(torus, ("w", "c"), ranges)
    assert curve.kind is cf.Kind.NS and len(curve) > 10
    exact = impacts * curve.params["w"] * math.log(e) / math.pi
    assert curve.params["c"] == pytest.approx(exact, abs=1e-10)
    for orbit in curve:
        mu = orbit.multipliers
        assert orbit.periods == 1
        assert np.prod(mu) == pytest.approx(1.0, abs=1e-9)
        if (
            abs(mu[0].imag) > 1e-3
        ):  # where the two meet on the axis, they are known to the root of rounding
            assert np.abs(mu) == pytest.approx([1.0, 1.0], abs=1e-9)
    for end in curve.ends:
        if end.special is not None and end.special.name in {"R1", "R2"}:
            sign = 1.0 if end.special.name == "R1" else -1.0
            assert end.special.orbit.turn_multipliers == pytest.approx([sign, sign], abs=1e-5)
    assert sum(np.abs(o.multipliers[0].imag) > 1e-3 for o in curve) > 5


@pytest.fixture(scope="module")
def coulomb() -> cf.Curve:
    orbit = cf.find_orbit("coulomb", {"Omega": 1.6, "S": 0.1, "S0": 0.1, "zeta": 0.05})
    ranges = {"Omega": (1.2, 4.0), "zeta": (-0.3, 0.1)}
    return cf.continue_bifurcation(
        torus_of(orbit, "zeta", (-0.2, 0.1)), ("Omega", "zeta"), ranges, max_step=0.05
    )


def half_map(orbit: cf.Orbit, state: np.ndarray) -> np.ndarray:
    """Return the mirrored state after half a period of the Coulomb oscillator, by Runge-Kutta."""
    p = orbit.params
    half = math.pi / p["Omega"]
    time, y = 0.0, state
    direction = math.copysign(1.0, y[1])
    while time < half:

        def rate(t: float, y: np.ndarray, s: float = direction) -> list[float]:
            force = math.cos(p["Omega"] * t) - y[0] - 2 * p["zeta"] * y[1]
            return [y[1], force - s * p["S"]]

        def stop(_: float, y: np.ndarray, s: float = direction) -> float:
            return s * y[1] + 1e-300

        stop.terminal, stop.direction = True, -1.0  # type: ignore[attr-defined]
        end = solve_ivp(rate, (time, half), y, "DOP853", events=stop, rtol=1e-13, atol=1e-14)
        time, y = float(end.t[-1]), end.y[:, -1].copy()
        if end.status == 1:
            y[1], direction = 0.0, -direction
    return -y


def test_both_multipliers_are_on_the_circle_of_a_simulated_map(coulomb: cf.Curve) -> None:
    for orbit in coulomb[:: len(coulomb) // 5]:
        state, h = orbit.state(0.0), 1e-5
        assert half_map(orbit, state) == pytest.approx(state, abs=1e-8)
        slopes = [
            (half_map(orbit, state + h * e) - half_map(orbit, state - h * e)) / (2 * h)
            for e in np.eye(2)
        ]
        mu = np.linalg.eigvals(np.column_stack(slopes))
        assert abs(mu[0].imag) > 1e-3
        assert np.abs(mu) == pytest.approx([1.0, 1.0], abs=1e-6)


def test_strong_resonances_are_named_and_located(coulomb: cf.Curve) -> None:
    found = {s.name: s for s in coulomb.special}
    assert {"R3", "R4"} <= set(found)
    for name, power in (("R3", 3), ("R4", 4)):
        mu = found[name].orbit.turn_multipliers
        assert mu**power == pytest.approx([1.0, 1.0], abs=1e-9) and abs(mu[0].imag) > 0.5
        place = np.array([found[name].params[n] for n in coulomb.parameters])
        assert np.min(np.linalg.norm(coulomb.values - place, axis=1)) < 0.2


def test_multipliers_of_an_integrated_model_by_differences(tmp_path: Path) -> None:
    """Where a forced self-excited oscillator is no longer entrained; to R1, where the curve ends."""
    torus = torus_of(
        cf.find_orbit(
            typed(
                tmp_path,
                """
name: entrained
states: [x, v]
parameters: {F: 4.0, w: 1.5, mu: 0.25}
period: 2*pi/w
field: {x: v, v: mu*(1 - x**2)*v - x - 0.1*x**3 + F*cos(w*t)}
spread: {x: 3, v: 3}
""",
            ),
            {},
        ),
        "F",
        (0.5, 5.0),
    )
    curve = cf.continue_bifurcation(torus, ("w", "F"), {"w": (1.1, 1.8), "F": (0.2, 5.0)})
    assert len(curve) > 10
    for orbit in [*curve[:: len(curve) // 4], *(s.orbit for s in curve.special)]:
        p, start = orbit.params, np.asarray(orbit.begins[0])

        def rate(t: float, y: np.ndarray, p: dict[str, float] = p) -> list[float]:
            damping = p["mu"] * (1 - y[0] ** 2)
            return [y[1], damping * y[1] - y[0] - 0.1 * y[0] ** 3 + p["F"] * math.cos(p["w"] * t)]

        def period(y: np.ndarray, rate=rate, start=start, end=orbit.period) -> np.ndarray:  # type: ignore[no-untyped-def]
            return after(rate, y, (start[0], start[0] + end))

        state, h = start[1:], 1e-4
        slopes = [(period(state + h * e) - period(state - h * e)) / (2 * h) for e in np.eye(2)]
        mu = np.linalg.eigvals(np.column_stack(slopes))
        assert period(state) == pytest.approx(state, abs=1e-9)
        assert np.prod(mu) == pytest.approx(1.0, abs=1e-7)
        both = np.sum(orbit.multipliers)
        assert np.sum(mu) == pytest.approx(both, abs=1e-6) and abs(both) <= 2.0 + 1e-6
    for special in curve.special:
        trace = {"R1": 2.0, "R2": -2.0, "R3": -1.0, "R4": 0.0}[special.name]
        assert np.sum(special.orbit.multipliers) == pytest.approx(trace, abs=1e-7)
    assert {s.name for s in curve.special} == {"R1", "R3", "R4"}


def test_steps_do_not_move_the_curve(coulomb: cf.Curve) -> None:
    """Each point of a curve with other steps is a zero of its own: solved along zeta, it is the same."""
    for orbit in coulomb[3 :: len(coulomb) // 4]:
        zeta = orbit.params["zeta"]
        near = cf.continue_orbit(orbit, "zeta", (zeta - 0.01, zeta + 0.01))[0]
        again = torus_of(near, "zeta", (zeta - 0.01, zeta + 0.01))
        assert again.params["zeta"] == pytest.approx(zeta, abs=1e-9)


def test_a_curve_is_kept_in_a_file(coulomb: cf.Curve, tmp_path) -> None:  # type: ignore[no-untyped-def]
    cf.save(coulomb, tmp_path / "torus.npz")
    again = cf.load(tmp_path / "torus.npz")
    assert np.array_equal(again.values, coulomb.values) and again.kind is cf.Kind.NS
    assert [s.name for s in again.special] == [s.name for s in coulomb.special]


def test_an_orbit_off_the_circle_starts_no_curve() -> None:
    from dataclasses import replace

    orbit = cf.find_orbit("coulomb", {"Omega": 1.6, "S": 0.1, "S0": 0.1, "zeta": 0.05})
    torus = torus_of(orbit, "zeta", (-0.2, 0.1))
    with pytest.raises(cf.ParameterError, match="no complex pair is on the unit circle"):
        cf.continue_bifurcation(
            replace(torus, orbit=orbit), ("Omega", "zeta"), {"Omega": (1, 2), "zeta": (-0.2, 0.1)}
        )
