"""Two oscillators that pulse each other (Mirollo and Strogatz 1990), unequal, in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from typed import typed

import contfric as cf

#: What a pulse carries to its threshold fires, too: the reset jumps at the distance eps from it.
PULSES = """
name: pulses
states: [x, y]
parameters: {S: 2.0, R: 1.9, eps: 0.2}
autonomous: true
surfaces:
  fx: {observable: x, level: 1}
  fy: {observable: y, level: 1}
  nx: {observable: x, level: 1 - eps}
  ny: {observable: y, level: 1 - eps}
field: {x: S - x, y: R - y}
modes:
  far: {in: {nx: -, ny: -}}
  x_near: {in: {nx: +, fx: -, ny: -}}
  y_near: {in: {nx: -, ny: +, fy: -}}
  near: {in: {nx: +, fx: -, ny: +, fy: -}}
resets:
  fx: {x: 0, y: "where(y + eps >= 1, 0, y + eps)"}
  fy: {y: 0, x: "where(x + eps >= 1, 0, x + eps)"}
"""


def test_a_reset_may_jump_where_modes_of_one_field_part(tmp_path) -> None:
    """The field is the same on both sides, the reset is not: the surface is no section."""
    model = typed(tmp_path, PULSES)
    report = cf.check_model(model)
    assert report.ok, report
    assert not model.section_surfaces
    plain = PULSES.replace('"where(y + eps >= 1, 0, y + eps)"', "y*(1 - eps)")
    plain = plain.replace('"where(x + eps >= 1, 0, x + eps)"', "x*(1 - eps)")
    assert {"nx", "ny"} <= typed(tmp_path, plain).section_surfaces


@pytest.mark.parametrize("seed", range(4))
def test_both_fire_at_once_while_the_pulse_is_strong_enough(tmp_path, seed: int) -> None:
    """The slower one is at R (1 - e^-T) when the faster one fires, with S (1 - e^-T) = 1."""
    rng = np.random.default_rng([31, seed])
    S = rng.uniform(1.5, 3.0)
    R = S * rng.uniform(0.9, 0.97)
    orbit = cf.find_orbit(typed(tmp_path, PULSES), {"S": S, "R": R})
    assert orbit.period == pytest.approx(-math.log(1 - 1 / S), abs=1e-10)
    diagram = cf.explore(orbit, "eps", (0.01, 0.25))
    ends = [e for e in diagram.bifurcations if e.kind is cf.Kind.CS]
    assert [e.params["eps"] for e in ends] == pytest.approx([1 - R / S], abs=1e-9)
    assert diagram.verify().passed
