"""What everyday computations take: the table of the guide is what signatures, classes and studies say."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

import contfric as cf
from contfric.results import Saveable
from contfric.simulation.simulate import Trajectory
from contfric.study.tasks import TASKS

GUIDE = Path(__file__).parents[2] / "docs" / "guide.md"
SAVED = set(str(Saveable).split(" | "))
HEAD = "| function | result | study key |"


def rows() -> list[list[str]]:
    lines = GUIDE.read_text(encoding="utf-8").split(HEAD)[1].splitlines()[2:]
    kept = lines[: next(k for k, line in enumerate(lines) if not line.startswith("|"))]
    return [[cell.strip(" `") for cell in line.strip("|").split("|")] for line in kept]


def test_every_everyday_computation_has_a_row() -> None:
    tiled = {"executor", "folder"}
    with_tiles = {
        name
        for name in cf.__all__
        if inspect.isfunction(getattr(cf, name))
        and tiled <= set(inspect.signature(getattr(cf, name)).parameters)
    }
    assert with_tiles <= {row[0] for row in rows()}


@pytest.mark.parametrize("row", rows(), ids=lambda row: row[0])
def test_a_row_of_the_guide_is_true(row: list[str]) -> None:
    name, result, key, *cells = row
    executor, folder, progress, table, plot, saved = (cell == "yes" for cell in cells)
    function, kind = getattr(cf, name), getattr(cf, result, Trajectory)
    assert kind.__name__ == result
    returns = inspect.signature(function).return_annotation
    assert re.search(rf"\b{result}\b", str(returns)), returns
    taken = set(inspect.signature(function).parameters)
    assert ("executor" in taken, "folder" in taken, "progress" in taken) == (
        *(executor, folder, progress),
    )
    assert (hasattr(kind, "to_dataframe"), hasattr(kind, "plot")) == (table, plot)
    assert any(base.__name__ in SAVED for base in kind.__mro__) == saved
    if key != "none":
        (task,) = [task for task in TASKS if task.name == key]
        assert task.figures


def test_a_gradient_is_a_table() -> None:
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    gradient = orbit.gradient("rms(v)")
    table = gradient.to_dataframe()
    assert table["parameter"].tolist() == list(gradient)
    assert table["ahead"].tolist() == list(gradient.values())
