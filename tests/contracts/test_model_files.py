"""Users' models in YAML files: what is accepted, and how each mistake is reported."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import pytest

import contfric as cf
from contfric.base.resources import bundled_dir
from contfric.continuation.points import LARGEST_STEP
from contfric.curves.trace import largest_step
from contfric.events.bifurcation import meaning_of
from contfric.models.described.reading_back import from_text

GOOD = """\
name: spring
states: [x, v]
parameters:
  Omega: {default: 0.5, meaning: frequency}
  S: 0.2
constraints: [Omega > 0, S >= 0]
period: 2*pi/Omega
define:
  f: cos(Omega*t)
observables: {u: x - f}
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


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "spring.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_everything_is_derived(tmp_path: Path) -> None:
    model = cf.load_model(written(tmp_path, GOOD))
    assert [m.rank for m in model.modes] == [2, 2, 1]
    assert [m.sliding for m in model.modes] == [False, False, True]
    assert [s.name for s in model.surfaces if s.switching] == ["v"]
    assert len(model.domains) == 7
    assert model.stop_surface == "v"
    assert model.symmetry is not None
    assert model.symmetry.surfaces == {"F+": "F-", "F-": "F+", "v": "v"}
    assert {(*d.where.items(), *d.leaves.items()) for d in model.departures} == {
        (("v", 0), ("F+", 1), ("v", -1)),
        (("v", 0), ("F-", -1), ("v", 1)),
    }
    assert model.transitions["stick", "F+"] == "backward:u+"


def test_models_without_jumps_are_recognised(tmp_path: Path) -> None:
    """The stick ends where the slide would begin at rest; not so with a static limit of its own."""
    assert cf.load_model(written(tmp_path, GOOD)).filippov
    higher = GOOD.replace("S: 0.2", "S: 0.2\n  S0: 0.2").replace("level: S}", "level: S0}")
    assert not cf.load_model(
        written(tmp_path, higher.replace("level: -S}", "level: -S0}"))
    ).filippov
    assert [cf.load_model(n).filippov for n in ("belt", "popp", "coulomb-yaml", "lugre")] == [
        *(True, True),
        *(False, False),
    ]


def test_same_definition_is_the_same_model(tmp_path: Path) -> None:
    path = written(tmp_path, GOOD)
    again = tmp_path / "other.yaml"
    again.write_text(f"# a comment\n{GOOD}", encoding="utf-8")
    assert cf.load_model(path) is cf.load_model(str(again))


@pytest.mark.parametrize("more", ["", "max_step: 0.002\n"])
def test_text_of_a_description_reads_back(tmp_path: Path, more: str) -> None:
    definition = cf.load_model(written(tmp_path, GOOD + more)).definition
    assert from_text(definition).text == definition


def test_a_model_declares_its_largest_step(tmp_path: Path) -> None:
    """It holds where the user gives none, for branches and curves; motion does not depend on it."""
    plain = cf.load_model(written(tmp_path, GOOD))
    careful = cf.load_model(written(tmp_path, f"{GOOD}max_step: 0.002\n"))
    assert (plain.max_step, careful.max_step) == (None, 0.002)
    assert careful.flow_factory == plain.flow_factory
    assert cf.load_model("lugre").max_step == 0.001

    def points(model: cf.Model, **step: float) -> int:
        orbit = cf.find_orbit(model, {"Omega": 0.72})
        return len(cf.continue_orbit(orbit, "Omega", (0.68, 0.78), **step))

    assert points(careful) == points(plain, max_step=0.002) > 3 * points(plain)
    assert points(careful, max_step=0.01) == points(plain)
    assert largest_step(None, careful) == 0.002
    assert largest_step(0.1, careful) == 0.1
    assert largest_step(None, plain) == LARGEST_STEP


@pytest.mark.parametrize("name", sorted(p.stem for p in bundled_dir("models").glob("*.yaml")))
def test_bundled_files_have_their_own_name(name: str) -> None:
    assert cf.load_model(name).name == name
    assert name in cf.model_names()


