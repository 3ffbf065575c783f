"""Exponents of integrated models: cost next to the closed form, where it goes, and the first call.

``python benchmarks/lyapunov_models.py`` measures and renews its section of docs/lyapunov.md; ``--first`` only
prints what the first call costs (minutes of compilation). Times are least processor times of several rounds.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from origin import origin, renewed

import contfric as cf
from contfric.chaos.rows import FollowingLimits, follow
from contfric.simulation.simulate import Trajectory, tables

PAGE = Path(__file__).parents[1] / "docs" / "lyapunov.md"
BEGIN = "<!-- begin of benchmarks/lyapunov_models.py -->"
END = "<!-- end of benchmarks/lyapunov_models.py -->"
#: Solutions that never end: chaotic ones. Model, parameters.
MOTIONS: dict[str, tuple[str, dict[str, float]]] = {
    "coulomb, in closed form": ("coulomb", {"Omega": 0.35, "S": 0.05, "S0": 0.4}),
    "coulomb-yaml, the same solution": ("coulomb-yaml", {"Omega": 0.35, "S": 0.05, "S0": 0.4}),
    "popp": ("popp", {"omega": 1.69, "F": 0.1}),
    "impact": ("impact", {"w": 2.8, "d": 0.0}),
    "bang-bang": ("bang-bang", {"A": 100.0}),
    "lugre": ("lugre", {"Omega": 0.5, "S": 0.372, "S0": 0.4}),
}
#: Periods of a measured motion, joints whose parts are measured, and rounds of each measurement.
PERIODS, JOINTS, ROUNDS = 100, 60, 7
NONE, EMPTY, NOTHING = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))


def least(call: Callable[[], Any], rounds: int = ROUNDS) -> float:
    """Least processor time of a call, seconds."""
    best = math.inf
    for _ in range(rounds):
        began = time.process_time()
        call()
        best = min(best, time.process_time() - began)
    return best


def many(call: Callable[[], Any]) -> float:
    """The same of a short call, a millisecond at a time."""
    times = 1 + int(1e-3 / max(least(call, 2), 1e-6))
    return least(lambda: [call() for _ in range(times)], 3) / times


def parts(model: cf.Model, vector: Any, motion: Trajectory) -> tuple[float, float, float]:
    """Return the mean time of a joint's hits, flow with derivatives and flow without, seconds."""
    table, n = tables(model), len(model.states)
    workspace, jac = np.empty(n), np.empty((n, 2 + n))
    hits, full, plain = 0.0, 0.0, 0.0
    period = float(model.flow.period(vector, NONE, EMPTY))
    for k in range(len(motion) - JOINTS - 1, len(motion) - 1):
        mode, t, y = int(motion.modes[k + 1]), float(motion.times[k]), motion.states[k].copy()
        d = float(motion.times[k + 1]) - t + period * int(motion.cycles[k + 1] - motion.cycles[k])
        if table.bounds[0, motion.exits[k]] == 2:
            before, y = y, np.empty(n)
            model.flow.reset(int(motion.exits[k]), t, before, vector, NONE, y, NOTHING)
        for c in np.flatnonzero(table.bounds[mode]):
            level, on = float(model.flow.level(c, vector, NONE, EMPTY)), bool(c == motion.exits[k])
            ask = (mode, int(table.observables[c]), level, on, t, y, 1.001 * d, vector, workspace)
            hits += many(lambda ask=ask: model.flow.hit(*ask))
        flow = (mode, t, y, d, vector, NONE, workspace)
        full += many(lambda flow=flow: model.flow.flow(*flow, jac))
        plain += many(lambda flow=flow: model.flow.flow(*flow, NOTHING))
    return hits / JOINTS, full / JOINTS, plain / JOINTS


def costs() -> list[str]:
    """Return the table of what a joint costs, and where the time goes."""
    lines = [
        "| chaotic motion | joints a period | simulation, a joint | with exponents, a joint | of that: hits "
        "| flow with derivatives | the rest | the same flow without derivatives | a period |",
        "|---" * 9 + "|",
    ]
    for name, (which, params) in MOTIONS.items():
        model = cf.load_model(which)
        vector = model.vector(params)
        states = np.array([[1.36, 0.0]])  # that of the reference
        if not which.startswith("coulomb"):
            states = np.array(cf.simulate(model, params, periods=100).last[2])[None]
        motion = cf.simulate(model, params, state=states[0], periods=PERIODS)
        joints, limits = len(motion), FollowingLimits(0, PERIODS, 0.0)
        plain = least(
            lambda: cf.simulate(model, params, state=states[0], periods=PERIODS)  # noqa: B023
        )
        full = least(lambda: follow(model, vector[None], states, 0.0, limits))  # noqa: B023
        one = full / joints
        cells = "| - | - | - | - "  # of a microsecond a call from Python would be most
        if which != "coulomb":
            hits, flow, bare = parts(model, vector, motion)
            cells = (
                f"| {hits / one:.0%} | {flow / one:.0%} | {max(0.0, 1 - (hits + flow) / one):.0%} "
                f"| {bare * 1e6:.1f} us "
            )
        lines.append(
            f"| {name} | {joints / PERIODS:.2f} | {plain / joints * 1e6:.1f} us | {one * 1e6:.1f} us "
            f"{cells}| {full / PERIODS * 1e6:.0f} us |"
        )
        print(lines[-1], flush=True)
    return lines


def maps() -> list[str]:
    """Return how much a map costs next to the closed form."""
    grid = {"Omega": np.linspace(0.1, 0.6, 12), "S": np.linspace(0.0, 0.4, 10)}
    took = {}
    for name in ("coulomb", "coulomb-yaml"):
        took[name] = least(
            lambda: cf.lyapunov_map(name, grid, {"S0": 0.4}),  # noqa: B023
            3,
        )
    ratio = took["coulomb-yaml"] / took["coulomb"]
    return [
        f"A map of 12 x 10 solutions of the plane of Fig. 9 takes {took['coulomb']:.3f} s in closed form and "
        f"{took['coulomb-yaml']:.2f} s as `coulomb-yaml` (processor time): **generality costs a factor of "
        f"{ratio:.0f}**."
    ]


COLD = """
import sys, time
import contfric as cf
model = cf.load_model(sys.argv[1])
def took(call):
    began = time.process_time(); call(); return time.process_time() - began
from contfric.chaos.cells import follow_cells
first = took(lambda: cf.lyapunov_exponent(model, periods=1, transient=0))
print(first, took(lambda: model.flow.functions()))
"""


def cold() -> None:
    """Print what the first call costs in a new cache, and what is left out of it."""
    for name in ("coulomb", "popp", "lugre"):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                [sys.executable, "-c", COLD, name],
                env={**os.environ, "CONTFRIC_CACHE_DIR": folder},
                capture_output=True,
                text=True,
                check=True,
            )
        first, rest = (float(text) for text in done.stdout.split())
        print(f"{name}: {first:.0f} s; stationary points, which it does not ask for: {rest:.0f} s")


def main() -> None:
    """Measure, print, and renew the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", action="store_true", help="the first call alone, printed")
    options = parser.parse_args()
    if options.first:
        cold()
        return
    head = (
        f"Written by `make bench` (`benchmarks/lyapunov_models.py`): {origin()}. Least processor times of "
        "several rounds, warm. A tolerance of 1e-12."
    )
    text = "\n\n".join([head, *("\n".join(part) for part in (costs(), maps()))])
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(renewed(page, BEGIN, END, text), encoding="utf-8")


if __name__ == "__main__":
    main()
