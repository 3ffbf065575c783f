"""What a stress run has found: one small form for all of them, as text, as JSON and on a command line.

A run tries cases that are drawn from ``(seed, index)``, so that a failure names all it takes to see it
again. Every module of this folder offers ``run(count, seed) -> Report``; the other modules here and
``write_page.py`` know nothing else of it.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path

#: Failures shown in the lines of a report, and characters of what is told of a case that is set aside; the
#: JSON file has all of them.
_SHOWN, _CHARACTERS = 20, 240


def _short(text: str) -> str:
    """Return a text that fits into a cell of a table."""
    text = text.replace("|", "/").replace("\n", " ")
    return text if len(text) <= _CHARACTERS else text[:_CHARACTERS] + " ..."


@dataclass(frozen=True)
class Failure:
    """One case that failed: its index (with the seed it can be drawn again), its kind, and why."""

    index: int
    kind: str
    reason: str


@dataclass(frozen=True)
class Report:
    """The outcome of a run.

    Attributes
    ----------
    name : name of the module
    what : one line: what was tried, against what
    count, seed : as given to ``run``
    tried, passed : numbers of checks, by kind of check
    failed : the others
    worst : largest measured value of each quantity, by name
    counts : what was met on the way (ends by reason, refusals), by name
    seconds : run time
    aside : cases that are neither right nor wrong (excused, cut), with the reason
    commit : of the sources, several where a run went on later; with a plus where they were changed
    """

    name: str
    what: str
    count: int
    seed: int
    tried: dict[str, int]
    passed: dict[str, int]
    failed: tuple[Failure, ...] = ()
    worst: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    aside: tuple[Failure, ...] = ()
    commit: str = ""

    def lines(self) -> list[str]:
        """Return the report as lines of Markdown."""
        at = f", commit {self.commit}" if self.commit else ""
        rows = [f"{self.what} {self.count} cases, seed {self.seed}, {self.seconds:.0f} s{at}.", ""]
        rows += self._shares()
        rows += ["| check | tried | passed | failed |", "|---|---:|---:|---:|"]
        for kind, tried in sorted(self.tried.items()):
            passed = self.passed.get(kind, 0)
            rows.append(f"| {kind} | {tried} | {passed} | {tried - passed} |")
        if self.worst:
            rows += ["", "| largest | value |", "|---|---:|"]
            rows += [f"| {name} | {value:.2g} |" for name, value in sorted(self.worst.items())]
        if self.counts:
            rows += ["", "| met on the way | times |", "|---|---:|"]
            rows += [f"| {name} | {times} |" for name, times in sorted(self.counts.items())]
        if self.aside:
            rows += ["", "| case | excused or cut | what |", "|---:|---|---|"]
            rows += [f"| {f.index} | {f.kind} | {_short(f.reason)} |" for f in self.aside]
        rows += [""] if self.failed else []
        rows += [f"* case {f.index}, {f.kind}: {f.reason}" for f in self.failed[:_SHOWN]]
        if len(self.failed) > _SHOWN:
            rows.append(f"* and {len(self.failed) - _SHOWN} more")
        return rows

    def _shares(self) -> list[str]:
        """Return how many of the cases that have a start are wrong, excused and cut; where some can be."""
        starts = self.count - sum(
            n for name, n in self.counts.items() if name.startswith("no start")
        )
        if "scenes" not in self.counts or not starts:
            return []
        found = {"wrong": {f.index for f in self.failed}}
        for kind in ("excused", "cut"):
            found[kind] = {f.index for f in self.aside if f.kind.startswith(kind)} - found["wrong"]
        rows = [f"| of {starts} with a start | cases | share |", "|---|---:|---:|"]
        rows += [f"| {k} | {len(v)} | {100.0 * len(v) / starts:.1f} % |" for k, v in found.items()]
        return [*rows, ""]

    def write(self, path: Path) -> None:
        """Write the report as JSON."""
        path.write_text(json.dumps(asdict(self), indent=1) + "\n", encoding="utf-8")

    @classmethod
    def read(cls, path: Path) -> Report:
        """Read a report that was written."""
        data = json.loads(path.read_text(encoding="utf-8"))
        listed = {k: tuple(Failure(**f) for f in data.get(k, ())) for k in ("failed", "aside")}
        return cls(**{**data, **listed})


@dataclass
class Tally:
    """A report while it grows."""

    index: int = 0
    tried: dict[str, int] = field(default_factory=dict)
    passed: dict[str, int] = field(default_factory=dict)
    failed: list[Failure] = field(default_factory=list)
    worst: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    aside: list[Failure] = field(default_factory=list)

    def check(self, kind: str, fine: bool, reason: str = "") -> bool:
        """Count one check; the reason is kept if it failed."""
        self.tried[kind] = self.tried.get(kind, 0) + 1
        if fine:
            self.passed[kind] = self.passed.get(kind, 0) + 1
        else:
            self.failed.append(Failure(self.index, kind, reason))
        return fine

    def largest(self, name: str, value: float) -> None:
        """Keep the largest value of a quantity."""
        self.worst[name] = max(self.worst.get(name, 0.0), float(value))

    def met(self, name: str, times: int = 1) -> None:
        """Count something that was met."""
        self.counts[name] = self.counts.get(name, 0) + times

    def set_aside(self, kind: str, reason: str = "") -> None:
        """Count a case that is neither right nor wrong, and keep why."""
        self.met(kind)
        self.aside.append(Failure(self.index, kind, reason))

    def report(
        self, name: str, what: str, count: int, seed: int, seconds: float, commit: str = ""
    ) -> Report:
        """Return the report."""
        return Report(
            name,
            what,
            count,
            seed,
            self.tried,
            self.passed,
            tuple(self.failed),
            self.worst,
            self.counts,
            seconds,
            tuple(self.aside),
            commit,
        )


def say(text: str) -> None:
    """Report progress to the terminal, next to the results."""
    print(text, file=sys.stderr, flush=True)


def command_line(run: Callable[..., Report], count: int) -> None:
    """Run from the command line: ``--count --seed --out``; exit status 1 if something failed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    report = run(args.count, args.seed, progress=say)
    print(*report.lines(), sep="\n")
    if args.out is not None:
        report.write(args.out)
    sys.exit(1 if report.failed else 0)
