"""Whether anything got slower: tasks of the engine against a yardstick of the machine, and what is stored.

``make gate`` times each task in turns with a yardstick, and compares the ratio with that of
``benchmarks/gate.json``; what is above 1.25 times that is named, and the command fails. The yardstick is a
plain compiled loop of sines; for short branches and curves, half of whose time is between kernels, that loop
and one of small objects and arrays: machines run compiled code and Python at different ratios. (The very
sources for which ratios were first stored need 1.2 to 1.5 times these on another machine for the short tasks,
against the compiled loop alone, and 1.0 times for the others.)
``python benchmarks/gate.py --store`` writes the file anew. A machine under load slows both alike, but not
evenly: ratios are medians of the better half of the turns.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from bench_engine import branch_in_default_steps, branch_of, diagram_of_fig05, simulation

import contfric as cf
from contfric.base.arrays import FloatArray

STORED = Path(__file__).with_name("gate.json")
#: More than this times the stored ratio is slower, whatever the noise of two medians.
SLOWER = 1.25
#: Processor time that a task and its yardstick get (s): a dozen tasks take a minute.
SHARE = 4.0
#: Turns of a task at the least and at the most.
FEWEST, MOST = 3, 40
#: Passes of the compiled loop, and of that of objects: 5 to 10 ms each.
LOOP, OBJECTS = 400_000, 3_000


@numba.njit  # type: ignore[misc]
def turn_of_sines(count: int) -> float:
    """Sum sines and cosines: what the closed forms are made of."""
    total = 0.0
    for i in range(count):
        total += np.sin(1e-3 * i) * np.cos(2e-3 * i)
    return total


@dataclass(frozen=True)
class Held:
    """What the loop of objects makes one of at each pass."""

    row: FloatArray
    number: int

    @property
    def least(self) -> float:
        """The least element."""
        return float(self.row.min())


def turn_of_objects(count: int) -> float:
    """Make objects, copies of small arrays and calls: what is between kernels."""
    row, total = np.array((0.5, 1.5, 2.5)), 0.0
    for i in range(count):
        held = Held(row.copy(), i)
        total += held.least + len({"held": held})
    return total


def compiled_yardstick() -> None:
    """Take as long as the machine does for what is compiled."""
    turn_of_sines(LOOP)


def mixed_yardstick() -> None:
    """Take as long as the machine does for what is compiled and for what is between."""
    turn_of_sines(LOOP)
    turn_of_objects(OBJECTS)


def curve() -> Callable[[], object]:
    """Return a call that continues the fold of Fig. 5 in two parameters."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    branch = cf.continue_orbit(orbit, "Omega", (0.4, 0.6))
    fold = next(b for b in branch.bifurcations if b.kind is cf.Kind.SN)
    box = {"Omega": (0.4, 0.7), "S": (0.2, 0.4)}
    return lambda: cf.continue_bifurcation(fold, ("Omega", "S"), box)


def branch_in(model: str, parameter: str, bounds: tuple[float, float]) -> Callable[[], object]:
    """Return a call that continues the orbit that a model converges to."""
    orbit = cf.find_orbit(model)
    return lambda: cf.continue_orbit(orbit, parameter, bounds)


def exponent() -> Callable[[], object]:
    """Return a call that computes Lyapunov exponents of a chaotic motion."""
    params = {"Omega": 0.3, "S": 0.1, "S0": 0.4}
    return lambda: cf.lyapunov_exponent("coulomb", params, periods=2000, tolerance=0.0)


#: Tasks half of whose time is between kernels.
SHORT = {"1a in default steps", "Fig. 5 explored", "fold curve", "branch of coulomb-yaml"}

#: What is timed; each entry makes the call (and pays for its start).
TASKS: dict[str, Callable[[], Callable[[], object]]] = {
    "1a in fine steps": lambda: branch_of("1a"),
    "2s in fine steps": lambda: branch_of("2s"),
    "2a, 14 segments, in fine steps": lambda: branch_of("2a-14seg"),
    "1a in default steps": branch_in_default_steps,
    "Fig. 5 explored": diagram_of_fig05,
    "simulation, slides and sticks": lambda: simulation(5000),
    "simulation, slides": lambda: simulation(5000, sticks=False),
    "fold curve": curve,
    "Lyapunov exponents": exponent,
    "branch of coulomb-yaml": lambda: branch_in("coulomb-yaml", "Omega", (0.49, 0.52)),
    "branch of popp": lambda: branch_in("popp", "omega", (1.0, 1.05)),
    "orbit of lugre, simulated and solved": lambda: lambda: cf.find_orbit("lugre"),
}


def spent(call: Callable[[], object]) -> float:
    """Return the processor time of a call."""
    began = time.process_time()
    call()
    return time.process_time() - began


def ratio(call: Callable[[], object], yardstick: Callable[[], None]) -> float:
    """Return the time of a task in turns of the yardstick: the median of the better half of the turns."""
    call()
    found: list[float] = []
    began = time.process_time()
    while len(found) < MOST and (len(found) < FEWEST or time.process_time() - began < SHARE):
        before = spent(yardstick)
        taken = spent(call)
        after = spent(yardstick)
        found.append(2.0 * taken / (before + after))
    return statistics.median(sorted(found)[: (len(found) + 1) // 2])


def main() -> int:
    """Time all tasks; 1 if one of them got slower."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--store", action="store_true", help="write gate.json anew")
    options = parser.parse_args()
    mixed_yardstick()
    stored = json.loads(STORED.read_text(encoding="utf-8")) if STORED.exists() else {}
    found, slower = {}, []
    for name, prepare in TASKS.items():
        yardstick = mixed_yardstick if name in SHORT else compiled_yardstick
        found[name] = round(ratio(prepare(), yardstick), 4)
        before = stored.get(name)
        against = "" if before is None else f"{found[name] / before:8.2f} times the stored one"
        print(f"{name:38s}{found[name]:12.3f}{against}", flush=True)
        if before is not None and found[name] > SLOWER * before:
            slower.append(name)
    if options.store:
        STORED.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        return 0
    if slower:
        print(f"slower by more than {SLOWER:g}: {', '.join(slower)}", file=sys.stderr)
    return 1 if slower else 0


if __name__ == "__main__":
    sys.exit(main())
