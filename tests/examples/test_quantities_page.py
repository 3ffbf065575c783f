"""The code of the page on quantities runs, and says what the page says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pages import blocks, run, text_of

import contfric as cf

PAGE = text_of("quantities")


@pytest.fixture(scope="module")
def scope() -> dict[str, Any]:
    assert len(blocks(PAGE)) == 9
    return run("quantities")


def test_the_page_says_what_comes_out(scope: dict[str, Any]) -> None:
    assert scope["low"][-1].x_max == pytest.approx(1.43, abs=1e-13)
    assert str(scope["low"].ends[1]) in PAGE
    assert np.max(np.abs(scope["curve"].measured("x_max") - 1.43)) < 1e-11
    names = set(cf.quantity_names("coulomb"))
    assert {name for name in names if f"`{name}`" not in PAGE} == set()


def test_the_fits_find_the_truth(scope: dict[str, Any]) -> None:
    again = scope["again"]
    for name, value in (("S", 0.32), ("S0", 0.4)):
        assert abs(again.params[name] - value) < 4.0 * again.sigma[name]
    assert (
        scope["found"].chi_square < 1.0
    )  # the three data are those of S = 0.32, S0 = 0.4, rounded


def test_the_best_damper_is_the_best(scope: dict[str, Any]) -> None:
    """The gradient's zero is a minimum of the peaks: a parabola through neighbours has its vertex there."""
    best, highest, step = scope["best"], scope["highest"], 2e-3
    left, middle, right = (highest(best + by).value for by in (-step, 0.0, step))
    assert middle < left and middle < right
    vertex = 0.5 * step * (left - right) / (left - 2.0 * middle + right)
    assert abs(vertex) < 1e-5  # what the cubic term of the peaks moves it by
    assert abs(highest(best).orbit.gradient("x_max")["muN"]) < 1e-9


def test_the_curve_of_the_best_damper_goes_through_it(scope: dict[str, Any]) -> None:
    """At kt = 2, between two points of the curve, it is the zero of the gradient that brentq found."""
    curve = scope["smallest"]
    stiffness, limits = curve.params["kt"], curve.params["muN"]
    k = int(
        np.searchsorted(stiffness * (order := np.sign(stiffness[-1] - stiffness[0])), 2.0 * order)
    )
    near = slice(max(0, k - 3), k + 3)
    between = np.polynomial.Polynomial.fit(stiffness[near], limits[near], len(stiffness[near]) - 1)
    assert between(2.0) == pytest.approx(scope["best"], abs=1e-7)
    for orbit in curve:
        gradient = orbit.gradient("x_max")
        assert max(abs(gradient["W"]), abs(gradient["muN"])) < 1e-10
