"""Lyapunov maps: run time, accuracy and memory; prints the tables of docs/lyapunov.md.

``python benchmarks/lyapunov.py`` measures everything and renews the section of the page; ``--short`` takes
some seconds, and only prints. What is compared takes turns in one process. Where others share the machine the
processor time tells more than the clock: both are given.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from origin import origin, renewed

import contfric as cf
from contfric.chaos.rows import FollowingLimits, follow

sys.path.append(str(Path(__file__).parents[1]))
from tests.two_orbits import two_orbit_estimate

PAGE = Path(__file__).parents[1] / "docs" / "lyapunov.md"
BEGIN, END = "<!-- begin of benchmarks/lyapunov.py -->", "<!-- end of benchmarks/lyapunov.py -->"
#: The plane of Fig. 9 of the reference, its longest averages, and what a map may take on two
#: processors (s).
S0, PERIODS = 0.4, 600
ALLOWED = {100: 7.0, 150: 15.0}
#: Side and periods of the map whose memory is measured, and what it may take (MB). Its memory does not
#: depend on the periods: a hundredth of them serves.
LARGE, FEW, WANTED = 1000, 6, 500
#: Chaotic solutions with sticks; with damping the closed form takes complex numbers, with h a cubic.
MOTIONS = {
    "chaotic (Omega 0.35, S 0.05)": {"Omega": 0.35, "S": 0.05, "S0": 0.4},
    "chaotic, damped (zeta 0.002)": {"Omega": 0.35, "S": 0.05, "S0": 0.4, "zeta": 0.002},
    "chaotic, h = 0.05 (Omega 0.3, S 0.1)": {"Omega": 0.3, "S": 0.1, "S0": 0.4, "h": 0.05},
}


def reference_start(params: Any) -> tuple[float, float]:
    """The initial state of the reference."""
    return 1.0 + 0.9 * params["S0"], 0.0


def map_of(side: int, periods: int = PERIODS, **options: Any) -> cf.LyapunovMap:
    """Compute a map of the plane of Fig. 9."""
    grid = {"Omega": np.linspace(0.1, 0.6, side), "S": np.linspace(0.0, S0, side)}
    return cf.lyapunov_map(
        "coulomb", grid, {"S0": S0}, periods=periods, state=reference_start, **options
    )


@dataclass
class Clock:
    """Seconds by the clock and of the processors, of several rounds."""

    wall: list[float] = field(default_factory=list)
    busy: list[float] = field(default_factory=list)

    def time(self, call: Callable[[], Any]) -> Any:
        """Call and measure."""
        wall, busy = time.perf_counter(), time.process_time()
        found = call()
        self.wall.append(time.perf_counter() - wall)
        self.busy.append(time.process_time() - busy)
        return found


def maps(rounds: int, sides: tuple[int, ...]) -> list[str]:
    """Time of whole maps, and what is in them."""
    map_of(8, 2)  # what is compiled, loaded and imported once
    clocks = {side: Clock() for side in sides}
    found = {}
    for _ in range(rounds):
        for side, clock in clocks.items():
            found[side] = clock.time(lambda side=side: map_of(side))
    lines = [
        f"| map | wall (median) | wall (minimum) | wanted, on 2 processors | processor (minimum) "
        f"| a solution | periods followed (of {PERIODS + 100}) |",
        "|---|---|---|---|---|---|---|",
    ]
    for side, clock in clocks.items():
        allowed = f"{ALLOWED[side]:.0f} s" if side in ALLOWED else "-"
        lines.append(
            f"| {side} x {side} | {statistics.median(clock.wall):.2f} s | {min(clock.wall):.2f} s "
            f"| {allowed} | {min(clock.busy):.2f} s "
            f"| {min(clock.busy) / side**2 * 1e6:.0f} us | {found[side].followed.mean():.0f} |"
        )
    last = found[sides[-1]]
    kinds = ", ".join(f"{count} {motion.name.lower()}" for motion, count in last.counts().items())
    return [*lines, "", f"The {sides[-1]} x {sides[-1]} motions: {kinds}."]


def tangents(rounds: int, periods: int) -> list[str]:
    """Cost of a joint with the tangent map, next to the simulation alone."""
    model = cf.load_model("coulomb")
    lines = [
        "| motion | joints a period | simulation, a joint | with exponents, a joint | a period |",
        "|---|---|---|---|---|",
    ]
    for name, params in MOTIONS.items():
        start = np.array([reference_start(params)])
        vector = model.vector(params)[None]
        plain, full = Clock(), Clock()
        for _ in range(rounds):
            joints = len(
                plain.time(lambda: cf.simulate(model, params, state=start[0], periods=periods))  # noqa: B023
            )
            rows = full.time(
                lambda: follow(model, vector, start, 0.0, FollowingLimits(0, periods, 0.0))  # noqa: B023
            )
        assert rows.followed[0] == periods  # it is chaotic, to the end
        lines.append(
            f"| {name} | {joints / periods:.2f} | {min(plain.busy) / joints * 1e6:.2f} us "
            f"| {min(full.busy) / joints * 1e6:.2f} us | {min(full.busy) / periods * 1e6:.2f} us |"
        )
    return lines


def estimates(rounds: int) -> list[str]:
    """The tangent map next to the two-orbit estimate, on chaotic motions."""
    lines = [
        "| motion | tangent map | error | two orbits | error | difference in errors "
        "| time of the tangent map | of two orbits |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, params in MOTIONS.items():
        start = reference_start(params)
        one, two = Clock(), Clock()
        for _ in range(rounds):
            exact = one.time(
                lambda: cf.lyapunov_exponent(
                    "coulomb",
                    params,  # noqa: B023
                    state=start,  # noqa: B023
                    periods=PERIODS,
                    transient=100,
                    tolerance=0.0,
                )
            )
            rough = two.time(
                lambda: two_orbit_estimate("coulomb", params, state=start, periods=PERIODS)  # noqa: B023
            )
        apart = abs(exact.largest - rough.value) / np.hypot(exact.error, rough.error)
        lines.append(
            f"| {name} | {exact.largest:.5f} | {exact.error:.5f} | {rough.value:.5f} | {rough.error:.5f} | "
            f"{apart:.1f} | {min(one.busy) * 1e3:.1f} ms | {min(two.busy) * 1e3:.0f} ms |"
        )
    return lines


def accuracy(count: int) -> list[str]:
    """Exponents of random periodic solutions against the multipliers of the boundary-value problem."""
    rng = np.random.default_rng(11)
    worst, compared, sticking = 0.0, 0, 0
    while compared < count:
        s = rng.uniform(0.0, 0.6)
        params = {"Omega": rng.uniform(0.1, 1.3), "S": s, "S0": s * rng.uniform(1.0, 3.0) + 0.05}
        found = cf.lyapunov_exponent("coulomb", params, periods=PERIODS)
        if found.motion is not cf.Motion.PERIODIC or found.periods > 64:
            continue
        orbit = cf.find_orbit("coulomb", params)
        kept = np.abs(orbit.multipliers) > 0.0
        expected = np.log(np.abs(orbit.multipliers[kept])) / orbit.period
        worst = max(worst, float(np.max(np.abs(found.exponents[kept] - expected))))
        sticking += int(not kept.all())
        compared += 1
    return [
        f"{count} random periodic solutions ({sticking} with sticks): the exponents differ from "
        f"`ln|multiplier| / period` of the solved orbit by {worst:.1e} at most (wanted: 1e-6)."
    ]


def executors(rounds: int, side: int) -> list[str]:
    """The same map on one thread, on threads, and on processes that are running already."""
    clocks = {name: Clock() for name in ("one thread", "two threads", "two processes")}
    seen = set()
    with (
        ThreadPoolExecutor(1) as one,
        ThreadPoolExecutor(2) as threads,
        ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes,
    ):
        pools = dict(zip(clocks, (one, threads, processes), strict=True))
        map_of(16, 10, executor=processes, tile=4)  # they load what they need
        for _ in range(rounds):
            for name, pool in pools.items():
                found = clocks[name].time(lambda pool=pool: map_of(side, executor=pool))
                seen.add(found.rows.exponents.tobytes())
    assert len(seen) == 1, "the bits depend on the executor"
    lines = [f"| {side} x {side} on | wall (minimum) |", "|---|---|"]
    lines += [f"| {name} | {min(clock.wall):.2f} s |" for name, clock in clocks.items()]
    return [*lines, "", "The results are the same to the last bit."]


def memory() -> list[str]:
    """Peak of a large map, in a fresh process."""
    done = subprocess.run(
        [sys.executable, __file__, "--memory"], capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)
    return [
        f"A map of {LARGE} x {LARGE} points ({FEW} periods each) takes {found['peak']:.0f} MB at its "
        f"peak (wanted: below {WANTED} MB), of which {found['before']:.0f} MB are Python, numpy and numba "
        f"with the kernel, and {found['results']:.0f} MB the results."
    ]


def measure_memory() -> None:
    """Print the memory of this process before and after a large map, MB."""
    from dataclasses import fields

    from scale_memory import peak

    map_of(8, 2, transient=1)
    before = peak()
    found = map_of(LARGE, FEW, transient=1)
    results = sum(getattr(found.rows, f.name).nbytes for f in fields(found.rows))
    print(json.dumps({"before": before, "peak": peak(), "results": results / 1e6}))


def report(short: bool) -> str:
    """Measure, and return the tables."""
    rounds, sides = (1, (20, 30)) if short else (5, (100, 150))
    began = time.perf_counter()
    parts = [
        maps(rounds, sides),
        executors(rounds, 20 if short else 100),
        tangents(3 if short else 9, 500 if short else 5000),
        estimates(1 if short else 3),
        accuracy(20 if short else 500),
    ]
    if not short:
        parts.append(memory())
    took = time.perf_counter() - began
    head = (
        f"Written by `make bench` (`benchmarks/lyapunov.py`, which took {took:.0f} s): {origin()}. Medians "
        f"and minima of {rounds} rounds in turns, warm. The plane is that of Fig. 9 of the article (S0 = "
        "0.4, Omega from 0.1 to 0.6, S from 0 to 0.4), with its initial state."
    )
    return "\n\n".join([head, *("\n".join(part) for part in parts)])


def main() -> None:
    """Measure, print, and renew the page unless it was a short run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="some seconds, and nothing is written")
    parser.add_argument("--memory", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.memory:
        measure_memory()
        return
    text = report(options.short)
    print(text)
    if not options.short:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(renewed(page, BEGIN, END, text), encoding="utf-8")


if __name__ == "__main__":
    main()
