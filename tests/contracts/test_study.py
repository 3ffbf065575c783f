"""Studies: what is accepted, what is computed and what is not, and that nothing found is lost."""

from __future__ import annotations

import csv
import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.base.tally import counts
from contfric.events.bifurcation import End, EndReason
from contfric.study import UnwrittenError, make_plan, read_study, study_names
from contfric.study.result import RunStatus

HEAD = "model: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\n"
EXPLORE = "explore: {parameter: Omega, range: [0.45, 0.56]}\n"
CONTINUE = "continue: {parameter: Omega, range: [0.45, 0.56]}\n"
ALL = "want: [stability, asymmetry, extrema, stops]\n"


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def run_python(code: str, *args: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, args)], capture_output=True, text=True, check=False
    )


# ------------------------------------------------------------------------------------ bad input


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        # YAML
        ("", 1, "must be a mapping"),
        ("model: [\n", 2, "not valid YAML"),
        (HEAD + "model: coulomb\n", 3, r"key 'model' is given twice \(first in line 1\)"),
        # unknown itineraries
        (HEAD + "exlpore: {}\n", 3, "unknown key 'exlpore'; did you mean 'explore'"),
        (HEAD + "explore:\n  parameter: Omega\n  rnage: [0.4, 0.6]\n", 5, "did you mean 'range'"),
        ("model: colomb\n", 1, "unknown model 'colomb'; did you mean 'coulomb'"),
        ("model: coulomb\nparams:\n  Omga: 1.0\n", 3, "no parameter 'Omga'; did you mean 'Omega'"),
        (HEAD + EXPLORE.replace("Omega", "omega"), 3, "no parameter 'omega'; did you mean 'Omega'"),
        (HEAD + "want: [stability, stop]\n", 3, "'want' has no 'stop'; did you mean 'stops'"),
        (HEAD + "want:\n- stability\n- extremes\n", 5, "did you mean 'extrema'"),
        (HEAD + "figures: [{kind: diagramm}]\n", 3, "no 'diagramm'; did you mean 'diagram'"),
        (HEAD + "figures: [{kind: orbit, row: [psi]}]\n", 3, "unknown key 'row'; .*'rows'"),
        (HEAD + "figures: [{kind: orbit, format: jpg}]\n", 3, "'format' has no 'jpg'.*png, svg"),
        (HEAD + "start: {signatur: 1a}\n", 3, "unknown key 'signatur'; did you mean 'signature'"),
        (HEAD + "start: {simulate: {states: [1, 0]}}\n", 3, "did you mean 'state'"),
        (HEAD + "start: simulat\n", 3, "'start' is 'simulate' or a mapping.*got 'simulat'"),
        (HEAD + "start: {signature: 1s}\n", 3, "unknown signature '1s'.*Valid: 0s, 1a"),
        # missing
        ("title: a\n", 1, "key 'model' is missing; it must be the name of a model"),
        (HEAD + "explore: {parameter: Omega}\n", 3, "key 'range' is missing; .*two finite numbers"),
        (HEAD + "figures: [{}]\n", 3, "key 'kind' is missing; it must be one of diagram"),
        (HEAD + "start: {}\n", 3, "one of simulate, signature, orbit; got none"),
        # wrong types
        (
            "model: 7\n",
            1,
            r"'model' must be the name of a model, or the path of its YAML file, got 7 \(int\)",
        ),
        ("model: coulomb\nparams: 3\n", 2, "'params' must be a mapping of parameters"),
        (
            "model: coulomb\nparams: {S: yes}\n",
            2,
            r"'S' must be a finite number, got 'yes' \(str\)",
        ),
        (
            "model: coulomb\nparams:\n  S: abc\n",
            3,
            r"'S' must be a finite number, got 'abc' \(str\)",
        ),
        ("model: coulomb\nparams: {S: '0.3'}\n", 2, "a number has no quotes"),
        ("model: coulomb\nparams: {zeta: '1e-3'}\n", 2, "a number has no quotes"),
        ("model: coulomb\nparams: {S: .nan}\n", 2, "'S' must be a finite number, got nan"),
        ("model: coulomb\nparams: {S: .inf}\n", 2, "'S' must be a finite number, got inf"),
        (HEAD + "want: stability\n", 3, "'want' must be a list.*got 'stability'"),
        (HEAD + "figures: {kind: orbit}\n", 3, "'figures' must be a list of mappings"),
        (HEAD + "explore: [Omega, 0.4, 0.6]\n", 3, "'explore' must be a mapping"),
        (HEAD + "explore: {parameter: Omega, range: 0.4}\n", 3, "'range' .*two finite numbers"),
        (HEAD + "explore: {parameter: Omega, range: [0.4]}\n", 3, "'range' .*two finite numbers"),
        (HEAD + "explore: {parameter: Omega, range: [0.4, b]}\n", 3, "'range' .*got 'b'"),
        (HEAD + "explore: {parameter: Omega, range: [0.4, .nan]}\n", 3, "'range' .*got nan"),
        (HEAD + EXPLORE.replace("}", ", max_step: 0}"), 3, r"'max_step' .*in \(0, 1\].*got 0"),
        (HEAD + EXPLORE.replace("}", ", max_periods: 1.5}"), 3, "'max_periods' .*whole number"),
        (HEAD + EXPLORE.replace("}", ", max_periods: 17}"), 3, "'max_periods' .*from 1 to 16"),
        (HEAD + EXPLORE.replace("}", ", bridges: 0}"), 3, "'bridges' .*true or false.*got 0"),
        (HEAD + CONTINUE.replace("}", ", max_periods: 2}"), 3, "unknown key 'max_periods'"),
        (HEAD + CONTINUE.replace("}", ", bridges: true}"), 3, "unknown key 'bridges'"),
        (HEAD + "start: {simulate: {state: [1.0]}}\n", 3, r"is 2 numbers \(x, v\), got 1"),
        (HEAD + "start: {simulate: {state: [a, 0]}}\n", 3, "'state' .*finite numbers.*got 'a'"),
        (HEAD + "start: {simulate: {periods: 0}}\n", 3, "'periods' .*from 1 to 64"),
        # values
        (
            "model: coulomb\nparams:\n  S: 0.5\n  S0: 0.4\n",
            4,
            r"needs S0 >= S, got S0 = 0\.4, S = 0\.5",
        ),
        ("model: coulomb\nparams:\n  h: 0\n  Omega: 0\n", 4, "needs Omega > 0, got Omega = 0"),
        ("model: coulomb\nparams: {Omega: -1.0}\n", 2, "needs Omega > 0, got Omega = -1.0"),
        (HEAD + EXPLORE.replace("0.45, 0.56", "0.6, 0.4"), 3, r"is reversed: write \[0.4, 0.6\]"),
        (HEAD + EXPLORE.replace("0.45, 0.56", "0.5, 0.5"), 3, "is empty"),
        (HEAD + EXPLORE.replace("0.45, 0.56", "-1, 0"), 3, "needs Omega > 0"),
        (HEAD + "explore:\n  parameter: S\n  range: [0.5, 0.9]\n", 5, "needs S >= 0 and S0 >= S"),
        (HEAD + EXPLORE.replace("0.45, 0.56", "0.6, 0.7"), 3, "the start, Omega = 0.5, is outside"),
        # contradictions
        (HEAD + EXPLORE + CONTINUE, 4, "one of explore and continue, not both"),
        (HEAD + "start: {simulate: {}, signature: 1a}\n", 3, "got simulate and signature"),
        (HEAD + "figures: [{kind: diagram}]\n", 3, "a diagram needs 'explore' or 'continue'"),
        (HEAD + "figures: [{kind: branches}]\n", 3, "a graph of branches needs 'explore'"),
        (HEAD + "figures: [{kind: orbit, rows: [psi]}]\n", 3, "only a diagram has rows"),
        (
            HEAD + "figures: [{kind: orbit, file: a/b.png}]\n",
            3,
            "name of a file in the run's folder",
        ),
        (HEAD + "figures: [{kind: orbit, file: a.jpg}]\n", 3, "unknown format 'jpg'"),
        (
            HEAD + "figures: [{kind: orbit, file: a.png, format: svg}]\n",
            3,
            "not of the format 'svg'",
        ),
        (
            HEAD + "figures:\n- {kind: orbit, file: a}\n- {kind: transitions, file: a.png}\n",
            5,
            "two figures cannot be one file, 'a.png'",
        ),
    ],
)
def test_bad_study(write, text: str, line: int, message: str) -> None:
    path = write(text)
    with pytest.raises(cf.StudyError, match=message) as caught:
        read_study(path)
    assert str(caught.value).startswith(f"{path}:{line}: ")
    assert "\n" not in str(caught.value)


