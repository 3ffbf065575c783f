"""``contfric check``: sound models pass, and each kind of mistake is found and said."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.base.resources import bundled_dir
from contfric.cli import main
from contfric.models.check import ModelReport, Severity, Topic, check_model
from contfric.models.check.hidden import check_hidden, hidden_symmetry
from contfric.models.check.probe import Probe, _shortest

GOOD = """\
name: checked
states: [x, v]
parameters: {Omega: 0.7, S: 0.2, k: 1.0}
constraints: [Omega > 0]
period: 2*pi/Omega
observables: {u: k*x - cos(Omega*t)}
surfaces:
  F+: {observable: u, level: S}
  F-: {observable: u, level: -S}
  v: {observable: v, level: 0}
field: {x: v, v: -u - S*sign(v)}
modes:
  forward: {in: {v: +}}
  backward: {in: {v: -}}
  stick: {in: {v: 0, F+: -, F-: +}, field: {x: 0, v: 0}}
symmetry: x -> -x, v -> -v, t -> t + T/2
"""


def report_of(tmp_path: Path, text: str) -> cf.ModelReport:
    path = tmp_path / "checked.yaml"
    path.write_text(text, encoding="utf-8")
    return check_model(path)


#: Models of many modes, or with much to integrate: seconds each.
LARGE = (
    *("braced-chain", "storeys", "beam-stop", "drill-string", "iwan", "two-blocks"),
    *("lugre", "belt-lugre", "popp"),
)
BUNDLED = sorted(p.stem for p in bundled_dir("models").glob("*.yaml"))


@pytest.mark.parametrize(
    "name",
    [
        "coulomb",
        *(n for n in BUNDLED if n not in LARGE),
        *(pytest.param(n, marks=pytest.mark.slow) for n in LARGE),
    ],
)
def test_bundled_models_pass(name: str) -> None:
    report = check_model(name)
    assert report.ok, str(report)
    # what is said and is no fault: a static limit above the kinetic one, states that nobody walks through
    said = ("above the kinetic one", "states that were tried")
    assert all(any(s in f.message for s in said) for f in report.findings), str(report)
    assert report.counts[Topic.DERIVATIVES] > 0


#: (what is written in the place of what, topic, severity, what the finding says)
MISTAKES = [
    ("- S*sign(v)", "- S*sign(v) - v**2/9", Topic.SYMMETRY, "error", "no image of that of"),
    (
        "field: {x: 0, v: 0}",
        "field: {x: 0, v: 0.1}",
        Topic.SLIDING,
        "error",
        "is 0.1, it must be 0",
    ),
    ("2*pi/Omega", "3*pi/Omega", Topic.PERIOD, "error", "common period"),
    ("Omega > 0]", "Omega > 1]", Topic.CONSTRAINTS, "error", "violate Omega > 1 (Omega = 0.7)"),
    ("S*sign(v)", "S*sign(v)*(1 - k + abs(abs(v) - k))", Topic.KINKS, "warning", "kink where -k "),
    ("k: 1.0}", "k: 1.0, mu: 0.3}", Topic.NAMES, "warning", "parameter 'mu' is used nowhere"),
    ("  backward: {in: {v: -}}\n", "", Topic.TRANSITIONS, "error", "and no domain follows"),
    (
        "  stick: {in: {v: 0, F+: -, F-: +}, field: {x: 0, v: 0}}\n",
        "",
        Topic.TRANSITIONS,
        "error",
        "the solution is caught there",
    ),
    ("in: {v: 0, F+: -, F-: +}", "in: {v: 0}", Topic.SLIDING, "warning", "'stick' is never left"),
    (
        "states: [x, v]",
        "states: [x, v]\ndefine: {g: 2*Omega}",
        Topic.NAMES,
        "warning",
        "'g: 2*Omega'",
    ),
]


@pytest.mark.parametrize(
    ("old", "new", "topic", "severity", "says"),
    MISTAKES,
    ids=[m[4] for m in MISTAKES],
)
def test_mistakes_are_found(
    tmp_path: Path, old: str, new: str, topic: Topic, severity: str, says: str
) -> None:
    assert old in GOOD
    text = GOOD.replace(old, new, 1)
    if topic in (Topic.TRANSITIONS, Topic.PERIOD):
        text = text.replace("symmetry: x -> -x, v -> -v, t -> t + T/2\n", "")
    report = report_of(tmp_path, text)
    found = [f for f in report.findings if f.topic is topic and f.severity is not Severity.NOTE]
    assert any(says in f.message for f in found), str(report)
    assert {f.severity for f in found} == {Severity(severity)}
    assert report.ok == (severity == "warning")


def test_flat_surfaces_are_found(tmp_path: Path) -> None:
    text = GOOD.replace("{u: k*x", "{w: x**3, u: k*x").replace(
        "  v: {observable: v", "  w: {observable: w, level: 0}\n  v: {observable: v"
    )
    report = report_of(tmp_path, text)
    assert any("vanishes on surface 'w'" in f.message for f in report.findings), str(report)


@pytest.mark.parametrize(("also", "ok"), [("", False), (", chatter: true", True)])
def test_what_stays_at_a_wall_needs_a_mode_there(tmp_path: Path, also: str, ok: bool) -> None:
    ball = (
        "name: ball\nstates: [y, v]\nparameters: {a: 1.4, w: 0.8}\nperiod: 2*pi/w\nsurfaces: {table: "
        "{observable: y - a*sin(w*t)}}\nmodes: {flight: {in: {table: +}, field: {y: v, v: -0.7}}}\n"
    )
    report = report_of(tmp_path, f"{ball}resets: {{table: {{v: a*w*cos(w*t){also}}}}}\n")
    assert report.ok == ok, str(report)
    assert ok or any("must turn the rate" in f.message for f in report.findings), str(report)


WALL = """\
name: wall
states: [x, v]
parameters: {Omega: 0.7, e: 0.8, b: 0.5}
period: 2*pi/Omega
surfaces:
  wall: {observable: x, level: b}
  stop: {observable: v, level: 0}
