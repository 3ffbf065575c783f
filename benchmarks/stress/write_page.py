"""Write docs/stress.md from the JSON reports of the stress runs.

``python benchmarks/stress/write_page.py *.json --out docs/stress.md``

A run that is on the page and is not given again stays there as it is; one with the same name and seed is
replaced.
"""

from __future__ import annotations

import argparse
import platform
import re
from dataclasses import dataclass, field
from pathlib import Path

from report import Report

import contfric as cf

INTRODUCTION = """# Stress runs

A stress run tries many random cases and compares each with a second computation. There are far more cases
than `make test` has time for. This page has the results of seven runs: how much was tried, how large the
errors are, and which cases failed.

**What is compared.** The second computation uses 50 digits. It shares nothing with contfric but the
equation of motion. Two runs need no digits: they compute a branch or a diagram again, with another step
or from another start, and expect the same result.

**What counts as an error.** No program can be more exact than its input: each number is rounded to 16
digits, and the problem may amplify this. The tables compare an error with what rounding of the input
alone explains. Up to 1 it is as exact as possible.

**What failed.** A failure stays on this page, with all numbers that are needed to repeat it. All failures
of events and branches but one (case 175, a tangency) are degenerate cases (see
[conditioning](numerics.md#conditioning)):

* S = S0. Several conditions vanish at the same point there, so that the name of an event may depend on
  the step.
* Omega = 1/2, where a stick vanishes just where its release becomes tangential, and orbits are not
  isolated.

In restarts, what is left are orbits next to a family of orbits that are not isolated (at a value of Omega
that is no 1/n), folds of bridges of many segments, and events on orbits of many periods that are closer
to each other than 1e-7 of the range. In case 36 of seed 36 branches of three periods pass a fold at which all
of six holds turn: some are said to end there, and one half of another is counted twice.

**What is excused, and what is cut.** Before the run it was fixed which differences are not counted as
failures: values at which Omega = 1/n and nothing is damped; two events of one solution that are
nearer than their accuracies, both located; and smooth events at which a second condition fails
(`contfric/atlas/completeness/degenerate.py`). They excuse what differs at them, or is joined to the start
by them alone. Runs up to commit e57bef2b excuse all cases with S = S0, or with Omega = 1/n where zeta
varies, too. Cases that take longer than a limit are cut (in runs that name no commit
those with too many branches, too). The tables show how many there are.

**To repeat.** `make stress` repeats everything. One run, and the page:

    python benchmarks/stress/<name>.py --count N --seed K --out <name>.json
    python benchmarks/stress/write_page.py *.json --out docs/stress.md
"""
#: What each run looks at, for readers who do not know its code.
EXPLANATIONS = {
    "sequences": (
        "A mass is simulated for many periods. Each slide, stick, stop and release must happen in the right "
        "order, at the right time and place. *Undecidable* cases are left out: rounding of the input alone "
        "decides what happens next. *sigma* is the error that rounding is expected to cause."
    ),
    "segments": (
        "One segment of motion at a time: where does it end, and how does the end depend on the start "
        "and on each parameter? Some cases are made to graze a level."
    ),
    "orbits": (
        "Periodic orbits are found by simulation and by signature, and moved to late times. *Joints* "
        "are the states at which segments meet."
    ),
    "events": (
        "The parameter value of each event, and orbits just next to it: at a distance of 1e-10 in the "
        "parameter, and where a branch is stopped 1e-12 before it."
    ),
    "continuation": (
        "A branch must not depend on the step. *Ends* are listed with their reasons: RANGE is the end "
        "of the range of the parameter, LIMIT a limit of the model."
    ),
    "restarts": (
        "A diagram must not depend on its start. Each is explored again from up to six of its "
        "branches, and must have the same branches and events. *Indices* are numbers of orbits, "
        "counted with a sign, that must be the same on both sides of an event."
    ),
    "models": (
        "The same for other models: those that the bundled studies explore, those of the tests, and "
        "models as users write them (`benchmarks/stress/typed`). Parameters are moved by up to a fifth, and "
        "a random part of the range is explored, in at most a minute. Where a study has no attractor at the "
        "moved parameters there is *no start*."
    ),
}
#: Order of the sections; others follow by name.
ORDER = ("sequences", "segments", "orbits", "events", "continuation", "restarts", "models")


