"""Write docs/benchmarks-error.md and its pictures docs/images/error_*.png: run time against error.

All settings of a question run in one process and take turns. What is asked stands in ``tasks.py``, the
methods in ``peers/``, the 40-digit reference in ``many_digits.py``. Packages that are not installed
are left out, and the page says so (``pip install '.[bench]'`` installs them).
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import scipy
import tasks
from many_digits import DIGITS
from measuring import SHORTEST, Row, measure
from mpmath import mp
from origin import origin
from page import draw, duration, summary, table, verdict
from settings import NEAR_FOLD, NODES, OMEGA, OPTIONAL, S0, S, integrators, versions

#: Rounds of each question: fewer where one round takes 10 s.
ROUNDS = {"orbit": 9, "fold": 9, "branch": 3, "simulation": 3}
#: Title of the picture, and its axes.
PICTURES = {
    "orbit": (
        rf"Orbit 1a, $\Omega$ = {OMEGA}, $S$ = {S}, $S_0$ = {S0}",
        ("time of one solution, s", "largest error of a joint (nondimensional)"),
    ),
    "fold": (
        rf"Fold of 1a in $\Omega$, $S$ = {S}, $S_0$ = {S0}",
        ("time of one solution, s", r"error of $\Omega$ (nondimensional)"),
    ),
    "branch": (
        rf"Branch 1a in $\Omega$, $S$ = {S}, $S_0$ = {S0}",
        ("time of the whole branch, s", "largest error of a point (nondimensional)"),
    ),
    "simulation": (
        rf"Simulation over {tasks.PERIODS} periods, $\Omega$ = {OMEGA}, $S$ = {S}, $S_0$ = {S0}",
        ("time of one event, s", "largest error of an event time (nondimensional)"),
    ),
}


def run(most_rounds: int) -> tuple[dict[str, list[Row]], float]:
    """Measure all questions; also return the seconds that building the integrators took."""
    began = time.perf_counter()
    methods = list(integrators())
    compiling = time.perf_counter() - began
    cases = {
        "orbit": tasks.orbit_cases(methods),
        "fold": tasks.fold_cases(methods),
        "branch": tasks.branch_cases(methods),
        "simulation": tasks.simulation_cases(methods),
    }
    return {n: measure(c, min(ROUNDS[n], most_rounds)) for n, c in cases.items()}, compiling


def machine() -> str:
    """Describe processor and versions."""
    present, _ = versions()
    packages = [f"numpy {np.__version__}", f"scipy {scipy.__version__}"]
    packages += [f"{name} {number}" for name, number in present.items()]
    return f"{origin()}; {', '.join(packages)}"


def absent() -> str:
    """Say which packages are missing."""
    _, missing = versions()
    if not missing:
        return f"All optional peers ({', '.join(OPTIONAL)}) are installed."
    return f"Not installed, and therefore left out: {', '.join(missing)}."


def itineraries(results: dict[str, list[Row]], compiling: float, took: float, most: int) -> dict:
    """Return what the page is filled with."""
    filled = {}
    for name, rows in results.items():
        filled |= {f"{name}_summary": summary(rows), f"{name}_table": table(rows)}
        filled[f"{name}_verdict"] = verdict(rows)
    rows = [row for rows in results.values() for row in rows]
    rounds = ", ".join(f"{min(count, most)} ({name})" for name, count in ROUNDS.items())
    lower, upper = tasks.branch_task().ends
    return filled | {
        "took": f"{took:.0f}",
        "rounds": rounds,
        "shortest": duration(SHORTEST),
        "machine": machine(),
        "absent": absent(),
        "compiling": f"{compiling:.1f} s for all integrators, imports included",
        "digits": DIGITS,
        "failures": sum(row.failed for row in rows),
        "settings": len(rows),
        "segments": results["orbit"][1].remark,
        "points": results["branch"][0].remark.split()[0],
        "lower": f"{lower:.12g}",
        "upper": f"{upper:.12g}",
        "fold": mp.nstr(tasks.exact_fold(), 20),
        "events": results["simulation"][0].remark,
        **{"off": tasks.OFF, "apart": tasks.APART, "near": NEAR_FOLD, "nodes": NODES},
        **{"omega": OMEGA, "S": S, "S0": S0, "height": tasks.HEIGHT, "periods": tasks.PERIODS},
    }


def main() -> None:
    """Measure, draw and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=max(ROUNDS.values()), help="at most")
    most = parser.parse_args().rounds
    began = time.perf_counter()
    results, compiling = run(most)
    took = time.perf_counter() - began
    docs = Path(__file__).parents[1] / "docs"
    for name, (title, axes) in PICTURES.items():
        draw(results[name], title, axes, docs / "images" / f"error_{name}.png")
    template = Path(__file__).with_name("error_page.md")
    page = docs / "benchmarks-error.md"
    page.write_text(
        template.read_text(encoding="utf-8").format(**itineraries(results, compiling, took, most)),
        encoding="utf-8",
    )
    print(page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
