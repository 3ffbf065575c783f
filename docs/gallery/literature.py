"""Models of the literature: runs their studies, writes figures and tables; ``make gallery``.

Each page has its table between ``<!-- events: STUDY -->`` and ``<!-- end -->``, that of a plane between
``<!-- plane: STUDY -->`` and ``<!-- end -->``; all else is written by hand.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import contfric as cf

HERE = Path(__file__).resolve().parent
IMAGES = HERE.parent / "images" / "gallery"
#: Studies, each with a page of the same name.
STUDIES = (
    *("dead-band", "impact", "impact-friction", "belt", "popp", "bang-bang"),
    *("buck", "relay", "relay-sliding", "thermostat", "rocking-block", "rimless-wheel"),
    *("bouncing-ball", "chattering-ball", "gear-pair", "pendulum", "normal-force", "jenkins"),
    "compass-gait",
    *("blade-damper", "pounding", "two-blocks", "braced-chain"),
    *("drill-string", "iwan", "beam-stop", "storeys"),
)
#: Studies of planes, each with the page that shows it.
PLANES = {"popp-plane": "popp", "integrate-and-fire": "integrate-and-fire"}
#: Digits after the point: what is located to rounding, and confirmed in the tests.
DIGITS = 11


def rows_of(diagram: cf.Diagram) -> list[tuple[str, float, str]]:
    """Return the events of a diagram, tangencies apart: name, value, branches that meet there."""
    rows = []
    for node in diagram.events:
        event = node.bifurcation
        if event.kind is not cf.Kind.T:
            names = sorted({diagram.branches[i].name for i in node.branches})
            rows.append((event.label, event.params[diagram.parameter], "; ".join(names)))
    return rows


def table_of(diagram: cf.Diagram) -> list[str]:
    """Return the events of a diagram as a table."""
    rows = [f"| {event} | {at:.{DIGITS}f} | {names} |" for event, at, names in rows_of(diagram)]
    if not rows:
        return ["No event: one branch over the whole range."]
    head = f"| event | {diagram.parameter} | branches that meet there |"
    return [head, "|---|---|---|", *rows]


def points_of(plane: cf.Plane) -> list[tuple[str, str, float, float]]:
    """Return the points of codimension two of a plane, tangencies apart: name, orbit, both parameters."""
    one, other = plane.parameters
    return [
        (s.name, s.orbit.name, s.params[one], s.params[other])
        for s in sorted(plane.special, key=lambda s: s.params[one])
        if s.located and "T" not in s.name.split("-")
    ]


def table_of_plane(plane: cf.Plane) -> list[str]:
    """Return the points of codimension two of a plane as a table."""
    one, other = plane.parameters
    rows = [
        f"| {name} | {orbit} | {p:.{DIGITS}f} | {q:.{DIGITS}f} |"
        for name, orbit, p, q in points_of(plane)
    ]
    return [f"| point | orbit | {one} | {other} |", "|---|---|---|---|", *rows]


def with_table(page: str, name: str, lines: list[str], what: str = "events") -> str:
    """Return the text of a page with its table put in its place."""
    before, begin, rest = page.partition(f"<!-- {what}: {name} -->\n")
    _, end, after = rest.partition("<!-- end -->")
    if not end:
        raise ValueError(f"the page has no place for the table of {name}")
    return before + begin + "\n".join(lines) + "\n" + end + after


def main(pages: tuple[str, ...] = (*STUDIES, *PLANES.values())) -> None:
    """Run the studies of some pages, copy their figures and put the tables into the pages."""
    for name in STUDIES:
        if name not in pages:
            continue
        page = HERE / f"{name}.md"
        with tempfile.TemporaryDirectory() as folder:
            result = cf.run_study(name, Path(folder) / "out")
            assert result.diagram is not None
            for figure, image in (("diagram", name), ("orbit", f"{name}-orbit")):
                if (drawn := result.out / f"{figure}.png").is_file():
                    shutil.copyfile(drawn, IMAGES / f"{image}.png")
        text = page.read_text(encoding="utf-8")
        page.write_text(with_table(text, name, table_of(result.diagram)), encoding="utf-8")
        print(f"{name}: {result.diagram!r}, {result.info['timings']}")
    for name, on in PLANES.items():
        if on in pages:
            draw_plane(name, HERE / f"{on}.md")


def draw_plane(name: str, page: Path) -> None:
    """Run the study of a plane, copy its figure and put its table into a page."""
    with tempfile.TemporaryDirectory() as folder:
        result = cf.run_study(name, Path(folder) / "out")
        assert result.plane is not None
        shutil.copyfile(result.out / "plane.png", IMAGES / f"{name}.png")
        if name == page.stem:
            shutil.copyfile(result.out / "orbit.png", IMAGES / f"{name}-orbit.png")
    text = with_table(page.read_text(encoding="utf-8"), name, table_of_plane(result.plane), "plane")
    page.write_text(text, encoding="utf-8")
    print(f"{name}: {result.plane!r}, {result.info['timings']}")


if __name__ == "__main__":
    main()
