"""What a model says in short - clocks, angles, derived sliding, ties - and how mistakes in it are told."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from typed import typed

import contfric as cf
from contfric.base.resources import bundled_dir
from contfric.models.entries import EntryError
from contfric.models.reading.describe import describe
from contfric.models.reading.files import from_data, model_of
from contfric.results import save


def data_of(name: str) -> dict[str, Any]:
    text = (bundled_dir("models") / f"{name}.yaml").read_text(encoding="utf-8")
    return yaml.load(text, yaml.BaseLoader)  # texts: `on` is a name, and no truth


def changed(name: str, path: str, value: object) -> dict[str, Any]:
    data = copy.deepcopy(data_of(name))
    *way, last = path.split("/")
    part = data
    for key in way:
        part = part.setdefault(key, {})
    if value is None:
        del part[last]
    else:
        part[last] = value
    given = data["parameters"].items()  # numbers again
    data["parameters"] = {k: float(v["default"] if isinstance(v, dict) else v) for k, v in given}
    return data | ({"autonomous": True} if "autonomous" in data else {})


RAMP = "low + (high - low)*{}/Ts"


@pytest.mark.parametrize(
    ("name", "path", "value", "at", "says"),
    [
        (
            "buck",
            "define/ramp",
            RAMP.format("mod(t, 2*Ts)"),
            "define",
            "the period of the model, 'Ts'",
        ),
        (
            "buck",
            "define/ramp",
            RAMP.format("mod(t, R)"),
            "define",
            "the period of the model, 'Ts'",
        ),
        ("buck", "define/ramp", RAMP.format("mod(t - Ts, Ts)"), "define", "less than a period"),
        (
            "buck",
            "define/ramp",
            RAMP.format("mod(v, Ts)"),
            "define",
            "a state that jumps has a reset",
        ),
        ("buck", "define/ramp", RAMP.format("mod(t)"), "define", "time and period"),
        ("buck", "define/ramp", RAMP.format("(v % 2)"), "define", "only the time begins again"),
        ("buck", "define/ramp", RAMP.format("(t - floor(t/Ts)*Ts)"), "define", "every jump needs"),
        ("relay", "modes/up/field/v", "-2*zeta*v - floor(x)", "modes", "every jump needs"),
        ("relay", "modes/up/field/v", "-2*zeta*v - x // 2", "modes", "no whole division"),
        ("relay", "modes/up/field/v", "-2*zeta*v - mod(x, 2)", "", "the period T of the model"),
        ("buck", "define/ramp", RAMP.format("mod(t, Q)"), "define", "unknown name 'Q'"),
        (
            "buck",
            "define/ramp",
            RAMP.format("mod(t, Ts) + t"),
            "observables",
            "not the same a period",
        ),
        ("buck", "modes/on/field/i", "(E + sin(pi*t/Ts) - v)/L", "modes", "not the same a period"),
        ("buck", "period", None, "", "write 'period: ...'"),
        ("buck", "define/clock", "1.0", "", "give other names to yours"),
        ("buck", "symmetry", "v -> -v, t -> t + T/2", "symmetry", "the clock"),
        ("buck", "resets/tick/to", "of", "resets", "did you mean 'off'"),
        ("buck", "surfaces/switch/sliding", "filipov", "surfaces", "did you mean 'filippov'"),
        ("relay", "surfaces/high/sliding", "filippov", "surfaces", "a mode on each side"),
        ("pendulum", "angles", ["phi"], "angles", "'phi' is no state"),
        ("pendulum", "surfaces/theta+", {"observable": "theta"}, "surfaces", "begins again"),
        ("relay", "modes/third", {"field": {"x": "v", "v": "0"}}, "modes", "to: third"),
        ("relay", "units", {"y": 2.0}, "units", "unknown key 'y'"),
        ("relay", "units", {"x": "h"}, "units", "a positive number"),
        ("relay", "units", {"x": -1.0}, "units", "a positive number"),
        ("relay", "units", [2.0], "units", "a mapping of states and t"),
        ("pendulum", "units", {"theta": 2.0}, "units", "is an angle"),
    ],
)
def test_mistakes_are_told_in_their_place(
    name: str, path: str, value: object, at: str, says: str
) -> None:
    with pytest.raises(EntryError) as caught:
        from_data(changed(name, path, value))
    assert says in str(caught.value), str(caught.value)
    assert (caught.value.address[:1] or ("",))[0] == at


def test_percent_and_T_are_the_same_clock() -> None:
    typed = from_data(changed("buck", "define/ramp", RAMP.format("mod(t, Ts)")))
    for text in ("(t % Ts)", "mod(t, T)", "mod(t, 1.0*Ts)"):
        other = from_data(changed("buck", "define/ramp", RAMP.format(text)))
        assert other.states == typed.states == ("v", "i", "clock")
        a, b = (cf.find_orbit(m) for m in (typed, other))
        assert np.allclose(a.joints, b.joints, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("text", ["sin(2*pi*t/Ts)", "cos(t*6*pi/Ts)", "abs(sin(pi*t/Ts))", "0*t"])
def test_time_outside_of_a_clock_that_begins_again_with_it(text: str) -> None:
    """It is the same with the time since the last tick."""
    model = from_data(changed("buck", "modes/on/field/i", f"(E + {text} - v)/L"))
    assert model.states == ("v", "i", "clock")


@pytest.mark.parametrize("name", ["buck", "pendulum", "relay-sliding", "relay", "rimless-wheel"])
def test_what_is_stored_is_the_same_model(name: str, tmp_path: Path) -> None:
    model = cf.load_model(name)
    again = model_of(model.definition)
    assert again.targets == model.targets and again.definition == model.definition
    orbit = cf.find_orbit(model)
    save(orbit, tmp_path / "orbit.npz")
    loaded = cf.load(tmp_path / "orbit.npz")
    assert loaded.signature.segments == orbit.signature.segments
    assert np.array_equal(loaded.joints, orbit.joints)


def test_a_tie_is_kept_along_a_branch_and_in_files(tmp_path: Path) -> None:
    tie = {"Omega": 0.47, "S": 0.3, "S0": {"tie": "1.2*S"}}
    orbit = cf.find_orbit("coulomb", tie)
    assert orbit.model.parameter_names == ("Omega", "S", "h", "zeta")
    branch = cf.continue_orbit(orbit, "S", (0.2, 0.4))
    for point in list(branch)[:: max(1, len(branch) // 5)]:
        S = point.params["S"]
        free = cf.simulate(
            "coulomb",
            {"Omega": 0.47, "S": S, "S0": 1.2 * S},
            state=point.begins[0, 1:],
            time=float(point.begins[0, 0]),
            domain=None,
            periods=2.0,
        )
        known = {(m, e) for m, e in point.as_whole().itinerary}
        assert set(free.itinerary) <= {*known, *((e, m) for m, e in known)} or point.system.holds
    save(branch, tmp_path / "branch.npz")
    again = cf.load(tmp_path / "branch.npz")
    assert again.model.parameter_names == orbit.model.parameter_names
    assert np.array_equal(again.values, branch.values)


def test_a_model_ties_its_own_parameters() -> None:
    data = data_of("coulomb-yaml")
    given = {
        k: float(v["default"] if isinstance(v, dict) else v) for k, v in data["parameters"].items()
    }
    own = from_data({**data, "parameters": {**given, "S0": {"tie": "1.2*S"}}})
    asked = cf.find_orbit("coulomb", {"Omega": 0.47, "S": 0.3, "S0": {"tie": "1.2*S"}})
    orbit = cf.find_orbit(own, {"Omega": 0.47, "S": 0.3})
    assert own.parameter_names == asked.model.parameter_names
    assert np.allclose(orbit.joints, asked.joints, rtol=0, atol=1e-13)
    for text, says in (
        ("Q", "'Q' is no parameter"),
        ("S0", "is tied itself"),
        ("S*", "cannot read"),
    ):
        with pytest.raises(EntryError) as caught:
            describe({**data, "parameters": {**given, "S0": {"tie": text}}})
        assert says in str(caught.value) and caught.value.address == ("parameters", "S0")


@pytest.mark.parametrize(
    ("params", "says"),
    [
        ({"S0": {"tie": "Q"}}, "'Q' is no parameter"),
        ({"S0": {"tei": "S"}}, "such as {tie: S}"),
        ({"S0": {"tie": "S0"}}, "'S0' is tied itself"),
        ({"S0": {"tie": "S +"}}, "cannot read"),
        ({"S9": {"tie": "S"}}, "no parameter 'S9'"),
        ({"S": 0.3, "S0": {"tie": "0.5*S"}}, "S0 >= S"),
    ],
)
def test_ties_that_mean_nothing(params: dict[str, Any], says: str) -> None:
    for call in (cf.find_orbit, cf.simulate, cf.lyapunov_exponent):
        with pytest.raises(cf.ParameterError) as caught:
            call("coulomb", params)
        assert says in str(caught.value) or says.replace("S0", "0.5 * S") in str(caught.value)


WRONG = [
    *(("surfaces", v) for v in ([1], {"s": 3}, {"s": None})),
    *(("modes", v) for v in ([2], {"m": 3}, {"m": {"field": [1]}}, {"m": None})),
    *(("resets", v) for v in ([1], {"s": 4})),
    *(
        (key, v)
        for key in ("define", "spread", "field", "observables", "parameters")
        for v in ([1], 3)
    ),
    *(("states", v) for v in ("x", None, [1.5])),
    *(("constraints", v) for v in ("a > 0", [3])),
    *(("angles", v) for v in (3, ["x"], ["nobody"])),
]


@pytest.mark.parametrize("short", ["", "tie", "mod", "tie, mod", "filippov", "latch"])
@pytest.mark.parametrize(("key", "value"), WRONG, ids=[f"{k}: {v}" for k, v in WRONG])
def test_parts_of_the_wrong_kind_are_told(short: str, key: str, value: object) -> None:
    data: dict[str, Any] = {
        "name": "a",
        "states": ["x"],
        "parameters": {"a": 1.0},
        "autonomous": True,
        "surfaces": {"s": {"observable": "x"}},
        "modes": {"m": {"field": {"x": "a"}}},
    }
    if "tie" in short:
        data["parameters"]["b"] = {"tie": "a"}
    if "mod" in short or "latch" in short:
        del data["autonomous"]
        data |= {"period": "a", "define": {"q": "mod(t, a)"}, "resets": {"tick": {"to": "m"}}}
    if "filippov" in short:
        data["surfaces"]["s"]["sliding"] = "filippov"
    try:
        describe({**data, key: value})
    except EntryError as error:
        assert "\n" not in str(error)


def test_motion_that_could_go_on_in_two_modes_is_refused() -> None:
    data: dict[str, Any] = {
        "name": "two",
        "states": ["x", "y"],
        "parameters": {"h": 1.0},
        "autonomous": True,
        "surfaces": {
            "hi": {"observable": "x", "level": "h"},
            "lo": {"observable": "x", "level": "-h"},
            "q": {"observable": "y"},
        },
        "modes": {
            "up": {"in": {"hi": "-"}, "field": {"x": 1, "y": 1}},
            "down": {"in": {"lo": "+", "q": "+"}, "field": {"x": -1, "y": 1}},
            "fast": {"in": {"hi": "+"}, "field": {"x": -2, "y": 1}},
        },
    }
    with pytest.raises(EntryError) as caught:
        from_data(data)
    assert "down or fast" in str(caught.value) and caught.value.address == ("modes", "fast", "in")
    apart = copy.deepcopy(data)
    apart["modes"]["fast"]["in"]["q"] = "-"
    assert from_data(apart).targets["up:x0,y+", "hi"] == ("down:x0",)  # it turns back there


def test_names_of_modes_with_signs_have_sliding_between_them(tmp_path: Path) -> None:
    text = """
