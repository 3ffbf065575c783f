"""Run every bundled study from the shell, each with a time limit, and write docs/studies.md."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from origin import origin

from contfric.study.library import study_names

#: Time that a study gets (s), several times what the longest one takes on two processors.
LIMIT = 300.0
#: A study that takes longer than this (s) is run once: kernels that it may have compiled are a small part.
ONCE = 60.0

PAGE = """# The bundled studies

Written by `make studies` (`benchmarks/studies.py`, which took {took}): {origin}.
Each study is run from the shell (`contfric run NAME`), with a limit of {limit:.0f} s; one
that does not end by itself, or ends with an error, fails the command. The times are those of a whole process
with its kernels compiled, figures and tables written. {once}

| study | what it computes | found | clock, s | processor, s |
|---|---|---|---|---|
{rows}
"""


@dataclass(frozen=True)
class Run:
    """How a run of a study ended.

    Attributes
    ----------
    seconds : wall time
    work : processor time, that of its own processes included
    failed : what went wrong; empty if nothing did
    record : what the run says of itself
    """

    seconds: float
    work: float
    failed: str
    record: dict[str, Any]


def run(name: str, limit: float) -> Run:
    """Run a study in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / name)
        command = [sys.executable, "-m", "contfric", "run", name, "--out", out, "--json", "--quiet"]
        began, before = time.perf_counter(), os.times()

        def spent() -> tuple[float, float]:
            """Return wall and processor time since the start."""
            now = os.times()
            work = now.children_user + now.children_system
            work -= before.children_user + before.children_system
            return time.perf_counter() - began, work

        try:
            done = subprocess.run(
                command, capture_output=True, text=True, timeout=limit, check=False
            )
        except subprocess.TimeoutExpired:
            return Run(*spent(), f"did not end within {limit:.0f} s", {})
        if done.returncode != 0:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            return Run(*spent(), f"ended with {done.returncode}: {last}", {})
        return Run(*spent(), "", json.loads(done.stdout))


def timed(name: str, limit: float) -> Run:
    """Run a study, and once more if it was short: the first time may have compiled kernels."""
    first = run(name, limit)
    return first if first.failed or first.seconds > ONCE else run(name, limit)


def found(record: dict[str, Any]) -> str:
    """Say how much a run has found."""
    parts = []
    if branches := record.get("branches"):
        points = sum(branch["points"] for branch in branches)
        events = counted(len(record["bifurcations"]), "event")
        parts.append(f"{counted(len(branches), 'branch')}, {points} points, {events}")
    if plane := record.get("plane"):
        points = sum(curve["points"] for curve in plane["curves"])
        parts.append(
            f"{len(plane['curves'])} curves, {points} points, {len(plane['regions'])} regions"
        )
    if lmap := record.get("lyapunov"):
        size = " x ".join(str(values[-1]) for values in lmap["grid"].values())
        parts.append(f"a Lyapunov map of {size} points")
    return "; ".join(parts) or f"the orbit {record['start']['signature']}"


def counted(number: int, what: str) -> str:
    """Return a number with its noun, in the plural unless it is one."""
    plural = f"{what}es" if what.endswith("ch") else f"{what}s"
    return f"{number} {what if number == 1 else plural}"


def row(name: str, run: Run) -> str:
    """Return the line of a study in the table."""
    if run.failed:
        return f"| {name} | | **{run.failed}** | {run.seconds:.1f} | {run.work:.1f} |"
    return f"| {name} | {run.record['title']} | {found(run.record)} | {run.seconds:.1f} | {run.work:.1f} |"


def main() -> int:
    """Run all, write the page, and return 1 if any has failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "names", nargs="*", help="studies to run; all by default, and only then a page"
    )
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds that each one gets")
    options = parser.parse_args()
    began, runs = time.perf_counter(), {}
    for name in options.names or study_names():
        runs[name] = timed(name, options.limit)
        print(row(name, runs[name]), flush=True)
    if not options.names:
        page = PAGE.format(
            took=f"{(time.perf_counter() - began) / 60.0:.0f} min",
            origin=origin(),
            limit=options.limit,
            once=f"Studies that take longer than {ONCE:.0f} s are run once.",
            rows="\n".join(row(name, done) for name, done in runs.items()),
        )
        (Path(__file__).parents[1] / "docs" / "studies.md").write_text(page, encoding="utf-8")
    failed = [name for name, done in runs.items() if done.failed]
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
