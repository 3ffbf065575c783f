"""Friction elements that turned together reach their limits together: two surfaces are met to rounding."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf


def stepped(params: dict[str, float], state: np.ndarray, until: float) -> np.ndarray:
    """Integrate three Jenkins elements by small steps of clipped springs: the midpoint rule."""
    p = params
    limits = p["S"] / p["kt"] * np.array([1.0, p["n"], p["m"]])
    x, v, z = state[0], state[1], state[2:].copy()
    count = 200_000
    h = until / count

    def pull(x: float, v: float, z: np.ndarray, t: float) -> float:
        return p["F"] * np.cos(p["W"] * t) - p["c"] * v - p["k"] * x - p["kt"] * z.sum()

    for i in range(count):
        t = i * h
        a = pull(x, v, z, t)
        middle = np.clip(z + 0.5 * h * v, -limits, limits)
        rate = v + 0.5 * h * a
        v += h * pull(x + 0.5 * h * v, rate, middle, t + 0.5 * h)
        x, z = x + h * rate, np.clip(z + h * rate, -limits, limits)
    return np.array([x, v, *z])


@pytest.mark.parametrize("frequency", [0.97, 1.03])
def test_a_transient_against_small_steps(frequency: float) -> None:
    found = cf.simulate("iwan", {"W": frequency}, periods=3)
    assert found.end.name == "TIME"
    cycles, phase, state, _ = found.last
    start = np.array(found.begin[1])
    until = cycles * 2.0 * np.pi / frequency + phase
    reference = stepped(found.params, start, until)
    np.testing.assert_allclose(np.array(state), reference, atol=1e-4)


def test_every_start_of_a_structure_has_a_steady_state() -> None:
    swept = cf.sweep("iwan", "W", np.linspace(0.9, 1.1, 7))
    assert set(swept.counts()) == {cf.Outcome.PERIODIC}
    found = cf.lyapunov_map(
        "iwan", {"W": np.linspace(0.95, 1.1, 4), "F": np.linspace(0.35, 0.5, 3)}, periods=60
    )
    assert set(found.counts()) <= {cf.Motion.PERIODIC, cf.Motion.UNDECIDED}


def test_no_element_leaves_its_limits() -> None:
    found = cf.simulate("iwan", {"W": 1.03}, periods=40)
    states = found.sample(np.linspace(found.times[0], 200.0, 2000))
    assert (np.abs(states[:, 2:]) <= np.array([0.2, 0.4, 0.8]) + 1e-12).all()
    assert np.abs(states[:, 4]).max() == pytest.approx(0.8, abs=1e-9)
