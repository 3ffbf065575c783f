"""Cost of the engine, warm: a point of a branch, a slide of a simulation, a whole diagram.

``make bench`` runs this with pytest-benchmark and then writes the table of docs/benchmarks.md from the
same functions, so that the page and the numbers cannot differ.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

import contfric as cf

CASES = {
    "1a": ({"Omega": 0.5, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    "2s": ({"Omega": 0.48, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    "0s": ({"Omega": 0.58, "S": 0.32, "S0": 0.4}, "Omega", (0.4, 0.6)),
    "2a-14seg": ({"Omega": 0.5, "S": 0.06, "S0": 0.4}, "S", (0.03, 0.4)),
}


def branch_of(name: str, stability: bool = True) -> Callable[[], cf.Branch]:
    """Return a call that continues a bundled orbit over its whole branch in fine steps."""
    params, parameter, bounds = CASES[name]
    orbit = cf.solve_orbit("coulomb", name, params)
    return lambda: cf.continue_orbit(
        orbit, parameter, bounds, max_step=5e-4, stability=stability, max_points=100_000
    )


def branch_in_default_steps() -> Callable[[], cf.Branch]:
    """Return a call that continues 1a of Fig. 5 from end to end as a user would."""
    orbit = cf.solve_orbit("coulomb", "1a", CASES["1a"][0])
    return lambda: cf.continue_orbit(orbit, "Omega", (0.4, 0.6))


def diagram_of_fig05() -> Callable[[], cf.Diagram]:
    """Return a call that explores Fig. 5 from a solved orbit."""
    orbit = cf.find_orbit("coulomb", CASES["1a"][0])
    return lambda: cf.explore(orbit, "Omega", (0.4, 0.6))


def simulation(periods: int = 20_000, sticks: bool = True) -> Callable[[], int]:
    """Return a call that simulates and counts the events: two slides and a stick a period, or slides."""
    with_sticks = {"Omega": 0.5, "S": 0.05, "S0": 0.4}
    params = with_sticks if sticks else {"Omega": 0.7, "S": 0.1, "S0": 0.1}
    return lambda: len(cf.simulate("coulomb", params, state=[1.3, 0.0], periods=periods))


@pytest.mark.parametrize("name", CASES)
def test_branch(benchmark, name: str) -> None:
    points = len(benchmark(branch_of(name)))
    benchmark.extra_info["points"] = points


def test_diagram(benchmark) -> None:
    assert len(benchmark(diagram_of_fig05()).branches) == 8


def test_simulation(benchmark) -> None:
    benchmark.extra_info["events"] = benchmark(simulation())
