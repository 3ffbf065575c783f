"""The probe of ``make bench`` takes a run of the command line apart, and fails where the run does."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import contfric.study

PROBE = Path(__file__).parents[2] / "benchmarks" / "scene_probe.py"


def probe(study: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(PROBE), str(study), str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)


def test_calls_of_kernels_are_counted(tmp_path: Path) -> None:
    study = tmp_path / "study.yaml"
    text = contfric.study.study_path("fig05").read_text(encoding="utf-8")
    study.write_text(text.split("figures:")[0], encoding="utf-8")
    done = probe(study, tmp_path / "out")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["calls"]["march"] > 4  # a branch has two sides
    assert report["kernels"].keys() >= {"march.march", "newton.solve"}
    assert not report["modules"]["matplotlib"]


def test_a_run_that_fails_is_no_measurement(tmp_path: Path) -> None:
    study, out = tmp_path / "study.yaml", tmp_path / "out"
    study.write_text("model: coulomb\nstart: simulate\nparams: {Omga: 0.5}\n", encoding="utf-8")
    out.mkdir()
    (out / "run.json").write_text('{"timings": {}, "counts": {}, "skipped": []}', encoding="utf-8")
    done = probe(study, out)
    assert done.returncode != 0 and not done.stdout
    assert "Omga" in done.stderr