def test_bad_signature_file_is_named_with_its_line(write) -> None:
    write("name: a\nmodel: coulomb\nsegments: stik -> x-v+\n", "own.yaml")
    path = write(HEAD + "start: {signature: own.yaml}\n")
    with pytest.raises(
        cf.StudyError, match=r"scene\.yaml:3: .*own\.yaml:3: .*did you mean 'stick'"
    ):
        read_study(path)
    write("name: a\nmodel: coulomb\nsegments: stick -> x+v+\n", "own.yaml")
    with pytest.raises(cf.StudyError, match=r"'stick' cannot be followed .*can come: x\+v-"):
        read_study(path)
    path = write(HEAD + "start: {signature: none.yaml}\n")
    with pytest.raises(cf.StudyError, match=r"scene\.yaml:3: cannot read .*none\.yaml"):
        read_study(path)


def test_unknown_study(tmp_path) -> None:
    with pytest.raises(cf.StudyError, match="unknown study 'fig5'; did you mean 'fig05'"):
        read_study("fig5")
    (tmp_path / "scene.yaml").write_text("")
    with pytest.raises(cf.StudyError, match=r"no file .*scne\.yaml; did you mean 'scene.yaml'"):
        read_study(tmp_path / "scne.yaml")
    with pytest.raises(cf.StudyError, match="is a folder"):
        read_study(tmp_path)


