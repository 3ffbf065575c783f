"""The command line: data to stdout, one line for each mistake, and what the exit codes say."""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import contfric as cf
from contfric.cli import main
from contfric.cli.exits import Exit

HEAD = "model: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\n"
EXPLORE = "explore: {parameter: Omega, range: [0.45, 0.56]}\n"


@pytest.fixture
def study(write):
    return lambda *given: str(write(*given))


def command(*args: object, cwd: Path | None = None, before: str = "") -> subprocess.Popen[str]:
    """Start the command line in a process of its own, after some Python code."""
    code = f"import sys\n{before}\nfrom contfric.cli import main\nsys.exit(main(sys.argv[1:]))"
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, args)],
        cwd=cwd,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finish(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    out, err = process.communicate(timeout=300)
    return process.returncode, out, err


# ---------------------------------------------------------------------------------- run, info


def test_run_and_info(study, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    path = study("title: A scene\n" + HEAD + EXPLORE + "want: [stability]\n")
    assert main(["run", path, "--out", str(out)]) == Exit.DONE
    printed = capsys.readouterr()
    assert printed.err == "", "stderr is no terminal: no progress"
    for text in ("scene: A scene", "1a and mirror", "SN_1a", "0.541912816945", "loose ends"):
        assert text in printed.out
    assert f"written to {out}: points.csv, bifurcations.csv" in printed.out
    assert "(bridge) and mirror" in printed.out
    assert "proposed" not in printed.out, "what was proposed is for those who ask for it"
    assert main(["info", str(out)]) == Exit.DONE
    shown = capsys.readouterr().out
    assert "(bridge) and mirror" in shown
    assert "what was proposed to follow the events\n  SS_a at Omega = 0.4917488139\n" in shown
    assert "accepted as branch 3: hold at stop" in shown
    for text in ("scene: A scene", "1a and mirror", "SN_1a", "0.541912816945", "loose ends"):
        assert text in shown
    for text in ("newton solves", "multiplier evaluations", "matplotlib: no figures", "run.json"):
        assert text in shown


def test_run_prints_json(study, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    assert main(["run", study(HEAD), "--out", str(out), "--json"]) == Exit.DONE
    printed = capsys.readouterr().out
    assert json.loads(printed) == json.loads((out / "run.json").read_text())


def test_quiet_run_prints_nothing(study, tmp_path, capsys) -> None:
    assert main(["run", study(HEAD), "--out", str(tmp_path / "out"), "--quiet"]) == Exit.DONE
    assert capsys.readouterr() == ("", "")


def test_progress_goes_to_a_terminal(study, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("contfric.cli.progress._INTERVAL", 0.0)
    assert main(["run", study(HEAD), "--out", str(tmp_path / "out")]) == Exit.DONE
    progress = capsys.readouterr().err
    assert " s  orbit: simulating" in progress
    assert progress.endswith("\r\x1b[K"), "the line is cleared at the end"


def test_fig05_from_an_empty_folder(tmp_path) -> None:
    """The files that are asked for, and the figures of the library, bit for bit."""
    code, out, err = finish(command("run", "fig05", cwd=tmp_path))
    assert (code, err) == (0, "")
    files = {p.name for p in (tmp_path / "fig05").iterdir()}
    assert files == {
        *("points.csv", "bifurcations.csv", "orbit.npz", "diagram.npz", "run.json"),
        *("diagram.png", "orbit.png"),
    }
    for name in ("1a and mirror", "2a and mirror", "2s", "0s"):
        assert name in out
    cf.run_study("fig05", tmp_path / "library")
    for name in ("diagram.png", "orbit.png"):
        drawn = [(tmp_path / which / name).read_bytes() for which in ("fig05", "library")]
        assert drawn[0] == drawn[1]


# ----------------------------------------------------------------------------------- bad input


def one_line(capsys) -> str:
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("contfric: error: ")
    assert printed.err.count("\n") == 1, printed.err
    return printed.err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("modell: coulomb\n", ":1: unknown key 'modell'; did you mean 'model'"),
        (HEAD + "range: [0.4, 0.6]\n", ":3: unknown key 'range' here: it belongs into explore, "),
        (HEAD + "seeds: {values: 3}\n", ":3: unknown key 'seeds' here: it belongs into explore"),
        (
            HEAD + "sweep: {parameter: Omega, range: [0.4, 0.6]}\n",
            ":3: unknown key 'range'; key 'values' is missing: [low, high, number of values]",
        ),
        (
            HEAD + "explore: {parameter: Omega, values: [0.4, 0.6]}\n",
            ":3: unknown key 'values'; key 'range' is missing: two finite numbers [low, high]",
        ),
        ("model: colomb\n", ":1: unknown model 'colomb'; did you mean 'coulomb'"),
        ("model: coulomb\nparams: {S: 0.5}\n", ":2: model 'coulomb' needs S0 >= S"),
        ("model: coulomb\nparams: {Omega: 0}\n", ":2: model 'coulomb' needs Omega > 0"),
        ("model: coulomb\nparams: {S: .nan}\n", ":2: parameter 'S' must be a finite number"),
        ("model: coulomb\nparams: {S: low}\n", ":2: parameter 'S' must be a finite number"),
        (HEAD + "explore: {parameter: Omega, range: [0.6, 0.4]}\n", ":3: the range [0.6, 0.4] is"),
        (HEAD + "explore: {parameter: Omega, range: [0.5, 0.5]}\n", ":3: the range [0.5, 0.5] is"),
        ("model: [\n", ":2: not valid YAML"),
        ("name: gap\nstates: [x, v]\n", ":2: this is a model, not a study"),
        (
            "model: coulomb\nparams:\n\tS: 0.3\n",
            ":3: not valid YAML: found character '\\t' that cannot start any token, a tab: indent",
        ),
    ],
)
@pytest.mark.parametrize("name", ["run", "explain"])
def test_bad_study(study, tmp_path, capsys, monkeypatch, name, text, message) -> None:
    monkeypatch.chdir(tmp_path)
    path = study(text)
    assert main([name, path]) == Exit.BAD_INPUT
    assert f"{path}{message}" in one_line(capsys)
    assert [p.name for p in tmp_path.iterdir()] == ["scene.yaml"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "fig5"], "unknown study 'fig5'; did you mean 'fig05'"),
        (["explain", "none.yaml"], "there is no file none.yaml"),
        (["run", "."], ". is a folder: give the YAML file in it"),
        (["run", "run.txt"], "A file needs the suffix .yaml or .yml"),
        (["rnu", "fig05"], "unknown command 'rnu'; did you mean 'run'"),
        (["run"], "required: STUDY (see: contfric run --help)"),
        (
            ["run", "fig05", "--ouf", "x"],
            "unrecognized arguments: --ouf x (see: contfric run --help)",
        ),
        (["census", "--modle", "belt"], "arguments: --modle (see: contfric census --help)"),
        (["check"], "check takes one model: contfric check MODEL, or --model MODEL"),
        (["check", "belt", "--model", "belt"], "check takes one model"),
        (["graph", "--model", "colomb"], "unknown model 'colomb'; did you mean 'coulomb'"),
        (["graph", "--out", "a.jpg"], "cannot draw to 'a.jpg': its ending is not one of .png"),
        (["signatures", "show", "1s"], "unknown signature '1s'"),
        (["signatures", "shwo"], "invalid choice"),
        (["simulate", "-p", "Omega"], "-p takes NAME=VALUE, such as -p Omega=0.5; got 'Omega'"),
        (["simulate", "-p", "Omga=1"], "no parameter 'Omga'; did you mean 'Omega'"),
        (["simulate", "-p", "Omega=fast"], "parameter 'Omega' must be a number, got 'fast'"),
        (["simulate", "-p", "Omega=nan"], "parameter 'Omega' must be finite, got nan"),
        (["simulate", "-p", "Omega=0"], "needs Omega > 0"),
        (["simulate", "-p", "S=0.5"], "needs S0 >= S"),
        (["simulate", "--state", "1"], "a state of 'coulomb' is 2 finite numbers (x, v)"),
        (["simulate", "--state", "1,b"], "--state: each part must be a number, got 'b'"),
        (["simulate", "--domain", "stik"], "unknown domain 'stik'; did you mean 'stick'"),
        (["simulate", "--periods", "many"], "argument --periods: invalid number value: 'many'"),
        (["simulate", "--events", "0"], "--events: invalid whole number >= 1 value: '0'"),
        (["info", "nowhere"], "nowhere is not the folder of a run: cannot read nowhere/run.json"),
    ],
)
def test_bad_arguments(capsys, tmp_path, monkeypatch, arguments, message) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == Exit.BAD_INPUT
    assert message in one_line(capsys)


