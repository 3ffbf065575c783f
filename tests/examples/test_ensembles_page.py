"""The code of the page on ensembles runs, and its studies are valid."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import contfric as cf
from contfric.study import read_study

PAGE = Path(__file__).parents[2] / "docs" / "ensembles.md"


def blocks(language: str) -> list[str]:
    text = PAGE.read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def test_the_page_runs(tmp_path: Path) -> None:
    scope: dict[str, object] = {}
    (block,) = blocks("python")
    exec(compile(block, str(PAGE), "exec"), scope)
    found = scope["found"]
    assert isinstance(found, cf.Ensemble) and found.complete
    assert found.counts()["complete"] + found.counts().get("limited", 0) == 80
    (study,) = blocks("yaml")
    (tmp_path / "random.yaml").write_text(study, encoding="utf-8")
    assert read_study(tmp_path / "random.yaml").content.ensemble is not None