def test_a_billion_laughs_end_in_one_line(write) -> None:
    lines = ["a0: &a0 [x, x]"] + [f"a{k}: &a{k} [*a{k - 1}, *a{k - 1}]" for k in range(1, 40)]
    with pytest.raises(cf.StudyError, match="entries, those that its aliases repeat"):
        read_study(write("\n".join(lines)))
    nested = "model: &m [x, x, *m]\n"
    with pytest.raises(cf.StudyError) as caught:
        read_study(write(nested))
    assert len(str(caught.value)) < 500


# ----------------------------------------------------------------------------------------- plan


def test_bundled_studies_are_valid() -> None:
    assert {"fig03", "fig04", "fig05", "fig06", "fig07", "fig13"} <= set(study_names())
    for name in study_names():
        assert make_plan(read_study(name)).steps


def test_plan_says_what_is_skipped(write) -> None:
    text = str(make_plan(read_study(write(HEAD + EXPLORE))))
    for line in (
        "1. orbit: simulate until",
        "2. explore: every branch that can be reached, Omega from 0.45 to 0.56\n",
        "points.csv, bifurcations.csv",
        "orbit.npz, diagram.npz",
        "- multipliers, and PD with them: not wanted (stability)",
        "- columns psi: not wanted (asymmetry)",
        "- matplotlib: no figures",
    ):
        assert line in text
    everything = str(make_plan(read_study("fig05")))
    assert "skipped:" not in everything
    assert "diagram (x_max, stops, psi), orbit" in everything


def test_bridges_are_switched_off(tmp_path, write) -> None:
    path = write(HEAD + EXPLORE.replace("}", ", bridges: false, max_periods: 16}"))
    text = str(make_plan(read_study(path)))
    assert (
        "- bridges: branches end where the Poincare map is discontinuous: switched off (bridges: false)"
        in text
    )
    assert "Omega from 0.45 to 0.56, of up to 16 periods" in text
    record = cf.run_study(path, tmp_path / "out").info
    assert not any(branch["bridge"] for branch in record["branches"])
    assert len(record["loose_ends"]) > 0
    refused = [p for event in record["bifurcations"] for p in event["proposals"]]
    assert "bridges are switched off" in {p["why"] for p in refused if p["verdict"] == "refused"}
    plain = write(HEAD + EXPLORE, "plain.yaml")
    assert "bridges" not in str(make_plan(read_study(plain)))
    record = cf.run_study(plain, tmp_path / "plain").info
    assert {b["bridge"] for b in record["branches"]} == {True, False}
    assert record["loose_ends"] == []


def test_proposals_are_recorded(tmp_path, write) -> None:
    result = cf.run_study(write(HEAD + EXPLORE), tmp_path / "out")
    events = result.info["bifurcations"]
    assert [e["label"] for e in events] == [b.label for b in result.diagram.bifurcations]
    for entry, event in zip(events, result.diagram.bifurcations, strict=True):
        assert [p["reason"] for p in entry["proposals"]] == [p.reason for p in event.proposals]
        for item in entry["proposals"]:
            assert (item["branch"] is None) is (item["verdict"] == "refused")
            assert bool(item["why"]) is (item["verdict"] == "refused")
    assert any(e["proposals"] for e in events)


def test_plan_of_other_scenes(write) -> None:
    text = str(make_plan(read_study(write(HEAD + "start: {signature: 1a}\n"))))
    assert "solve for the signature 1a" in text
    assert "- simulation to a steady state: the start is a signature" in text
    assert "- continuation: neither 'explore' nor 'continue' is given" in text
    text = str(make_plan(read_study(write(HEAD + CONTINUE + ALL))))
    assert "- other branches: 'continue' follows one branch only" in text


def test_plan_computes_nothing() -> None:
    before = counts()
    str(make_plan(read_study("fig05")))
    assert counts() == before
    code = (
        "import sys; from contfric.study import make_plan, read_study;"
        "str(make_plan(read_study('fig05')));"
        "print(*[m for m in ('numba', 'matplotlib', 'networkx', 'scipy') if m in sys.modules])"
    )
    done = run_python(code)
    assert (done.returncode, done.stdout.split()) == (0, []), done.stderr


# ------------------------------------------------------------------------- only what is wanted


