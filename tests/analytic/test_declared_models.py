"""Declared models against Liouville's formula: areas shrink by the damping, and by e**2 at an impact."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf

WALL = """\
name: walled
states: [x, v]
parameters: {Omega: 0.7, e: 0.8, b: 0.5, zeta: 0.05}
period: 2*pi/Omega
surfaces:
  wall: {observable: x, level: b}
  stop: {observable: v, level: 0}
field: {x: v, v: cos(Omega*t) - x - 2*zeta*v}
modes:
  rise: {in: {wall: -, stop: +}}
  fall: {in: {wall: -, stop: -}}
resets: {wall: {v: -e*v}}
"""


def test_bang_bang() -> None:
    orbit = cf.find_orbit("bang-bang", {"la": 0.2, "om": 1.0})
    shrinks = math.exp(-0.2 * 2 * math.pi * orbit.periods)
    assert np.prod(orbit.multipliers) == pytest.approx(shrinks, rel=1e-9)


def test_impacts(tmp_path: Path) -> None:
    orbit = cf.find_orbit(typed(tmp_path, WALL), {"e": 0.8, "zeta": 0.05, "Omega": 0.7})
    impacts = str(orbit.signature).count("impact@wall")
    assert impacts > 0
    shrinks = 0.8 ** (2 * impacts) * math.exp(-2 * 0.05 * orbit.periods * 2 * math.pi / 0.7)
    assert np.prod(orbit.multipliers) == pytest.approx(shrinks, rel=1e-9)
    assert orbit.x_max == pytest.approx(0.5, abs=1e-12)