modes:
  rise: {in: {wall: -, stop: +}, field: {x: v, v: cos(Omega*t) - x}}
  fall: {in: {wall: -, stop: -}, field: {x: v, v: cos(Omega*t) - x}}
resets: {wall: {v: -e*v}}
"""


@pytest.mark.parametrize(
    ("reset", "says"),
    [
        ("v: -e*v", ""),
        ("v: e*v", "must turn the rate"),
        ("v: -e*v, x: x - 0.1", ""),
        ("v: -e*v, x: x + 0.1", "is in no domain"),
    ],
)
def test_resets_are_checked(tmp_path: Path, reset: str, says: str) -> None:
    report = report_of(tmp_path, WALL.replace("v: -e*v", reset))
    assert report.counts[Topic.RESETS] > 0
    assert report.ok == (not says), str(report)
    assert not says or any(says in f.message for f in report.findings), str(report)


FORCED = """\
name: forced
states: [x, v]
parameters: {{w: {w}, z: 0.1}}
period: 2*pi/w
field: {{x: v, v: "cos(w*t) - 2*z*v - x + {size}*({force})"}}
spread: {{x: 2, v: 2}}
"""


@pytest.mark.parametrize(
    ("force", "along"),
    [
        ("acos(cos(w*t))", "t"),
        ("acos(cos(w*t))**2", "t"),
        ("sqrt(sin(w*t)**2)", "t"),
        ("(sin(w*t)**4)**0.25", "t"),
        ("asin(sin(x))", "x"),
        ("(x**2)**0.5", "x"),
        ("sqrt(1 - cos(x))", "x"),
        ("log(1 + sqrt(v**2))", "v"),
        ("sqrt(1 + x**2)", ""),
        ("asin(sin(x)/2)", ""),
        ("sqrt(x**2 + z**6)", ""),
        ("asin(tanh(x))", ""),
        ("(x**2)**1.5", ""),
    ],
)
def test_kinks_that_no_abs_shows_are_found(tmp_path: Path, force: str, along: str) -> None:
    draw = np.random.default_rng(len(force))
    size, w = draw.uniform(0.1, 2.0), draw.uniform(0.5, 2.0)
    report = report_of(tmp_path, FORCED.format(size=size, w=w, force=force))
    found = [f.message for f in report.findings if f.topic is Topic.KINKS]
    assert report.ok and len(found) == bool(along), str(report)
    assert not along or f"the rate of 'v' in mode 'smooth' has a kink along {along}, at" in found[0]


@pytest.mark.parametrize(("place", "met"), [(0.5, True), (50.0, False)])
def test_a_reset_that_no_simulation_meets_is_said(tmp_path: Path, place: float, met: bool) -> None:
    """Of a model with one mode, and of one with several."""
    one_mode = WALL.replace("  stop: {observable: v, level: 0}\n", "").replace(", stop: +", "")
    one_mode = "\n".join(line for line in one_mode.splitlines() if "fall" not in line)
    for text in (WALL, one_mode):
        report = report_of(tmp_path, text.replace("b: 0.5", f"b: {place}"))
        said = [f for f in report.findings if "came to the reset at 'wall'" in f.message]
        assert report.ok and len(said) == (not met), str(report)
        assert all(f.severity is Severity.NOTE for f in said)


@pytest.mark.parametrize("reset", ["v: -0.5*v", "v: -0.5, from: [up]", "x: 0.9*x, to: up", "v: 1"])
def test_sliding_where_a_reset_acts_is_refused(tmp_path: Path, reset: str) -> None:
    text = f"""
