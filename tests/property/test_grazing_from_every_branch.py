"""Impacts that graze where the velocity is a section too: the same diagram from whichever branch.

The smooth orbit of a linear oscillator has a closed form, so its graze is known: there its amplitude is the
distance of the wall. Orbits with an impact now and then begin there, too. The forms of the solution at the
event once had a joint at the touch, where v = 0 is a section, and no impact could come in: what was found
depended on the branch that arrived.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.events.bifurcation import Kind

DOUBLE = """
name: double
states: [x, v]
parameters: {w: 2.0, F: 2.0, zeta: 0.05, d: 0.5, e: 0.7}
constraints: [w > 0, e >= 0, e <= 1, d > 0]
period: 2*pi/w
surfaces:
  s: {observable: v, level: 0}
  right: {observable: x, level: d}
  left: {observable: x, level: -d}
field: {x: v, v: F*cos(w*t) - 2*zeta*v - x}
modes:
  up: {in: {s: +, right: -, left: +}}
  down: {in: {s: -, right: -, left: +}}
resets:
  right: {v: -e*v}
  left: {v: -e*v}
symmetry: x -> -x, v -> -v, t -> t + T/2
"""


def agrees(diagram: cf.Diagram, graze: float, name: str) -> None:
    """Check the smooth orbit's graze, restarts and balances of a diagram."""
    grazes = [e.bifurcation for e in diagram.events if e.bifurcation.kind is Kind.GS]
    found = [b for b in grazes if abs(b.params[name] - graze) < 1e-8 * graze]
    assert len(found) == 1, f"{graze}: {[str(b) for b in grazes]}"
    held = diagram.verify(4)
    assert all(restart.same for restart in held.restarts), str(held)
    assert all(balance.holds for balance in held.balances), str(held)


def smooth(amplitude: complex, w: float) -> list[float]:
    """Return the state of the smooth orbit at time 0."""
    return [amplitude.real, (1j * w * amplitude).real]


@pytest.mark.parametrize("seed", range(4))
def test_restarts_agree_at_a_graze_of_one_wall(seed: int) -> None:
    rng = np.random.default_rng([43, seed])
    params = {
        "A": float(rng.uniform(0.5, 1.5)),
        "w": float(rng.uniform(0.6, 1.6)),
        "k": float(rng.uniform(0.6, 1.5)),
        "c": float(rng.uniform(0.07, 0.3)),
        "e": float(rng.uniform(0.3, 0.8)),
    }
    w = params["w"]
    at = params["A"] / (params["k"] - w**2 + 1j * params["c"] * w)
    reach = abs(at)
    orbit = cf.find_orbit("impact", params | {"d": 1.02 * reach}, state=smooth(at, w))
    agrees(cf.explore(orbit, "d", (0.9 * reach, 1.1 * reach), max_periods=3), reach, "d")


@pytest.mark.parametrize("seed", range(6))
def test_restarts_agree_at_a_graze_of_both_walls(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng([44, seed])
    params = {
        "w": float(rng.uniform(0.6, 1.6)),
        "zeta": float(rng.uniform(0.05, 0.2)),
        "d": float(rng.uniform(0.5, 1.5)),
        "e": float(rng.uniform(0.3, 0.8)),
    }
    w = params["w"]
    stiffness = 1.0 - w**2 + 2j * params["zeta"] * w
    graze = params["d"] * abs(stiffness)
    state = smooth(0.98 * graze / stiffness, w)
    orbit = cf.find_orbit(typed(tmp_path, DOUBLE), params | {"F": 0.98 * graze}, state=state)
    diagram = cf.explore(orbit, "F", (0.9 * graze, 1.1 * graze), max_periods=2)
    agrees(diagram, graze, "F")
