"""Studies that ask for Lyapunov exponents: what is accepted, computed, written, and resumed."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.study import make_plan, read_study
from contfric.study.result import RunStatus

HEAD = "model: coulomb\nparams: {S0: 0.4}\n"
GRID = "lyapunov: {grid: {Omega: [0.3, 0.5, 5], S: [0.05, 0.3, 4]}, periods: 100}\n"


@pytest.mark.parametrize(
    ("grid", "line", "message"),
    [
        ("{grid: {Omega: [0.3, 0.5, 5]}}", 3, "two parameters"),
        ("{grid: {Omga: [0.3, 0.5, 5], S: [0, 1, 2]}}", 3, "did you mean 'Omega'"),
        ("\n  grid:\n    Omega: [0.3, 0.5, 5]\n    S: [0.3, 0.1, 4]", 6, "low < high"),
        ("\n  grid:\n    Omega: [0.3, 0.5, 5.5]\n    S: [0.1, 0.3, 4]", 5, "whole number"),
        ("{grid: {Omega: [0.3, 0.5, 5], S: [0, 1, 2]}, state: [1]}", 3, "2 numbers"),
        ("{grid: {Omega: [0.3, 0.5, 5], S: [0, 1, 2]}, peroids: 5}", 3, "did you mean 'periods'"),
    ],
)
def test_bad_grid(write, grid: str, line: int, message: str) -> None:
    path = write(f"{HEAD}lyapunov: {grid}\n")
    with pytest.raises(cf.StudyError, match=f"scene.yaml:{line}: .*{message}"):
        read_study(path)


def test_a_figure_of_the_map_needs_the_map(write) -> None:
    path = write(f"{HEAD}figures: [{{kind: lyapunov}}]\n")
    with pytest.raises(cf.StudyError, match=r"scene.yaml:3: .* needs 'lyapunov'"):
        read_study(path)


def test_a_map_alone(write, tmp_path: Path) -> None:
    path = write(HEAD + GRID + "figures: [{kind: lyapunov}]\n")
    result = cf.run_study(path, tmp_path / "out")
    assert result.orbit is None and result.diagram is None and result.status is RunStatus.DONE
    grid = {"Omega": np.linspace(0.3, 0.5, 5), "S": np.linspace(0.05, 0.3, 4)}
    direct = cf.lyapunov_map("coulomb", grid, {"S0": 0.4}, periods=100)
    assert result.lyapunov is not None
    assert np.array_equal(result.lyapunov.exponents, direct.exponents, equal_nan=True)
    names = {file.name for file in result.files}
    assert names == {"lyapunov.csv", "lyapunov.npz", "lyapunov.png", "run.json"}
    assert not (tmp_path / "out" / "checkpoint").exists()
    loaded = cf.load(tmp_path / "out" / "lyapunov.npz")
    assert np.array_equal(loaded.exponents, direct.exponents, equal_nan=True)
    with (tmp_path / "out" / "lyapunov.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 20
    assert float(rows[7]["Omega"]) == grid["Omega"][1] and float(rows[7]["S"]) == grid["S"][3]
    assert float(rows[7]["exponent_1"]) == direct.exponents[1, 3, 0, 0]
    assert sum(result.info["lyapunov"]["motions"].values()) == 20
    assert "start" not in result.info
    assert "the orbit of the start: nothing asks for it" in str(make_plan(result.study))


def test_a_map_alone_loads_no_continuation(write, tmp_path: Path) -> None:
    path = write(HEAD + GRID)
    code = (
        "import sys, contfric as cf\ncf.run_study(sys.argv[1], sys.argv[2])\nprint([m for m in "
        "('contfric.continuation.core.march', 'contfric.atlas.explore', 'matplotlib') if m in sys.modules])"
    )
    arguments = [sys.executable, "-c", code, str(path), str(tmp_path / "out")]
    done = subprocess.run(arguments, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_map_beside_a_diagram(write, tmp_path: Path) -> None:
    text = (
        HEAD.replace("S0", "S: 0.32, S0") + GRID + "explore: {parameter: S, range: [0.3, 0.33]}\n"
    )
    result = cf.run_study(write(text), tmp_path / "out")
    assert result.orbit is not None and result.diagram is not None and result.lyapunov is not None
    assert {"lyapunov", "start", "branches"} <= set(result.info)


def test_a_killed_run_goes_on(write, tmp_path: Path) -> None:
    path = write(HEAD + GRID.replace("5]", "40]"))
    out = tmp_path / "out"

    def kill(text: str) -> None:
        if "% " in text or "%," in text:  # a tile is finished
            raise KeyboardInterrupt

    first = cf.run_study(path, out, progress=kill)
    assert first.status is RunStatus.INTERRUPTED
    assert first.lyapunov is not None and not first.lyapunov.complete
    assert (out / "checkpoint").exists()
    said: list[str] = []
    second = cf.run_study(path, out, force=True, progress=said.append)
    assert second.status is RunStatus.DONE and not (out / "checkpoint").exists()
    assert any("in" in text and "already" in text for text in said)
    direct = cf.lyapunov_map("coulomb", second.lyapunov.axes, {"S0": 0.4}, periods=100)
    assert np.array_equal(second.lyapunov.exponents, direct.exponents, equal_nan=True)
