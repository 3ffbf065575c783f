"""Stiff motion: LuGre friction up to a contact a thousand times stiffer than the article's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lugre_integrated import flow, hit, observe, rate
from scipy.integrate import solve_ivp

NONE, EMPTY, NOTHING = np.empty(0, dtype=np.int64), np.empty(0), np.empty((0, 0))
#: Omega, S, S0, sigma0, sigma1, c, vS of section 5.2
ARTICLE = np.array([0.5, 0.32, 0.4, 1000.0, 0.0, 0.0, 0.05])
ALL = np.arange(7)


def parameters(stiffness, sigma1=0.0, c=0.0):
    p = ARTICLE.copy()
    p[3:6] = stiffness, sigma1, c
    return p


def scipy_solution(p, t0, y, dt):
    """The slide with v > 0, with z in units of 1/sigma0 as the tolerance of scipy is the same for all."""
    omega, s, s0, stiffness, sigma1, c, speed = p

    def field(t, w):
        x, v, force = w
        g = s + (s0 - s) * math.exp(-v / speed)
        slip = v - v / g * force
        return [
            v,
            math.cos(omega * t) - x - force - sigma1 * slip - c * v,
            stiffness * slip,
        ]

    def jacobian(t, w):
        _, v, force = w
        e = math.exp(-v / speed)
        g = s + (s0 - s) * e
        dm = 1.0 / g + v / g**2 * (s0 - s) / speed * e
        by_v, by_force = 1.0 - dm * force, -v / g
        return [
            [0.0, 1.0, 0.0],
            [-1.0, -sigma1 * by_v - c, -1.0 - sigma1 * by_force],
            [0.0, stiffness * by_v, stiffness * by_force],
        ]

    start = [y[0], y[1], stiffness * y[2]]
    options = {"method": "Radau", "jac": jacobian, "rtol": 1e-10, "atol": 1e-12}
    return solve_ivp(field, (t0, t0 + dt), start, **options).y[:, -1]


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [1e2, 1e3, 1e4, 1e6])
def test_slide_against_scipy(stiffness):
    p = parameters(stiffness, sigma1=0.02 / math.sqrt(stiffness), c=0.05)
    y1, start = np.empty(3), np.array([-1.0, 0.0, 0.1 / stiffness])
    flow(0, 0.4, start, 2.0, p, NONE, y1, NOTHING)
    assert y1 * [1, 1, stiffness] == pytest.approx(scipy_solution(p, 0.4, start, 2.0), abs=1e-8)


@pytest.mark.parametrize("stiffness", [1e2, 1e3, 1e4, 1e6])
def test_derivatives_against_differences(stiffness):
    p = parameters(stiffness, sigma1=0.02 / math.sqrt(stiffness), c=0.05)
    start, t0, dt = np.array([-1.0, 0.3, 0.3 / stiffness]), 0.4, 1.5
    y1, jac = np.empty(3), np.empty((3, 12))
    flow(0, t0, start, dt, p, ALL, y1, jac)

    def moved(column, by):
        q, y, t, d = p.copy(), start.copy(), t0, dt
        if column == 0:
            t += by
        elif column <= 3:
            y[column - 1] += by
        elif column == 4:
            d += by
        else:
            q[column - 5] += by
        out = np.empty(3)
        flow(0, t, y, d, q, NONE, out, NOTHING)
        return out

    unit = np.array([1, 1, 1, 1 / stiffness, 1, 1, 1, 1, stiffness, 1, 1, 0.05])
    rows = np.array([1.0, 1.0, stiffness])
    for column in range(12):
        # fourth order: its error is 1e-12, that of the flow over the step 1e-9
        h = 1e-3 * unit[column]
        one = moved(column, h) - moved(column, -h)
        two = moved(column, 2 * h) - moved(column, -2 * h)
        difference = (8.0 * one - two) / (12.0 * h)
        scale = rows * unit[column]
        assert scale * jac[:, column] == pytest.approx(scale * difference, abs=2e-8), column


@pytest.mark.parametrize("stiffness", [1e3, 1e5])
def test_a_slide_ends_where_its_velocity_vanishes(stiffness):
    p = parameters(stiffness)
    start, end, y1 = np.array([-1.0, 0.0, 0.0]), np.empty(3), np.empty(3)
    tau = hit(0, 0, 0.0, True, 0.4, start, 10.0, p, end)
    assert 2.0 < tau < 10.0
    assert abs(observe(0, 0.4 + tau, end, p, NONE, EMPTY)) < 1e-15
    flow(0, 0.4, start, tau, p, NONE, y1, NOTHING)
    assert np.abs((y1 - end) * [1, 1, stiffness]).max() < 1e-10
    # nowhere before: the velocity is positive at all times between
    for share in np.linspace(0.01, 0.999, 60):
        flow(0, 0.4, start, share * tau, p, NONE, y1, NOTHING)
        assert y1[1] > 0.0
    assert rate(0, 0, 0.4 + tau, end, p, NONE, EMPTY) < 0.0


def test_micro_oscillations_of_a_stick():
    """Near v = 0 the contact is a spring that gives way a little: ``sigma0 z' = sigma0 (1 - F/S0) v``."""
    p, left_over = parameters(1e4), 1e-3
    start, end = np.array([0.9, 0.0, 0.0]), np.empty(3)
    held = 1.0 - start[0] - left_over
    start[2] = held / p[3]
    tau = hit(0, 0, 0.0, True, 0.0, start, 10.0, p, end)
    frequency = math.sqrt(1.0 + p[3] * (1.0 - held / p[2]))
    assert tau == pytest.approx(math.pi / frequency, rel=0.1)
    assert end[1] == pytest.approx(0.0, abs=1e-15)
