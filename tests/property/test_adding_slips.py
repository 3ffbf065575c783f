"""Forced dry friction as a system of Filippov: slips come in and go.

At a low frequency each half period has several slips. They come in where the load of a stick touches its
limit (AS), here in both halves at once, though no symmetry is declared.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf

FRICTION = """
name: friction
states: [x, v]
parameters: {w: 0.2, S: 0.3, z: 0.02, h: 0.08}
period: 2*pi/w
surfaces: {s: {observable: v, sliding: filippov}}
modes:
  p: {in: {s: +}, field: {x: v, v: "-x - S - 2*z*v + cos(w*t) + h*cos(3*w*t)"}}
  n: {in: {s: -}, field: {x: v, v: "-x + S - 2*z*v + cos(w*t) + h*cos(3*w*t)"}}
"""


@pytest.mark.parametrize("seed", range(3))
def test_slips_that_come_in_and_go_are_joined(tmp_path: Path, seed: int) -> None:
    model = typed(tmp_path, FRICTION)
    rng = np.random.default_rng([67, seed])
    params = {
        "S": rng.uniform(0.25, 0.4),
        "z": rng.uniform(0.01, 0.03),
        "h": rng.uniform(0.06, 0.1),
    }
    low, high = 0.12, 0.2
    orbit = cf.find_orbit(model, params | {"w": 0.16})
    found = cf.explore(orbit, "w", (low, high), max_periods=1)
    assert not found.loose_ends
    assert found.of_kind("AS") or found.of_kind("GS")
    checked = found.verify(1)
    assert checked.passed, str(checked)
    # what simulations come to, each from rest, lies on a branch of as many segments
    for value in rng.uniform(low, high, 4):
        there = cf.find_orbit(model, params | {"w": float(value)})
        beside = [b for b in found.branches if b.values.min() <= value <= b.values.max()]
        assert there.system.segments in [b.system.segments for b in beside]


ASYMMETRIC = """
name: one_sided
states: [x, v]
parameters: {W: 0.45, S: 0.22, c: 0.08}
period: 2*pi/W
surfaces: {stop: {observable: v, sliding: filippov}}
field: {x: v, v: cos(W*t) + c - x - S*sign(v)}
modes: {forward: {in: {stop: +}}, backward: {in: {stop: -}}}
spread: {x: 2, v: 1}
"""


@pytest.mark.parametrize(("omega", "s", "c"), [(0.483, 0.205, 0.07), (0.45, 0.22, 0.08)])
def test_where_a_slide_without_length_lies_between_a_hold_and_a_rest(
    omega: float, s: float, c: float, tmp_path: Path
) -> None:
    """Without symmetry a touch is alone; no surface parts the rest after it."""
    orbit = cf.find_orbit(typed(tmp_path, ASYMMETRIC), {"W": omega, "S": s, "c": c})
    diagram = cf.explore(orbit, "W", (0.85 * omega, 1.15 * omega), max_branches=4)
    assert len(diagram.branches) > 1
    for branch in diagram.branches:
        assert branch[len(branch) // 2].certify().admissible.proved