def test_everything(tmp_path, write) -> None:
    result = cf.run_study(write(HEAD + EXPLORE + ALL), tmp_path / "out")
    assert result.status is RunStatus.DONE
    assert [p.name for p in result.files] == [
        "points.csv",
        "bifurcations.csv",
        "orbit.npz",
        "diagram.npz",
        "run.json",
    ]
    assert sorted(p.name for p in result.out.iterdir()) == sorted(p.name for p in result.files)
    points = rows_of(result.out / "points.csv")
    assert list(points[0])[:9] == ["branch", "signature", *result.study.params, "x_max", "x_min"]
    assert list(points[0])[9:12] == ["psi", "stop_1", "stop_2"]
    assert list(points[0])[-1] == "stable"
    assert {row["signature"] for row in points} == {"0s", "1a", "1a, 7seg, 1hold", "2a", "2s"}
    assert {row["stable"] for row in points} == {"True", "False"}
    assert result.info["counts"]["multiplier_evaluations"] > 0


def test_tables_are_exact(tmp_path, write) -> None:
    result = cf.run_study(write(HEAD + EXPLORE + ALL), tmp_path / "out")
    assert result.diagram is not None
    points = rows_of(result.out / "points.csv")
    for number, branch in enumerate(result.diagram.branches, start=1):
        rows = [row for row in points if row["branch"] == str(number)]
        assert [float(r["Omega"]) for r in rows] == branch.values.tolist()
        assert [float(r["psi"]) for r in rows] == branch.asymmetry.tolist()
        assert [float(r["stop_2"]) for r in rows] == branch.stops[:, 1].tolist()
        assert [r["stable"] for r in rows] == [str(s) for s in branch.stable.tolist()]
    table = rows_of(result.out / "bifurcations.csv")
    assert list(table[0]) == [
        *("kind", "branch", "signature"),
        *("Omega", "S", "S0", "h", "zeta"),
        *("stable_before", "stable_after", "scenario"),
        *("label", "branches", "period"),
    ]
    assert [float(row["Omega"]) for row in table] == [
        b.params["Omega"] for b in result.diagram.bifurcations
    ]
    assert {row["kind"] for row in table} >= {"SN", "CS", "SS", "BP", "T"}
    for row in table:
        assert result.diagram.branches[int(row["branch"]) - 1].name == row["signature"]
    for row, node in zip(table, result.diagram.events, strict=True):
        assert row["branches"] == " ".join(str(k + 1) for k in node.branches)
        assert row["label"] == node.bifurcation.label
        assert float(row["period"]) == node.bifurcation.orbit.period


def test_without_stability_no_multiplier_is_evaluated(tmp_path, write) -> None:
    before = counts()
    result = cf.run_study(
        write(HEAD + EXPLORE + "want: [extrema, stops, asymmetry]\n"), tmp_path / "out"
    )
    assert (counts() - before).multiplier_evaluations == 0
    assert result.info["counts"]["multiplier_evaluations"] == 0
    assert result.info["counts"]["newton_solves"] > 0
    assert "stable" not in rows_of(result.out / "points.csv")[0]
    # a branch point is seen where the asymmetric branch turns, a doubling would need multipliers
    assert "PD" not in {row["kind"] for row in rows_of(result.out / "bifurcations.csv")}
    assert result.diagram is not None
    assert all(branch.stable is None for branch in result.diagram.branches if not branch.bridge)


@pytest.mark.parametrize(
    ("want", "columns"),
    [
        ("", []),
        ("want: [extrema]\n", ["x_max", "x_min"]),
        ("want: [asymmetry]\n", ["psi"]),
        ("want: [stops]\n", ["stop_1", "stop_2"]),
        ("want: [stability]\n", ["stable"]),
    ],
)
def test_only_wanted_columns(tmp_path, write, want, columns) -> None:
    result = cf.run_study(write(HEAD + CONTINUE + want), tmp_path / "out")
    header = list(rows_of(result.out / "points.csv")[0])
    assert header == ["branch", "signature", "Omega", "S", "S0", "h", "zeta", *columns]


def test_quantities_that_are_not_wanted_are_not_computed(tmp_path, write, monkeypatch) -> None:
    def refuse(_: object) -> None:
        raise AssertionError("computed, though nobody wants it")

    for name in ("stops", "x_max", "x_min", "asymmetry", "multipliers"):
        monkeypatch.setattr(cf.Branch, name, property(refuse))
    cf.run_study(write(HEAD + CONTINUE), tmp_path / "out")
    with pytest.raises(UnwrittenError, match="nobody wants it"):
        cf.run_study(write(HEAD + CONTINUE + "want: [asymmetry]\n"), tmp_path / "other")


