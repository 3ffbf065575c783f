"""The page on bridges: its code runs, its table is what the gallery's script computes."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import pages
import pytest

PAGE = pages.text_of("bridges")


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return pages.script("gallery/bridges.py")


def test_code_runs(capsys: pytest.CaptureFixture[str]) -> None:
    pages.run("bridges")
    shown = capsys.readouterr().out.splitlines()
    said = re.search(r"# (x-v\+ -> .*)", PAGE)
    assert said is not None
    assert shown[0] == said[1]
    assert "2 0" in shown
    first = re.search(r"print\(window\)  # (<1a-2a-2a.*, stable>), ...", PAGE)
    assert first is not None
    assert first[1] in shown


def test_table_is_that_of_the_script(script: ModuleType) -> None:
    rows = re.findall(r"^\| (.*) \|$", script.table(), re.MULTILINE)[1:]
    assert len(rows) > 10
    for row in rows:
        *itineraries, parameter, motion = row.split(" | ")
        assert f"| {' | '.join(itineraries)} |" in PAGE
        # without damping the end of the bridge with one hold is located to the root of rounding
        rough = "1a, 9seg, 1hold | SS | 0.4285233972" in row
        assert float(parameter) < (1e-6 if rough else 1e-10)
        assert float(motion) < (1e-6 if rough else 1e-10)


def test_pictures_are_drawn_and_shown(
    script: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(script, "IMAGES", tmp_path)
    for kind in script.FIGURES:
        script.figure(kind)
        name = f"bridge_{kind.lower()}.png"
        assert (tmp_path / name).stat().st_size > 10_000
        assert f"images/{name}" in PAGE and (pages.DOCS / "images" / name).exists()
