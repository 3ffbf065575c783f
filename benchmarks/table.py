"""Write docs/benchmarks.md: medians of repeated runs, all in one process, in turns."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from pathlib import Path

from bench_engine import (
    CASES,
    branch_in_default_steps,
    branch_of,
    diagram_of_fig05,
    simulation,
)
from origin import origin

ROUNDS = 15
#: The other pages.
FURTHER = (
    "Further: [cost at scale](benchmarks-scale.md) (segments, a million points, each monitor on and off),",
    "[cost of a scene](benchmarks-scenes.md) (what it does and skips, cold and warm),",
    "[run time against error](benchmarks-error.md) (next to other packages),",
    "[AUTO-07p](benchmarks-auto.md) (a branch, paired),",
    "[number of states](benchmarks-states.md) (a chain with a contact, next to scipy and heyoka),",
    "[sweeps and basins](benchmarks-everyday.md) (next to a loop with scipy, and to recurrences),",
    "[curves in two parameters](curves.md#cost), [Lyapunov maps](lyapunov.md#run-time-accuracy-memory),",
    "[numerical integration](benchmarks-integrated.md).",
)


def count(result: object) -> int:
    """Return the number of points or events of a result."""
    if isinstance(result, int):
        return result
    if hasattr(result, "branches"):
        return sum(len(b) for b in result.branches if not b.mirrored)
    return len(result)  # type: ignore[arg-type]


def measure(calls: dict[str, Callable[[], object]]) -> dict[str, tuple[float, float, int]]:
    """Return (median, minimum, units) of the seconds of each call; the calls take turns."""
    units = {name: count(call()) for name, call in calls.items()}  # also the warm-up
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            start = time.perf_counter()
            call()
            seconds[name].append(time.perf_counter() - start)
    return {n: (statistics.median(s), min(s), units[n]) for n, s in seconds.items()}


def main() -> None:
    """Measure and write the page."""
    calls: dict[str, Callable[[], object]] = {}
    for name in CASES:
        calls[f"branch {name}, everything on"] = branch_of(name)
        calls[f"branch {name}, without multipliers"] = branch_of(name, stability=False)
    calls["diagram of Fig. 5, all branches"] = diagram_of_fig05()
    calls["branch 1a of Fig. 5 in default steps"] = branch_in_default_steps()
    calls["simulation, an event (two slides and a stick a period)"] = simulation()
    calls["simulation without sticks, a slide"] = simulation(sticks=False)
    lines = [
        "# Benchmarks",
        "",
        f"Written by `make bench`: {origin()}.",
        f"Warm, one process, medians of {ROUNDS} rounds in turns. A point of a branch",
        "includes Newton, tangent, multipliers, admissibility, event tests and the location of events.",
        "",
        "| what | units | median total | per unit (median) | per unit (minimum) |",
        "|---|---|---|---|---|",
    ]
    for name, (median, least, units) in measure(calls).items():
        lines.append(
            f"| {name} | {units} | {median * 1e3:.2f} ms | {median / units * 1e6:.2f} us "
            f"| {least / units * 1e6:.2f} us |"
        )
    lines += ["", *FURTHER]
    page = Path(__file__).parents[1] / "docs" / "benchmarks.md"
    page.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
