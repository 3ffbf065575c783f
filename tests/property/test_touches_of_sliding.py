"""Relay feedback with sliding: motion leaves a surface by a tangent, and may touch it again.

Where it does the event is the same from both sides: without sliding (a touch inside of a segment), and with
sliding for no time, at which two margins vanish that are one function.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.base.attributes import altered
from contfric.bvp.system import Margin
from contfric.events.bifurcation import ACCURACY
from contfric.events.local.gradients import gradient_of

ABOUT = {
    "zeta": 0.0481491523,
    "lam": 0.0598897997,
    "k": 0.9423874574,
    "sigma": -0.9620687229,
    "rho": 1.0211808313,
}
#: Step of the differences: its share of a second derivative is a hundredth of what is allowed.
STEP = 1e-6


def scene(seed: int) -> tuple[cf.Orbit, tuple[float, float]]:
    draw = np.random.default_rng([54, seed])
    params = {name: value * draw.uniform(0.98, 1.02) for name, value in ABOUT.items()}
    return cf.find_orbit("relay-sliding", params | {"w": 10.43}, longest=1000), (9.4, 11.0)


@pytest.mark.parametrize("seed", range(2))
def test_a_touch_is_one_event_from_both_sides(seed: int) -> None:
    orbit, bounds = scene(seed)
    diagram = cf.explore(orbit, "w", bounds, max_periods=1)
    assert not diagram.loose_ends
    touches = diagram.of_kind("GS")
    assert touches
    for node in diagram.events:
        assert node.bifurcation.accuracy < ACCURACY
        if node.bifurcation.kind is cf.Kind.GS:
            assert len(node.branches) == 2
    ends = [str(end) for branch in diagram.branches for end in branch.ends]
    assert not any("discontinuous" in text for text in ends)
    checked = diagram.verify(1)
    assert checked.passed, str(checked)


def test_the_gradient_of_a_touch_is_not_that_of_the_start_by_a_tangent() -> None:
    """Against differences, by all joints but the place on the surface from which the segment starts."""
    checked = 0
    for seed in range(4):
        orbit, bounds = scene(seed)
        branch = cf.continue_orbit(orbit, "w", bounds)
        for event in (end.bifurcation for end in branch.ends if end.bifurcation is not None):
            here, active = event.orbit, event.orbit.model.index_of("w")
            for test in event.tests:
                if test.margin is not Margin.INTERIOR or test.surface != "switch":
                    continue
                found = gradient_of(here.as_whole(), test, here.system.segments, active)
                assert found is not None
                k, i = here.system.tests.index(test), test.segment
                for j in range(2, here.joints.shape[1]):
                    joints = here.joints.copy()
                    joints[i, j] += STEP
                    difference = (altered(here, joints=joints).margins[k] - here.margins[k]) / STEP
                    assert found[0][i, j] == pytest.approx(difference, abs=1e-4)
                vector = here.vector.copy()
                vector[active] += STEP
                difference = (altered(here, vector=vector).margins[k] - here.margins[k]) / STEP
                assert found[1] == pytest.approx(difference, abs=1e-4)
                checked += 1
    assert checked
