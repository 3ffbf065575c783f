"""Write docs/stress.md from the JSON reports of the stress runs.

``python benchmarks/stress/write_page.py *.json --out docs/stress.md``
"""

from __future__ import annotations

import argparse
import platform
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
to each other than 1e-7 of the range.

**What is excused, and what is cut.** Before the run it was fixed which differences are not counted as
failures: all cases with S = S0, or with Omega = 1/n and no damping; two events at one point with the same
motion; and smooth events at which a second condition fails (`contfric/atlas/degenerate.py`). Cases with
too many branches, or of more than a minute, are cut. The tables show how many there are.

**To repeat.** `make stress` repeats everything. One run, and the page:

    python benchmarks/stress/<name>.py --count N --seed K --out <name>.json
    python benchmarks/stress/write_page.py *.json --out docs/stress.md
"""
#: What each run looks at, for readers who do not know its code.
EXPLANATIONS = {
    "sequences": (
        "A mass is simulated for many periods. Each slide, stick, stop and release must happen in the "
        "right order, at the right time and place. *Undecidable* cases are left out: rounding of the "
        "input alone decides what happens next. *sigma* is the error that rounding is expected to "
        "cause."
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


def page(reports: list[Report]) -> str:
    """Return the page: a summary, then each report."""
    reports = sorted(reports, key=lambda report: (_place(report.name), report.seed))
    lines = [INTRODUCTION, f"contfric {cf.__version__}, Python {platform.python_version()}.", ""]
    lines += ["| run | cases | checks | failed | run time |", "|---|---:|---:|---:|---:|"]
    for report in reports:
        tried, failed = sum(report.tried.values()), len(report.failed)
        lines.append(
            f"| [{report.name}](#{report.name}) | {report.count} | {tried} | {failed} "
            f"| {report.seconds:.0f} s |"
        )
    named = set()
    for report in reports:
        lines.append("")
        if report.name not in named:
            lines += [f"## {report.name}", ""]
            if report.name in EXPLANATIONS:
                lines += [EXPLANATIONS[report.name], ""]
            named.add(report.name)
        lines += _folded(report.lines())
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
    text = page([Report.read(path) for path in args.reports])
    args.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
