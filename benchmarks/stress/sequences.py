"""Simulations of contfric against the reference of fifty digits, event by event.

    python benchmarks/stress/sequences.py --count 100000 --seed 1 --workers 2 --out sequences.json

What is drawn stands in :mod:`sequence_cases`, what is compared in :mod:`sequence_compare`, and what errors
are measured against in :mod:`sequence_errors`. With ``--out`` each chunk that is done is kept beside the
report, and a run that was interrupted goes on from there.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from pathlib import Path

from report import Failure, Report, Tally, say
from sequence_cases import draw
from sequence_compare import MAX_EVENTS, PERIODS, compare

#: Trajectories in one chunk of work: some ten seconds, after which the file is written.
CHUNK = 250
#: Cases with the largest ratio of error to bound that a report names.
WORST = 5
WHAT = (
    f"Simulations over {PERIODS} periods of the excitation (at most {MAX_EVENTS} events) against fifty "
    "digits: mode, surface, time and position of each event."
)


def chunk(seed: int, first: int, last: int) -> Tally:
    """Compare the cases of a range of indices."""
    tally = Tally()
    for index in range(first, last):
        tally.index = index
        compare(draw(seed, index), tally)
    keep_worst(tally.worst)
    return tally


def keep_worst(worst: dict[str, float]) -> None:
    """Keep the worst few cases only."""
    names = sorted((n for n in worst if "case" in n), key=lambda n: worst[n], reverse=True)
    for name in names[WORST:]:
        del worst[name]


def merged(tallies: list[Tally]) -> Tally:
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
    keep_worst(whole.worst)
    return whole


def run(
    count: int,
    seed: int,
    progress: Callable[[str], None] | None = None,
    workers: int = 1,
    out: Path | None = None,
) -> Report:
    """Compare ``count`` trajectories; with ``out``, what is done is kept there and not done again."""
    began = time.perf_counter()
    done, spent = restore(out, seed)
    ranges = [(first, min(first + CHUNK, count)) for first in range(0, count, CHUNK)]
    todo = [r for r in ranges if f"{r[0]}-{r[1]}" not in done]
    for (first, last), tally in zip(todo, _results(seed, todo, workers), strict=True):
        done[f"{first}-{last}"] = tally
        if out is not None:
            keep(out, seed, done, spent + time.perf_counter() - began)
        if progress is not None:
            progress(
                f"{len(done)}/{len(ranges)} chunks, {len(merged(list(done.values())).failed)} failed"
            )
    whole = merged([done[f"{a}-{b}"] for a, b in ranges])
    return whole.report("sequences", WHAT, count, seed, spent + time.perf_counter() - began)


def _results(seed: int, ranges: list[tuple[int, int]], workers: int) -> Iterator[Tally]:
    firsts, lasts = [r[0] for r in ranges], [r[1] for r in ranges]
    if workers <= 1:
        yield from map(partial(chunk, seed), firsts, lasts)
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(partial(chunk, seed), firsts, lasts)


def keep(out: Path, seed: int, done: dict[str, Tally], seconds: float) -> None:
    """Write what is done, beside the report to come."""
    data = {"seed": seed, "seconds": seconds, "done": {k: asdict(v) for k, v in done.items()}}
    part = out.with_suffix(".part")
    part.write_text(json.dumps(data), encoding="utf-8")
    part.replace(out.with_suffix(".chunks.json"))


def restore(out: Path | None, seed: int) -> tuple[dict[str, Tally], float]:
    """Return what an earlier run with the same seed has done, and the time it took."""
    path = None if out is None else out.with_suffix(".chunks.json")
    if path is None or not path.exists():
        return {}, 0.0
    data = json.loads(path.read_text(encoding="utf-8"))
    if data["seed"] != seed:
        return {}, 0.0
    done = {}
    for name, tally in data["done"].items():
        done[name] = Tally(**{**tally, "failed": [Failure(**f) for f in tally["failed"]]})
    return done, data["seconds"]


def main() -> None:
    parser = argparse.ArgumentParser(description=WHAT)
    parser.add_argument("--count", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    report = run(args.count, args.seed, say, args.workers, args.out)
    print(*report.lines(), sep="\n")
    if args.out is not None:
        report.write(args.out)
    sys.exit(1 if report.failed else 0)


if __name__ == "__main__":
    main()
