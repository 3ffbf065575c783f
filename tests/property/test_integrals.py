"""Integrals by compiled code: the same values and derivatives as the panels of Python, whatever the model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.orbit.functionals import integral_states as carried
from contfric.orbit.gradient import by_parameters
from contfric.quantities.functionals import Measuring
from contfric.quantities.inside import inside_of
from contfric.quantities.registry import quantity_of

#: Excited and autonomous, halves of symmetric orbits, resets, integrated; the last ones take longer.
MODELS = ("coulomb", "impact", "popp", "belt", "thermostat", "relay-sliding", "gear-pair")
MORE = ("stribeck", "lugre", "rocking-block", "normal-force", "two-blocks")
#: Of these some mode is integrated.
CARRIED = ("stribeck", "lugre", "pendulum")
#: Of integrated flow with boundary layers derivatives are known to a few times its rounding, amplified.
TOLERANCE = {"stribeck": 1e-9, "lugre": 1e-7, "normal-force": 1e-9}


@pytest.mark.parametrize(
    "name", [*MODELS, *(pytest.param(name, marks=pytest.mark.slow) for name in MORE)]
)
def test_compiled_integrals_are_those_of_panels(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    orbit = cf.find_orbit(name)
    first, last = orbit.model.states[0], orbit.model.states[-1]
    texts = [
        *(f"mean({first})", f"rms({last})", f"integral({first}*{last}**2/(2 + sin({first})))"),
        *(f"amplitude({first}, 1)", f"integral(exp(-{last}**2) + t*{first})"),
    ]
    compiled = [replace(orbit).gradient(text) for text in texts]
    values = [replace(orbit).quantity(text) for text in texts]
    for text in texts:
        (functional,) = quantity_of(text, orbit.model).parsed.functionals.values()  # type: ignore[union-attr]
        tape = inside_of(orbit.model).tape(functional)
        assert orbit.integrals(tape, 1.0, by_parameters(orbit)) is not None, text
    monkeypatch.setattr(Measuring, "_compiled", lambda *_: [])
    tolerance = TOLERANCE.get(name, 1e-11)
    for text, gradient, value in zip(texts, compiled, values, strict=True):
        panels = replace(orbit).gradient(text)
        assert value == pytest.approx(panels.value, rel=tolerance, abs=tolerance), text
        assert gradient.value == pytest.approx(value, rel=tolerance, abs=tolerance), text
        for by, slope in panels.items():
            assert gradient[by] == pytest.approx(slope, rel=tolerance, abs=tolerance), (text, by)


@pytest.mark.parametrize(
    "name", ["stribeck", *(pytest.param(n, marks=pytest.mark.slow) for n in CARRIED[1:])]
)
def test_integrals_that_an_integrated_motion_carries_are_those_at_nodes(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    orbit, rng = cf.find_orbit(name), np.random.default_rng(hash_of(name))
    states, carries = orbit.model.states, carried.carried_by
    used: list[bool] = []

    def seen(*given: Any) -> Any:
        used.append(carries(*given) is not None)
        return carries(*given)

    for _ in range(3):
        a, b, c = (str(each) for each in rng.choice(states, 3))
        k, size = int(rng.integers(1, 4)), float(rng.uniform(0.2, 2.0))
        for text in (f"mean({a}*{b} + {size}*sin({c} + t))", f"amplitude({a}*{b}, {k})"):
            monkeypatch.setattr(carried, "carried_by", seen)
            found = replace(orbit).gradient(text)
            monkeypatch.setattr(carried, "carried_by", lambda *_: None)
            nodes = replace(orbit).gradient(text)
            tolerance = TOLERANCE.get(name, 1e-11)
            assert found.value == pytest.approx(nodes.value, rel=tolerance, abs=tolerance), text
            for by, slope in nodes.items():
                assert found[by] == pytest.approx(slope, rel=tolerance, abs=tolerance), (text, by)
    assert used
    assert all(used)


def hash_of(name: str) -> int:
    """Return a number of a name that is the same in every process."""
    return sum(map(ord, name))


@pytest.mark.parametrize(
    "text",
    ["integral(abs(x - 0.1))", "mean(where(v > 0.2, x, 1))", "mean(1/(x - 0.1))", "rms(sign(x))"],
)
def test_what_has_kinks_inside_of_a_segment_is_left_to_panels(text: str) -> None:
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    (functional,) = quantity_of(text, orbit.model).parsed.functionals.values()  # type: ignore[union-attr]
    tape = inside_of(orbit.model).tape(functional)
    assert orbit.integrals(tape, 0.0, None) is None


@pytest.mark.parametrize(
    "text", ["tan(x/2)", "asin(x/2)", "acos(x/2)", "atan(x)", "sinh(x)", "cosh(x)"]
)
def test_functions_of_a_tape_have_their_derivatives(text: str) -> None:
    _agrees_with_differences(f"mean({text})")


@pytest.mark.parametrize(
    "text",
    [
        *("tanh(v)", "exp(x)", "log(x + 4)", "sqrt(x + 4)", "abs(x + 4)", "sign(x + 4)*v**3"),
        *("(x + 4)**v", "2**x", "-x/(v + 9)", "where(x > 9, v, x)", "max(x, v - 9)", "u*S - Omega"),
    ],
)
def test_operations_of_a_tape_have_their_derivatives(text: str) -> None:
    _agrees_with_differences(f"mean({text})")


@cache
def _orbit(Omega: float, S: float) -> cf.Orbit:
    return cf.solve_orbit("coulomb", "1a", {"Omega": Omega, "S": S, "S0": 0.4})


def _agrees_with_differences(quantity: str) -> None:
    """Compare with orbits that are solved on both sides, and see that compiled code measured them."""
    orbit, params, step = _orbit(0.5, 0.32), {"Omega": 0.5, "S": 0.32}, 1e-4
    (functional,) = quantity_of(quantity, orbit.model).parsed.functionals.values()  # type: ignore[union-attr]
    assert orbit.integrals(inside_of(orbit.model).tape(functional), 0.0, None) is not None
    gradient = orbit.gradient(quantity)
    for name in ("Omega", "S"):
        ends = [
            _orbit(**{**params, name: params[name] + by}).quantity(quantity)
            for by in (step, -step, 2 * step, -2 * step)
        ]
        slope = (8.0 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12.0 * step)
        assert gradient[name] == pytest.approx(slope, rel=1e-7, abs=1e-8)
