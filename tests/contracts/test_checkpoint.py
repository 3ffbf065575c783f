"""A run that is killed at any moment goes on with the same command, and ends with the same files."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.cli import main
from contfric.cli.exits import Exit
from contfric.continuation.points import Point
from contfric.events.bifurcation import Decision
from contfric.remember import journal
from contfric.remember.journal import Journal, keeping, remembered
from contfric.remember.stored import _MOVED, Reader, UnstorableError, Writer, _class
from contfric.study import checkpoint

HEAD = "model: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\n"
EXPLORE = (
    HEAD + "explore: {parameter: Omega, range: [0.4, 0.6]}\nwant: [extrema, stops, stability]\n"
)
PLANE = (
    HEAD + "plane: {parameters: [Omega, S], range: {Omega: [0.52, 0.56], S: [0.3, 0.39]}, "
    "max_sections: 1}\n"
)
MAP = HEAD + "lyapunov: {grid: {Omega: [0.3, 0.6, 24], S: [0.2, 0.3, 16]}, periods: 60}\n"


def killed(folder: Path, rounds: int, seed: int, *command: str) -> dict[str, list[int]]:
    script = Path(__file__).parent / "killed.py"
    arguments = [sys.executable, script, folder, str(rounds), str(seed), *command]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    report: dict[str, list[int]] = json.loads(done.stdout)
    return report


needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")


@needs_fork
@pytest.mark.parametrize(
    ("text", "rounds"),
    [
        pytest.param(EXPLORE, 4, id="explore"),
        pytest.param(PLANE, 4, id="plane", marks=pytest.mark.slow),
        pytest.param(MAP, 3, id="map", marks=pytest.mark.slow),
    ],
)
def test_a_killed_run_ends_with_the_files_of_an_undisturbed_one(tmp_path, text, rounds) -> None:
    study = tmp_path / "study.yaml"
    study.write_text(text)
    report = killed(tmp_path, rounds, len(text), "run", str(study), "--quiet")
    assert report["codes"][0] == report["codes"][-1] == Exit.DONE
    assert all(code in (-9, -15) for code in report["codes"][1:-1])
    assert len(report["codes"]) > 2, "a run was killed"
    assert max(report["sizes"]) > 0, "and left a checkpoint"
    whole, out = tmp_path / "whole" / "run", tmp_path / "out" / "run"
    names = sorted(p.name for p in whole.iterdir())
    assert sorted(p.name for p in out.iterdir()) == names
    for name in names:
        if name != "run.json":
            assert (whole / name).read_bytes() == (out / name).read_bytes(), name
    records = [json.loads((folder / "run.json").read_text()) for folder in (whole, out)]
    for record in records:  # of the process, not of what was found
        for key in ("date", "timings", "counts", "modules", "module_count"):
            del record[key]
    assert records[0] == records[1]


@pytest.mark.slow
@needs_fork
def test_a_killed_census_goes_on(tmp_path) -> None:
    command = ["census", "-p", "Omega=0.5", "-p", "S=0.32", "--stops", "4", "--json", "--quiet"]
    report = killed(tmp_path, 4, 3, *command)
    assert report["codes"][0] == report["codes"][-1] == Exit.DONE
    assert max(report["sizes"]) > 0
    out, whole = ((tmp_path / name / "stdout").read_text() for name in ("out", "whole"))
    assert out == whole
    assert not list((tmp_path / "checkpoints").iterdir()), "it is removed at the end"


# ------------------------------------------------------------------------------- from the shell


def write(tmp_path: Path, text: str) -> str:
    path = tmp_path / "study.yaml"
    path.write_text(text)
    return str(path)


def interrupt_at(itinerary: str):
    def progress(text: str) -> None:
        if itinerary in text:
            raise KeyboardInterrupt

    return progress


def test_an_interrupted_run_goes_on_without_force(tmp_path) -> None:
    path = write(tmp_path, EXPLORE)
    first = cf.run_study(path, tmp_path / "out", progress=interrupt_at("branch 3"))
    assert (first.goes_on, (tmp_path / "out" / "checkpoint").exists()) == (True, True)
    said: list[str] = []
    again = cf.run_study(path, tmp_path / "out", progress=said.append)
    assert any(text.startswith("goes on: ") for text in said)
    assert (again.status.value, again.goes_on) == ("done", False)
    assert not (tmp_path / "out" / "checkpoint").exists()
    whole = cf.run_study(path, tmp_path / "whole")
    for name in ("points.csv", "bifurcations.csv", "diagram.npz"):
        assert (again.out / name).read_bytes() == (whole.out / name).read_bytes()


def test_the_checkpoint_of_another_run_is_kept(tmp_path, capsys) -> None:
    path = write(tmp_path, EXPLORE)
    cf.run_study(path, tmp_path / "out", progress=interrupt_at("branch 3"))
    kept = (tmp_path / "out" / "checkpoint").read_bytes()
    write(tmp_path, EXPLORE.replace("0.4, 0.6", "0.4, 0.61"))
    command = ["run", path, "--out", str(tmp_path / "out"), "--quiet"]
    assert main(command) == Exit.BAD_INPUT
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "checkpoint of an unfinished run of another study" in error
    assert (tmp_path / "out" / "checkpoint").read_bytes() == kept
    assert main([*command, "--force"]) == Exit.DONE
    assert not (tmp_path / "out" / "checkpoint").exists()


def test_two_runs_do_not_share_a_folder(tmp_path) -> None:
    pytest.importorskip("fcntl")
    path = write(tmp_path, EXPLORE)

    def second(text: str) -> None:
        if "branch 2" in text:
            with pytest.raises(cf.ResultFileError, match="is in use: another run is writing"):
                cf.run_study(path, tmp_path / "out")
            raise KeyboardInterrupt

    assert cf.run_study(path, tmp_path / "out", progress=second).goes_on


def test_a_failed_run_leaves_no_checkpoint(tmp_path) -> None:
    path = write(tmp_path, HEAD + "start: {simulate: {periods: 2}}\n")
    with pytest.raises(cf.ConvergenceError):
        cf.run_study(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_census_without_a_folder_to_write_to_is_taken_all_the_same(tmp_path, monkeypatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(checkpoint, "user_cache", lambda: tmp_path / "file")
    assert main(["census", "-p", "Omega=0.55", "--stops", "1", "--quiet"]) == Exit.DONE


# ----------------------------------------------------------------------------------- the journal


@remembered()
def slow_square(x: np.ndarray, calls: list[int] | None = None) -> np.ndarray:
    CALLED.append(1)
    return x * x


CALLED: list[int] = []


@pytest.fixture(autouse=True)
def everything_is_worth_keeping(monkeypatch) -> None:
    monkeypatch.setattr(journal, "_WORTH", 0.0)
    CALLED.clear()


def squares(path: Path, key: str = "x") -> tuple[list[float], int]:
    """Return nine squares through a journal, and how many were computed."""
    CALLED.clear()
    kept = Journal(path, key)
    with keeping(kept):
        found = [float(slow_square(np.array([k, k + 0.1]))[1]) for k in range(9)]
    kept.close()
    return found, len(CALLED)


def test_a_journal_is_looked_up(tmp_path) -> None:
    path = tmp_path / "journal"
    found, count = squares(path)
    assert count == 9
    assert squares(path) == (found, 0)
    assert squares(path, "another program") == (found, 9)


@pytest.mark.parametrize("seed", range(12))
def test_a_torn_or_garbled_journal_loses_only_what_is_damaged(tmp_path, seed) -> None:
    path, rng = tmp_path / "journal", np.random.default_rng(seed)
    found, _ = squares(path)
    content = bytearray(path.read_bytes())
    if seed % 2:
        content = content[: int(rng.integers(0, len(content)))]
    else:
        content[int(rng.integers(0, len(content)))] ^= int(rng.integers(1, 256))
    path.write_bytes(content)
    again, count = squares(path)
    assert again == found
    assert count > 0
    assert squares(path) == (found, 0)


def test_what_is_no_data_is_computed_and_not_kept(tmp_path) -> None:
    kept = Journal(tmp_path / "journal", "x")
    with keeping(kept):
        slow_square(np.array([1.0]), [object()])  # type: ignore[list-item]
        slow_square(np.array([2.0]))
    assert len(kept) == 1


def test_an_orbit_is_stored_to_the_last_bit() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    branch = cf.continue_orbit(orbit, "Omega", (0.49, 0.51))
    inputs = Writer()
    inputs.bytes_of([orbit])
    content = Writer(inputs.objects).bytes_of((orbit, branch, [branch.ends, branch.ends]))
    same, again, ends = Reader(content, inputs.objects).value()
    assert same is orbit
    assert again.system is branch.system, "a system is built once"
    assert ends[0][0] is again.ends[0]
    for name in ("values", "joints", "arc", "labels", "turn_multipliers"):
        assert getattr(again, name).tobytes() == getattr(branch, name).tobytes()
    assert [b.params for b in again.bifurcations] == [b.params for b in branch.bifurcations]


VALUES = [
    *(None, True, 3, 10**30, 0.1, -0.0, float("inf"), "text", 1 + 2j, (1, (2.0, "x")), [], {}),
    *({1: "a", (2, "b"): [3]}, {"s", "t"}, frozenset([1, 2]), np.float64(0.1), np.int64(3)),
    *(
        cf.Kind.SN,
        cf.EndReason.CS,
        np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        np.empty((0, 3)),
    ),
]


@pytest.mark.parametrize("value", VALUES, ids=lambda v: f"{type(v).__name__}")
def test_plain_values_come_back(value) -> None:
    found = Reader(Writer().bytes_of(value)).value()
    assert type(found) is type(value)
    if isinstance(value, np.ndarray):
        assert found.flags.f_contiguous == value.flags.f_contiguous
        assert (found.dtype, found.shape) == (value.dtype, value.shape)
        assert found.tobytes() == value.tobytes()
    else:
        assert repr(found) == repr(value) or found == value


@pytest.mark.parametrize("odd", ["none", "shape", "order", "strides", "kind"])
def test_many_objects_of_one_class_come_back(odd: str) -> None:
    """Whether they are of one shape, and written as rows, or one of them differs."""
    draw = np.random.default_rng(4)

    def point() -> Point:
        states = draw.normal(size=(2, 3)), draw.normal(size=2)
        mu, none = draw.normal(size=2) + 1j * draw.normal(size=2), np.empty(0, dtype=np.int64)
        return Point(*states, *states, draw.normal(size=8), none, mu, draw.normal(), odd == "none")

    points = [point() for _ in range(30)]
    other = points[17]
    if odd == "shape":
        other.joints = np.ones((3, 3))
    elif odd == "order":
        other.joints = np.asfortranarray(other.joints)
    elif odd == "strides":
        other.tests = np.arange(16.0)[::2]
    elif odd == "kind":
        other.tests = np.arange(8)
    found, again = Reader(Writer().bytes_of([points, points[3]])).value()
    assert again is found[3] and len(found) == 30
    for a, b in zip(found, points, strict=True):
        for name in vars(b):
            one, two = np.asarray(getattr(a, name)), np.asarray(getattr(b, name))
            assert (one.dtype, one.shape, one.tobytes()) == (two.dtype, two.shape, two.tobytes())
            assert type(getattr(a, name)) is type(getattr(b, name))


@pytest.mark.parametrize(
    "node",
    [
        ["object", "os:environ"],
        ["object", "contfric.errors:did_you_mean"],
        ["made", "subprocess:Popen", "true"],
        ["named", "contfric.cli:main", []],
        ["error", "builtins:SystemExit", "x", None],
        ["value", 1],
    ],
)
def test_nothing_but_data_classes_of_the_package_is_made(node) -> None:
    tree = json.dumps(node).encode()
    with pytest.raises(UnstorableError):
        Reader(len(tree).to_bytes(8, "little") + tree).value()


@pytest.mark.parametrize(("then", "now"), sorted(_MOVED.items()))
def test_classes_of_modules_that_moved_are_found_by_their_earlier_paths(
    then: str, now: str
) -> None:
    here = [c for c in vars(import_module(now)).values() if getattr(c, "__module__", "") == now]
    kinds = [c for c in here if isinstance(c, type)]
    assert kinds
    for kind in kinds:
        assert _class(f"{then}:{kind.__qualname__}", object) is kind


@pytest.mark.parametrize(
    ("path", "known"),
    [
        ("contfric.continuation.events:Verdict", True),
        ("contfric.continuation.events:Decision", True),
        ("contfric.continuation.events:Nothing", False),
    ],
)
def test_what_was_written_under_an_earlier_name_of_a_class_is_read(path: str, known: bool) -> None:
    content = Writer().bytes_of(Decision.KNOWN)
    tree = content[8:].replace(b"contfric.events.bifurcation:Decision", path.encode())
    assert tree != content[8:]
    reader = Reader(len(tree).to_bytes(8, "little") + tree)
    if known:
        assert reader.value() is Decision.KNOWN
        return
    with pytest.raises(UnstorableError, match="another version of contfric"):
        reader.value()
