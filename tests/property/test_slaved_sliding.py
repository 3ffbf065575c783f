"""Sliding motion that another oscillator leads, and that leaves its surface where that one is too fast.

The leading states do not depend on the sliding: both halves of a symmetric cycle leave the surface at one
value of a parameter, which is known from the leading oscillator alone. One cannot leave without the other.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import contfric as cf

LED = """
name: led
states: [x, v, z]
parameters: {{mu: 0.3, k: 3.0, b: {b}, c: {c}}}
autonomous: true
define: {{force: (mu - x**2)*v - x - {cubic}*x**3}}
surfaces: {{s: {{observable: z, sliding: filippov}}}}
modes:
  up: {{in: {{s: +}}, field: {{x: v, v: force, z: -k + v + b*x - c*z}}}}
  down: {{in: {{s: -}}, field: {{x: v, v: force, z: k + v + b*x - c*z}}}}
"""


def largest(mu: float, b: float, cubic: float) -> float:
    """Return the largest v + b x on the cycle of the leading oscillator, after its transient."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], (mu - y[0] ** 2) * y[1] - y[0] - cubic * y[0] ** 3]

    def slope(t: float, y: np.ndarray) -> float:
        return rates(t, y)[1] + b * y[1]

    slope.direction = -1.0  # type: ignore[attr-defined]
    kept = {"rtol": 1e-11, "atol": 1e-12, "method": "DOP853"}
    start = solve_ivp(rates, (0.0, 80.0 / mu), [0.0, 2.0 * mu**0.5], **kept).y[:, -1]
    found = solve_ivp(rates, (0.0, 20.0), start, events=slope, **kept).y_events[0]
    return float(np.max(found[:, 1] + b * found[:, 0]))


@pytest.mark.parametrize("seed", range(4))
def test_both_halves_leave_the_surface_at_once(tmp_path: Path, seed: int) -> None:
    draw = np.random.default_rng(seed)
    b, c, cubic = (float(draw.uniform(*r)) for r in ((-0.5, 0.5), (0.3, 2.0), (0.0, 0.4)))
    path, leaves = tmp_path / "led.yaml", float(draw.uniform(0.4, 0.9))
    path.write_text(LED.format(b=b, c=c, cubic=cubic), encoding="utf-8")
    k = largest(leaves, b, cubic)
    diagram = cf.explore(cf.find_orbit(path, {"mu": 0.6 * leaves, "k": k}), "mu", (0.2, 1.0))
    (event,) = (e for e in diagram.bifurcations if e.kind is not cf.Kind.T)  # touches end nothing
    assert event.params["mu"] == pytest.approx(leaves, abs=1e-8)
    assert event.kind is cf.Kind.AS and not diagram.loose_ends
    first, second = diagram.branches
    assert {first.values.min(), second.values.max()} == {0.2, 1.0}
