"""The code of docs/lyapunov.md runs, and says what it says; its table has every kind of motion."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import matplotlib

import contfric as cf

matplotlib.use("Agg")
PAGE = (Path(__file__).parents[2] / "docs" / "lyapunov.md").read_text(encoding="utf-8")


def test_code_runs() -> None:
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) == 3
    scope: dict[str, Any] = {}
    for block in blocks:
        exec(compile(block, "docs/lyapunov.md", "exec"), scope)
    assert scope["found"].motion is cf.Motion.CHAOTIC
    assert scope["both"].coexisting.tolist() == [[False], [True]]
    assert scope["short"].chaotic.tolist() == [[True]]
    assert scope["told"].chaotic.tolist() == [[False]]


def test_table_has_every_motion_in_its_order() -> None:
    named = re.findall(r"^\| `([A-Z_]+)` \|", PAGE, re.MULTILINE)
    assert named == [motion.name for motion in cf.Motion]


def test_the_code_that_needs_other_machines_is_python() -> None:
    (block,) = re.findall(r"```py\n(.*?)```", PAGE, re.DOTALL)
    compile(block, "docs/lyapunov.md", "exec")