@pytest.mark.parametrize(
    ("want", "rows"),
    [
        *(("[]", rows) for rows in ("", ", rows: [x_max]", ", rows: [psi, stops, x_min, energy]")),
        ("[stops]", ", rows: [x_max]"),
        ("[extrema]", ""),
    ],
)
def test_rows_need_no_columns(tmp_path, write, want, rows) -> None:
    """A figure shows its rows, whatever columns are wanted; without rows it has one all the same."""
    text = HEAD + EXPLORE + f"want: {want}\nfigures: [{{kind: diagram{rows}}}]\n"
    cf.run_study(write(text), tmp_path / "out")
    header = list(rows_of(tmp_path / "out" / "points.csv")[0])
    assert ("x_max" in header, "stop_1" in header) == ("extrema" in want, "stops" in want)
    assert (tmp_path / "out" / "diagram.png").stat().st_size > 5000


@pytest.mark.parametrize("figures", ["", "figures: [{kind: orbit}]\n"])
def test_matplotlib_is_loaded_for_figures_only(tmp_path, write, figures) -> None:
    code = (
        "import sys, contfric as cf; r = cf.run_study(sys.argv[1], sys.argv[2]);"
        "assert r.info['modules']['matplotlib'] == ('matplotlib' in sys.modules);"
        "print('matplotlib' in sys.modules, 'pandas' in sys.modules, 'networkx' in sys.modules)"
    )
    done = run_python(code, write(HEAD + figures), tmp_path / "out")
    assert done.stdout.split() == [str(bool(figures)), "False", "False"], done.stderr
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert record["modules"]["matplotlib"] is bool(figures)
    assert record["modules"]["numba"] is True
    assert record["module_count"] > 100
    assert ("matplotlib" in [item["what"] for item in record["skipped"]]) is not bool(figures)


def test_record(tmp_path, write) -> None:
    result = cf.run_study(write("title: A scene\n" + HEAD + EXPLORE), tmp_path / "out")
    record = json.loads((result.out / "run.json").read_text())
    assert record == json.loads(json.dumps(result.info))
    assert record["title"] == "A scene"
    assert record["study"]["explore"] == {"parameter": "Omega", "range": [0.45, 0.56]}
    assert record["status"] == "done"
    assert record["complete"] is True
    assert set(record["timings"]) == {"orbit", "explore", "tables", "data"}
    assert set(record["counts"]) == {
        "newton_solves",
        "multiplier_evaluations",
        "admissibility_checks",
        "simulated_events",
    }
    assert [b["signature"] for b in record["branches"]] == [b.name for b in result.diagram.branches]
    assert record["loose_ends"] == [str(end) for end in result.diagram.loose_ends]


def test_record_counts_this_run_only(tmp_path, write) -> None:
    path = write(HEAD + CONTINUE)
    first = cf.run_study(path, tmp_path / "a").info["counts"]
    second = cf.run_study(path, tmp_path / "b").info["counts"]
    assert first == second


# ------------------------------------------------------------------------------ starts and tasks


def test_start_from_a_signature(tmp_path, write) -> None:
    result = cf.run_study(write(HEAD + "start: {signature: 2s}\n" + ALL), tmp_path / "out")
    assert result.orbit is not None
    assert result.orbit.name == "2s"
    assert result.diagram is None
    assert [p.name for p in result.files] == ["points.csv", "orbit.npz", "run.json"]
    (row,) = rows_of(result.out / "points.csv")
    assert (row["signature"], row["stable"]) == ("2s", "False")
    assert float(row["x_max"]) == result.orbit.x_max


def test_start_from_a_given_state(tmp_path, write) -> None:
    start = "start: {simulate: {state: [-1.3, 0.0], time: 0.5, periods: 1}}\n"
    result = cf.run_study(write(HEAD + start), tmp_path / "out")
    assert result.orbit is not None
    assert result.orbit.name == "1a"
    with pytest.raises(cf.ConvergenceError, match=r"an orbit of 1 period, not 2"):
        cf.run_study(write(HEAD + "start: {simulate: {periods: 2}}\n"), tmp_path / "two")
    assert not (tmp_path / "two").exists()


def test_restart_from_a_saved_orbit(tmp_path, write) -> None:
    first = cf.run_study(write(HEAD + CONTINUE), tmp_path / "first")
    text = "model: coulomb\nstart: {orbit: first/orbit.npz}\n" + CONTINUE
    again = cf.run_study(write(text, "again.yaml"), tmp_path / "again")
    assert again.info["counts"]["simulated_events"] == 0
    assert first.branch is not None
    assert again.branch is not None
    assert again.branch.joints.tobytes() == first.branch.joints.tobytes()
    loaded = cf.load(tmp_path / "again" / "branch.npz")
    assert isinstance(loaded, cf.Branch)
    assert loaded.values.tolist() == again.branch.values.tolist()


