"""Fits against what is known: formulas of a linear oscillator, and synthetic data of known truth."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.fitting.predict import predicted

FIG5 = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


def series(orbit: cf.Orbit, sigma: float, count: int = 90, seed: int | None = None) -> cf.Series:
    """Return three periods of the displacement, with noise if a seed is given."""
    times = np.linspace(0.0, 3.0 * orbit.period, count, endpoint=False)
    values = np.array([orbit.state(t)[0] for t in times])
    if seed is not None:
        values = values + sigma * np.random.default_rng(seed).standard_normal(count)
    return cf.Series("x", times, values, sigma)


def test_the_damping_of_a_linear_oscillator_is_found_from_its_response() -> None:
    """Amplitudes 1/|1 - w^2 + 2 i zeta w|: parameters to rounding, and the covariance of the formula."""
    zeta, sigma = 0.13, 0.02
    frequencies = np.array([0.6, 0.8, 0.95, 1.1, 1.4])
    size = np.hypot(1 - frequencies**2, 2 * zeta * frequencies)
    data = [
        cf.Measured("amplitude(x, 1)", 1 / s, sigma, {"Omega": float(w)})
        for w, s in zip(frequencies, size, strict=True)
    ]
    found = cf.fit("coulomb", data, {"S": 0.0, "S0": 0.0, "zeta": 0.3}, ["zeta"])
    assert found.converged
    assert found.params["zeta"] == pytest.approx(zeta, rel=1e-10)
    slopes = -4 * zeta * frequencies**2 / size**3
    assert found.sigma["zeta"] == pytest.approx(sigma / np.linalg.norm(slopes), rel=1e-9)
    assert found.chi_square < 1e-15


@pytest.mark.parametrize("by", ["Omega", "S", "S0", "h", "zeta"])
def test_derivatives_of_a_series_are_differences(by: str) -> None:
    """At fixed times, over three periods: the period moves with Omega, and the fold of time with it."""
    orbit = cf.find_orbit("coulomb", FIG5)
    data = series(orbit, 0.01, count=40)
    _, slopes = predicted(data, orbit)
    step, values = 1e-4, []
    for k in (1, -1, 2, -2):
        there = cf.solve_orbit("coulomb", "1a", {**orbit.params, by: orbit.params[by] + k * step})
        near = min(there, there.mirror(), key=lambda o: abs(o.x_max - orbit.x_max))
        values.append(predicted(data, near)[0])
    one, two = (values[0] - values[1]) / (2 * step), (values[2] - values[3]) / (4 * step)
    difference = (4 * one - two) / 3
    # a joint that passes a time of the series between neighbours costs the differences some digits
    assert slopes[:, orbit.model.index_of(by)] == pytest.approx(difference, rel=1e-4, abs=1e-4)
    assert np.median(np.abs(slopes[:, orbit.model.index_of(by)] - difference)) < 1e-8


@pytest.mark.parametrize(("S", "S0"), [(0.36, 0.45), (0.34, 0.4), (0.2, 0.4)])
def test_noise_free_data_give_the_truth_whatever_the_start(S: float, S0: float) -> None:
    """The first two start from an orbit of another signature, 2s, with two sticks."""
    truth = cf.find_orbit("coulomb", FIG5)
    start = {**FIG5, "S": S, "S0": S0}
    assert cf.find_orbit("coulomb", start).name == ("2s" if S > 0.33 else "1a")
    found = cf.fit("coulomb", [series(truth, 0.01)], start, ["S", "S0"])
    assert found.converged
    assert found.orbits[0].name == "1a"
    assert found.params["S"] == pytest.approx(0.32, abs=1e-10)
    assert found.params["S0"] == pytest.approx(0.4, abs=1e-10)
    assert np.max(np.abs(found.jacobian.T @ found.residuals)) < 1e-6


def test_the_image_that_was_measured_is_the_one_that_is_fitted() -> None:
    orbit = cf.find_orbit("coulomb", FIG5)
    for truth in (orbit, orbit.mirror()):
        found = cf.fit("coulomb", [series(truth, 0.01)], {**FIG5, "S": 0.315}, ["S"])
        assert found.params["S"] == pytest.approx(0.32, abs=1e-9)
        assert found.orbits[0].x_max == pytest.approx(truth.x_max, abs=1e-8)


@pytest.mark.slow
def test_intervals_cover_the_truth_as_often_as_they_say() -> None:
    """200 draws of noise: the ellipse of 90 percent covers S and S0 in 90 percent of them."""
    orbit = cf.find_orbit("coulomb", FIG5)
    truth, level, inside, squares = np.array([0.32, 0.4]), 0.9, 0, []
    limit = -2.0 * np.log(1.0 - level)  # the quantile of chi^2 with two degrees of freedom
    for seed in range(200):
        data = [series(orbit, 0.01, seed=seed)]
        found = cf.fit("coulomb", data, {**FIG5, "S": 0.31, "S0": 0.41}, ["S", "S0"])
        off = np.array([found.params["S"], found.params["S0"]]) - truth
        inside += int(off @ np.linalg.solve(found.covariance, off) < limit)
        squares.append(found.chi_square)
    # three standard deviations of a binomial count, and of the mean of chi^2 with 88 degrees of freedom
    assert abs(inside - 200 * level) < 3 * np.sqrt(200 * level * (1 - level))
    assert abs(np.mean(squares) - 88) < 3 * np.sqrt(2 * 88 / 200)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"data": []}, "data are a list of contfric.Measured, contfric.Series and contfric.Jump"),
        ({"data": [1.4]}, "data are a list of contfric.Measured"),
        ({"free": []}, "free is a list of parameters"),
        ({"free": ["s"]}, "has no parameter 's'"),
        ({"free": ["Omega"]}, "'Omega' is free, and a measurement gives it a value"),
        ({"params": {"S": 0.5}}, "needs S0 >= S"),
        ({"free": ["S", "h", "zeta"]}, "do not determine"),
        ({"data": [cf.Measured("y_max", 1.0, 0.1)]}, "has no quantity 'y_max'"),
        ({"data": [cf.Series("y", [0.0], [1.0], 0.1)]}, "has no 'y'"),
        (
            {"model": "belt", "params": {}, "free": ["vb"]},
            "a series needs the phase of an excitation",
        ),
    ],
)
def test_what_cannot_be_fitted_is_said(change: dict[str, Any], words: str) -> None:
    asked: dict[str, Any] = {
        "model": "coulomb",
        "data": [cf.Measured("x_max", 1.42, 0.01, {"Omega": 0.5})],
        "params": {"S": 0.31, "S0": 0.4},
        "free": ["S"],
    }
    if change.get("model") == "belt":
        asked["data"] = [cf.Series("x", [0.0], [1.0], 0.1)]
    with pytest.raises(cf.ContfricError) as caught:
        cf.fit(**{**asked, **change})
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: cf.Measured("x_max", "high", 0.1), "value is a finite number"),  # type: ignore[arg-type]
        (lambda: cf.Measured("x_max", 1.0, 0.0), "sigma is a standard deviation"),
        (lambda: cf.Series("x", [0.0, 1.0], [1.0], 0.1), "got 2 times and 1 values"),
        (lambda: cf.Series("x", [0.0], [np.nan], 0.1), "values of a series are finite numbers"),
    ],
)
def test_what_is_no_measurement_is_said(make: Any, words: str) -> None:
    with pytest.raises(cf.ParameterError) as caught:
        make()
    assert words in str(caught.value)


def places(params: dict[str, float]) -> dict[str, cf.Bifurcation]:
    """Return the fold and the pitchfork of Fig. 5's diagram at other parameters."""
    orbit = cf.find_orbit("coulomb", {**params, "Omega": 0.5})
    diagram = cf.explore(orbit, "Omega", (0.44, 0.6))
    return {b.kind.value: b for b in diagram.bifurcations if b.kind.value in ("SN", "BP", "CS")}


