"""The code of the page on ensembles runs, and its studies are valid."""

from __future__ import annotations

from pathlib import Path

from pages import blocks, run, text_of

import contfric as cf
from contfric.study import read_study


def test_the_page_runs(tmp_path: Path) -> None:
    found = run("ensembles")["found"]
    assert isinstance(found, cf.Ensemble) and found.complete
    assert found.counts()["complete"] + found.counts().get("limited", 0) == 80
    (study,) = blocks(text_of("ensembles"), "yaml")
    (tmp_path / "random.yaml").write_text(study, encoding="utf-8")
    assert read_study(tmp_path / "random.yaml").content.ensemble is not None