def test_no_command(capsys) -> None:
    assert main([]) == Exit.BAD_INPUT
    assert "COMMAND" in one_line(capsys)


def test_debug_shows_the_traceback(capsys) -> None:
    for arguments in (["--debug", "explain", "fig5"], ["explain", "fig5", "--debug"]):
        with pytest.raises(Exception, match="unknown study"):
            main(arguments)


def test_an_internal_error_says_so(capsys, monkeypatch) -> None:
    def fail(_: object) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("contfric.study.plan.make_plan", fail)
    assert main(["explain", "fig05"]) == Exit.FAILED
    assert "internal error, ZeroDivisionError: division by zero" in one_line(capsys)


def test_an_aperiodic_start_fails_with_advice(study, tmp_path, capsys) -> None:
    path = study("model: coulomb\nparams: {Omega: 0.35, S: 0.1, S0: 0.4}\n")
    assert main(["run", path, "--out", str(tmp_path / "out")]) == Exit.FAILED
    message = one_line(capsys)
    assert "aperiodic: no period from 1 to 64" in message
    assert "start from a signature" in message


def test_results_are_not_overwritten(study, tmp_path, capsys) -> None:
    out, path = str(tmp_path / "out"), study(HEAD)
    assert main(["run", path, "--out", out, "--quiet"]) == Exit.DONE
    assert main(["run", path, "--out", out]) == Exit.BAD_INPUT
    assert "holds results of an earlier run (run.json, points.csv, orbit.npz)" in one_line(capsys)
    assert main(["run", path, "--out", out, "--quiet", "--force"]) == Exit.DONE