#: (what is written in the place of what, line of the error, what its message says)
MISTAKES = [
    ("constraints:", "constrains:", 6, "did you mean 'constraints'?"),
    ("default: 0.5", "defualt: 0.5", 4, "did you mean 'default'?"),
    ("S: 0.2", "sin: 0.2", 5, "means a function"),
    ("S: 0.2", "lambda: 0.2", 5, "word of Python; write lambda_ or λ"),
    ("S: 0.2", "del: 0.2", 5, "word of Python; write del_"),
    ("v: -u - S", "v: -lambda*v - S", 15, "word of Python: write lambda_ or λ"),
    ("S: 0.2", "x: 0.2", 5, "has the name of a state"),
    ("Omega > 0, S", "Omega > 0, S*S", 6, "must be linear"),
    ("Omega > 0, S", "Omega < 0 < S, S", 6, "a constraint is such as"),
    ("Omega > 0, S", "Omgea > 0, S", 6, "did you mean 'Omega'?"),
    ("period: 2*pi/Omega", "period: 2*pi/t", 7, "only parameters"),
    ("period: 2*pi/Omega", "autonomous: true", 9, "autonomous model"),
    ("period: 2*pi/Omega", "", 1, "one of 'period"),
    ("f: cos(Omega*t)", "f: cos(Omega*t", 9, "never closed"),
    ("f: cos(Omega*t)", "f: coz(Omega*t)", 9, "did you mean 'cos'?"),
    ("f: cos(Omega*t)", "f: cos(Omega^t)", 9, "write **"),
    ("f: cos(Omega*t)", "f: f + 1", 9, "defined by itself: f -> f"),
    ("f: cos(Omega*t)", "f: Omega.real", 9, "dot"),
    ("f: cos(Omega*t)", "f: 1/0 + t", 9, "no finite real value"),
    ("{u: x - f}", "{u: x - g}", 10, "unknown name 'g'"),
    ("{u: x - f}", "{u: x - f, v: x}", 10, "observable 'v' has the name of a state"),
    ("F+: {observable: u", "F+: {observable: w", 12, "no observable or state 'w'"),
    ("level: S}", "level: x}", 12, "only parameters"),
    ("v: -u - S*sign(v)}", "v: max(0, S)}", 15, "needs quotes"),
    ("field: {x: v, ", "field: {x: v, w: 1, ", 15, "unknown key 'w'"),
    ("field: {x: v, v: -u - S*sign(v)}", "", 17, "key 'field' is missing"),
    ("{in: {v: +}}", "{in: {w: +}}", 17, "no surface 'w'"),
    ("{in: {v: +}}", "{in: {v: up}}", 17, "+ (above)"),
    ("{in: {v: -}}", "{in: {v: +}}", 18, "share the region"),
    ("{in: {v: -}}", "{in: {v: -, F+: +, F-: -}}", 18, "contradict each other"),
    ("in: {v: 0, ", "sliding: false, in: {v: 0, ", 19, "slides if and only if"),
    ("x -> -x, v", "x -> -2*x, v", 20, "image of surface"),
    ("t + T/2", "t*t", 20, "image of t"),
    ("x -> -x, v", "x -> x*x, v", 20, "linear in the states"),
    ("name: spring", "name: spring\nspread: {x: t}", 2, "only parameters"),
    ("name: spring", "name: spring\nintegration: {method: magic}", 2, "explicit, implicit"),
    ("name: spring", "name: spring\nstop_surface: w", 2, "no surface 'w'"),
    ("name: spring", "name: spring\nmax_step: 2", 2, "largest step of a continuation"),
    ("name: spring", "name: spring\nmax_step: '1e-3'", 2, "got '1e-3'"),
    ("name: spring", "name: spring\nmax_step: true", 2, "got True"),
    ("name: spring", "name: spring\nresets: {v: {w: 1}}", 2, "unknown key 'w'"),
    (
        "name: spring",
        "name: spring\nresets: {v: {v: -v}}",
        2,
        "the rates after a reset must tell the side",
    ),
    ("name: spring", "name: spring\ndomains: {a: {mode: forward}}", 2, "it holds for: forward:u+"),
    (
        "name: spring",
        "name: spring\ndomains: {a: {mode: stick}, b: {mode: stick}}",
        2,
        "holds for the region of domain 'a'",
    ),
    ("v: -u - S", "v: -2u - S", 15, "a product needs its * (in '2u')"),
    ("v: -u - S", "v: -S u - S", 15, "a product needs its * (in 'S u')"),
    ("v: -u - S", "v: -if(u) - S", 15, "a choice is written where(condition, a, b)"),
]


