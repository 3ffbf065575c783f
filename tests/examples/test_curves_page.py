"""The pages on curves and planes: the code runs, and the numbers are what is computed."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import matplotlib
import pytest

import contfric as cf

matplotlib.use("Agg")
DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "curves.md").read_text(encoding="utf-8")


def test_code_runs(capsys: pytest.CaptureFixture[str]) -> None:
    scope: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
        exec(compile(block, "docs/curves.md", "exec"), scope)
    shown = capsys.readouterr().out
    assert "SN_1a" in shown
    assert "<SN-CS of 1a: Omega=0.535596272541" in shown


@pytest.fixture(scope="module")
def plane() -> cf.Plane:
    """A smaller plane than that of Fig. 9, with the points that the page lists."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    ranges = {"Omega": (0.35, 0.6), "S": (0.05, 0.4)}
    sections = {"S": [0.32, 0.2]}
    return cf.explore_plane(
        orbit, ("Omega", "S"), ranges, sections, max_periods=1, max_sections=2, seeds=None
    )


def test_numbers_are_computed(plane: cf.Plane) -> None:
    rows = re.findall(r"^\| (.*?) \| (0\.\d{12}) \| (0\.\d{12}) \|", PAGE, re.MULTILINE)
    assert len(rows) == 10
    for name, omega, s in rows:
        gaps = [
            max(abs(p.params["Omega"] - float(omega)), abs(p.params["S"] - float(s)))
            for p in plane.special
        ]
        assert min(gaps) < 5e-9, name


def test_gallery_page_has_every_plane(plane: cf.Plane) -> None:
    spec = importlib.util.spec_from_file_location("planes", DOCS / "gallery/planes.py")
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    page = (DOCS / "gallery/planes.md").read_text(encoding="utf-8")
    for name in script.STUDIES:
        assert (DOCS / "images/gallery" / f"{name}.png").is_file()
        table = re.search(rf"<!-- plane: {name} -->\n(.*?)<!-- end -->", page, re.DOTALL)
        assert table is not None and "| point | orbit |" in table[1], name
    # the fold and the branch point of Fig. 9, to the digits of the table
    published = [
        line for line in script.table_of(plane) if line.startswith(("| SN-CS | 1a", "| DBP"))
    ]
    fig09 = re.search(r"<!-- plane: fig09 -->\n(.*?)<!-- end -->", page, re.DOTALL)
    assert fig09 is not None and len(published) == 2
    for line in published:
        values = [float(cell) for cell in line.split("|")[3:5]]
        listed = re.findall(r"\| (\d\.\d{9}) \| (\d\.\d{9}) \|", fig09[1])
        near = [abs(float(a) - values[0]) + abs(float(b) - values[1]) for a, b in listed]
        assert min(near) < 1e-8
