"""What a point of a curve in two parameters costs, march alone and all in all.

Run with ``python benchmarks/curves.py``. Processor times of warm kernels, the best of several runs: the
march is the compiled loop (Newton, tangent, everything that is watched), the curve is the call of a user
(start, both sides, points of codimension two, the result).
"""

from __future__ import annotations

import time

import contfric as cf
from contfric.continuation.points import Rows
from contfric.curves.points import first_curve_point, march_rows
from contfric.curves.problem import problem_of
from contfric.curves.ranges import box_of

PLANE, RANGES = ("Omega", "S"), {"Omega": (0.4, 0.6), "S": (0.05, 0.39)}
START = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
#: Step of the measured marches: short, so that no event is on the way and every step is accepted.
STEP = 1e-4


def events():
    """Bifurcations to start from: those of Fig. 5 and of Fig. 4."""
    across = cf.explore(cf.find_orbit("coulomb", START), "Omega", (0.4, 0.6), bridges=False)
    orbit = cf.solve_orbit("coulomb", "1a", {**START, "S": 0.2})
    down = cf.explore(orbit, "S", (0.02, 0.4), bridges=False)
    found = {}
    for diagram in (across, down):
        for branch in diagram.branches:
            for b in branch.bifurcations:
                if b.kind.value != "T":
                    found.setdefault(b.label, b)
    return found


def march_cost(bifurcation, points=60, runs=40):
    """Microseconds a point of the compiled march; short runs, which no other process interrupts."""
    problem = problem_of(bifurcation, box_of(bifurcation.orbit.model, PLANE, RANGES))
    start, border = first_curve_point(problem, bifurcation.orbit)
    best = float("inf")
    for _ in range(runs):
        rows = Rows.empty(problem.system, points, 2)
        rows.put(0, start)
        began = time.process_time()
        _, last, _ = march_rows(problem, rows, 0, start, 0, border.copy(), STEP, STEP)
        best = min(best, (time.process_time() - began) / max(last, 1))
    return 1e6 * best, last


def curve_cost(bifurcation, max_step, runs=10):
    """Microseconds a point of a whole curve, and its number of points."""
    best, count = float("inf"), 0
    for _ in range(runs):
        began = time.process_time()
        curve = cf.continue_bifurcation(bifurcation, PLANE, RANGES, max_step=max_step)
        best = min(best, time.process_time() - began)
        count = len(curve)
    return 1e6 * best / count, count


def main() -> None:
    print(
        f"{'curve':>16} {'segments':>8} {'march':>9} {'curve':>9} {'points':>7} {'fine':>9} {'points':>7}"
    )
    for label, bifurcation in events().items():
        march, _ = march_cost(bifurcation)
        plain, count = curve_cost(bifurcation, None)
        fine, many = curve_cost(bifurcation, 1e-3)
        segments = bifurcation.orbit.system.segments
        print(
            f"{label:>16} {segments:8d} {march:6.1f} us {plain:6.1f} us {count:7d} {fine:6.1f} us {many:7d}"
        )


if __name__ == "__main__":
    main()
