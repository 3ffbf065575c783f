"""What gradients cost, against the solve of the orbit: ``python benchmarks/gradients.py``.

Each round times each of them three times in a row (the first one finds other code in the processor's
caches), one after the other, so that what else runs on the machine meets all alike; the least of three
counts, and ratios are medians over rounds of the ratio within one. Solves are compared with: by simulation
(find_orbit); the user's call of a signature, from nothing; Newton's method from an orbit at parameters a
thousandth away, the call of one kernel; and a point of a branch, with its multipliers and margins.
A gradient is asked of the orbit as find_orbit returns it, so that it is what comes on top of the
solve; "several" are all of them, asked of one orbit, and "at once" by one call of ``gradients``. "orbit" is
dz/dp, the derivatives of joints by parameters: they share it, and every other one has it computed anew.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from typing import Any

import contfric as cf
from contfric.orbit.gradient import by_parameters
from contfric.orbit.solve import refine

ROUNDS, REPEATS = 20, 3
SOLVES = ("find_orbit", "the user's call", "Newton's method", "a branch")
QUANTITIES = ("x_max", "mean({v})", "rms({v})", "amplitude({x}, 1)", "energy")
#: Cases: model, signature (or none: found by simulation), parameters, and a range of one parameter.
CASES: dict[str, tuple[str, str, dict[str, float], str, tuple[float, float]]] = {
    "closed form (coulomb 1a)": (
        *("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4}),
        *("Omega", (0.45, 0.55)),
    ),
    "affine (jenkins)": ("jenkins", "", {"muN": 1.4, "W": 1.3}, "W", (1.2, 1.4)),
    "integrated (stribeck)": ("stribeck", "", {}, "", (0.0, 0.0)),
}


def seconds(call: Callable[[cf.Orbit], Any], orbit: cf.Orbit) -> float:
    """Return how long a call takes, in time of the processor: the least of some in a row.

    Each is handed a copy of the orbit, of which nothing but what its solve leaves is known.
    """
    found = []
    for _ in range(REPEATS):
        fresh = copy(orbit)
        start = time.process_time()
        call(fresh)
        found.append(time.process_time() - start)
    return min(found)


def calls(name: str) -> tuple[cf.Orbit, dict[str, Callable[[cf.Orbit], Any]]]:
    """Return the orbit of a case, and what is timed of it, the solve first."""
    model, signature, params, parameter, limits = CASES[name]
    loaded, found = cf.load_model(model), cf.find_orbit(model, params)
    timed: dict[str, Callable[[cf.Orbit], Any]] = {
        "find_orbit": lambda _: cf.find_orbit(loaded, params)
    }
    if signature:
        timed["the user's call"] = lambda _: cf.solve_orbit(model, signature, params)
    moved = found.vector.copy()
    moved[0] *= 1.001
    timed["Newton's method"] = lambda orbit: refine(replace(orbit, vector=moved))
    if parameter:
        timed["a branch"] = lambda orbit: cf.continue_orbit(orbit, parameter, limits)
    timed["orbit"] = by_parameters
    x, v = loaded.states[:2]
    asked = [text.format(x=x, v=v) for text in QUANTITIES]
    asked = [text for text in asked if text in cf.quantity_names(model) or "(" in text]
    for quantity in asked:
        timed[f"{quantity}, value"] = lambda orbit, q=quantity: orbit.quantity(q)
        timed[f"{quantity}, gradient"] = lambda orbit, q=quantity: orbit.gradient(q)

    def several(orbit: cf.Orbit) -> None:
        for quantity in asked:
            orbit.gradient(quantity)

    timed["several, gradient"] = several
    timed["at once, gradients"] = lambda orbit: orbit.gradients(asked)
    return found, timed


def main() -> None:
    """Print times and ratios."""
    for name in CASES:
        orbit, timed = calls(name)
        points = len(timed["a branch"](orbit)) if "a branch" in timed else 1
        for call in timed.values():
            call(copy(orbit))
        rounds = [
            {what: seconds(call, orbit) for what, call in timed.items()} for _ in range(ROUNDS)
        ]
        for each in rounds:
            each["a branch"] = each.get("a branch", 0.0) / points
        solves = [what for what in SOLVES if what in timed]
        print(
            f"\n{name}: ms, and as a share of {', '.join(solves)} (a branch: of one of its points)"
        )
        for what in timed:
            median = statistics.median(each[what] for each in rounds) * 1e3
            ratios = [statistics.median(each[what] / each[s] for each in rounds) for s in solves]
            print(f"{what:28s} {median:8.3f}  " + "  ".join(f"{ratio:9.3f}" for ratio in ratios))


if __name__ == "__main__":
    main()
