"""What a point of a curve in two parameters costs, march alone and all in all.

``python benchmarks/curves.py`` renews the table of docs/curves.md. Processor times of warm kernels, the best
of several runs: the march is the compiled loop (Newton, tangent, everything that is watched), the curve is
the call of a user (start, both sides, points of codimension two, the result), a short curve goes to the next
thousandth of both parameters.
"""

from __future__ import annotations

import time
from pathlib import Path

from origin import origin, renewed

import contfric as cf
from contfric.continuation.points import PointRows
from contfric.curves.points import first_curve_point, march_rows
from contfric.curves.problem import problem_of
from contfric.curves.ranges import box_of

PLANE, RANGES = ("Omega", "S"), {"Omega": (0.4, 0.6), "S": (0.05, 0.39)}
START = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
PAGE = Path(__file__).parents[1] / "docs" / "curves.md"
BEGIN, END = "<!-- begin of benchmarks/curves.py -->", "<!-- end of benchmarks/curves.py -->"
#: How far a short curve goes to each side, in both parameters.
NEAR = 1e-3
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
        rows = PointRows.empty(problem.system, points, 2)
        rows.put(0, start)
        began = time.process_time()
        _, last, _ = march_rows(problem, rows, 0, start, 0, border.copy(), STEP, STEP)
        best = min(best, (time.process_time() - began) / max(last, 1))
    return 1e6 * best, last


def curve_cost(bifurcation, ranges, max_step, runs=10):
    """Milliseconds of a whole curve, its number of points, and that of its points of codimension two."""
    best, curve = float("inf"), None
    for _ in range(runs):
        began = time.process_time()
        curve = cf.continue_bifurcation(bifurcation, PLANE, ranges, max_step=max_step)
        best = min(best, time.process_time() - began)
    return 1e3 * best, len(curve), len(curve.special)


def row_of(label, bifurcation) -> str:
    """One line of the table."""
    march, _ = march_cost(bifurcation)
    near = {name: bifurcation.params[name] for name in PLANE}
    around = {name: (value - NEAR, value + NEAR) for name, value in near.items()}
    short, few, _ = curve_cost(bifurcation, around, None)
    plain, count, special = curve_cost(bifurcation, RANGES, None)
    fine, many, _ = curve_cost(bifurcation, RANGES, 1e-3)
    cells = [label, str(bifurcation.orbit.system.segments), f"{march:.1f}"]
    cells += [f"{short:.2f} ({few})", f"{plain:.1f} ({count}, {special})"]
    cells += [f"{1e3 * plain / count:.0f}", f"{1e3 * fine / many:.0f}"]
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    """Measure, and renew the table."""
    rows = [row_of(label, bifurcation) for label, bifurcation in events().items()]
    lines = [
        f"Written by `make bench` (`benchmarks/curves.py`): {origin()}.",
        "",
        "| curve | segments solved | march, us a point | short curve, ms (points) "
        "| curve, ms (points, special ones) | curve, us a point | a tenth of the step |",
        "|---" * 7 + "|",
        *rows,
    ]
    text = "\n".join(lines)
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8"), BEGIN, END, text), encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