name: both
states: [x, v]
parameters: {{w: 1.0, S: 0.3}}
period: 2*pi/w
surfaces: {{stop: {{observable: v, sliding: filippov}}}}
field: {{x: v, v: cos(w*t) - x - S*sign(v)}}
modes: {{up: {{in: {{stop: +}}}}, down: {{in: {{stop: -}}}}}}
resets: {{stop: {{{reset}}}}}
"""
    with pytest.raises(cf.ModelError, match=r"a reset acts at 'stop' in up.*does not slide"):
        report_of(tmp_path, text)
    passes = text.replace("- S*sign(v)", "+ S")  # nothing slides there: the reset alone acts
    if reset == "v: 1":
        assert cf.load_model(_written(tmp_path, passes)).resets


def _written(folder: Path, text: str) -> Path:
    path = folder / "written.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_states_that_do_nothing_are_found(tmp_path: Path) -> None:
    text = (
        GOOD.replace("states: [x, v]", "states: [x, v, z, w]")
        .replace("field: {x: v, v: -u - S*sign(v)}", "field: {x: v, v: -u - S*sign(v), z: 0, w: v}")
        .replace("field: {x: 0, v: 0}", "field: {x: 0, v: 0, z: 0, w: v}")
        .replace("v -> -v,", "v -> -v, w -> -w,")
    )
    report = report_of(tmp_path, text)
    messages = [f.message for f in report.findings]
    assert any("state 'z' never changes" in m for m in messages), str(report)
    assert any("nothing depends on state 'w'" in m for m in messages), str(report)
    assert report.ok


def altered(model: cf.Model, **functions: Any) -> cf.Model:
    flow = replace(model.flow, **functions)
    return replace(model, flow_factory=lambda: flow)


@pytest.mark.parametrize("name", ["coulomb", "coulomb-yaml"])
def test_wrong_derivatives_are_found(name: str) -> None:
    """Compiled code with one wrong derivative, and with one wrong value."""
    model = cf.load_model(name)

    def slope(c: int, t: float, y: Any, p: Any, which: Any, grad: Any) -> float:
        value: float = model.flow.observe(c, t, y, p, which, grad)
        if len(grad) > 3:
            grad[3] *= 1.001
        return value

    report = check_model(altered(model, observe=slope))
    message = next(f.message for f in report.findings if f.topic is Topic.DERIVATIVES)
    assert "its derivative by Omega is compiled as" in message

    def rate(mode: int, c: int, t: float, y: Any, p: Any, which: Any, grad: Any) -> float:
        value: float = model.flow.rate(mode, c, t, y, p, which, grad)
        return value + 1e-6 * y[0]

    report = check_model(altered(model, rate=rate))
    assert not report.ok
    assert {f.topic for f in report.findings} >= {Topic.DERIVATIVES}


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "checked.yaml"
    path.write_text(GOOD, encoding="utf-8")
    assert main(["check", str(path)]) == 0
    assert capsys.readouterr().out.endswith("ok\n")
    path.write_text(GOOD.replace("Omega > 0]", "Omega > 1]"), encoding="utf-8")
    assert main(["check", str(path), "--json"]) == 2
    found = json.loads(capsys.readouterr().out)
    assert found["ok"] is False
    assert found["findings"][0]["topic"] == "constraints"
    path.write_text(GOOD.replace("states", "sates"), encoding="utf-8")
    assert main(["check", str(path)]) == 2
    assert f"{path}:2: unknown key 'sates'; did you mean 'states'?" in capsys.readouterr().err


#: Models that have the symmetry they declare, and some that have none at all.
SYMMETRIC, PLAIN = ("coulomb-yaml", "dead-band", "bang-bang", "stribeck"), ("popp", "belt")


@pytest.mark.parametrize("name", SYMMETRIC)
def test_a_symmetry_that_is_not_declared_is_proposed(name: str) -> None:
    declared = cf.load_model(name)
    assert declared.symmetry is not None
    report = ModelReport(name)
    check_hidden(report, Probe(replace(declared, symmetry=None), {}))
    (finding,) = report.findings
    assert finding.topic is Topic.UNDECLARED and finding.severity is Severity.NOTE and report.ok
    later = "" if declared.autonomous else ", t -> t + T/2"
    assert f"Declare it, 'symmetry: x -> -x, v -> -v{later}'" in finding.message
    found = hidden_symmetry(Probe(declared, {}))
    assert found is not None
    assert np.array_equal(np.diag(found.signs), declared.symmetry.array())
    check_hidden(report, Probe(declared, {}))
    assert report.counts[Topic.UNDECLARED] == 1  # what is declared is not looked for


@pytest.mark.parametrize("name", PLAIN)
def test_no_symmetry_is_proposed_where_there_is_none(name: str) -> None:
    assert hidden_symmetry(Probe(cf.load_model(name), {})) is None


#: A model whose symmetry goes with any but the first of these parameters.
BROKEN = """\
name: broken
states: [x, v]
parameters: {Omega: 0.7, S: 0.2, a: 0, b: 0, d: 0, f: 0, m: 0}
period: 2*pi/Omega
observables: {u: x - a + b*x**2 - cos(Omega*t) - m*cos(2*Omega*t)}
surfaces:
  F+: {observable: u, level: S}
  F-: {observable: u, level: -S - f}
  v: {observable: v, level: 0}