name: capsubot
states: [y, u, V]
parameters: {w: 1.1, a: 0.6, xi: 0.05, b: 15.0, d: 0.3, g: 2.0, mu: 0.4}
period: 2*pi/w
define: {F: a*cos(w*t), S: y + 2*xi*u, C: b*(y - d)}
surfaces: {wall: {observable: y, level: d}, ground: {observable: V, sliding: filippov}}
modes:
  n+: {in: {wall: -, ground: +}, field: {y: u, u: "F - S - (S - mu)/g", V: "(S - mu)/g"}}
  n-: {in: {wall: -, ground: -}, field: {y: u, u: "F - S - (S + mu)/g", V: "(S + mu)/g"}}
  c+: {in: {wall: +, ground: +}, field: {y: u, u: "F - S - C - (S + C - mu)/g", V: "(S + C - mu)/g"}}
  c-: {in: {wall: +, ground: -}, field: {y: u, u: "F - S - C - (S + C + mu)/g", V: "(S + C + mu)/g"}}
"""
    orbit = cf.find_orbit(typed(tmp_path, text), {})
    assert orbit.admissible and any(mode.startswith("slide_") for mode, _ in orbit.itinerary)


def test_a_part_of_define_may_be_an_observable_and_its_surface_have_any_name(
    tmp_path: Path,
) -> None:
    text = """
name: relay
states: [x, v]
parameters: {h: 0.2}
autonomous: true
define: {signal: x + 0.1*v}
surfaces: {signal: {observable: signal, level: h}, x: {observable: x + 0.1*v, level: -h}}
modes:
  up: {in: {signal: -}, field: {x: v, v: -0.6*v - x + 1}}
  down: {in: {x: +}, field: {x: v, v: -0.6*v - x - 1}}
"""
    orbit = cf.find_orbit(typed(tmp_path, text), {})
    assert orbit.admissible
    for end, (mode, _) in zip(orbit.ends, orbit.itinerary, strict=True):
        assert abs(end[1] + 0.1 * end[2]) == pytest.approx(0.2, abs=1e-12), mode
