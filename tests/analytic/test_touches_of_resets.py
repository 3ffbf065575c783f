"""Touches of a surface whose reset acts on the way back only: what does not cross is not mapped."""

from __future__ import annotations

import numpy as np
import pytest
from typed import typed

import contfric as cf

#: A gate that is passed on the way up; what comes down through it is mapped.
GATE = """
name: gate
states: [x, v]
parameters: {A: 0.8, W: 1.4, z: 0.1, k: 0.3, at: 1.0}
period: 2*pi/W
surfaces: {gate: {observable: x, level: at}, turn: {observable: v}}
field: {x: v, v: A*cos(W*t) - 2*z*v - x}
modes:
  below: {in: {gate: -}}
  rises: {in: {gate: +, turn: +}}
  falls: {in: {gate: +, turn: -}}
resets: {gate: RESET}
spread: {x: 2, v: 2}
"""


def grazed(W: float, z: float, at: float) -> float:
    """Return the amplitude of the force at which a linear oscillator just comes to a place."""
    return float(at * np.hypot(1.0 - W * W, 2.0 * z * W))


@pytest.mark.parametrize("seed", range(4))
def test_what_is_mapped_on_its_way_back_jumps(tmp_path, seed: int) -> None:
    """The touch was called a grazing impact, at which another orbit was to go on."""
    rng = np.random.default_rng(seed)
    W, z, at, k = (
        float(rng.uniform(*r)) for r in ((1.2, 2.0), (0.05, 0.3), (0.5, 2.0), (0.1, 0.5))
    )
    model = typed(tmp_path, GATE.replace("RESET", "{v: v - k, from: [falls]}"))
    A = grazed(W, z, at)
    params = {"W": W, "z": z, "at": at, "k": k, "A": 0.8 * A}
    diagram = cf.explore(cf.find_orbit(model, params, state=[0, 0]), "A", (0.5 * A, 1.5 * A))
    (event,) = diagram.bifurcations
    assert event.params["A"] == pytest.approx(A, rel=1e-10)
    assert "the map jumps" in event.meaning
    assert diagram.verify().passed


@pytest.mark.parametrize("reset", ["{v: 0.7*v, from: [falls]}", "{v: v - k*v**2, from: [falls]}"])
def test_what_is_mapped_to_itself_at_a_touch_does_not_jump(tmp_path, reset: str) -> None:
    """At speed zero no speed is lost: orbits go on beyond the touch."""
    model = typed(tmp_path, GATE.replace("RESET", reset))
    A = grazed(1.4, 0.1, 1.0)
    diagram = cf.explore(
        cf.find_orbit(model, {"A": 0.8 * A}, state=[0, 0]), "A", (0.7 * A, 1.3 * A)
    )
    (touch,) = (e for e in diagram.bifurcations if abs(e.params["A"] - A) < 1e-8)
    assert "jumps" not in touch.meaning
    assert max(branch.values.max() for branch in diagram.branches) > 1.01 * A
    assert diagram.verify().passed