field: {x: v, v: -u - S*sign(v) - d*v**2}
modes:
  forward: {in: {v: +}}
  backward: {in: {v: -}}
  stick: {in: {v: 0, F+: -, F-: +}, field: {x: 0, v: 0}}
"""


def test_shifts_are_found_and_nothing_false_is(tmp_path: Path) -> None:
    model = typed(tmp_path, BROKEN)
    for params, image in (({}, "-x"), ({"a": 0.3}, "0.6 - x"), ({"a": -1.0, "S": 0.4}, "-2 - x")):
        report = ModelReport("broken")
        check_hidden(report, Probe(model, params))
        (finding,) = report.findings
        assert f"x -> {image}, v -> -v, t -> t + T/2" in finding.message
        assert "at these parameters" in finding.message
    for name in "bdfm":
        for value in (0.1, -1e-4):
            assert hidden_symmetry(Probe(model, {"a": 0.3, name: value})) is None


def test_a_shift_of_differing_frictions_is_an_expression_of_them(tmp_path: Path) -> None:
    path = tmp_path / "checked.yaml"
    text = GOOD.replace("S: 0.2", "S: 0.2, R: 0.4").replace("level: -S", "level: -R")
    for old, new in (
        ("u: k*x", "u: x"),
        ("forward: {in: {v: +}}", "forward: {in: {v: +}, field: {x: v, v: -u - R}}"),
        ("backward: {in: {v: -}}", "backward: {in: {v: -}, field: {x: v, v: -u + S}}"),
    ):
        assert old in text
        text = text.replace(old, new)
    path.write_text(text.partition("symmetry:")[0], encoding="utf-8")
    report = ModelReport("checked")
    check_hidden(report, Probe(cf.load_model(path), {}))
    (finding,) = report.findings
    assert "Declare it, 'symmetry: x -> S - R - x, v -> -v" in finding.message


APART = """\
name: apart
states: [x, q]
parameters: {w: 1.0, h: 0.1}
period: 2*pi/w
surfaces:
  up: {observable: x, level: h}
modes:
  low: {in: {up: -}, field: {x: cos(w*t) - x, q: x - q}}
  high: {in: {up: +}, field: {x: cos(w*t) - 2*x, q: x - q}}
