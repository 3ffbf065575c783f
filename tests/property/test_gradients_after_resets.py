"""Gradients of margins of orbits with resets: on the joint before a reset, and along all orbits.

They tell which orbits begin at a graze, and how exact its place is. The reference is a central difference:
the joint and a parameter are moved, the state is mapped by the reset and followed by scipy; or orbits are
solved at other parameters. Gradients are compared along orbits, as off them a stick has no meaning.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar
from typed import typed

import contfric as cf
from contfric.base.arrays import FloatArray
from contfric.base.attributes import altered
from contfric.bvp.linear import null_space
from contfric.bvp.system import Margin
from contfric.events.local.gradients import closing, gradient_of
from contfric.orbit.solve import refine

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
BRACED = """
name: braced-floors
coordinates: [q1, q2]
parameters: {W: 0.6, F: 0.3, c: 0.1, S: 0.1, d: 0.5, e: 0.6}
period: 2*pi/W
mass: [1, 1]
damping: [c, c]
stiffness: [[2, -1], [-1, 1]]
force: {q1: F*cos(W*t), q2: F*cos(W*t)}
contacts:
  brace: {kind: friction, velocity: v2 - v1, kinetic: S, static: S}
  roof: {kind: impact, gap: d - q2, restitution: e}
"""
#: Parameters of floors that come to an orbit with impacts, three of five of them with sticks.
RANGES = {
    "W": (0.4, 0.8),
    "F": (0.2, 0.5),
    "c": (0.05, 0.2),
    "S": (0.02, 0.1),
    "d": (0.3, 0.6),
    "e": (0.3, 0.8),
}
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
    orbit = cf.find_orbit(typed(tmp_path, WALLS), params, longest=2000)
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


def along_orbits(orbit: cf.Orbit, k: int, active: int) -> float:
    """Return the derivative of a margin along the curve of orbits, by its gradient."""
    (moves,), (share,) = null_space(orbit.system, orbit.joints, orbit.vector, active)
    by_parameter = moves / share
    last = orbit.system.closing @ by_parameter[0] + closing(orbit, active)
    found = gradient_of(orbit.as_whole(), orbit.system.tests[k], len(moves), active)
    assert found is not None
    return float(np.vdot(found[0], [*by_parameter, last]) + found[1])


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 5])  # 4 is aperiodic
def test_margins_along_orbits(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng([46, 2 * seed])
    params = {name: float(rng.uniform(*ends)) for name, ends in RANGES.items()}
    orbit = cf.find_orbit(typed(tmp_path, BRACED), params, longest=400)
    compared = set()
    for name in RANGES:
        active = orbit.model.index_of(name)
        beside = []
        for sign in (1.0, -1.0):
            vector = orbit.vector.copy()
            vector[active] += sign * STEP
            beside.append(refine(altered(orbit, vector=vector)))
            assert beside[-1].converged
        for k, test in enumerate(orbit.system.tests):
            after, before = (float(other.margins[k]) for other in beside)
            if np.isfinite([after, before]).all():  # else nothing is stationary inside
                expected = (after - before) / (2 * STEP)
                assert along_orbits(orbit, k, active) == pytest.approx(expected, rel=1e-5, abs=1e-5)
                compared.add(test.margin)
    assert compared == {Margin.INTERIOR, Margin.EXIT, Margin.JOINT, Margin.ENTRY}