def test_saved_start_is_checked_before_anything_is_computed(tmp_path, write) -> None:
    first = cf.run_study(write(HEAD + CONTINUE), tmp_path / "first")
    other = "model: coulomb\nparams: {Omega: 0.51}\nstart: {orbit: first/orbit.npz}\n"
    with pytest.raises(
        cf.StudyError, match=r":2: Omega = 0\.51, but the saved orbit has Omega = 0\.5"
    ):
        read_study(write(other))
    other = "model: coulomb\nstart: {orbit: first/branch.npz}\n"
    with pytest.raises(cf.StudyError, match=r":2: first/branch\.npz holds a Branch"):
        read_study(write(other))
    path = first.out / "orbit.npz"
    path.write_bytes(path.read_bytes()[:-40])
    other = "model: coulomb\nstart: {orbit: first/orbit.npz}\n"
    with pytest.raises(cf.StudyError, match=r":2: .*orbit\.npz is damaged or incomplete"):
        read_study(write(other))


def test_limits_are_passed_on(tmp_path, write) -> None:
    limits = "max_step: 0.01, max_points: 12"
    text = HEAD + CONTINUE.replace("}", f", {limits}}}")
    result = cf.run_study(write(text), tmp_path / "a")
    assert result.branch is not None
    assert len(result.branch) <= 2 * 12
    assert any("max_points" in end for end in result.info["loose_ends"])
    text = HEAD + EXPLORE.replace("}", ", max_branches: 1, max_periods: 1}")
    result = cf.run_study(write(text), tmp_path / "b")
    assert result.info["notes"][-1] == "stopped at max_branches = 1"


def test_figures(tmp_path, write) -> None:
    text = (
        HEAD
        + CONTINUE
        + "want: [extrema]\nfigures:\n- {kind: diagram}\n"
        + "- {kind: diagram, rows: [x_min], format: svg}\n"
        + "- {kind: transitions, file: moves.pdf}\n- {kind: branches}\n"
    )
    result = cf.run_study(write(text), tmp_path / "out")
    names = ("diagram.png", "diagram.svg", "moves.pdf", "branches.png")
    figures = [result.out / name for name in names]
    starts = [path.read_bytes()[:5] for path in figures]
    assert starts == [b"\x89PNG\r", b"<?xml", b"%PDF-", b"\x89PNG\r"]
    assert {p.name for p in figures} < {p.name for p in result.files}
    assert "figures" in result.info["timings"]


def test_default_folder_is_the_name(tmp_path, write, monkeypatch) -> None:
    path = write(HEAD, "my-scene.yaml")
    monkeypatch.chdir(tmp_path)
    assert cf.run_study(path).out == Path("my-scene")
    assert (tmp_path / "my-scene" / "run.json").is_file()


# ------------------------------------------------------------------------------- nothing is lost


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_results_are_not_overwritten(tmp_path, write) -> None:
    path, out = write(HEAD), tmp_path / "out"
    cf.run_study(path, out)
    before = contents(out)
    started = counts()
    with pytest.raises(cf.ResultFileError, match=r"holds results .*run\.json.*another.*--force"):
        cf.run_study(path, out)
    assert contents(out) == before
    assert counts() == started, "refused before anything is computed"


def test_a_single_file_in_the_way_is_enough(tmp_path, write) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine.png").write_text("precious")
    text = HEAD + "figures: [{kind: orbit, file: mine}]\n"
    with pytest.raises(cf.ResultFileError, match=r"holds results of an earlier run \(mine\.png\)"):
        cf.run_study(write(text), out)
    assert contents(out) == {"mine.png": b"precious"}
    (out / "mine.png").rename(out / "notes.txt")
    cf.run_study(write(text), out)
    assert contents(out)["notes.txt"] == b"precious"


def test_force_replaces_and_leaves_no_stale_file(tmp_path, write) -> None:
    out = tmp_path / "out"
    cf.run_study(write(HEAD + CONTINUE), out)
    (out / "notes.txt").write_text("mine")
    cf.run_study(write(HEAD), out, force=True)
    assert sorted(contents(out)) == ["notes.txt", "orbit.npz", "points.csv", "run.json"]


def test_a_failing_forced_run_keeps_the_earlier_results(tmp_path, write) -> None:
    out = tmp_path / "out"
    cf.run_study(write(HEAD), out)
    before = contents(out)
    with pytest.raises(cf.ConvergenceError):
        cf.run_study(write(HEAD + "start: {simulate: {periods: 2}}\n"), out, force=True)
    assert contents(out) == before


def test_aperiodic_start(tmp_path, write) -> None:
    text = "model: coulomb\nparams: {Omega: 0.35, S: 0.1, S0: 0.4}\n"
    text += "start: {simulate: {longest: 1000}}\n"
    with pytest.raises(cf.AperiodicError, match=r"is aperiodic: .*1000 periods\. Try .*signature"):
        cf.run_study(write(text), tmp_path / "out")
    assert not (tmp_path / "out").exists(), "an empty folder is not left behind"


