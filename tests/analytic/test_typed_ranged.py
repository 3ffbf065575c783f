"""Textbook systems whose states have ranges, against closed forms and matrix exponentials."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm
from typed import typed

import contfric as cf

#: Three genes in a ring, each of which stops the next one above a threshold (Glass, Pasternack 1978).
GENES = """
name: genes
states: [x, y, z]
parameters: {k: 2.0, g: 1.0, th: 1.0}
autonomous: true
surfaces: {X: {observable: x, level: th}, Y: {observable: y, level: th}, Z: {observable: z, level: th}}
modes:
"""

#: A tank that a siphon empties once it is full: the cup of Tantalus.
SIPHON = """
name: siphon
states: [h]
parameters: {q: 0.3, a: 0.5, g: 9.81, top: 1.0, low: 0.2}
autonomous: true
surfaces: {full: {observable: h, level: top}, empty: {observable: h, level: low}}
modes:
  fills: {in: {full: -}, field: {h: q}}
  drains: {in: {empty: +}, field: {h: q - a*sqrt(2*g*h)}}
spread: {h: [0, 1.2]}
"""

CUK = """
name: cuk
states: [i1, i2, v1, v2]
parameters: {E: 12.0, L1: 1.0e-3, L2: 1.0e-3, C1: 1.0e-5, C2: 1.0e-5, R: 10.0, D: 0.4, Ts: 5.0e-5}
period: Ts
surfaces: {duty: {observable: "mod(t, Ts)", level: D*Ts}}
modes:
  on: {in: {duty: -}, field: {i1: E/L1, i2: (v1 - v2)/L2, v1: -i2/C1, v2: (i2 - v2/R)/C2}}
  off: {in: {duty: +}, field: {i1: (E - v1)/L1, i2: -v2/L2, v1: i1/C1, v2: (i2 - v2/R)/C2}}
spread: {i1: [0, 2], i2: [0, 2], v1: [0, 40], v2: [0, 20]}
units: {t: 1.0e-5}
"""


def genes() -> str:
    """Return the file: each gene is made while the one before it is below its threshold."""
    modes = ""
    for code in range(8):
        high = [bool(code >> k & 1) for k in range(3)]
        sides = ", ".join(f"{s}: {'+' if h else '-'}" for s, h in zip("XYZ", high, strict=True))
        rates = ", ".join(
            f"{s}: {'0' if high[k - 1] else 'k'} - g*{s}" for k, s in enumerate("xyz")
        )
        modes += f"  m{code}: {{in: {{{sides}}}, field: {{{rates}}}}}\n"
    return GENES + modes + "spread: {x: [0, k/g], y: [0, k/g], z: [0, k/g]}\n"


@pytest.mark.parametrize("rate", [1.0, 0.7])
def test_ring_of_genes(tmp_path: Path, rate: float) -> None:
    """With thresholds in the middle each of six steps takes the logarithm of the golden ratio."""
    model = typed(tmp_path, genes())
    assert cf.check_model(model, {"g": rate, "k": 2 * rate}).ok
    orbit = cf.find_orbit(model, {"g": rate, "k": 2 * rate})
    assert len(orbit.system.itinerary) == 6
    assert orbit.period == pytest.approx(6 * math.log((1 + math.sqrt(5)) / 2) / rate, rel=1e-12)


def test_siphon(tmp_path: Path) -> None:
    model = typed(tmp_path, SIPHON)
    assert cf.check_model(model).ok
    diagram = cf.explore(cf.find_orbit(model), "q", (0.2, 0.5))
    assert len(diagram.branches) == 1
    for q in (0.25, 0.45):
        drain, _ = quad(
            lambda h, q=q: 1 / (0.5 * math.sqrt(2 * 9.81 * h) - q), 0.2, 1.0, epsabs=1e-13
        )
        assert cf.find_orbit(model, {"q": q}).period == pytest.approx(0.8 / q + drain, rel=1e-11)


def test_cuk_converter(tmp_path: Path) -> None:
    model = typed(tmp_path, CUK)
    assert cf.check_model(model).ok
    orbit = cf.find_orbit(model)
    a, b = np.zeros((2, 5, 5))
    a[:4] = [[0, 0, 0, 0, 12e3], [0, 0, 1e3, -1e3, 0], [0, -1e5, 0, 0, 0], [0, 1e5, 0, -1e4, 0]]
    b[:4] = [[0, 0, -1e3, 0, 12e3], [0, 0, 0, -1e3, 0], [1e5, 0, 0, 0, 0], [0, 1e5, 0, -1e4, 0]]
    turn = expm(b * 3e-5) @ expm(a * 2e-5)
    state = np.linalg.solve(np.eye(4) - turn[:4, :4], turn[:4, 4])
    np.testing.assert_allclose(orbit.joints[0, 1:5], state, rtol=1e-10)
    multipliers = np.sort(np.abs(np.linalg.eigvals(turn[:4, :4])))
    np.testing.assert_allclose(np.sort(np.abs(orbit.multipliers))[-4:], multipliers, rtol=1e-9)
