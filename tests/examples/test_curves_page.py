"""The pages on curves and planes: the code runs, and the numbers are what is computed."""

from __future__ import annotations

import re

import pages
import pytest
from pages import DOCS

import contfric as cf

PAGE = pages.text_of("curves")


def test_code_runs(capsys: pytest.CaptureFixture[str]) -> None:
    pages.run("curves")
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
    script, page = pages.script("gallery/planes.py"), pages.text_of("gallery/planes")
    for name in script.STUDIES:
        assert (DOCS / "images/gallery" / f"{name}.png").is_file()
        assert "| point | orbit |" in pages.part(page, f"plane: {name}"), name
    # the fold and the branch point of Fig. 9, to the digits of the table
    published = [
        line for line in script.table_of(plane) if line.startswith(("| SN-CS | 1a", "| DBP"))
    ]
    fig09 = pages.part(page, "plane: fig09")
    assert len(published) == 2
    for line in published:
        values = [float(cell) for cell in line.split("|")[3:5]]
        listed = re.findall(r"\| (\d\.\d{9}) \| (\d\.\d{9}) \|", fig09)
        near = [abs(float(a) - values[0]) + abs(float(b) - values[1]) for a, b in listed]
        assert min(near) < 1e-8
