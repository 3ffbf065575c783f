"""A model's flow by names: the same values as the compiled functions, and none left out silently."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.errors import ContfricError

MODEL = cf.load_model("coulomb")
FLOW = MODEL.view(MODEL.vector({"Omega": 0.7, "S": 0.2, "S0": 0.3, "h": 0.1, "zeta": 0.01}))
Y = np.array([0.4, -0.3])


@pytest.mark.parametrize("periods", [1, 40, 900])
def test_all_stationary_points_are_returned(periods: int) -> None:
    lasts = periods * FLOW.period
    times, values = FLOW.stationary("slide+", "v", 0.3, Y, lasts)
    rates = [FLOW.rate("slide+", "v", 0.3 + t, FLOW.state("slide+", 0.3, Y, t)) for t in times]
    assert np.max(np.abs(rates)) < 1e-9
    for t, value in zip(times[::50], values[::50], strict=True):
        assert abs(FLOW.state("slide+", 0.3, Y, float(t))[1] - value) < 1e-10
    # in two halves: what is found does not depend on how many there are
    half = 0.5 * lasts
    middle = FLOW.state("slide+", 0.3, Y, half)
    halves = [(0.3, Y), (0.3 + half, middle)]
    counts = [len(FLOW.stationary("slide+", "v", t, y, half)[0]) for t, y in halves]
    assert sum(counts) == len(times) >= periods


def test_more_than_fit_is_an_error() -> None:
    with pytest.raises(ContfricError, match="stationary points of 'v'"):
        FLOW.stationary("slide+", "v", 0.0, Y, 3e5 * FLOW.period)


def test_gradients_are_those_of_differences() -> None:
    step = 1e-6
    for name in MODEL.observable_index:
        grad = FLOW.gradient(name, 0.3, Y, MODEL.index_of("Omega"))
        by_time = FLOW.observe(name, 0.3 + step, Y) - FLOW.observe(name, 0.3 - step, Y)
        assert abs(grad[0] - by_time / (2 * step)) < 1e-8
    jac = FLOW.jacobian("slide+", 0.3, Y, 1.1)
    moved = [FLOW.state("slide+", 0.3, Y + np.array([d, 0.0]), 1.1) for d in (step, -step)]
    assert np.max(np.abs(jac[:, 1] - (moved[0] - moved[1]) / (2 * step))) < 1e-8
