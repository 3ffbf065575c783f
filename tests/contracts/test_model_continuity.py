"""``check`` refuses what an expression cannot be: jumps in time and state that no surface marks."""

from __future__ import annotations

from itertools import product

import pytest
import sympy

import contfric as cf
from contfric.models.language import formulas

MODEL = """
name: {name}
states: [x, v]
parameters:
  w: {{default: 0.7, meaning: frequency}}
period: 2*pi/w
define:
  f: {force}
observables: {{v: v, x: x}}
surfaces:
  stop: {{observable: v, level: 0}}
field: {{x: v, v: -x - 0.1*v + f}}
modes:
  up: {{in: {{stop: +}}}}
  down: {{in: {{stop: -}}}}
"""

#: Jumps and poles: in time, at places of all kinds; in a state.
JUMPS = {
    "sawtooth": "atan(tan(w*t/2))",
    "sawtooth of another phase": "0.1*atan(tan(w*t/2 + 0.123))",
    "pulse": "where(sin(w*t) > 0.3, 1, 0)",
    "small pulse": "where(sin(w*t) > 0.95, 0.01, 0)",
    "sign": "sign(cos(w*t))",
    "pole": "0.1*tan(w*t/2)",
    "step in x": "where(x > 0.1, 0.5, 0)",
}
#: Steep, but smooth; kinks; and a jump that the modes' sides decide.
SMOOTH = {
    "harmonic": "cos(w*t)",
    "steep": "tanh(1e4*sin(w*t))",
    "steep in x": "tanh(1e4*(x - 0.1)) + cos(w*t)",
    "kink": "abs(sin(w*t))",
    "friction": "0.2*cos(w*t) - 0.1*sign(v)",
}


def report_of(tmp_path, name: str, force: str) -> cf.ModelReport:
    path = tmp_path / "model.yaml"
    path.write_text(MODEL.format(name="model", force=force), encoding="utf-8")
    return cf.check_model(path)


@pytest.mark.parametrize("name", JUMPS)
def test_jumps_are_refused(tmp_path, name) -> None:
    report = report_of(tmp_path, name, JUMPS[name])
    assert not report.ok
    (found,) = [f for f in report.findings if f.topic.name == "CONTINUITY"]
    assert found.severity.value == "error"
    assert "the rate of 'v'" in found.message
    assert "surface" in found.message


@pytest.mark.parametrize("force", ["0.01/(x - 0.2)", "v*x/(1 + x)"])
def test_a_pole_in_a_state_is_warned_of(tmp_path, force: str) -> None:
    """Prey and predators are positive: a pole where no solution comes is no fault."""
    report = report_of(tmp_path, "pole", force)
    assert report.ok
    (found,) = {f.message for f in report.findings if f.topic.name == "CONTINUITY"} or [""]
    assert "has a pole along x" in found


@pytest.mark.parametrize("name", SMOOTH)
def test_what_is_steep_or_has_kinks_is_no_jump(tmp_path, name) -> None:
    report = report_of(tmp_path, name, SMOOTH[name])
    assert not [f for f in report.findings if f.topic.name == "CONTINUITY"]


def test_an_observable_that_jumps_is_refused(tmp_path) -> None:
    text = MODEL.format(name="model", force="cos(w*t)").replace(
        "x: x}", "u: 'x + where(sin(w*t) > 0.5, 0.2, 0)'}"
    )
    (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
    (found,) = [
        f for f in cf.check_model(tmp_path / "model.yaml").findings if f.topic.name == "CONTINUITY"
    ]
    assert "the observable 'u'" in found.message


SAMPLED = """
name: sampled
states: [x, s]
parameters: {{ref: 0.3, Ts: 0.4}}
period: Ts
{modes}
resets: {{tick: {{s: '{map}'}}}}
"""


#: The same solution in one mode, and in two with a surface between them, at which only the reset may change.
ONE = "modes: {only: {field: {x: -x + s, s: 0}}}"
TWO = """surfaces: {mid: {observable: x, level: ref}}
field: {x: -x + s, s: 0}
modes: {low: {in: {mid: -}}, high: {in: {mid: +}}}"""


@pytest.mark.parametrize("modes", [ONE, TWO])
@pytest.mark.parametrize(
    ("map", "jumps"),
    [
        ("sign(ref - x)", True),
        ("where(x > ref, -1, 0.5*x)", True),
        ("tanh(40*(ref - x))", False),
        ("max(ref - x, 0)", False),
        ("where(x > ref, 0, x - ref)", False),
    ],
)
def test_a_reset_that_jumps_within_a_mode_is_refused(
    tmp_path, modes: str, map: str, jumps: bool
) -> None:
    jumps = jumps and modes is ONE
    (tmp_path / "model.yaml").write_text(SAMPLED.format(map=map, modes=modes), encoding="utf-8")
    report = cf.check_model(tmp_path / "model.yaml")
    assert report.ok != jumps
    assert any("after the reset at 'tick' jumps" in f.message for f in report.findings) == jumps


def test_a_branch_ends_where_a_sample_lies_on_the_surface_at_which_the_reset_jumps(
    tmp_path,
) -> None:
    text = SAMPLED.format(map="sign(ref - x)", modes=TWO)
    (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
    branch = cf.continue_orbit(cf.find_orbit(tmp_path / "model.yaml"), "ref", (0.05, 0.8))
    for end in branch.ends:
        assert end.bifurcation is not None and end.reason.name == "CS"
        orbit = end.bifurcation.orbit
        samples = [
            state[1]
            for (_, surface), state in zip(orbit.itinerary, orbit.ends, strict=True)
            if surface == "tick"
        ]
        assert min(abs(x - orbit.params["ref"]) for x in samples) < 1e-9


def test_formulas_that_cannot_jump_are_told_from_those_that_may() -> None:
    """Of the first nothing is tried; a wrong answer there would let a jump pass."""
    x, p = sympy.symbols("x p")
    parts = [x, x * x, formulas.Abs(x), sympy.tanh(40.0 * x), sympy.sin(x) / p, sympy.log(p)]
    for one, other in product(parts, parts):
        for whole in (one + other, one * other, sympy.exp(one - p * other)):
            assert formulas.cannot_jump(whole, {x})
    jumps = [formulas.Sign(x), formulas.Where(x, p, x), 1 / x, sympy.log(x), x ** sympy.S("1/2")]
    for one, other in product(parts, [*jumps, formulas.Power(x, p), sympy.tan(x), sympy.floor(x)]):
        assert not formulas.cannot_jump(one + 2 * other, {x})
        assert formulas.cannot_jump(other.subs(x, p + 7), {x})


@pytest.mark.parametrize(
    ("wave", "kinked"),
    [
        ("asin(sin(3*w*t + 0.2))", True),
        ("abs(sin(w*t))", True),
        ("max(cos(2*w*t), 0.3)", True),
        ("sin(w*t)**3", False),
        ("tanh(20*sin(w*t))", False),
    ],
)
def test_kinks_in_time_of_a_switch_are_said(tmp_path, wave: str, kinked: bool) -> None:
    """A carrier that is a triangle: crossings were found at its peaks, and the simulation ended there."""
    text = MODEL.format(name="model", force="cos(w*t)").replace(
        "x: x}", f'x: x, u: "{wave} - 0.1*x"}}'
    )
    path = tmp_path / "model.yaml"
    path.write_text(
        text.replace("surfaces:\n", "surfaces:\n  sw: {observable: u}\n"), encoding="utf-8"
    )
    said = [
        f.message
        for f in cf.check_model(path).findings
        if "crossings near such a kink" in f.message
    ]
    assert bool(said) == kinked