#: The line that a run begins with on the page.
_RUN = re.compile(r"(\d+) cases, seed (\d+), (\d+) s")
#: A row of checks: name, tried, passed, failed.
_CHECK = re.compile(r"\| .* \| (\d+) \| (\d+) \| (\d+) \|$")


@dataclass
class Section:
    """What the page has of one name: the text before its runs, and the lines of each run by its seed."""

    name: str
    head: list[str] = field(default_factory=list)
    runs: dict[int, list[str]] = field(default_factory=dict)

    def rows(self) -> list[str]:
        """Return the rows of the summary."""
        rows = []
        for lines in self.runs.values():
            found = _RUN.search(lines[0])
            assert found is not None
            checks = [m for m in map(_CHECK.match, lines) if m is not None]
            tried, failed = (sum(int(m[k]) for m in checks) for k in (1, 3))
            link = f"[{self.name}](#{self.name})"
            rows.append(f"| {link} | {found[1]} | {found[2]} | {tried} | {failed} | {found[3]} s |")
        return rows

    def lines(self) -> list[str]:
        """Return its text, without empty lines at its end."""
        blocks = [[f"## {self.name}"], self.head, *(self.runs[seed] for seed in sorted(self.runs))]
        joined = [line for block in blocks if block for line in (*block, "")]
        return joined[:-1]


def sections_of(page: str) -> dict[str, Section]:
    """Return the sections of a page that was written."""
    found: dict[str, Section] = {}
    for part in re.split(r"^## ", page, flags=re.MULTILINE)[1:]:
        name, _, text = part.partition("\n")
        section = found[name.strip()] = Section(name.strip())
        block = section.head
        for line in text.split("\n"):
            begins = _RUN.search(line)
            if begins is not None and not line.startswith(("|", "*")):
                block = section.runs[int(begins[2])] = []
            block.append(line)
        for lines in (section.head, *section.runs.values()):
            lines[:] = "\n".join(lines).strip("\n").split("\n")
    return found


def page(reports: list[Report], before: str = "") -> str:
    """Return the page: a summary, then each report; what it had before and is not given stays."""
    sections = sections_of(before)
    for report in reports:
        section = sections.setdefault(report.name, Section(report.name))
        if not section.head and report.name in EXPLANATIONS:
            section.head = [EXPLANATIONS[report.name]]
        section.runs[report.seed] = _folded(report.lines())
    lines = [INTRODUCTION, f"contfric {cf.__version__}, Python {platform.python_version()}.", ""]
    lines += [
        "| run | cases | seed | checks | failed | run time |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    ordered = [sections[name] for name in sorted(sections, key=_place)]
    lines += [row for section in ordered for row in section.rows()]
    for section in ordered:
        lines += ["", *section.lines()]
    return "\n".join(lines) + "\n"


def _folded(lines: list[str]) -> list[str]:
    """Return the lines of a report with its failures, which are long, after a click."""
    first = next((k for k, line in enumerate(lines) if line.startswith("* case ")), len(lines))
    if first == len(lines):
        return lines
    head = ['<details markdown="1"><summary>What failed, and how to repeat it</summary>', ""]
    return [*lines[:first], *head, *lines[first:], "", "</details>"]


def _place(name: str) -> tuple[int, str]:
    return (ORDER.index(name) if name in ORDER else len(ORDER)), name


def main() -> None:
    """Read the reports that are named and write the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("reports", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, default=Path("docs/stress.md"))
    args = parser.parse_args()
    before = args.out.read_text(encoding="utf-8") if args.out.exists() else ""
    text = page([Report.read(path) for path in args.reports], before)
    args.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
