"""The code of docs/lyapunov.md runs, and says what it says; its table has every kind of motion."""

from __future__ import annotations

import re

from pages import blocks, run, text_of

import contfric as cf

PAGE = text_of("lyapunov")


def test_code_runs() -> None:
    scope = run("lyapunov")
    assert len(blocks(PAGE)) == 3
    assert scope["found"].motion is cf.Motion.CHAOTIC
    assert scope["both"].coexisting.tolist() == [[False], [True]]
    assert scope["short"].chaotic.tolist() == [[True]]
    assert scope["longer"].chaotic.tolist() == [[False]]


def test_table_has_every_motion_in_its_order() -> None:
    named = re.findall(r"^\| `([A-Z_]+)` \|", PAGE, re.MULTILINE)
    assert named == [motion.name for motion in cf.Motion]


def test_the_code_that_needs_other_machines_is_python() -> None:
    (block,) = blocks(PAGE, "py")
    compile(block, "docs/lyapunov.md", "exec")
