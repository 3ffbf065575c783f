"""The code of the page on sweeps, return maps and basins runs, and says what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
PAGE = Path(__file__).parents[2] / "docs" / "response.md"


def test_the_page_runs() -> None:
    scope: dict[str, object] = {}
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 5
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), scope)
    shares = [share.share for share in scope["found"].shares]  # type: ignore[attr-defined]
    assert len(shares) == 3 and abs(sum(shares) - 1.0) < 1e-12
