"""Stationary points at double zeros of a rate: the search ends, and finds what counts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import contfric as cf
from contfric.models.reading.files import from_data


def model(nonlinear: bool) -> cf.Model:
    """x' = 1 - cos(t - a) + d: a double zero at t = a where d = 0, two zeros below and none above."""
    slow = "-y**3" if nonlinear else "-y"
    return from_data(
        {
            "name": f"double zero {slow}",
            "states": ["x", "y"],
            "parameters": {"a": 2.0, "d": 0.0},
            "period": "2*pi",
            "observables": {"x": "x"},
            "surfaces": {"far": {"observable": "x", "level": 1000}},
            "modes": {"on": {"field": {"x": "1 - cos(t - a) + d + 0*y", "y": slow}}},
        }
    )


@pytest.mark.parametrize("nonlinear", [True, False])
@settings(max_examples=40, deadline=None)
@given(
    a=st.one_of(st.floats(1.0, 5.0), st.sampled_from([1.5, 2.0, 3.0, 4.0, 4.5])),
    d=st.sampled_from([0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-8, -1e-8, -1e-4, 1e-4]),
    x=st.sampled_from([0.0, 1.0, -30.0]),
)
def test_the_search_ends_and_what_counts_is_found(nonlinear, a, d, x) -> None:
    found = model(nonlinear)
    flow = found.view(found.vector({"a": a, "d": d}))
    times, values = flow.stationary("on", "x", 0.0, np.array([x, 1.0]), 6.0)
    half = math.acos(1.0 + d) if d < 0.0 else 0.0
    drop = 2 * (math.sin(half) - half * math.cos(half)) if half else 0.0
    if drop > 1e-11 * (1 + abs(x)):  # else two stationary points have one value to rounding
        assert np.allclose(times, [a - half, a + half], atol=1e-6)
        assert values[0] - values[1] == pytest.approx(drop, rel=1e-3)
    else:  # which are as many as rounding makes
        assert len(times) == 0 or np.ptp(values) < 1e-14 * (1 + abs(x)) + 2 * drop
    assert np.all(np.abs(times - a) < half + 1e-4)
    if d > 1e-6:
        assert len(times) == 0
