"""The pages on models of the literature show what is computed."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest
from pages import DOCS, script, table, text_of

import contfric as cf
from contfric.study import read_study
from contfric.study.result import StudyResult

GALLERY = DOCS / "gallery"
SCRIPT = vars(script("gallery/literature.py"))


def computed(name: str, folder: Path) -> StudyResult:
    """Run a study without its figures."""
    return cf.run_study(dataclasses.replace(read_study(name), drawings=()), folder / "out")


@pytest.mark.slow
@pytest.mark.parametrize("name", SCRIPT["STUDIES"])
def test_table_is_what_is_computed(name: str, tmp_path: Path) -> None:
    diagram = computed(name, tmp_path).diagram
    assert diagram is not None
    page = text_of(f"gallery/{name}")
    shown = table(page, f"events: {name}")
    rows = SCRIPT["rows_of"](diagram)
    assert [(event, names) for event, _, names in shown] == [
        (event, names) for event, _, names in rows
    ]
    for (_, value, _), (_, at, _) in zip(shown, rows, strict=True):
        assert float(value) == pytest.approx(at, abs=1e-9)
    figures_exist(page)


def figures_exist(page: str) -> None:
    for figure in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page):
        assert (GALLERY / figure).is_file()


@pytest.mark.parametrize("name, on", SCRIPT["PLANES"].items())
def test_table_of_plane_is_what_is_computed(name: str, on: str, tmp_path: Path) -> None:
    plane = computed(name, tmp_path).plane
    assert plane is not None
    page = text_of(f"gallery/{on}")
    shown = table(page, f"plane: {name}")
    rows = SCRIPT["points_of"](plane)
    assert [tuple(row[:2]) for row in shown] == [row[:2] for row in rows] and rows
    for row, (*_, one, other) in zip(shown, rows, strict=True):
        assert [float(row[2]), float(row[3])] == pytest.approx([one, other], abs=1e-9)
    figures_exist(page)
