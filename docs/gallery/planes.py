"""The planes of the gallery: runs each study, writes its figure and the table of its page.

``planes.md`` has its tables between ``<!-- plane: STUDY -->`` and ``<!-- end -->``; all else is written
by hand.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from pathlib import Path

import contfric as cf

HERE = Path(__file__).resolve().parent
IMAGES = HERE.parent / "images" / "gallery"
STUDIES = ("fig08", "fig09", "fig10", "fig11", "fig14", "fig15", "fig16")
#: Points of these kinds are listed: what the smooth curves do, and where they end.
SHOWN = re.compile(r"SN|BP|PD|CUSP|DBP|GPD|CS-SS|R1|R2")
#: Digits of the tables: points of codimension two are located to about 1e-10.
DIGITS = 9


def table_of(plane: cf.Plane) -> list[str]:
    """Return the smooth points of codimension two of a plane as a table."""
    one, other = plane.parameters
    points = [s for s in plane.special if SHOWN.search(s.name) and not s.name.endswith("-T")]
    points.sort(key=lambda s: -s.params[other])
    rows = [
        f"| {s.name} | {s.orbit.name} | {s.params[one]:.{DIGITS}f} | {s.params[other]:.{DIGITS}f} |"
        for s in points
        if s.located
    ]
    return [f"| point | orbit | {one} | {other} |", "|---|---|---|---|", *rows]


def with_table(page: str, name: str, lines: list[str]) -> str:
    """Return a page with one of its tables replaced."""
    found = re.compile(rf"(<!-- plane: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    if not found.search(page):
        raise ValueError(f"the page has no place for {name}")
    return found.sub(lambda m: m.group(1) + "\n".join(lines) + "\n" + m.group(2), page)


def main(studies: tuple[str, ...] = STUDIES) -> None:
    """Run the studies, write their figures and tables."""
    file = HERE / "planes.md"
    page = file.read_text(encoding="utf-8")
    for name in studies:
        with tempfile.TemporaryDirectory() as folder:
            result = cf.run_study(name, Path(folder) / "out")
            assert result.plane is not None
            page = with_table(page, name, table_of(result.plane))
            shutil.copyfile(result.out / "plane.png", IMAGES / f"{name}.png")
            print(f"{name}: {result.plane!r}, {result.info['timings']}")
    file.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main(tuple(sys.argv[1:]) or STUDIES)