def test_info_finds_damage(study, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    assert main(["run", study(HEAD + EXPLORE), "--out", str(out), "--quiet"]) == Exit.DONE
    content = (out / "diagram.npz").read_bytes()
    (out / "diagram.npz").write_bytes(content[: len(content) // 2])
    assert main(["info", str(out)]) == Exit.BAD_INPUT
    assert "diagram.npz is damaged or incomplete" in capsys.readouterr().err
    (out / "diagram.npz").unlink()
    assert main(["info", str(out)]) == Exit.BAD_INPUT
    assert "diagram.npz is missing: run the study again" in capsys.readouterr().err
    (out / "run.json").write_text('{"name": "sce')
    assert main(["info", str(out)]) == Exit.BAD_INPUT
    assert "run.json is damaged" in one_line(capsys)


# ------------------------------------------------------------- interrupted, full, cut off

_INTERRUPT = """
import signal
from contfric.cli.progress import ProgressLine
def show(self, text):
    if {itinerary!r} in text:
        signal.raise_signal(signal.SIGINT)
ProgressLine.show = show
"""


def test_interrupted_run_is_saved_and_says_so(study, tmp_path) -> None:
    out = tmp_path / "out"
    before = _INTERRUPT.format(itinerary="branch 2")
    path = study(HEAD + EXPLORE)
    code, printed, err = finish(command("run", path, "--out", out, "--json", before=before))
    assert code == Exit.INTERRUPTED
    assert err.startswith("contfric: interrupted: what was found until then (")
    assert err.endswith(f"is saved in {out}; the same command goes on from there\n")
    assert json.loads(printed)["status"] == "interrupted"
    assert (out / "diagram.npz").is_file()
    assert main(["info", str(out)]) == Exit.DONE


def test_interrupted_before_anything_was_found(study, tmp_path) -> None:
    before = _INTERRUPT.format(itinerary="simulating")
    path = study(HEAD + EXPLORE)
    code, printed, err = finish(command("run", path, "--out", tmp_path / "out", before=before))
    assert (code, printed) == (Exit.INTERRUPTED, "")
    assert err == "contfric: interrupted before an orbit was found: there is nothing to save\n"


@pytest.mark.skipif(sys.platform == "win32", reason="no limits on the size of files")
def test_a_full_disk(study, tmp_path) -> None:
    out = tmp_path / "out"
    before = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (16_000, 16_000))"
    path = study(HEAD + EXPLORE + "want: [extrema, stops]\n")
    # numba's cache could not be written either: fill it first
    assert main(["run", path, "--out", str(tmp_path / "warm")]) == Exit.DONE
    code, _, err = finish(command("run", path, "--out", out, before=before))
    assert code == Exit.FAILED, err
    assert err.count("\n") == 1
    assert "points.csv: File too large; free some space" in err
    assert "diagram.npz: File too large" in err
    assert f"(written to {out}: bifurcations.csv, orbit.npz, run.json)" in err
    left = {p.name for p in out.iterdir()}
    assert left == {"bifurcations.csv", "checkpoint", "orbit.npz", "run.json"}


def test_a_folder_that_cannot_be_made(study, tmp_path, capsys) -> None:
    (tmp_path / "file").write_text("")
    out = str(tmp_path / "file" / "out")
    assert main(["run", study(HEAD), "--out", out]) == Exit.FAILED
    assert "a file stands where a folder should be" in one_line(capsys)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_stdout_on_a_full_disk() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "contfric", "explain", "fig05"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode != 0
    assert "No space left on device" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="pipes close differently")
def test_a_reader_that_goes_away_is_no_error() -> None:
    with command("simulate", "--periods", "20000") as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == ""
        assert process.wait(timeout=300) == Exit.BROKEN_PIPE


# ---------------------------------------------------------------------- the other commands


def test_explain_imports_nothing_heavy() -> None:
    before = (
        "import atexit\nheavy = ('numba', 'matplotlib', 'networkx', 'scipy', "
        "'pandas')\natexit.register(lambda: print(*[m for m in heavy if m in sys.modules], file=sys.stderr))"
    )
    code, out, err = finish(command("explain", "fig05", before=before))
    assert (code, err.split()) == (0, [])
    assert "1. orbit: simulate until" in out


def test_a_run_loads_what_its_study_asks_for(study, tmp_path: Path) -> None:
    before = (
        "import atexit\nother = ('matplotlib', 'concurrent.futures.process', 'contfric.chaos.map',\n  "
        "'contfric.ensembles.ensemble', 'contfric.equilibria.explore', 'contfric.fitting.result',\n  "
        "'contfric.response.sweep', 'contfric.curves.curve')\natexit.register(lambda: print(*[m for m in "
        "other if m in sys.modules], file=sys.stderr))"
    )
    options = ("run", study(HEAD + EXPLORE), "--out", tmp_path / "out", "--quiet")
    code, _, err = finish(command(*options, before=before))
    assert (code, err.split()) == (0, [])


def test_help_is_light() -> None:
    before = (
        "import atexit\natexit.register(lambda: print('numpy' in sys.modules, file=sys.stderr))"
    )
    code, out, err = finish(command("--help", before=before))
    assert (code, err.strip()) == (0, "False")
    for name in ("run", "explain", "info", "signatures", "graph", "simulate"):
        assert name in out


def test_version(capsys) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code in (0, None)
    assert capsys.readouterr().out.startswith("contfric ")


def test_module_runs() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "contfric", "graph"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) == 14


