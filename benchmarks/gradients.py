"""What gradients cost, against the solve of the orbit: ``python benchmarks/gradients.py``.

Each round times all of them once, one after the other, so that what else runs on the machine meets all
alike; ratios are medians over rounds of the ratio within one. Solves are compared with: the user's call, from
nothing, of a signature and by simulation (find_orbit); Newton's method from an orbit at parameters a
thousandth away, the call of one kernel; and a point of a branch, with its multipliers and margins. "orbit" is
dz/dp, the derivatives of all joints by all parameters, which quantities share; every gradient here has it
computed anew.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import contfric as cf
from contfric.orbit.gradient import by_parameters
from contfric.orbit.solve import refine

ROUNDS = 40
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


def seconds(call: Callable[[], Any]) -> float:
    """Return how long a call takes, in time of the processor."""
    start = time.process_time()
    call()
    return time.process_time() - start


def calls(name: str) -> dict[str, Callable[[], Any]]:
    """Return what is timed for a case: the solves first."""
    model, signature, params, parameter, limits = CASES[name]

    def solved() -> cf.Orbit:
        return (
            cf.solve_orbit(model, signature, params) if signature else cf.find_orbit(model, params)
        )

    orbit = solved()
    moved = orbit.vector.copy()
    moved[0] *= 1.001
    found: dict[str, Callable[[], Any]] = {
        "the user's call": solved,
        "find_orbit": lambda: cf.find_orbit(orbit.model, params),
        "Newton's method": lambda: refine(replace(orbit, vector=moved)),
    }
    if parameter:
        found["a branch"] = lambda: cf.continue_orbit(orbit, parameter, limits)
    found["orbit"] = lambda: by_parameters(replace(orbit))
    x, v = orbit.model.states[:2]
    for text in QUANTITIES:
        quantity = text.format(x=x, v=v)
        if quantity in cf.quantity_names(model) or "(" in quantity:
            found[f"{quantity}, value"] = lambda q=quantity: replace(orbit).quantity(q)
            found[f"{quantity}, gradient"] = lambda q=quantity: replace(orbit).gradient(q)
    return found


def main() -> None:
    """Print times and ratios."""
    for name in CASES:
        timed = calls(name)
        points = len(timed["a branch"]()) if "a branch" in timed else 0
        for call in timed.values():
            call()
        rounds = [{what: seconds(call) for what, call in timed.items()} for _ in range(ROUNDS)]
        if points:
            for each in rounds:
                each["a branch"] /= points
        solves = [
            what
            for what in ("the user's call", "find_orbit", "Newton's method", "a branch")
            if what in timed
        ]
        print(
            f"\n{name}: ms, and as a share of {', '.join(solves)} (a branch: of one of its points)"
        )
        for what in timed:
            median = statistics.median(each[what] for each in rounds) * 1e3
            ratios = [statistics.median(each[what] / each[s] for each in rounds) for s in solves]
            print(f"{what:28s} {median:8.3f}  " + "  ".join(f"{ratio:9.3f}" for ratio in ratios))


if __name__ == "__main__":
    main()
