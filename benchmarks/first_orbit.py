"""Lines of each hybrid model's file, and seconds to its first orbit; the table of docs/gallery/README.md.

``python benchmarks/first_orbit.py``. Lines are counted without name, title, references, comments and blanks.
Seconds are those of the processor in a new process, Python's start and imports included, with kernels
compiled and the model's formulas read before. The orbit is the one that the model's study starts from.
"""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

from origin import origin

from contfric.base.yaml_lines import read_yaml

ROOT = Path(__file__).resolve().parents[1]
BUNDLED = ROOT / "contfric" / "models" / "bundled"
STUDIES = ROOT / "docs" / "studies"
PAGE = ROOT / "docs" / "gallery" / "README.md"
MODELS = (
    *("buck", "relay", "relay-sliding", "thermostat", "rocking-block", "rimless-wheel"),
    *("compass-gait", "integrate-and-fire", "bouncing-ball", "gear-pair", "pendulum"),
    *("normal-force", "jenkins"),
)
#: Keys of a file that say what a model is called, and not what it is.
NAMES = ("name", "title", "references")
WRITTEN = "Written by `make bench` (`benchmarks/first_orbit.py`):"
HEAD = "| model | lines | s |\n|---|---|---|\n"


def lines_of(text: str) -> int:
    """Return the number of lines that a user writes."""
    top, count = "", 0
    for line in text.splitlines():
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        top = line.split(":")[0] if not line.startswith((" ", "-")) else top
        count += top not in NAMES
    return count


def seconds_of(model: str) -> float:
    """Return the processor's seconds of a new process that finds the first orbit."""
    study = read_yaml(STUDIES / f"{model}.yaml").data
    start = study.get("start")
    given = start["simulate"] if isinstance(start, dict) else {}
    code = (
        f"import contfric as cf; cf.find_orbit({model!r}, {study.get('params', {})!r}, **{given!r})"
    )
    took = []
    for _ in range(3):  # the first one may compile
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", code], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        took.append(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
    return min(took[1:])


def main() -> None:
    """Measure all, and put the table into the page."""
    rows = ""
    for model in MODELS:
        text = (BUNDLED / f"{model}.yaml").read_text(encoding="utf-8")
        rows += f"| {model} | {lines_of(text)} | {seconds_of(model):.1f} |\n"
    page = PAGE.read_text(encoding="utf-8")
    before, _, rest = page.partition(HEAD)
    after = rest[rest.index("\n\n") + 2 :]
    if after.startswith(WRITTEN):
        after = after.partition("\n\n")[2]
    says = f"\n{WRITTEN} {origin()}.\n\n"
    PAGE.write_text(before + HEAD + rows + says + after, encoding="utf-8")
    print(HEAD + rows, end="")


if __name__ == "__main__":
    main()