spread: {x: 1, q: 1}
"""


def findings(tmp_path: Path, text: str, topic: Topic) -> list[str]:
    return [f.message for f in report_of(tmp_path, text).findings if f.topic is topic]


def test_a_mode_that_nothing_leads_into_is_told(tmp_path: Path) -> None:
    assert not findings(tmp_path, APART, Topic.REACHED)
    fields = "{x: v, v: cos(Omega*t) - x}"
    sides = f"in: {{in: {{wall: -}}, field: {fields}}}\n  out: {{in: {{wall: +}}, field: {fields}}}"
    text = WALL[: WALL.index("  rise")] + f"  {sides}\n" + WALL[WALL.index("resets") :]
    told = findings(tmp_path, text, Topic.REACHED)
    assert len(told) == 2 and "'out'" in told[1]


def test_sizes_and_times_that_are_far_apart_are_told(tmp_path: Path) -> None:
    assert not findings(tmp_path, APART, Topic.SCALES)
    (sizes,) = findings(tmp_path, APART.replace("q: 1}", "q: 1.0e-9}"), Topic.SCALES)
    assert "'q' (1e-09) and 'x' (1)" in sizes
    fast = APART.replace("- x,", "- 1.0e+9*x,").replace("q: x - q", "q: 1.0e+9*(x - q)")
    (times,) = findings(tmp_path, fast.replace("- 2*x", "- 1.0e+9*x"), Topic.SCALES)
    assert "Write units: {x: 1.0e-09" in times


@pytest.mark.parametrize("level", [-0.3, 0.2])
@pytest.mark.parametrize("side", ["+", "-"])
def test_a_slide_that_meets_a_surface_with_no_mode_behind_it(
    tmp_path: Path, side: str, level: float
) -> None:
    """It goes on beyond the surface, where its mode does not hold; a mode on both sides is sound."""
    text = """\
name: checked
states: [x, v]
parameters: {w: 1.0, F: 3.0, S: 1.0}
period: 2*pi/w
observables: {u: x - F*cos(w*t)}
surfaces: {F+: {observable: u, level: S}, F-: {observable: u, level: -S}, v: {observable: v, level: 0},
  gate: {observable: x + u, level: LEVEL}}
field: {x: v, v: -u - S*sign(v)}
modes:
  forward: {in: {v: +}}
  backward: {in: {v: -}}
  stick: {in: {v: 0, F+: -, F-: +, gate: SIDE}, field: {x: 0, v: 0}}
""".replace("LEVEL", str(level))
    found = report_of(tmp_path, text.replace("SIDE", f"'{side}'"))
    assert any("a slide in 'stick' meets 'gate'" in f.message for f in found.findings)
    both = report_of(tmp_path, text.replace(", gate: SIDE", ""))
    assert not any("a slide in" in f.message for f in both.findings)


TWISTING = """
name: twisting
states: [s, v]
parameters: {a: 1.5, b: 0.5, A: 1.3, w: 1.0, c: 0.2}
period: 2*pi/w
surfaces: {s: {observable: s}, v: {observable: v, sliding: filippov}, far: {observable: sin(s), level: 2}}
field: {s: v, v: -c*v - a*sign(s) - b*sign(v) + A*cos(w*t)}
modes:
  pp: {in: {s: +, v: +}}
  pn: {in: {s: +, v: -}}
  np: {in: {s: -, v: +}}
  nn: {in: {s: -, v: -}}
"""


def test_an_end_of_derived_sliding_that_no_state_has_is_no_warning(tmp_path: Path) -> None:
    """Sliding ends where A cos(w t) = a - b, never at a + b; nobody wrote that surface."""
    said = str(check_model(typed(tmp_path, TWISTING)))
    assert "no state was found on surface 'far'" in said
    assert "surface 'slide" not in said


def test_places_on_surfaces_are_the_nearest_ones() -> None:
    """Of one surface without a decomposition: a gradient may vanish, be tiny, or huge."""
    rng = np.random.default_rng(3)
    for size in (0.0, 1e-200, 1e-9, 1.0, 1e200):
        for rows in (1, 2):
            slopes, heights = size * rng.normal(size=(rows, 4)), size * rng.normal(size=rows)
            exact, _, rank, _ = np.linalg.lstsq(slopes, heights, rcond=None)
            step, found = _shortest(slopes, heights)
            assert found == rank
            assert step == pytest.approx(exact, rel=1e-12, abs=1e-14)


def test_surfaces_that_do_not_meet_have_no_place() -> None:
    model = cf.load_model("dead-band")
    probe = Probe(model, {})
    low, high, *_ = (s.name for s in model.surfaces if s.observable == model.surfaces[0].observable)
    for t, y in probe.states(20):
        assert probe.landed((low,), t, y) is not None
        assert probe.landed((high,), t, y) is not None
        assert probe.landed((low, high), t, y) is None
