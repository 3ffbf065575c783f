"""Integrated segments against the closed form, and against integrators with many digits."""

from __future__ import annotations

import math

import coulomb_integrated as integrated
import mpmath as mp
import numpy as np
import pytest
from catalogue import OSCILLATOR
from catalogue import flow as catalogue_flow

from contfric.flow.oscillator import flow as closed

NONE, EMPTY, NOTHING = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
ALL = np.arange(5)
LOAD, SPEED, STICK = 0, 1, 2


def random_segment(rng):
    """Mode, time, state, duration and parameters; phases of many periods, any damping."""
    s, extra = rng.uniform(0, 1), rng.uniform(0, 0.5)
    p = np.array([rng.uniform(0.1, 3), s, s + extra, rng.uniform(-1, 1), rng.uniform(0, 0.5)])
    p[3:] *= rng.integers(0, 2, 2)
    mode, y = int(rng.integers(3)), rng.uniform(-2, 2, 2)
    if mode == STICK:
        y[1] = 0.0
    return mode, rng.uniform(-30, 30), y, rng.uniform(0, 20), p


@pytest.mark.parametrize("seed", range(150))
def test_state_and_derivatives(seed):
    mode, t0, y, dt, p = random_segment(np.random.default_rng(seed))
    a, b, ja, jb = np.empty(2), np.empty(2), np.empty((2, 9)), np.empty((2, 9))
    integrated.flow(mode, t0, y, dt, p, ALL, a, ja)
    closed.flow(mode, t0, y, dt, p, ALL, b, jb)
    assert np.all(np.abs(a - b) < 1e-11 * (1 + np.abs(b)))
    assert np.all(np.abs(ja - jb) < 1e-11 * (1 + np.abs(jb)))
    alone = np.empty(2)
    integrated.flow(mode, t0, y, dt, p, NONE, alone, NOTHING)
    assert np.all(np.abs(alone - b) < 1e-11 * (1 + np.abs(b)))


@pytest.mark.parametrize("seed", range(150))
def test_hits_and_turnings(seed):
    rng = np.random.default_rng(1000 + seed)
    mode, t0, y, dt, p = random_segment(rng)
    for c in (LOAD, SPEED):
        target, on = rng.uniform(-1, 1), bool(rng.integers(2))
        if on:
            target = closed.observe(c, t0, y, p, NONE, EMPTY)
        if not (on and c == SPEED):  # a slide that starts at v = 0 is below
            compare_hits(mode, c, target, on, t0, y, dt, p)
        times, values = np.empty((2, 200)), np.empty((2, 200))
        n = integrated.stationary(mode, c, t0, y, dt, p, times[0], values[0])
        assert n == closed.stationary(mode, c, t0, y, dt, p, times[1], values[1])
        assert np.all(np.abs(np.diff(times[:, :n], axis=0)) < 1e-8)
        assert np.all(np.abs(np.diff(values[:, :n], axis=0)) < 1e-11 * (1 + np.abs(values[1, :n])))


def compare_hits(mode, c, target, on, t0, y, dt, p):
    a, b = np.empty(2), np.empty(2)
    tau = integrated.hit(mode, c, target, on, t0, y, dt, p, a)
    expected = closed.hit(mode, c, target, on, t0, y, dt, p, b)
    assert (tau < 0) == (expected < 0)
    if tau >= 0:
        rate = abs(closed.rate(mode, c, t0 + expected, b, p, NONE, EMPTY))
        assert abs(tau - expected) * min(rate, 1.0) < 1e-11
        assert np.all(np.abs(a - b) * min(rate, 1.0) < 1e-11)


@pytest.mark.parametrize("seed", range(60))
def test_slides_that_start_at_rest(seed):
    rng = np.random.default_rng(2000 + seed)
    _, t0, y, dt, p = random_segment(rng)
    # a release at S0, or (every third) one with no acceleration at all, as with S0 = S
    force = closed.observe(LOAD, t0, np.zeros(2), p, NONE, EMPTY)
    limit = p[1] if seed % 3 == 0 else p[2]
    for mode, sign in ((0, -1.0), (1, 1.0)):
        y = np.array([sign * limit - force, 0.0])
        bend = closed.rate(mode, LOAD, t0, y, p, NONE, EMPTY)
        if limit == p[1] and abs(bend) < 1e-3:
            continue  # two rates vanish: see below
        compare_hits(mode, SPEED, 0.0, True, t0, y, dt, p)


def test_starts_with_neither_acceleration_nor_its_rate():
    # at the extrema of the force v' = v'' = 0, and v leaves 0 with the third power of time
    p, largest, smallest = np.array([0.5, 0.4, 0.4, 0.0, 0.0]), 0.0, 2.0 * math.pi
    a, b = np.empty(2), np.empty(2)
    for mode, t0, x in ((0, smallest, -1.4), (1, largest, 1.4)):
        start = np.array([x, 0.0])
        tau = integrated.hit(mode, SPEED, 0.0, True, t0, start, 20.0, p, a)
        expected = closed.hit(mode, SPEED, 0.0, True, t0, start, 20.0, p, b)
        assert tau == pytest.approx(expected, abs=1e-9)
        assert tau > 1.0
    for mode, t0, x in (
        (0, largest, 0.6),
        (1, smallest, -0.6),
    ):  # to the wrong side: it stops at once
        start = np.array([x, 0.0])
        assert integrated.hit(mode, SPEED, 0.0, True, t0, start, 20.0, p, a) == 0.0
        assert closed.hit(mode, SPEED, 0.0, True, t0, start, 20.0, p, b) == pytest.approx(0.0)


