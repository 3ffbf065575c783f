"""Gradients of what vanishes inside of a segment that follows a reset, on the joint before the reset.

They tell which orbits begin at a graze, and how exact its place is. The reference is a central difference:
the joint and a parameter are moved, the state is mapped by the reset and followed by scipy.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

import contfric as cf
from contfric.base.arrays import FloatArray
from contfric.bvp.system import Margin
from contfric.events.gradients import gradient_of

WALLS = """
name: two-walls
states: [x, v]
parameters: {w: 2.0, F: 2.0, zeta: 0.05, d: 0.5, far: 1.0, e: 0.7, b: 0.02}
period: 2*pi/w
surfaces:
  s: {observable: v, level: 0}
  right: {observable: x, level: d}
  left: {observable: x, level: -far}
field: {x: v, v: F*cos(w*t) - 2*zeta*v - x}
modes:
  up: {in: {s: +, right: -, left: +}}
  down: {in: {s: -, right: -, left: +}}
resets:
  right: {v: -e*v*(1 + b*cos(w*t))}
  left: {v: -e*v}
"""
NAMES = ("F", "zeta", "d", "far", "e", "b")
#: Step of the differences: rounding of scipy's 1e-12 over it, and its square, are 1e-7.
STEP = 1e-5


def lowest(joint: FloatArray, p: dict[str, float], until: float) -> float:
    """Return the least height above the left wall after an impact on the right one."""
    begin = [joint[1], -p["e"] * joint[2] * (1.0 + p["b"] * np.cos(p["w"] * joint[0]))]

    def field(t: float, y: FloatArray) -> list[float]:
        return [y[1], p["F"] * np.cos(p["w"] * t) - 2.0 * p["zeta"] * y[1] - y[0]]

    run = solve_ivp(
        field, (joint[0], until), begin, method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True
    )
    times = np.linspace(joint[0], until, 400)
    at = int(np.argmin(run.sol(times)[0]))
    near = (times[max(at - 1, 0)], times[min(at + 1, 399)])
    found = minimize_scalar(
        lambda t: run.sol(t)[0], bounds=near, method="bounded", options={"xatol": 1e-10}
    )
    return float(found.fun) + p["far"]


@pytest.mark.parametrize("seed", range(5))
def test_heights_after_an_impact(seed: int, tmp_path: Path) -> None:
    path = tmp_path / "walls.yaml"
    path.write_text(WALLS)
    rng = np.random.default_rng([45, seed])
    params = {
        "w": float(rng.uniform(0.8, 1.2)),
        "zeta": float(rng.uniform(0.05, 0.2)),
        "d": float(rng.uniform(0.5, 1.5)),
        "e": float(rng.uniform(0.3, 0.8)),
        "b": float(rng.uniform(-0.4, 0.4)),
        "F": 1.0,
    }
    reach = 1.0 / abs(1.0 - params["w"] ** 2 + 2j * params["zeta"] * params["w"])
    params["F"] = 1.3 * params["d"] / reach
    params["far"] = 3.0 * params["d"]
    orbit = cf.find_orbit(path, params, longest=2000)
    tests = [t for t in orbit.system.tests if t.margin is Margin.INTERIOR and t.surface == "left"]
    assert tests
    for test in tests:
        i = test.segment
        joint, until = orbit.cycle[i], float(orbit.ends[i, 0])
        for name in NAMES:
            found = gradient_of(orbit, test, orbit.system.segments, orbit.model.index_of(name))
            if found is None:  # nothing is stationary inside
                continue
            moved = [
                lowest(joint, params | {name: params[name] + s * STEP}, until) for s in (1, -1)
            ]
            assert found[1] == pytest.approx((moved[0] - moved[1]) / (2 * STEP), rel=1e-4, abs=1e-5)
        for k in range(3):
            apart = STEP * np.eye(3)[k]
            moved = [lowest(joint + s * apart, params, until) for s in (1, -1)]
            expected = (moved[0] - moved[1]) / (2 * STEP)
            assert found[0][i, k] == pytest.approx(expected, rel=1e-4, abs=1e-5)
