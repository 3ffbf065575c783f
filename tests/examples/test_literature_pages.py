"""The pages on models of the literature show what is computed."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

import contfric as cf

GALLERY = Path(__file__).parents[2] / "docs" / "gallery"
SCRIPT = runpy.run_path(str(GALLERY / "literature.py"))


@pytest.mark.slow
@pytest.mark.parametrize("name", SCRIPT["STUDIES"])
def test_table_is_what_is_computed(name: str, tmp_path: Path) -> None:
    import dataclasses

    from contfric.study import read_study

    study = dataclasses.replace(read_study(name), drawings=())
    diagram = cf.run_study(study, tmp_path / "out").diagram
    assert diagram is not None
    page = (GALLERY / f"{name}.md").read_text(encoding="utf-8")
    found = re.search(rf"<!-- events: {name} -->\n(.*?)\n<!-- end -->", page, re.DOTALL)
    assert found is not None
    shown = [[c.strip() for c in row.strip("|").split("|")] for row in found[1].splitlines()[2:]]
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
    import dataclasses

    from contfric.study import read_study

    study = dataclasses.replace(read_study(name), drawings=())
    plane = cf.run_study(study, tmp_path / "out").plane
    assert plane is not None
    page = (GALLERY / f"{on}.md").read_text(encoding="utf-8")
    found = re.search(rf"<!-- plane: {name} -->\n(.*?)\n<!-- end -->", page, re.DOTALL)
    assert found is not None
    shown = [[c.strip() for c in row.strip("|").split("|")] for row in found[1].splitlines()[2:]]
    rows = SCRIPT["points_of"](plane)
    assert [tuple(row[:2]) for row in shown] == [row[:2] for row in rows] and rows
    for row, (*_, one, other) in zip(shown, rows, strict=True):
        assert [float(row[2]), float(row[3])] == pytest.approx([one, other], abs=1e-9)
    figures_exist(page)