def test_the_orbit_of_a_failed_run_is_saved(tmp_path, write, monkeypatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise cf.ConvergenceError("no tangent")

    monkeypatch.setattr("contfric.atlas.explore.explore", fail)
    for name in ("orbit-of-failed-run.npz", "orbit-of-failed-run-2.npz"):
        with pytest.raises(cf.ConvergenceError, match=rf"no tangent \(the orbit 1a .*{name}\)"):
            cf.run_study(write(HEAD + EXPLORE), tmp_path / "out")
        loaded = cf.load(tmp_path / "out" / name)
        assert isinstance(loaded, cf.Orbit)
        assert loaded.name == "1a"


def test_a_task_that_fails_costs_nothing_but_itself(tmp_path, write) -> None:
    """What was found before it is written, and the tasks after it are computed."""
    hold = "hold: {quantity: x_max, value: 99, parameters: [Omega, S], "
    hold += "range: {Omega: [0.49, 0.51], S: [0.31, 0.33]}}\n"
    others = "sweep: {parameter: Omega, values: [0.49, 0.51, 3], periods: 20}\n"
    others += "fit: {free: [S], data: [{quantity: x_max, value: 1.42, sigma: 0.01}]}\n"
    text = HEAD + "continue: {parameter: Omega, range: [0.49, 0.51]}\n" + others + hold
    out = tmp_path / "out"
    with pytest.raises(
        cf.ConvergenceError, match=r"^hold: no orbit .* \(all else is written to .*out\)"
    ):
        cf.run_study(write(text), out)
    assert {"points.csv", "sweep.npz", "fit.npz", "orbit.npz"} <= set(contents(out))
    record = json.loads((out / "run.json").read_text())
    assert record["status"] == "some tasks failed" and "x_max = 99" in record["failures"][0]
    assert "sweep" in record and "hold" not in record
    fine = cf.run_study(write(text.replace("99", "1.43")), out, force=True)
    assert fine.status is RunStatus.DONE and not list(out.glob("*of-failed-run*"))


def interrupt_at(itinerary: str):
    def progress(text: str) -> None:
        if itinerary in text:
            raise KeyboardInterrupt

    return progress


def test_interrupted_exploration_is_saved(tmp_path, write) -> None:
    result = cf.run_study(
        write(HEAD + EXPLORE + ALL), tmp_path / "out", progress=interrupt_at("branch 2")
    )
    assert result.status is RunStatus.INTERRUPTED
    assert result.diagram is not None
    assert not result.diagram.complete
    loaded = cf.load(result.out / "diagram.npz")
    assert isinstance(loaded, cf.Diagram)
    assert [b.name for b in loaded.branches] == [b.name for b in result.diagram.branches]
    record = json.loads((result.out / "run.json").read_text())
    assert (record["status"], record["complete"]) == ("interrupted", False)


def test_interrupted_before_the_first_branch(tmp_path, write) -> None:
    result = cf.run_study(
        write(HEAD + EXPLORE), tmp_path / "out", progress=interrupt_at("points, Omega")
    )
    assert result.status is RunStatus.INTERRUPTED
    assert [p.name for p in result.files] == ["orbit.npz", "run.json"]


def test_interrupted_branch_is_saved(tmp_path, write, monkeypatch) -> None:
    whole = cf.continue_orbit(cf.find_orbit("coulomb", {}), "Omega", (0.45, 0.56))
    partial = dataclasses.replace(whole, ends=(whole.ends[0], End(EndReason.INTERRUPTED)))
    monkeypatch.setattr("contfric.continuation.trace.continue_orbit", lambda *_, **__: partial)
    result = cf.run_study(write(HEAD + CONTINUE), tmp_path / "out")
    assert result.status is RunStatus.INTERRUPTED
    loaded = cf.load(result.out / "branch.npz")
    assert isinstance(loaded, cf.Branch)
    assert loaded.ends[1].reason is EndReason.INTERRUPTED


def test_interrupted_checks_of_a_diagram_keep_it(tmp_path, write) -> None:
    # a restart that was cut was compared as if it were whole, and the next one began
    text = HEAD + "explore: {parameter: Omega, range: [0.49, 0.52], verify: true}\n" + ALL
    result = cf.run_study(
        write(text), tmp_path / "out", progress=interrupt_at("explored again from its own")
    )
    assert result.status is RunStatus.INTERRUPTED
    assert result.diagram is not None
    assert isinstance(cf.load(result.out / "diagram.npz"), cf.Diagram)
    again = cf.run_study(write(text), tmp_path / "out")
    assert again.status is RunStatus.DONE
    assert again.diagram is not None and again.diagram.complete and again.diagram.verified
    assert len(again.diagram.branches) == len(result.diagram.branches)


@pytest.mark.parametrize("task", [EXPLORE, CONTINUE])
def test_interrupted_before_the_orbit(tmp_path, write, task) -> None:
    result = cf.run_study(write(HEAD + task), tmp_path / "out", progress=interrupt_at("simulating"))
    assert (result.status, result.files) == (RunStatus.INTERRUPTED, ())
    assert not (tmp_path / "out").exists()


def test_interrupted_while_writing(tmp_path, write, monkeypatch) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("contfric.study.tasks.one_parameter.points", interrupt)
    result = cf.run_study(write(HEAD + CONTINUE), tmp_path / "out")
    assert result.status is RunStatus.INTERRUPTED
    assert sorted(contents(result.out)) == [
        "bifurcations.csv",
        "branch.npz",
        "checkpoint",
        "orbit.npz",
        "run.json",
    ]


def test_a_full_disk_loses_no_result(tmp_path, write, monkeypatch) -> None:
    from contfric.base import files

    synced: list[int] = []

    def full(descriptor: int) -> None:
        synced.append(descriptor)
        if len(synced) == 1:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full)
    with pytest.raises(UnwrittenError) as caught:
        cf.run_study(write(HEAD + CONTINUE), tmp_path / "out")
    message = str(caught.value)
    assert "cannot write" in message
    assert "points.csv: No space left on device; free some space" in message
    assert "bifurcations.csv, orbit.npz, branch.npz" in message
    result = caught.value.result
    assert result.branch is not None
    assert np.all(np.isfinite(result.branch.values))
    assert sorted(contents(result.out)) == [
        "bifurcations.csv",
        "branch.npz",
        "checkpoint",
        "orbit.npz",
        "run.json",
    ]
    assert json.loads((result.out / "run.json").read_text())["status"] == RunStatus.UNWRITTEN.value