def test_graph(capsys, tmp_path) -> None:
    assert main(["graph"]) == Exit.DONE
    lines = capsys.readouterr().out.splitlines()
    assert "stick -> x+v- (F+)" in lines
    out = tmp_path / "graph.png"
    assert main(["graph", "--out", str(out)]) == Exit.DONE
    printed = capsys.readouterr()
    assert (printed.out, printed.err) == ("", f"contfric: written to {out}\n")
    assert out.read_bytes().startswith(b"\x89PNG")


def test_signatures_list(capsys) -> None:
    assert main(["signatures", "list"]) == Exit.DONE
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [
        *("name", "0s", "1a", "1a-9seg", "2a", "2a-14seg", "2s")
    ]
    assert main(["signatures"]) == Exit.BAD_INPUT


@pytest.mark.parametrize("name", ["0s", "1a", "1a-9seg", "2a", "2a-14seg", "2s"])
def test_signatures_show_prints_a_file(capsys, tmp_path, name) -> None:
    from contfric.signature import load_signature

    assert main(["signatures", "show", name]) == Exit.DONE
    path = tmp_path / "copy.yaml"
    path.write_text(capsys.readouterr().out)
    copy, original = load_signature(path), load_signature(name)
    assert copy == original
    assert (copy.name, copy.symmetric) == (original.name, original.symmetric)
    assert copy.example == original.example