def test_friction_is_found_from_where_the_response_jumps() -> None:
    """From jumps of another diagram: what a fresh exploration finds there, to rounding."""
    start, truth = places({"S": 0.31, "S0": 0.42}), places({"S": 0.32, "S0": 0.4})
    data = [cf.Jump(start[kind], truth[kind].params["Omega"], 1e-3) for kind in ("SN", "CS")]
    found = cf.fit("coulomb", data, {"S": 0.31, "S0": 0.42}, ["S", "S0"])
    assert found.converged and found.chi_square < 1e-16
    assert found.params["S"] == pytest.approx(0.32, abs=1e-9)
    assert found.params["S0"] == pytest.approx(0.4, abs=1e-9)
    slopes = np.array(
        [[truth[kind].gradient()[name] for name in ("S", "S0")] for kind in ("SN", "CS")]
    )
    np.testing.assert_allclose(found.jacobian, slopes / 1e-3, rtol=1e-6)


def test_jumps_that_cannot_be_fitted_say_why() -> None:
    fold = places({"S": 0.32, "S0": 0.4})["SN"]
    with pytest.raises(cf.ParameterError, match="a jump is measured along it"):
        cf.fit("coulomb", [cf.Jump(fold, 0.54, 1e-3)], {"S": 0.32, "S0": 0.4}, ["Omega"])
    with pytest.raises(cf.ParameterError, match=r"is one of the model 'coulomb', not of 'popp'"):
        cf.fit("popp", [cf.Jump(fold, 0.54, 1e-3)], {}, ["F"])
    with pytest.raises(cf.ParameterError, match=r"a jump is taken for a Bifurcation, got 0\.54"):
        cf.Jump(0.54, 0.54, 1e-3)  # type: ignore[arg-type]
