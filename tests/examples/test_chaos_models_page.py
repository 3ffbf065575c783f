"""The page on chaos of integrated models, and its study: single entries are computed again."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from pages import DOCS, script, table, text_of

import contfric as cf
from contfric.study import read_study

PAGE = text_of("gallery/chaos-models")
SCRIPT = vars(script("gallery/chaos_models.py"))


def test_tables_are_those_of_the_script() -> None:
    assert [row[0] for row in table(PAGE, "table: maps")] == [
        f"`{model}`" for model in SCRIPT["MAPS"]
    ]
    assert [float(row[0]) for row in table(PAGE, "table: doublings")] == [
        F for F, _ in SCRIPT["DOUBLINGS"]
    ]
    assert [row[0] for row in table(PAGE, "table: chaos")] == [
        f"`{model}`" for model, *_ in SCRIPT["CHAOS"]
    ]
    for figure in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", PAGE):
        assert (DOCS / "gallery" / figure).is_file()


def test_points_of_the_maps_add_up() -> None:
    for row in table(PAGE, "table: maps"):
        rows, columns = (int(side) for side in row[1].split(" x "))
        assert sum(int(n) for n in re.findall(r"(\d+) [a-z_]+", row[3])) == rows * columns


def test_two_estimates_of_each_chaotic_motion_agree() -> None:
    """As they stand there; that of Popp's oscillator is computed again (in tests/analytic the others)."""
    for row in table(PAGE, "table: chaos"):
        assert float(row[3].split(",")[0]) > 3.0 * float(row[4]) > 0.0
        assert float(row[7]) < 4.0
    shown = table(PAGE, "table: chaos")[0]
    found = cf.lyapunov_exponent("popp", {"omega": 1.69, "F": 0.1}, periods=600, tolerance=0.0)
    error = np.hypot(found.error, float(shown[4]))
    assert abs(found.largest - float(shown[3].split(",")[0])) < 4.0 * error


def test_an_exponent_vanishes_at_a_doubling() -> None:
    shown = {float(row[0]): row for row in table(PAGE, "table: doublings")}
    F, omega = SCRIPT["DOUBLINGS"][0]
    found = SCRIPT["vanishes"](F, omega, 1.0)
    assert found == pytest.approx(omega, abs=3e-6)
    assert found == pytest.approx(float(shown[F][2]), abs=1e-7)
    for row in shown.values():
        assert float(row[2]) == pytest.approx(float(row[1]), abs=3e-6)


def test_motion_jumps_to_chaos_below_the_grazing() -> None:
    grid = {"omega": [1.7075, 1.709], "F": [0.1]}
    assert cf.lyapunov_map("popp", grid).chaotic[:, 0].tolist() == [True, False]


def test_study_of_a_map_of_an_integrated_model(tmp_path: Path) -> None:
    """The bundled one, with fewer points of its plane."""
    study = read_study("popp-chaos")
    task = study.content.lyapunov
    assert task is not None
    sides = {name: [low, high, 2] for name, (low, high, _) in task.grid.items()}
    content = study.content.model_copy(update={"lyapunov": task.model_copy(update={"grid": sides})})
    result = cf.run_study(dataclasses.replace(study, content=content), tmp_path / "out")
    assert result.lyapunov is not None and result.lyapunov.complete
    assert result.lyapunov.shape == (2, 2)
    assert (tmp_path / "out" / "lyapunov.png").is_file()
