"""Random branches retraced with a tenth of the step: the first cases of the stress run.

Here in all five parameters, point by point; ``test_random_diagrams`` compares whole diagrams in Omega.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import continuation
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
