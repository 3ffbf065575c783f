"""Machines whose thrust lasts for a time, against scipy: the hopper of Koditschek and Buehler (1991)."""

from __future__ import annotations

import numpy as np
import pytest
from by_scipy import met
from typed import typed

import contfric as cf

#: Thrust begins at the lowest point and lasts for a time; only flight comes to the ground, on its way down.
HOPPER = """
name: hopper
states: [y, v, s]
parameters: {g: 1.0, k: 30.0, b: 1.0, push: 12.0, lasts: 0.1}
autonomous: true
surfaces:
  ground: {observable: y}
  bottom: {observable: v}
  over: {observable: s, level: lasts}
modes:
  flight: {in: {ground: +}, field: {y: v, v: -g, s: 0}}
  compress: {in: {ground: -, bottom: -}, field: {y: v, v: -g - k*y - b*v, s: 0}}
  thrust: {in: {ground: -, over: -}, field: {y: v, v: push - g, s: 1}}
  extend: {in: {ground: -}, field: {y: v, v: -g - k*y - b*v, s: 0}}
resets:
  ground: {to: compress, from: flight}
  bottom: {s: 0, to: thrust, from: compress}
  over: {s: 0, to: extend, from: thrust}
"""


def lands(speed: float, push: float, k: float) -> tuple[float, float]:
    """Return the speed at the next landing, and the time to it: four flights by scipy."""

    def leg(_, z):
        return [z[1], -1.0 - k * z[0] - z[1]]

    first, low = met(leg, [0.0, -speed], lambda _, z: z[1], 1)
    pushed = [low[0] + 0.5 * (push - 1.0) * 0.01, 0.1 * (push - 1.0)]
    last, up = met(leg, pushed, lambda _, z: z[0], 1)
    return float(up[1]), first + 0.1 + last + 2.0 * float(up[1])


@pytest.mark.parametrize("seed", range(3))
def test_a_hopper_meets_the_ground_on_its_way_down_only(tmp_path, seed: int) -> None:
    """What meets the ground on its way up is no flight: it is not asked in which mode it would go on."""
    rng = np.random.default_rng([30, seed])
    push, k = rng.uniform(10.0, 16.0), rng.uniform(20.0, 40.0)
    orbit = cf.find_orbit(typed(tmp_path, HOPPER), {"push": push, "k": k}, state=[0.5, 0, 0])
    modes = {mode for mode, _ in orbit.itinerary}
    assert modes == {"flight", "compress", "thrust", "extend"}
    speed, period = 1.0, 0.0
    for _ in range(60):
        speed, period = lands(speed, push, k)
    assert orbit.period == pytest.approx(period, abs=1e-8)
    assert np.max(np.abs(orbit.begins[:, 2])) == pytest.approx(
        max(speed, 0.1 * (push - 1.0)), abs=1e-8
    )
