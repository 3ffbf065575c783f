"""Flow, first hits and stationary points of the declared oscillator against the closed form by hand."""

from __future__ import annotations

from math import comb

import numba
import numpy as np
import pytest

import contfric as cf
from contfric.flow.linear.search import first_root, sixth_of
from contfric.flow.linear.system import TERMS
from contfric.flow.oscillator import flow as by_hand

NONE, EMPTY, ALL = np.empty(0, dtype=np.int64), np.empty(0), np.arange(5)
LOAD, SPEED, STICK = 0, 1, 2


@pytest.mark.parametrize("seed", range(100))
def test_segments_agree(seed: int) -> None:
    flow, rng = cf.load_model("coulomb-yaml").flow, np.random.default_rng(seed)
    s, extra = rng.uniform(0, 1), rng.uniform(0, 0.5)
    p = np.array([rng.uniform(0.1, 3), s, s + extra, rng.uniform(-1, 1), rng.uniform(0, 0.5)])
    p[3:] *= rng.integers(0, 2, 2)
    mode, y = int(rng.integers(3)), rng.uniform(-2, 2, 2)
    y[1] *= mode != STICK
    t0, dt = rng.uniform(-30, 30), rng.uniform(0, 20)
    a, b, ja, jb = np.empty(2), np.empty(2), np.empty((2, 9)), np.empty((2, 9))
    flow.flow(mode, t0, y, dt, p, ALL, a, ja)
    by_hand.flow(mode, t0, y, dt, p, ALL, b, jb)
    assert np.all(np.abs(a - b) < 2e-13 * (1 + np.abs(b)))
    assert np.all(np.abs(ja - jb) < 2e-12 * (1 + np.abs(jb)))
    for c in (LOAD, SPEED):
        on = bool(rng.integers(2)) and c == LOAD
        target = by_hand.observe(c, t0, y, p, NONE, EMPTY) if on else rng.uniform(-1, 1)
        tau, want = (
            f.hit(mode, c, target, on, t0, y, dt, p, y1) for f, y1 in ((flow, a), (by_hand, b))
        )
        assert (tau < 0) == (want < 0)
        if tau >= 0:
            rate = abs(by_hand.rate(mode, c, t0 + want, b, p, NONE, EMPTY))
            assert max(abs(tau - want), *np.abs(a - b)) * min(rate, 1.0) < 1e-12
        times, values = np.empty((2, 200)), np.empty((2, 200))
        n = flow.stationary(mode, c, t0, y, dt, p, times[0], values[0])
        assert n == by_hand.stationary(mode, c, t0, y, dt, p, times[1], values[1])
        assert np.all(np.abs(np.diff(values[:, :n], axis=0)) < 1e-12)


@numba.njit  # type: ignore[untyped-decorator]
def root_in_step(poly, terms):  # type: ignore[no-untyped-def]
    """The first root of a polynomial that is positive at first."""
    return first_root(poly, 0, terms, 0.0, 1.0, sixth_of(poly, 0, terms))


@pytest.mark.parametrize("order", [2, 3, 4, 6])
@pytest.mark.parametrize("factor", [1.0, 1e-3, 1e-6])
@pytest.mark.parametrize("moved", [0.0, 1e-17, -1e-17, 2e-16, -2e-16, 1e-9, -1e-9])
def test_a_level_that_is_touched_at_the_end_of_a_step(
    order: int, factor: float, moved: float
) -> None:
    """A root or none where a zero of some order is rounding: never a search without an end."""
    poly = np.zeros(TERMS + 2)
    poly[: order + 1] = [factor * comb(order, k) * (-1.0) ** k for k in range(order + 1)]
    poly[0] += moved
    at, _ = root_in_step(poly, order)
    rounding = 1e-15 * (1.0 + factor * 2.0**order)
    if at >= 0.0:
        assert abs(factor * (1.0 - at) ** order + moved) <= rounding
    else:
        assert at == -1.0
        assert moved >= -rounding
