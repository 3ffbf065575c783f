"""Cycles that end near a saddle: solutions next to them may run through shorter cycles several times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.orbit.repetition import shortest

MODEL = Path(__file__).resolve().parents[1] / "models" / "switched.yaml"


@pytest.mark.parametrize("seed", range(4))
def test_no_branch_runs_through_a_shorter_cycle(seed: int) -> None:
    rng = np.random.default_rng([621, seed])
    stiffness = 0.833733252307 + float(rng.uniform(-2e-3, 2e-3)) * (seed > 0)
    begun = cf.find_orbit(MODEL, {"A": 0.82, "C": stiffness}, longest=1000)
    range_ = (0.55, 1.0)
    first = cf.explore(begun, "A", range_, max_periods=2)
    doubled = next(b for b in first.branches if b[0].periods == 2)
    again = cf.explore(doubled[len(doubled) // 2], "A", range_, max_step=0.02, max_periods=2)
    for branch in again.branches:
        orbit = branch[len(branch) // 2]
        assert shortest(orbit).periods == orbit.periods, branch
    assert not [b for b in again.bifurcations if b.kind is cf.Kind.BP], (
        "a doubling is no branch point"
    )
