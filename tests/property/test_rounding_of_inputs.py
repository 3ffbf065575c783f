"""Inputs changed by a few units in the last place give the same diagram, next to continua too.

At Omega = 1/2 and without damping curves of orbits cross, and what is near is known to the root of rounding.
Another processor, or another kernel of the linear algebra, rounds as these inputs do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness.balance import balances
from contfric.atlas.completeness.verification import differences
from contfric.continuation.points import LARGEST_STEP
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

BOUNDS = (0.4, 0.6)
EPS = float(np.finfo(float).eps)


def nudged(orbit: Orbit, rng: np.random.Generator) -> Orbit:
    """Return an orbit with joints and friction changed by a few units in the last place, solved again."""
    joints = orbit.joints * (1.0 + EPS * rng.integers(-4, 5, orbit.joints.shape))
    vector = orbit.vector.copy()
    for name in ("S", "S0"):
        vector[orbit.model.index_of(name)] *= 1.0 + EPS * rng.integers(-4, 5)
    return refine(replace(orbit, joints=joints, vector=vector, residual=np.inf), damped=False)


def told(diagram: cf.Diagram, orbit: Orbit, step: float) -> list[str]:
    """Return what differs when a diagram is explored from an orbit, and what does not hold of it."""
    again = cf.explore(orbit, "Omega", BOUNDS, max_step=step * LARGEST_STEP)
    return [
        *(f"without {text}" for text in differences(diagram, again)),
        *(f"with {text}" for text in differences(again, diagram)),
        *(f"unbalanced: {b}" for b in balances(again) if not b.holds),
        *(str(end) for end in again.loose_ends),
        *(f"not admissible: {b.name}" for b in again.branches if not all(o.admissible for o in b)),
    ]


def scene(seed: int) -> tuple[cf.Diagram, np.random.Generator]:
    rng = np.random.default_rng(seed)
    friction = float(rng.uniform(0.25, 0.33))
    limit = friction + float(rng.uniform(0.008, 0.03))
    params = {"Omega": 0.5, "S": friction, "S0": limit, "h": 0.0, "zeta": 0.0}
    return cf.explore(cf.find_orbit("coulomb", params), "Omega", BOUNDS), rng


#: Scenes and steps at which a T, a missing corner or another name depended on rounding.
SOME = [(0, 0.31), (2, 2.0), (3, 0.31), (4, 1.0)]


@pytest.mark.parametrize(("seed", "step"), SOME)
def test_the_same_from_inputs_that_differ_by_rounding(seed: int, step: float) -> None:
    diagram, rng = scene(seed)
    bridges = [b for b in diagram.branches if b.bridge and not b.mirrored]
    others = [b for b in diagram.branches if not b.bridge and not b.mirrored]
    for branch in (bridges[-1], others[0]):
        start = nudged(branch[len(branch) // 2], rng)
        assert start.converged
        assert told(diagram, start, step) == [], (branch.name, step)