def test_an_unwritable_folder_is_found_before_anything_is_computed(tmp_path, write) -> None:
    (tmp_path / "file").write_text("")
    before = counts()
    with pytest.raises(cf.ResultFileError, match="a file stands where a folder should be"):
        cf.run_study(write(HEAD), tmp_path / "file")
    with pytest.raises(cf.ResultFileError, match="a file stands where a folder should be"):
        cf.run_study(write(HEAD), tmp_path / "file" / "out")
    assert counts() == before


def test_a_read_only_disk(tmp_path, write, monkeypatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(cf.ResultFileError, match="Read-only file system; the folder is read-only"):
        cf.run_study(write(HEAD), tmp_path / "out")


def test_force_removes_the_figures_of_another_study(tmp_path: Path) -> None:
    """What lies in the folder afterwards is of this run, not of the one that it replaces."""
    text = "title: {0}\nmodel: coulomb\nparams: {{Omega: 0.5, S: 0.32, S0: 0.4}}\nstart: simulate\n"
    drawn, plain = tmp_path / "drawn.yaml", tmp_path / "plain.yaml"
    drawn.write_text(text.format("drawn") + "figures: [{kind: orbit, file: own.png}]\n")
    plain.write_text(text.format("plain"))
    out = tmp_path / "out"
    cf.run_study(drawn, out)
    assert (out / "own.png").is_file()
    cf.run_study(plain, out, force=True)
    assert not (out / "own.png").exists()


#: Tasks that do not use the default of S, which is above the S0 of the study.
DRAWN = "ensemble: {parameter: Omega, range: [0.5, 0.52], samples: 1, distributions: "
REPLACING = {
    "sweep": "sweep: {parameter: S, values: [0.1, 0.2, 3], periods: 5, transient: 5}",
    "lyapunov": "lyapunov: {grid: {Omega: [0.3, 0.4, 2], S: [0.1, 0.2, 2]}, periods: 20}",
    "ensemble": DRAWN + "{S: [0.1, 0.12]}}",
    "normal": DRAWN + "{S: {norm: [0.1, 0.01]}}}",
}
#: Tasks that use it.
USING = (
    "continue: {parameter: Omega, range: [0.4, 0.6]}",
    "basins: {grid: {x: [0, 1, 2], v: [0, 1, 2]}}",
)


@pytest.mark.parametrize("task", REPLACING.values(), ids=REPLACING)
def test_a_default_that_no_task_uses_contradicts_nothing(task: str, tmp_path: Path) -> None:
    path, words = tmp_path / "study.yaml", r"study.yaml:3: model 'coulomb' needs S0 >= S"
    text = f"title: t\nmodel: coulomb\nparams: {{Omega: 0.5, S0: 0.25}}\n{task}\n"
    path.write_text(text)
    assert cf.run_study(path, out=tmp_path / "run").status is RunStatus.DONE
    for other in (*(f"{text}{use}\n" for use in USING), text.replace("0.25}", "0.25, S: 0.3}")):
        path.write_text(other)
        with pytest.raises(cf.ContfricError, match=words):
            read_study(path)
