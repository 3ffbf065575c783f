"""A mass that a wall throws at its spring: random diagrams with slides that begin where they would rest.

A slide from a stop just beyond the limit of friction lasts half a natural period however short it is. Where
it vanishes the solution goes on at rest, with the same states. And where a slide before an impact's next stop
vanishes, the solution begins again behind the impact.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.events.bifurcation import ACCURACY
from contfric.events.outcomes.standing_slides import goes_nowhere

NEAR = {
    "k": 5.41325782573,
    "b": 0.81346464359,
    "m": 0.92658547593,
    "Ff": 0.66882056355,
    "omega": 0.83811081634,
    "a": 1.180861091,
    "e": 0.89115183554,
}
#: How far parameters are moved, and the range that is explored (relative).
MOVED, WIDTH = 0.06, 0.07
#: Cases by what was wrong. All but those marked have slides that stand at an event.
CASES = {
    "the rest that follows begins the orbit": (3, 7),
    "a tangential stop of the slide was the event's name": (6, 11, 12),
    "a slide vanishes behind an impact": (2, 5, 8),
}


def diagram(case: int) -> cf.Diagram:
    rng = np.random.default_rng([77, case])
    params = {name: value * (1.0 + rng.uniform(-MOVED, MOVED)) for name, value in NEAR.items()}
    params["e"] = min(params["e"], 0.97)
    orbit = cf.find_orbit("impact-friction", params, longest=1000, state=[-0.08, 0.0], time=-1.5)
    bounds = (params["k"] * (1.0 - WIDTH), params["k"] * (1.0 + WIDTH))
    return cf.explore(orbit, "k", bounds, max_branches=60, max_periods=1)


@pytest.mark.parametrize("case", [case for cases in CASES.values() for case in cases])
def test_a_diagram_does_not_depend_on_its_start_and_indices_balance(case: int) -> None:
    found = diagram(case)
    assert not found.loose_ends
    checked = found.verify(2)
    assert checked.passed, str(checked)
    told = [balance for balance in checked.balances if balance.below is not None]
    assert told


@pytest.mark.parametrize("case", CASES["the rest that follows begins the orbit"])
def test_an_event_at_which_a_slide_stands_is_known_as_well_as_without_it(case: int) -> None:
    """The margins of the slide place it to the root of rounding; those of the branch without it do not."""
    found = diagram(case)
    width = found.range[1] - found.range[0]
    standing = [
        (end.bifurcation, node.bifurcation)
        for node in found.nodes
        for i in node.branches
        for end in found.branches[i].ends
        if end.bifurcation is not None
        and abs(end.bifurcation.params["k"] - node.bifurcation.params["k"]) < 1e-6 * width
        and any(
            goes_nowhere(end.bifurcation.orbit, j)
            for j in range(end.bifurcation.orbit.system.segments)
        )
    ]
    assert standing
    for rough, best in standing:
        assert best.accuracy < ACCURACY
        gap = abs(rough.params["k"] - best.params["k"]) / width
        assert gap <= rough.accuracy + best.accuracy
    ends = [end for branch in found.branches for end in branch.ends if end.bifurcation is not None]
    assert not any("switching" in str(end) and "discontinuous" in str(end) for end in ends)


#: From a touch of this diagram a branch began outside of its conditions by 1e-9, twice what is known.
BEGINS = {
    "k": 6.31743,
    "b": 0.69899,
    "m": 0.82031,
    "Ff": 0.64451,
    "omega": 1.00497,
    "a": 1.1598,
    "e": 0.80765,
}


@pytest.mark.parametrize("seed", range(4))
def test_what_leaves_a_slide_that_stands_begins_inside_of_its_conditions(seed: int) -> None:
    rng = np.random.default_rng([83, seed])
    params = {name: value * (1.0 + rng.uniform(-1e-6, 1e-6)) for name, value in BEGINS.items()}
    orbit = cf.find_orbit("impact-friction", params, longest=1000, state=[-0.08, 0.0], time=-1.5)
    found = cf.explore(orbit, "k", (4.85, 6.78), max_branches=60, max_periods=2)
    points = [point for branch in found.branches if not branch.mirrored for point in branch]
    assert all(point.admissible for point in points)
    assert found.of_kind("SS")
