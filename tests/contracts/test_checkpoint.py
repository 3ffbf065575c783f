"""A run that is killed at any moment goes on with the same command, and ends with the same files."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from contfric.cli.exits import Exit

HEAD = "model: coulomb\nparams: {Omega: 0.5, S: 0.32, S0: 0.4}\n"
EXPLORE = (
    HEAD + "explore: {parameter: Omega, range: [0.4, 0.6]}\nwant: [extrema, stops, stability]\n"
)
PLANE = (
    HEAD + "plane: {parameters: [Omega, S], range: {Omega: [0.52, 0.56], S: [0.3, 0.39]}, "
    "max_sections: 1}\n"
)
MAP = HEAD + "lyapunov: {grid: {Omega: [0.3, 0.6, 40], S: [0.2, 0.3, 20]}, periods: 60}\n"


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
    ("text", "rounds"), [(EXPLORE, 6), (PLANE, 4), (MAP, 3)], ids=["explore", "plane", "map"]
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


@needs_fork
def test_a_killed_census_goes_on(tmp_path) -> None:
    command = ["census", "-p", "Omega=0.5", "-p", "S=0.32", "--stops", "4", "--json", "--quiet"]
    report = killed(tmp_path, 4, 3, *command)
    assert report["codes"][0] == report["codes"][-1] == Exit.DONE
    assert max(report["sizes"]) > 0
    out, whole = ((tmp_path / name / "stdout").read_text() for name in ("out", "whole"))
    assert out == whole
    assert not list((tmp_path / "checkpoints").iterdir()), "it is removed at the end"
