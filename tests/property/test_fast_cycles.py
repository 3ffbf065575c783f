"""Cycles that are short in time: the same orbits and multipliers, however fast a model is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf

#: Welander's box of the ocean: two nodes, each on the other side of the line at which they are switched.
WELANDER = """
name: welander-{rate:g}
states: [x, y]
parameters: {{a: {a}, b: {b}, k: {k}, eps: {eps}}}
autonomous: true
surfaces: {{density: {{observable: y - a*x, level: eps}}}}
modes:
  mixed: {{in: {{density: +}}, field: {{x: {rate}*(1 - x - k*x), y: {rate}*(b*(1 - y) - k*y)}}}}
  still: {{in: {{density: -}}, field: {{x: {rate}*(1 - x), y: {rate}*b*(1 - y)}}}}
spread: {{x: 1, y: 1}}
"""


def welander(folder: Path, rate: float, a: float, b: float, k: float, eps: float) -> cf.Model:
    return typed(folder, WELANDER.format(rate=rate, a=a, b=b, k=k, eps=eps))


@pytest.mark.parametrize("seed", range(4))
def test_multipliers_do_not_depend_on_how_fast_a_model_is(seed: int, tmp_path: Path) -> None:
    draw = np.random.default_rng(seed)
    a, b, k = draw.uniform(0.75, 0.85), draw.uniform(0.4, 0.6), draw.uniform(0.9, 1.1)
    eps = draw.uniform(0.2, 0.4) * (b / (b + k) - a / (1.0 + k))  # short of the node of one side
    values = a, b, k, float(eps)
    slow = cf.find_orbit(welander(tmp_path, 1.0, *values), {})
    assert slow.stable and slow.period > 0.5
    for rate in (30.0, 1e3):
        fast = cf.find_orbit(welander(tmp_path, rate, *values), {})
        assert fast.period * rate == pytest.approx(slow.period, rel=1e-9)
        assert fast.multipliers == pytest.approx(slow.multipliers, abs=1e-8)


def test_a_cycle_that_two_sides_share_shrinks_to_a_point(tmp_path: Path) -> None:
    """The folds of both fields meet at eps = 0, and the period goes to 0 as the root of eps."""
    model = welander(tmp_path, 1.0, 0.8, 0.5, 1.0, -0.02)
    branch = cf.continue_orbit(cf.find_orbit(model, {}), "eps", (-0.06, 0.1))
    assert branch.ends[1].reason is cf.EndReason.POINT
    assert abs(branch.values[-1]) < 1e-9 and branch.period[-1] < 1e-6
    share = branch.values[-12:-4] / branch.period[-12:-4] ** 2
    assert np.ptp(share) < 0.1 * abs(share.mean())


def test_a_surface_may_be_the_zero_of_an_expression(tmp_path: Path) -> None:
    """The observable then has the name of the surface."""
    model = welander(tmp_path, 1.0, 0.8, 0.5, 1.0, -0.02)
    orbit = cf.find_orbit(model, {})
    assert orbit.itinerary[0][1] == "density"
    assert orbit.quantity("max(density)") > -0.02 > orbit.quantity("min(density)")
