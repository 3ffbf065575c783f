"""Branches of several friction contacts up to where two of them change order: no steps creep up to it."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import contfric as cf

MASSES, SEEDS, FRICTION = 5, range(6), (0.16, 0.2, 0.24)
#: Steps as shares of the range; reach to either side of the lowest natural frequency.
COARSE, FINE, WIDTH = 0.01, 0.002, 0.03
#: Points this near to the end of a branch (arclength) creep up to it, and how many may.
NEAR, FEW = 1e-4, 2


def structure(seed: int) -> tuple[cf.Model, float]:
    """Masses on springs of their own and between neighbours, each with friction; the lowest frequency."""
    draw = np.random.default_rng([71, seed])
    beside = np.diag(draw.uniform(0.3, 0.7, MASSES - 1), 1)
    beside = beside + beside.T
    stiffness = np.diag(draw.uniform(0.8, 1.2, MASSES) + beside.sum(axis=1)) - beside
    low = float(np.sqrt(np.linalg.eigvalsh(stiffness).min()))
    rubs = {
        f"b{i}": {
            "kind": "friction",
            "velocity": f"v{i}",
            "kinetic": f"{draw.uniform(0.5, 1.5):.4f}*S",
        }
        for i in range(1, MASSES + 1)
    }
    model = cf.Mechanism(
        np.eye(MASSES),
        0.02 * stiffness,
        stiffness,
        contacts=rubs,
        force={"q1": "cos(Omega*t)"},
        parameters={"Omega": low, "S": 0.2},
        period="2*pi/Omega",
    )
    return model, low


def test_steps_do_not_creep_up_to_the_end() -> None:
    """Where one contact stops just as another one is released no pair of events hides within a step."""
    ended = 0
    for seed, friction in product(SEEDS, FRICTION):
        model, low = structure(seed)
        orbit = cf.find_orbit(model, {"S": friction}, periods=1)
        reach = (1.0 - WIDTH) * low, (1.0 + WIDTH) * low
        coarse, fine = (
            cf.continue_orbit(orbit, "Omega", reach, max_step=step) for step in (COARSE, FINE)
        )
        for row, end, other in zip((0, -1), coarse.ends, fine.ends, strict=True):
            assert end.reason is other.reason
            assert coarse.values[row] == pytest.approx(fine.values[row], abs=1e-9)
            if end.reason is cf.EndReason.CS:
                ended += 1
                assert np.sum(np.abs(coarse.arc - coarse.arc[row]) < NEAR) <= FEW
    assert ended > 12
