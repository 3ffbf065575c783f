"""Stable sets of random saddles of impact oscillators, with unstable multipliers of either sign."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.errors import ParameterError
from contfric.response.stable_half import StableEnd


def saddle(draw: np.random.Generator, sign: float) -> cf.Orbit:
    """Return an orbit of random parameters whose unstable multiplier has a sign."""
    while True:
        p = {
            "w": float(draw.uniform(2.0, 3.2)),
            "d": float(draw.uniform(0.0, 0.6)),
            "e": float(draw.uniform(0.5, 0.8)),
            "c": float(draw.uniform(0.05, 0.2)),
        }
        try:
            branch = cf.continue_orbit(cf.find_orbit("impact", p), "w", (0.8 * p["w"], 4.0))
        except cf.ContfricError:
            continue
        largest = [m[np.argmax(np.abs(m))] for m in branch.multipliers]
        fits = [k for k, m in enumerate(largest) if m.imag == 0.0 and 1.2 < sign * m.real < 6.0]
        if fits:
            return branch[fits[len(fits) // 2]]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_starts_on_the_set_come_to_the_saddle(sign: float) -> None:
    """By simulation, which knows nothing of the set."""
    tried = 0
    for seed in range(3):
        orbit = saddle(np.random.default_rng(seed), sign)
        ranges = {"x": (-2.0, orbit.params["d"]), "v": (-2.0, 2.0)}
        found = cf.stable_set(orbit, ranges, max_points=12, max_step=0.05)
        home, times = orbit.state(0.0), np.arange(1, 15) * orbit.period
        for half in found.states:
            for start in half[1:-1]:
                end = cf.simulate("impact", orbit.params, state=start, periods=14.5 * orbit.periods)
                assert np.min(np.hypot(*(end.sample(times) - home).T)) < 1e-6
                tried += 1
    assert tried > 50


def test_the_work_is_bounded() -> None:
    orbit = saddle(np.random.default_rng(0), -1.0)
    ranges = {"x": (-2.0, orbit.params["d"]), "v": (-2.0, 2.0)}
    whole = cf.stable_set(orbit, ranges, max_points=30)
    part = cf.stable_set(orbit, ranges, max_points=30, max_returns=800)
    assert part.ends == (StableEnd.RETURNS, StableEnd.RETURNS) and part.complete
    for one, other in zip(part.states, whole.states, strict=True):
        assert 1 <= len(one) < len(other)
        assert np.array_equal(one, other[: len(one)])
    with pytest.raises(ParameterError, match="max_returns"):
        cf.stable_set(orbit, ranges, max_returns=0)
