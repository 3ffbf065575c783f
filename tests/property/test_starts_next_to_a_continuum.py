"""Diagrams through the continuum of Omega = 1/2, from every branch: the same set, and every event balanced.

Random strengths of friction just below the limit of rest. There the symmetric branch touches a multiplier -1,
two branches of one itinerary end at one event, and a bridge ends where the symmetric branch crosses it.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness.balance import balances, index_sums
from contfric.atlas.completeness.verification import STEP, differences
from contfric.continuation.points import LARGEST_STEP

BOUNDS = (0.4, 0.6)
#: Starts from which a branch was missing or false, or an event unbalanced: S, S0, signature, step.
KNOWN = [
    (0.32, 0.33, "0a", 1.0),
    (0.28, 0.3, "1a, 7seg, 1hold", STEP),
    (0.28, 0.3, "0s, 8seg, 2hold", 1.0),
    (0.31, 0.322, "1a", STEP),
    (0.31, 0.322, "0s", 1.0),
    # points on both arms at the end of the continuum, and none between them
    (0.29094572997602053, 0.3198559312951911, "2s", 2.0),
]


@cache
def explored(friction: float, limit: float) -> cf.Diagram:
    params = {"Omega": 0.5, "S": friction, "S0": limit, "h": 0.0, "zeta": 0.0}
    return cf.explore(cf.find_orbit("coulomb", params), "Omega", BOUNDS)


def compared(diagram: cf.Diagram, branch: cf.Branch, step: float) -> list[str]:
    """Return what differs when a diagram is explored again from the middle of a branch, in words."""
    start = branch[len(branch) // 2]
    again = cf.explore(start, "Omega", BOUNDS, max_step=step * LARGEST_STEP)
    return [
        *(f"without {text}" for text in differences(diagram, again)),
        *(f"with {text}" for text in differences(again, diagram)),
        *(f"unbalanced: {b}" for b in balances(again) if not b.holds),
        *(str(s) for s in index_sums(again) if not s.holds),
        *(str(end) for end in again.loose_ends),
    ]


@pytest.mark.parametrize(("friction", "limit", "name", "step"), KNOWN)
def test_starts_that_gave_another_diagram(
    friction: float, limit: float, name: str, step: float
) -> None:
    diagram = explored(friction, limit)
    branch = next(b for b in diagram.branches if b.name == name)
    assert compared(diagram, branch, step) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_from_every_branch(seed: int) -> None:
    random = np.random.default_rng(seed)
    friction = float(random.uniform(0.25, 0.33))
    diagram = explored(friction, friction + float(random.uniform(0.008, 0.03)))
    assert [b for b in balances(diagram) if not b.holds] == []
    for branch in diagram.branches:
        for step in () if branch.mirrored else (2.0, 1.0, STEP):
            assert compared(diagram, branch, step) == [], (branch.name, step)


@pytest.mark.parametrize("case", [78, 93, *range(12)])
def test_with_little_damping_sticks_get_short_and_do_not_vanish(case: int) -> None:
    # a step that is longer than the stick goes over to orbits whose stick lasts less than no time
    random = np.random.default_rng([188, case])
    limit = random.uniform(0.05, 0.6)
    friction, zeta = limit * random.uniform(0.3, 0.95), 10.0 ** random.uniform(-8.0, -3.0)
    omega = float(random.choice([0.5, 0.25]))
    params = {"Omega": omega, "S": friction, "S0": limit, "h": 0.0, "zeta": zeta}
    orbit = cf.find_orbit("coulomb", params, longest=300)
    branch = cf.continue_orbit(orbit, "Omega", (omega - 0.04, omega + 0.04))
    vanished = [b for b in branch.bifurcations if b.kind is cf.Kind.CS]
    for b in vanished:
        left = [float(b.orbit.margins[b.orbit.system.tests.index(test)]) for test in b.tests]
        assert max(map(abs, left)) < 1e-8
