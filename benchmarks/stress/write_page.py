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

What random cases, far more than `make test` has time for, have found: each is drawn from a seed and its
index, compared with a reference that shares nothing with the library but the equation of motion, and
counted. An error is compared with what rounding of the arguments alone explains at the condition of the
problem (a ratio of 1 is the most that is allowed; below 1 the result is as exact as doubles permit).

A failure stays on the page with its scene. Those that remain are of two degenerate
kinds, each a limitation (see [numerics](numerics.md#conditioning)): scenes with
S = S0, where several conditions vanish together at an end, so that its name may depend on the step; and
ends at Omega = 1/2, where a stick vanishes just as its release becomes tangential and the orbit is one of
a continuum.

Of the restarts: a diagram explored again from another of its branches is to have the same events and
branches. What is excused was fixed before the run: by the scene (S = S0; Omega = 1/n without damping), or
by its events (`contfric/atlas/degenerate.py`): two in one place with one motion, or a second condition
that fails at a smooth one. Scenes with more branches than the limit, or that take longer than a minute,
are counted as cut. What is left failed are, by kind: orbits beside a continuum at a value of Omega that is
no 1/n, folds of bridges of many segments, and events on orbits of many periods that are nearer to each other
than 1e-7 of the range.

`make stress` repeats all runs; one of them and the page:

    python benchmarks/stress/<name>.py --count N --seed K --out <name>.json
    python benchmarks/stress/write_page.py *.json --out docs/stress.md
"""
#: Order of the sections; others follow by name.
ORDER = ("sequences", "segments", "orbits", "events", "continuation", "restarts")


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
            named.add(report.name)
        lines += report.lines()
    return "\n".join(lines) + "\n"


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
