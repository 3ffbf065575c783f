"""Curves and Poincare sections say how far they are, and are the same when they do."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import contfric as cf

START = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
NAMES = ("Omega", "S")
RANGES = {"Omega": (0.48, 0.56), "S": (0.3, 0.34)}


@pytest.fixture(scope="module")
def orbit() -> cf.Orbit:
    return cf.solve_orbit("coulomb", "1a", START)


def held(orbit: cf.Orbit, quantity: str, value: float, **options: Any) -> Any:
    return cf.continue_quantity(orbit, quantity, value, NAMES, RANGES, **options)


def fold(orbit: cf.Orbit, **options: Any) -> Any:
    branch = cf.continue_orbit(orbit, "Omega", RANGES["Omega"])
    found = next(b for b in branch.bifurcations if b.kind is cf.Kind.SN)
    return cf.continue_bifurcation(found, NAMES, RANGES, **options)


@pytest.mark.parametrize(
    ("title", "curve"),
    [
        ("x_max = 1.43", lambda orbit, **options: held(orbit, "x_max", 1.43, **options)),
        ("rms(v) = 0.52", lambda orbit, **options: held(orbit, "rms(v)", 0.52, **options)),
        ("SN", fold),
    ],
)
def test_a_curve_says_how_far_it_is(orbit: cf.Orbit, title: str, curve: Callable[..., Any]) -> None:
    said: list[str] = []
    heard, silent = curve(orbit, progress=said.append), curve(orbit)
    assert all(np.array_equal(heard.params[name], silent.params[name]) for name in NAMES)
    own = [text for text in said if text.startswith(f"{title}: ")]
    assert own
    assert all(re.fullmatch(r".*: \d+ points, Omega = \S+, S = \S+", text) for text in own)
    with pytest.raises(cf.ParameterError, match="progress is a function of one text"):
        curve(orbit, progress="loud")


def test_a_section_says_how_many_points_there_are() -> None:
    params, said = {"Omega": 0.35, "S": 0.05}, []
    found = cf.poincare("coulomb", params, section="v", periods=400, progress=said.append)
    numbers = [int(text.removesuffix(" points")) for text in said]
    assert numbers == sorted(set(numbers))
    assert 0 < numbers[0] <= numbers[-1] < len(found)
    silent = cf.poincare("coulomb", params, section="v", periods=400)
    assert np.array_equal(found.states, silent.states)
    with pytest.raises(cf.ParameterError, match="progress is a function of one text"):
        cf.poincare("coulomb", params, progress="loud")  # type: ignore[arg-type]
