"""Random branches retraced with a tenth of the step: the first cases of the stress run.

Here in all five parameters, point by point; ``test_random_diagrams`` compares whole diagrams in Omega.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import continuation
import numpy as np
import pytest
from report import Tally

import contfric as cf

BOUNDS = (0.4, 0.6)


@cache
def branch(max_step: float | None = None) -> tuple[cf.Branch, cf.Orbit]:
    start = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    return cf.continue_orbit(start, "Omega", BOUNDS, max_step=max_step), start


def test_random_branches() -> None:
    report = continuation.run(count=16, seed=13)
    assert not report.failed, report.failed
    assert report.passed["branch: points on the finer one"] >= 25
    reasons = [name for name in report.counts if name.startswith("end: ")]
    assert len(reasons) >= 5


def test_an_end_by_another_name_is_told() -> None:
    ends = [("SS", 0.4918, 1e-11), ("CS", 0.5353, 1e-11)]
    assert not continuation.difference(ends, [ends[1], ends[0]])
    assert "SS" in continuation.difference(ends, [("RANGE", 0.4918, 0.0), ends[1]])
    assert "CS" in continuation.difference(ends, [ends[0], ("CS", 0.5353 + 1e-8, 1e-11)])
    assert "SN" in continuation.difference(ends, [*ends, ("SN", 0.54, 1e-11)])
    assert not continuation.difference(ends, [ends[0], ("CS", 0.5353 + 1e-8, 2e-8)])


@pytest.mark.parametrize("off", [1e-5, 1e-3])
def test_a_point_beside_the_branch_is_told(off: float) -> None:
    coarse, start = branch()
    tally = Tally()
    continuation.retraced(tally, coarse, start, BOUNDS, "")
    assert not tally.failed, tally.failed
    joints = coarse.joints.copy()
    joints[len(coarse) // 2, 0, 1] += off
    continuation.retraced(tally, replace(coarse, joints=joints), start, BOUNDS, "")
    assert [failure.kind for failure in tally.failed] == ["branch: points on the finer one"]


def test_an_event_that_is_missing_is_told() -> None:
    coarse, start = branch()
    tally = Tally()
    short = replace(coarse, bifurcations=coarse.bifurcations[1:])
    continuation.retraced(tally, short, start, BOUNDS, "")
    assert [failure.kind for failure in tally.failed] == ["branch: the same events"]


@pytest.mark.parametrize("off", [1e-6, 1e-5])
def test_an_end_beside_the_branch_is_told(off: float) -> None:
    """Where an event is known to rounding so is the end of the branch."""
    coarse, start = branch()
    k = next(k for k in (0, -1) if coarse.ends[k].bifurcation is not None)
    joints = coarse.joints.copy()
    joints[k, 0, 1] += off
    tally = Tally()
    continuation.retraced(tally, replace(coarse, joints=joints), start, BOUNDS, "")
    assert [failure.kind for failure in tally.failed] == ["branch: points on the finer one"]


def from_half_frequency(seed: int) -> Iterator[tuple[cf.Branch, cf.Orbit, int]]:
    """Yield branches of three segments with an end at Omega = 1/2, orbits halfway, and which end it is.

    Without damping a slide that starts where X is stationary, X = cos(t/2)/(1 - 1/4), takes x to x - 2 X in
    a whole natural period, 2 pi. The one to x = -1 - S0 ends where the load is at its static limit and
    stands still: a stick there has no length and a tangential release. Both conditions fail at once.
    """
    S0 = float(np.random.default_rng(seed).uniform(0.15, 0.32))  # below 1/3 the other stop goes on
    params = {"Omega": 0.52, "S": 0.8 * S0, "S0": S0}
    diagram = cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.47, 0.56), bridges=False)
    for found in diagram.branches:
        if found.system.segments != 3:
            continue
        for k in (0, -1):
            if found.ends[k].bifurcation is not None and abs(found.values[k] - 0.5) < 1e-5:
                yield found, found[len(found) // 2], k


def test_an_end_that_is_known_to_the_root_of_rounding() -> None:
    """It is where the closed form says, to what its event says; the retrace asks for that, not for less."""
    asked = 0
    for seed in range(6):
        for found, halfway, k in from_half_frequency(seed):
            event, S0 = found.ends[k].bifurcation, halfway.params["S0"]
            assert event is not None
            high, low, still = 5.0 / 3.0 - S0, -1.0 - S0, 2.0 * np.pi
            t, x, _ = found.joints[k].T
            first = int(np.argmax(np.abs(x)))  # the stop at the larger distance
            side, start = np.sign(x[first]), t[first]
            apart = np.abs(np.roll(side * x, -first) - [high, low, low])
            after = np.abs(
                np.mod(np.roll(t, -first) - start + 1.0, 2.0 * still) - 1.0 - [0.0, still, still]
            )
            assert abs(found.values[k] - 0.5) <= event.accuracy * 0.09
            assert max(np.max(apart), np.max(after)) <= event.accuracy
            tally = Tally()
            continuation.retraced(tally, found, halfway, (0.47, 0.56), "")
            assert not tally.failed, tally.failed
            joints = found.joints.copy()
            joints[k, :, 1] += 1e-3
            continuation.retraced(tally, replace(found, joints=joints), halfway, (0.47, 0.56), "")
            assert [failure.kind for failure in tally.failed] == ["branch: points on the finer one"]
            asked += 1
    assert asked >= 12
