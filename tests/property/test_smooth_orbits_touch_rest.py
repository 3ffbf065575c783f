"""A mass on a belt that never sticks, until its velocity touches that of the belt.

There a hold opens from the smooth orbit, and the other way round it vanishes into it. The smooth orbit has no
joint but those on a section: the event has both, whichever side comes first.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from typed import typed

import contfric as cf

BELT = """
name: belt
states: [x, v]
parameters: {w: 0.735, vb: 0.561, F: 0.371, S: 0.41, S0: 0.788, d: 1.61, c: 0.03}
period: 2*pi/w
observables: {u: x - F*cos(w*t), r: v - vb}
surfaces:
  R: {observable: r}
  U+: {observable: u, level: S0 - c*vb}
  U-: {observable: u, level: -S0 - c*vb}
modes:
  fast: {in: {R: +}, field: {x: v, v: "-u - c*v - S/(1 + d*(v - vb))"}}
  slow: {in: {R: -}, field: {x: v, v: "-u - c*v + S/(1 - d*(v - vb))"}}
  stick: {in: {R: 0, U+: -, U-: +}, field: {x: vb, v: 0}}
"""


def fastest(params: dict[str, float], start: np.ndarray) -> float:
    """Return the largest velocity, less that of the belt, of the smooth orbit near a state at time 0."""
    w, vb, F, S, d, c = (params[name] for name in ("w", "vb", "F", "S", "d", "c"))

    def rates(t: float, y: np.ndarray) -> tuple[float, float]:
        return y[1], -y[0] + F * np.cos(w * t) - c * y[1] + S / (1.0 - d * (y[1] - vb))

    def orbit(y: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        found = solve_ivp(rates, (0.0, 2.0 * np.pi / w), y, "DOP853", times, rtol=1e-11, atol=1e-12)
        return np.asarray(found.y)

    y = fsolve(lambda y: orbit(y)[:, -1] - y, start, xtol=1e-10)
    assert np.abs(y - start).max() < 1e-4
    v = orbit(y, np.linspace(0.0, 2.0 * np.pi / w, 2001))[1]
    k = int(np.argmax(v[1:-1])) + 1
    a, b, _ = np.polyfit([-1.0, 0.0, 1.0], v[k - 1 : k + 2], 2)
    return float(v[k] - b * b / (4.0 * a) - vb)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_touch_joins_smooth_orbits_and_bridges(tmp_path: Path, seed: int) -> None:
    model = typed(tmp_path, BELT)
    rng = np.random.default_rng([602, seed])
    names = ("vb", "F", "S", "d")
    params = {n: float(model.defaults[n] * rng.uniform(0.98, 1.02)) for n in names}
    orbit = cf.find_orbit(model, params | {"w": 0.75}, longest=1000)
    found = cf.explore(orbit, "w", (0.66, 0.79), max_periods=1)
    assert not found.loose_ends
    smooth = [i for i, b in enumerate(found.branches) if b.name == "0a, 2seg"]
    assert len(smooth) == 1
    (touch,) = (e for e in found.events if smooth[0] in e.branches)
    assert touch.bifurcation.kind is cf.Kind.GS
    assert any(found.branches[i].bridge for i in touch.branches)
    there = touch.bifurcation
    assert abs(fastest(there.params, there.orbit.state(0.0))) < 1e-7
    checked = found.verify(5)  # from the smooth branch, too
    assert checked.passed, str(checked)
    assert not checked.sums  # at large amplitudes the law of friction is not linear