def test_no_time_little_time_and_backwards():
    p, y = np.array([0.7, 0.3, 0.4, 0.2, 0.05]), np.array([0.4, 0.9])
    for dt in (0.0, 1e-300, 1e-12, 1e-5, -1e-9, -0.3, -4.0):
        a, b, ja, jb = np.empty(2), np.empty(2), np.empty((2, 9)), np.empty((2, 9))
        integrated.flow(0, 0.3, y, dt, p, ALL, a, ja)
        closed.flow(0, 0.3, y, dt, p, ALL, b, jb)
        assert np.abs(a - b).max() < 1e-13
        assert np.abs(ja - jb).max() < 1e-11
    y1, times = np.empty(2), np.empty(9)
    assert integrated.hit(0, SPEED, 0.0, False, 0.3, y, -1.0, p, y1) < 0
    assert integrated.stationary(0, SPEED, 0.3, y, -1.0, p, times, times) == 0


@pytest.mark.parametrize("tiny", [0.0, 1e-300, -1.15e-15, 1e-12])
def test_starts_next_to_zero(tiny):
    # the first step is not in proportion to the state: from -1.15e-15 it would not have moved the time
    p, y = np.array([0.7, 0.0, 0.4, 0.2, 0.05]), np.array([tiny, 0.0])
    for t0 in (0.3, 9.581815299, -200.0):
        a, b = np.empty(2), np.empty(2)
        integrated.flow(0, t0, y, 1.7, p, NONE, a, NOTHING)
        closed.flow(0, t0, y, 1.7, p, NONE, b, NOTHING)
        assert np.abs(a - b).max() < 1e-12


def test_what_is_no_number_stays_none():
    p, y1, jac = np.array([0.5, 0.3, 0.4, 0.0, 0.0]), np.empty(2), np.empty((2, 5))
    for t0, y, dt in (
        (0.0, [math.nan, 0.0], 1.0),
        (0.0, [math.inf, 0.0], 1.0),
        (math.nan, [0.0, 1.0], 1.0),
        (0.0, [0.0, 1.0], math.nan),
    ):
        integrated.flow(0, t0, np.array(y), dt, p, np.array([0]), y1, jac)
        assert np.all(np.isnan(y1))
        assert np.all(np.isnan(jac))
    broken = np.array([math.nan, 0.0])
    assert integrated.hit(0, SPEED, 0.5, False, 0.0, broken, 1.0, p, y1) >= 0
    assert np.all(np.isnan(y1))
    assert integrated.stationary(0, SPEED, 0.0, broken, 1.0, p, np.empty(9), np.empty(9)) == -1


def test_more_stationary_points_than_there_is_space_for():
    p, y = np.array([1.0, 0.0, 0.5, 0.0, 0.0]), np.array([0.0, 0.0])
    times, values = np.empty(3), np.empty(3)
    assert integrated.stationary(STICK, LOAD, 0.1, y, 30.0, p, times, values) == -1


@pytest.mark.slow
def test_van_der_pol_against_many_digits():
    """State, and its derivatives by state and mu, from Taylor series with 30 digits."""
    with mp.workdps(30):

        def right(_t, w):  # the variations are written out by hand
            x, v, mu = w[0], w[1], mp.mpf("1.5")
            a, b = -2 * mu * x * v - 1, mu * (1 - x * x)
            rows = [v, b * v - x]
            for k in range(3):
                m0, m1 = w[2 + 2 * k], w[3 + 2 * k]
                rows += [m1, a * m0 + b * m1 + ((1 - x * x) * v if k == 2 else 0)]
            return rows

        start = [mp.mpf(1) / 2, mp.mpf("1.25"), 1, 0, 0, 1, 0, 0]
        exact = [float(w) for w in mp.odefun(right, 0, start)(3)]
    y1, jac = np.empty(2), np.empty((2, 5))
    p = np.array([1.5, 1e-13, *np.zeros(9)])
    catalogue_flow(OSCILLATOR, 0.0, np.array([0.5, 1.25]), 3.0, p, np.array([0]), y1, jac)
    assert np.abs(y1 - exact[:2]).max() < 1e-12
    expected = np.array(exact[2:]).reshape(3, 2).T
    assert np.abs(jac[:, [1, 2, 4]] - expected).max() < 1e-11
    assert np.all(jac[:, 0] == 0.0)  # autonomous
    assert jac[:, 3] == pytest.approx([y1[1], 1.5 * (1 - y1[0] ** 2) * y1[1] - y1[0]], abs=1e-12)
