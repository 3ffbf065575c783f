"""The figures and the tables of the gallery: runs each study and writes both; ``make gallery``.

A page has its tables between ``<!-- events: STUDY -->`` and ``<!-- end -->``; all else is written by hand.
"""

from __future__ import annotations

import dataclasses
import re
import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import yaml

import contfric as cf
from contfric.study import Study, read_study

HERE = Path(__file__).resolve().parent
IMAGES = HERE.parent / "images" / "gallery"
#: Studies of each page: bundled ones by name, those next to this script by their files.
PAGES: dict[str, tuple[str, ...]] = {
    "fig03": ("fig03",),
    "fig04": ("fig04",),
    "fig05": ("fig05",),
    "fig06": ("fig06",),
    "fig07": ("fig07",),
    "fig13": ("fig13",),
    "fig17": ("fig17",),
    "fig18": ("fig18",),
}
#: Studies that take minutes: motion is integrated there.
LONG = ("fig17", "fig18")
STUDIES = tuple(study for studies in PAGES.values() for study in studies)
#: Digits after the point in the tables: events are located to about 1e-10.
DIGITS = 9
#: Most turns of an itinerary in the table of windows: longer ones have windows of 1e-6 and less.
LONGEST = 6
#: An event belongs to what was published if it is this near to it.
NEAR = 3e-5


@dataclass(frozen=True)
class Row:
    """One event of a table, and how well its value is known."""

    event: str
    value: float
    branches: str
    says: str
    accuracy: float
    proved: str = ""

    def __str__(self) -> str:
        proved = f" {self.proved} |" if self.proved else ""
        return f"| {self.event} | {self.value:.{DIGITS}f} | {self.branches} | {self.says} |{proved}"


def study_of(name: str) -> Study:
    """Return a study, bundled or next to this script."""
    own = HERE / f"{name}.yaml"
    return read_study(own if own.is_file() else name)


def run(name: str, out: Path, *, figures: bool) -> cf.StudyResult:
    """Run a study of the gallery."""
    study = study_of(name)
    return cf.run_study(study if figures else dataclasses.replace(study, drawings=()), out)


def rows_of(name: str, diagram: cf.Diagram) -> list[Row]:
    """Return the events of a diagram, tangencies apart, next to what was published."""
    low, high = diagram.range
    rows = []
    for node in diagram.events:
        event = node.bifurcation
        if event.kind is cf.Kind.T:
            continue
        value = event.params[diagram.parameter]
        meeting = [diagram.branches[i] for i in node.branches]
        names = (f"{b.name} (bridge)" if b.bridge else b.name for b in meeting)
        says = _published(name, event.kind.value, value)
        label = event.label
        joined = "; ".join(sorted(set(names)))
        proved = proof_of(event, diagram.parameter)
        rows.append(Row(label, value, joined, says, event.accuracy * (high - low), proved))
    # events that differ by less than they are located to stand in the order of their names
    return sorted(rows, key=lambda r: (round(r.value, 6), r.event, r.branches, r.value))


def proof_of(event: cf.Bifurcation, parameter: str) -> str:
    """Return within what radius the parameter of an event is proved, or why not; empty if none is offered."""
    try:
        proof = event.certify(parameter)
    except cf.ParameterError:  # motion is integrated
        return ""
    if proof.proved:
        return f"{proof.radius:.0e}"
    return "open: " + proof.why.removeprefix("undecided (").removesuffix(")")


def _published(name: str, kind: str, value: float) -> str:
    entries = yaml.safe_load((HERE / "published.yaml").read_text(encoding="utf-8"))[name]
    found = [e["says"] for e in entries if e["kind"] == kind and abs(e["near"] - value) < NEAR]
    return "; ".join(found) or "-"


def table_of(name: str, result: cf.StudyResult) -> list[str]:
    """Return the lines of a table: the events of a diagram, or the orbit of a study without one."""
    if result.diagram is None:
        orbit = result.orbit
        assert orbit is not None
        return [
            "| | computed |",
            "|---|---|",
            f"| name | {orbit.name} |",
            f"| segments | `{orbit.signature}` |",
            f"| largest displacement | {orbit.x_max:.{DIGITS}f} |",
            f"| multiplier | {orbit.multipliers[0].real:.{DIGITS}f} |",
        ]
    head = f"| event | {result.diagram.parameter} | branches that meet there | the paper |"
    rows = rows_of(name, result.diagram)
    proved = any(row.proved for row in rows)
    return [
        head + " proved within |" * proved,
        "|---|---|---|---|" + "---|" * proved,
        *map(str, rows),
    ]


def windows_of(diagram: cf.Diagram) -> list[str]:
    """Return the table of the orbits between the two ends of the first bridge: itineraries over both."""
    bridge = next(branch for branch in diagram.branches if branch.bridge)
    rows = [
        f"| {window.itinerary} | {window.branch.name} | {window.range[0]:.{DIGITS}f} "
        f"| {window.range[1]:.{DIGITS}f} | {'yes' if window.branch.stable.all() else 'in part'} |"
        for window in cf.period_adding(bridge, longest=LONGEST)
    ]
    head = f"| itinerary | orbit | {diagram.parameter} from | to | stable |"
    return [head, "|---|---|---|---|---|", *rows]


def tables_in(page: str) -> dict[str, list[str]]:
    """Return the tables in the text of a page, by the names of their studies."""
    found = re.findall(r"<!-- events: (\S+) -->\n(.*?)\n<!-- end -->", page, re.DOTALL)
    return {name: body.splitlines() for name, body in found}


def with_table(page: str, name: str, lines: list[str]) -> str:
    """Return the text of a page with a table put in its place."""
    before, begin, rest = page.partition(f"<!-- events: {name} -->\n")
    _, end, after = rest.partition("<!-- end -->")
    if not end:
        raise ValueError(f"the page has no place for the table of {name}")
    return before + begin + "\n".join(lines) + "\n" + end + after


def main(pages: list[str]) -> None:
    """Run every study of some pages (by default all); write its figures, put its table into its page."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    for page, names in PAGES.items():
        if pages and page not in pages:
            continue
        path = HERE / f"{page}.md"
        text = path.read_text(encoding="utf-8")
        for name in names:
            with tempfile.TemporaryDirectory() as folder:
                result = run(name, Path(folder), figures=True)
                for file in result.files:
                    if file.suffix == ".png":
                        kind = "" if file.stem == _first_figure(result) else f"-{file.stem}"
                        shutil.copyfile(file, IMAGES / f"{name}{kind}.png")
                text = with_table(text, name, table_of(name, result))
                if f"<!-- events: {name}-windows -->" in text:
                    text = with_table(text, f"{name}-windows", windows_of(result.diagram))
            print(f"{name}: {path.name}")
        path.write_text(text, encoding="utf-8")


def _first_figure(result: cf.StudyResult) -> str:
    return Path(result.study.drawings[0].file).stem


if __name__ == "__main__":
    main(sys.argv[1:])
