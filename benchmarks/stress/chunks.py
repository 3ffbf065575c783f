"""Runs in chunks of cases: in several processes, kept as they are done, and gone on with later."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

from report import Failure, Report, Tally, say

sys.path.append(str(Path(__file__).resolve().parents[1]))
from origin import commit

Progress = Callable[[str], None] | None


def keep_all(worst: dict[str, float]) -> None:
    """Keep every largest value."""


@dataclass(frozen=True)
class Chunked:
    """A run in chunks.

    Attributes
    ----------
    name, what : of the report
    chunk : from a seed and a range of indices to the tally of those cases
    size : cases of a chunk, so many that one takes some ten seconds
    tidy : drops largest values that the report does not name
    limit : processor seconds of a case, where the chunk has an argument of that name
    """

    name: str
    what: str
    chunk: Callable[..., Tally]
    size: int
    tidy: Callable[[dict[str, float]], None] = keep_all
    limit: float | None = None

    def run(
        self,
        count: int,
        seed: int,
        progress: Progress = None,
        workers: int = 1,
        out: Path | None = None,
    ) -> Report:
        """Run ``count`` cases; with ``out``, what is done is kept there and not done again."""
        began = time.perf_counter()
        done, spent, commits = restore(out, seed)
        ranges = [(a, min(a + self.size, count)) for a in range(0, count, self.size)]
        todo = [r for r in ranges if f"{r[0]}-{r[1]}" not in done]
        here = commit()
        for (first, last), tally in zip(todo, self._results(seed, todo, workers), strict=True):
            done[f"{first}-{last}"], commits[f"{first}-{last}"] = tally, here
            if out is not None:
                keep(out, seed, done, spent + time.perf_counter() - began, commits)
            if progress is not None:
                failed = len(self.merged(list(done.values())).failed)
                progress(f"{len(done)}/{len(ranges)} chunks, {failed} failed")
        whole = self.merged([done[f"{a}-{b}"] for a, b in ranges])
        seconds = spent + time.perf_counter() - began
        at = in_words({r: commits.get(f"{r[0]}-{r[1]}", "") for r in ranges})
        return whole.report(self.name, self.what, count, seed, seconds, at)

    def merged(self, tallies: list[Tally]) -> Tally:
        """Return one tally for all."""
        whole = Tally()
        for tally in tallies:
            for mine, theirs in ((whole.tried, tally.tried), (whole.passed, tally.passed)):
                for name, times in theirs.items():
                    mine[name] = mine.get(name, 0) + times
            for name, times in tally.counts.items():
                whole.met(name, times)
            for name, value in tally.worst.items():
                whole.largest(name, value)
            whole.failed.extend(tally.failed)
            whole.aside.extend(tally.aside)
        self.tidy(whole.worst)
        return whole

    def _results(self, seed: int, ranges: list[tuple[int, int]], workers: int) -> Iterator[Tally]:
        firsts, lasts = [r[0] for r in ranges], [r[1] for r in ranges]
        if workers <= 1:
            yield from map(partial(self.chunk, seed), firsts, lasts)
            return
        with ProcessPoolExecutor(workers) as pool:
            yield from pool.map(partial(self.chunk, seed), firsts, lasts)

    def command_line(self, count: int, seed: int) -> None:
        """Run from the command line; exit status 1 if something failed."""
        parser = argparse.ArgumentParser(description=self.what)
        parser.add_argument("--count", type=int, default=count)
        parser.add_argument("--seed", type=int, default=seed)
        parser.add_argument("--workers", type=int, default=1)
        parser.add_argument("--out", type=Path)
        if self.limit is not None:
            text = "processor seconds of a case; what takes longer is cut"
            parser.add_argument("--limit", type=float, default=self.limit, help=text)
        args = parser.parse_args()
        limited = self
        if self.limit is not None and args.limit != self.limit:
            limited = replace(self, chunk=partial(self.chunk, limit=args.limit))
        report = limited.run(args.count, args.seed, say, args.workers, args.out)
        print(*report.lines(), sep="\n")
        if args.out is not None:
            report.write(args.out)
        sys.exit(1 if report.failed else 0)


def in_words(commits: dict[tuple[int, int], str]) -> str:
    """Return the commit of most chunks, and the cases that were run on others.

    Examples
    --------
    >>> in_words({(0, 10): "a", (10, 20): "b", (20, 25): "a"})
    'a (cases 10 to 19: b)'
    """
    names = list(commits.values())
    if not any(names):
        return ""
    most = max(dict.fromkeys(names), key=names.count)
    others = [
        f"cases {a} to {b - 1}: {c or 'unknown'}" for (a, b), c in commits.items() if c != most
    ]
    return f"{most} ({'; '.join(others)})" if others else most


def keep(
    out: Path, seed: int, done: dict[str, Tally], seconds: float, commits: dict[str, str]
) -> None:
    """Write what is done, next to the report to come."""
    tallies = {k: asdict(v) for k, v in done.items()}
    data = {"seed": seed, "seconds": seconds, "commits": commits, "done": tallies}
    part = out.with_suffix(".part")
    part.write_text(json.dumps(data), encoding="utf-8")
    part.replace(out.with_suffix(".chunks"))


def restore(out: Path | None, seed: int) -> tuple[dict[str, Tally], float, dict[str, str]]:
    """Return what an earlier run with the same seed has done, the time it took, and each chunk's commit."""
    path = None if out is None else out.with_suffix(".chunks")
    if path is None or not path.exists():
        return {}, 0.0, {}
    data = json.loads(path.read_text(encoding="utf-8"))
    if data["seed"] != seed:
        return {}, 0.0, {}
    done = {}
    for name, tally in data["done"].items():
        listed = {k: [Failure(**f) for f in tally.get(k, ())] for k in ("failed", "aside")}
        done[name] = Tally(**{**tally, **listed})
    return done, data["seconds"], data.get("commits", {})