@pytest.mark.parametrize(("old", "new", "line", "says"), MISTAKES, ids=[m[1] for m in MISTAKES])
def test_mistakes_have_their_line(tmp_path: Path, old: str, new: str, line: int, says: str) -> None:
    assert old in GOOD
    path = written(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(cf.ModelError) as caught:
        cf.load_model(path)
    message = str(caught.value)
    assert message.startswith(f"{path}:{line}: "), message
    assert says in message


@pytest.mark.parametrize("name", ["lambda_", "λ", "del_"])
def test_names_that_are_proposed_for_words_of_python_can_be_used(tmp_path: Path, name: str) -> None:
    text = GOOD.replace("S: 0.2", f"S: 0.2\n  {name}: 0.3")
    path = written(tmp_path, text.replace("v: -u - S", f"v: -u - {name}*v - S"))
    model = cf.load_model(path)
    view = model.view(model.vector({}))
    assert view.rate("forward", "v", 0.0, [1.0, 2.0]) == pytest.approx(-0.3 * 2.0 - 0.2)


TIMED = """
name: timed
states: [temp, s]
parameters: {q: 2.0, c: 0.3, low: 1.0, high: 1.4, wait: 0.2}
autonomous: true
surfaces:
  hot: {observable: temp, level: high}
  cold: {observable: temp, level: low}
  ready: {observable: s, level: wait}
modes:
  heats: {in: {ready: -}, field: {temp: q - c*temp, s: 1}}
  may_stop: {in: {hot: -}, field: {temp: q - c*temp, s: 0}}
  cools: {in: {ready: -}, field: {temp: -c*temp, s: 1}}
  may_start: {in: {cold: +}, field: {temp: -c*temp, s: 0}}
resets:
  ready: {to: {may_stop: {from: heats}, may_start: {from: cools}}}
  hot: {s: 0, to: cools, from: [may_stop]}
  cold: {s: 0, to: heats, from: [may_start]}
"""


def test_a_timer_that_stays_at_its_level_is_told_what_to_write(tmp_path: Path) -> None:
    """Each message names a mode and its line; with both written the cycle is that in closed form."""
    text = TIMED
    for mode, side, line in (("may_stop", "hot: -", 12), ("may_start", "cold: +", 14)):
        path = written(tmp_path, text)
        with pytest.raises(cf.ModelError, match=f"leads to '{mode}'.*write 'ready: 0'") as caught:
            cf.load_model(path)
        assert str(caught.value).startswith(f"{path}:{line}: ")
        text = text.replace(f"in: {{{side}}}", f"in: {{ready: 0, {side}}}")
    orbit = cf.find_orbit(written(tmp_path, text))
    level = 2.0 / 0.3  # heats towards q/c, cools towards 0
    period = (math.log((level - 1.0) / (level - 1.4)) + math.log(1.4 / 1.0)) / 0.3
    assert orbit.period == pytest.approx(period, abs=1e-12)


def test_missing_files_and_names(tmp_path: Path) -> None:
    written(tmp_path, GOOD)
    with pytest.raises(cf.ModelError, match=r"did you mean 'spring.yaml'"):
        cf.load_model(tmp_path / "sprin.yaml")
    with pytest.raises(cf.ParameterError, match="did you mean 'belt'"):
        cf.load_model("bellt")
    with pytest.raises(cf.ModelError, match="is no model"):
        cf.load_model(3)  # type: ignore[arg-type]


#: Loading a model that was built before takes the generated module, and neither sympy nor pydantic.
LOADS = """\
import sys, contfric as cf
model = cf.load_model({path!r})
if {use}:
    model.flow.period(model.vector({{}}), __import__("numpy").empty(0, dtype="i8"),
                      __import__("numpy").empty(0))
print("sympy" in sys.modules or "pydantic" in sys.modules)
"""


def test_sympy_is_imported_only_to_build(tmp_path: Path) -> None:
    path = str(written(tmp_path, GOOD.replace("spring", f"spring{tmp_path.name[-4:]}")))
    seen = []
    for use in (False, True):
        code = LOADS.format(path=path, use=use)
        done = subprocess.run(
            [sys.executable, "-c", code], check=False, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        seen.append(done.stdout.strip())
    assert seen[1] == "False"


@pytest.mark.parametrize(
    ("model", "surface", "meaning"),
    [
        ("coulomb", "v", "grazing-sliding"),
        ("impact", "wall", "grazing impact"),
        (Path(__file__).parents[1] / "models" / "bilinear.yaml", None, "grazing"),
    ],
)
def test_grazing_is_a_sliding_only_where_something_slides(
    model: str | Path, surface: str | None, meaning: str
) -> None:
    found = cf.load_model(model)
    surfaces = {surface} if surface else {s.name for s in found.surfaces}
    assert surfaces <= {s.name for s in found.surfaces}
    assert meaning_of(cf.Kind.GS, found, surfaces) == meaning
    assert meaning_of(cf.Kind.T, found, surfaces) == cf.Kind.T.meaning