def test_signatures_check(capsys, study) -> None:
    good = study("name: a\nmodel: coulomb\nsegments: x0v+ -> stick -> x-v+\n", "good.yaml")
    stray = study("name: a\nmodel: coulomb\nsegments: [x0v+, stik]\n", "stray.yaml")
    open_ = study("name: a\nmodel: coulomb\nsegments: x0v+ -> stick -> x+v-\n", "open.yaml")
    assert main(["signatures", "check", good]) == Exit.DONE
    assert capsys.readouterr().out == f"{good}: a, 3 segments: fine\n"
    assert main(["signatures", "check", stray, good, open_]) == Exit.BAD_INPUT
    printed = capsys.readouterr()
    assert printed.out == f"{good}: a, 3 segments: fine\n"
    first, second = printed.err.splitlines()
    assert f"{stray}:3: segment 2: model 'coulomb' has no domain 'stik'; did you mean" in first
    assert f"{open_}:3: the walk is not closed" in second
    assert "After x+v- can come: " in second


def test_simulate_prints_csv(capsys) -> None:
    arguments = ["simulate", "-p", "Omega=0.5", "-p", "S=0.32", "--state", "-1.3,0", "--periods"]
    assert main([*arguments, "20"]) == Exit.DONE
    printed = capsys.readouterr()
    rows = list(csv.DictReader(io.StringIO(printed.out)))
    assert list(rows[0]) == ["cycle", "phase", "x", "v", "mode", "surface"]
    assert {row["mode"] for row in rows} == {"slide+", "slide-", "stick"}
    assert printed.err == f"contfric: {len(rows)} events: the time asked for was reached\n"
    assert main([*arguments, "20", "--events", "5"]) == Exit.DONE
    printed = capsys.readouterr()
    assert list(csv.DictReader(io.StringIO(printed.out))) == rows[:5]
    assert "5 events: the number of events asked for was reached" in printed.err


def test_simulate_finds_what_the_motion_settles_on(capsys) -> None:
    assert main(["simulate", "--periods", "1", "--find"]) == Exit.DONE
    assert "converges to 1a over 1 period: " in capsys.readouterr().err
    code = main(["simulate", "-p", "Omega=0.35", "-p", "S=0.1", "--periods", "1", "--find"])
    assert code == Exit.FAILED
    printed = capsys.readouterr()
    assert printed.out.startswith("cycle,phase"), "the data come first"
    assert "is aperiodic" in printed.err


def test_environment_is_left_alone() -> None:
    before = dict(os.environ)
    main(["graph"])
    assert dict(os.environ) == before


def test_an_abbreviated_force_is_refused(tmp_path: Path) -> None:
    """``--forc`` must not overwrite results."""
    done = subprocess.run(
        [sys.executable, "-m", "contfric", "run", "fig05", "--out", str(tmp_path), "--forc"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "--forc" in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("want", ["", "want: [stability]\n", "want: [extrema]\n"])
def test_a_diagram_without_multipliers_says_what_it_may_miss(study, tmp_path, capsys, want) -> None:
    """The guide said so, and the terminal that there were no loose ends."""
    path = study(HEAD + "explore: {parameter: Omega, range: [0.49, 0.51]}\n" + want)
    assert main(["run", path, "--out", str(tmp_path / "out")]) == Exit.DONE
    out = capsys.readouterr().out
    assert ("PD and NS are not detected" in out) == ("stability" not in want)
    assert "branches" in out and "scenario" in out
