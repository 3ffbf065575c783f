"""Where figures come from: the commit, the machine, and how fast it was just then."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path

from gate import compiled_yardstick, spent

#: Turns of the yardstick of which the least is given.
TURNS = 25


def _git(*asked: str) -> str:
    """Return what git says; nothing where there is none."""
    command, here = ["git", *asked], Path(__file__).parent
    try:
        done = subprocess.run(command, cwd=here, capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return done.stdout.strip()


def commit() -> str:
    """Return the short name of the commit, with a plus where sources differ from it."""
    name = _git("rev-parse", "--short", "HEAD")
    changed = _git("status", "--porcelain", "../contfric")
    return (name or "unknown") + ("+" if changed else "")


def origin() -> str:
    """Return commit, machine and yardstick as a part of a sentence."""
    compiled_yardstick()
    yard = min(spent(compiled_yardstick) for _ in range(TURNS))
    return (
        f"commit {commit()}, {platform.machine()}, {os.cpu_count()} processors, "
        f"Python {platform.python_version()}; the yardstick of `make gate` takes {yard * 1e3:.2f} ms"
    )


def renewed(page: str, begin: str, end: str, text: str) -> str:
    """Return a page with the text between two marks replaced."""
    before, found, rest = page.partition(begin)
    if not found or end not in rest:
        raise ValueError(f"the page has no {begin}")
    return f"{before}{begin}\n\n{text}\n\n{end}{rest.partition(end)[2]}"
