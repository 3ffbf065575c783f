"""Folds just after a doubling that is nearly degenerate: the parameter hardly changes between the two."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.continuation.points import LARGEST_STEP

SOFT_STOP = """
name: softstop
states: [x, v]
parameters: {omega: 0.8, k: 29.8, zeta: 0.01126, c: 0.3423, gap: 1.1159, A: 0.81385, pre: 0.18685}
period: 2*pi/omega
surfaces:
  wall: {observable: x, level: gap}
modes:
  in: {in: {wall: +}, field: {x: v, v: "-x - 2*zeta*v + A*cos(omega*t) - k*(x - gap) - c*v - pre"}}
  out: {in: {wall: -}, field: {x: v, v: "-x - 2*zeta*v + A*cos(omega*t)"}}
"""
#: A multiplier this far from 1 is on one side of it: it is known to 1e-9.
CLEAR = 1e-7


def turns(branch: cf.Branch) -> int:
    """Return how often a multiplier passes 1 along a branch."""
    assert branch.multipliers is not None
    largest = np.max(branch.multipliers.real, axis=1) - 1.0
    signs = np.sign(largest[np.abs(largest) > CLEAR])
    return int(np.sum(signs[1:] != signs[:-1]))


@pytest.mark.parametrize("seed", range(3))
def test_a_fold_is_found_whatever_the_step(tmp_path: Path, seed: int) -> None:
    model = typed(tmp_path, SOFT_STOP)
    rng = np.random.default_rng([61, seed])
    moved = {k: v * (1.0 + rng.uniform(-2e-4, 2e-4)) for k, v in model.defaults.items()}
    orbit = cf.find_orbit(model, moved | {"omega": 0.95})
    places = []
    for step in (1.0, 0.31, 0.17):
        found = cf.explore(
            orbit, "omega", (0.88, 0.96), max_periods=2, max_step=step * LARGEST_STEP
        )
        folds = found.of_kind("SN")
        doubled = [b for b in found.branches if b.system.periods == 2 and not b.mirrored]
        assert sum(map(turns, doubled)) == len([f for f in folds if f.orbit.periods == 2]) > 0
        assert not any("continuum" in note for b in found.branches for note in b.notes)
        places.append([f.params["omega"] for f in folds])
    assert places[1] == pytest.approx(places[0], abs=1e-9)
    assert places[2] == pytest.approx(places[0], abs=1e-9)
