"""What is said where a model is typed as elsewhere: other names of functions, no modes, conditions."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import sympy
from typed import typed

import contfric as cf
from contfric.models.language.formulas import FORMULAS, formula, kinks_in
from contfric.models.language.grammar import Scope, parse


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("ln(x)", "write log(x)"),
        ("log10(x)", "write log(x)/log(10)"),
        ("arctan(x)", "write atan(x)"),
        ("sgn(x)", "write sign(x)"),
        ("Heaviside(x)", "where(x > 0, 1, 0)"),
        ("H(x)", "where(x > 0, 1, 0)"),
        ("sat(x)", "max(-1, min(1, x))"),
        ("relu(x)", "max(x, 0)"),
        ("floor(x)", "every jump needs a surface"),
        ("sine(x)", "did you mean 'sin'"),
        ("theta(1 - x)", "a product needs its *"),  # an angle, and no unit step
    ],
)
def test_functions_that_are_called_so_elsewhere(text: str, says: str) -> None:
    with pytest.raises(cf.ModelError, match="unknown function") as caught:
        parse(text)
    assert says in str(caught.value)
    assert ("unit step" in str(caught.value)) == (says == "where(x > 0, 1, 0)")


@pytest.mark.parametrize(
    ("text", "kinks"),
    [
        ("where(abs(x) > 1, 1, -1)", ["Abs(x) - 1"]),
        ("abs(x)*where(abs(x) > 1, 1, -1)", ["Abs(x) - 1", "x"]),
        ("where(max(x, v) > 1, 1, 2)", ["Where(v - x, v, x) - 1"]),
        ("where(where(x > 0, 1, -2)*v > 1, 1, 2)", ["v*Where(x, 1, -2) - 1", "x"]),
        ("where(v + sign(x) > 0, 1, 2)", ["v + Sign(x)", "x"]),
        ("max(x, v)", ["v - x"]),
    ],
)
def test_a_kink_of_a_condition_is_none_of_what_it_decides(text: str, kinks: list[str]) -> None:
    """Only a jump of it is."""
    x, v = sympy.symbols("x v")
    found = formula(parse(text), Scope(FORMULAS, {"x": x, "v": v}, {}))
    assert [str(kink) for kink in kinks_in(found, (x, v))] == kinks


def test_a_reset_without_modes_says_what_to_write(tmp_path: Path) -> None:
    """Clegg's integrator is reset from both sides; what the message says then works."""
    text = """
name: clegg
states: [y, v, xc]
parameters: {k: 0.4, zeta: 0.5, r: 1.0, w: 0.6}
period: 2*pi/w
define: {e: r*sin(w*t) - y}
surfaces: {zero: {observable: e}}
field: {y: v, v: -2*zeta*v - y + xc, xc: k*e}
"""
    path = tmp_path / "model.yaml"
    path.write_text(text + "resets: {zero: {xc: 0}}\n")
    with pytest.raises(cf.ModelError) as caught:
        cf.load_model(path)
    assert "modes: {free: {}}" in str(caught.value)
    assert "'from: [free]'" in str(caught.value)
    path.write_text(text + "modes: {free: {}}\nresets: {zero: {xc: 0, from: [free]}}\n")
    model = cf.load_model(path)
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model)
    assert [surface for _, surface in orbit.itinerary] == ["zero", "zero"]
    assert orbit.begins[:, 3] == pytest.approx([0.0, 0.0], abs=1e-14)


def test_a_reset_onto_the_surface_of_another_one_is_no_fault(tmp_path: Path) -> None:
    """Two oscillators that fire together: a pulse lifts the other one to its threshold, where it fires."""
    text = """
name: fireflies
states: [x1, x2]
parameters: {S0: 2.0, g: 1.0, eps: 0.05, S2: 2.05}
autonomous: true
surfaces: {fire1: {observable: x1, level: 1}, fire2: {observable: x2, level: 1}}
modes: {charge: {in: {fire1: -, fire2: -}, field: {x1: S0 - g*x1, x2: S2 - g*x2}}}
resets:
  fire1: {x1: 0, x2: "min(1, x2 + eps)"}
  fire2: {x2: 0, x1: "min(1, x1 + eps)"}
spread: {x1: [0, 1], x2: [0, 1]}
"""
    model = typed(tmp_path, text)
    report = str(cf.check_model(model))
    assert "is in no domain" not in report
    assert "the reset at 'fire1' has a kink" in report
    p = model.defaults
    orbit = cf.find_orbit(model)
    # the faster one fires, lifts the slower one to its threshold, and is lifted by its pulse
    charged = p["S2"] / p["g"]
    shortest = min(
        charging_time(charged, 0.0, 1.0, p["g"]),
        charging_time(p["S0"] / p["g"], p["eps"], 1.0, p["g"]),
    )
    assert orbit.period == pytest.approx(shortest, abs=1e-12)


def charging_time(limit: float, begin: float, end: float, rate: float) -> float:
    """Return the time in which a state that tends to a limit goes from one value to another one."""
    return math.log((limit - begin) / (limit - end)) / rate
