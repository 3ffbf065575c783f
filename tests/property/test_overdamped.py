"""Strong damping: slides, first roots and stationary points for zeta from 1 to 1e7, against 50 digits.

The reference is the sum of exponentials with undetermined coefficients. The fast one lasts for 1/(2 zeta):
samples lie on a logarithmic grid from far within it to the end of the segment.
"""

from __future__ import annotations

import time

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import contfric as cf
from contfric.flow.oscillator.flow import flow, hit, stationary

LOAD, SPEED = range(2)
NONE, NOTHING = np.empty(0, dtype=np.int64), np.empty((0, 0))


class Slide:
    """One slide with 50 digits."""

    def __init__(self, sign, p, t0, x0, v0):
        self.p = [mpmath.mpf(float(value)) for value in p]
        self.w, force, _, h, zeta = self.p
        self.sign, self.t0 = sign, mpmath.mpf(t0)
        root = mpmath.sqrt(mpmath.mpc(zeta * zeta - 1))
        self.roots = -zeta + root, -zeta - root
        self.terms = [
            (k * self.w, size / (1 - (k * self.w) ** 2 + 2j * zeta * k * self.w))
            for k, size in ((1, mpmath.mpf(1)), (3, h))
        ]
        self.rest = -sign * force
        x, v = self.particular(0, 0), self.particular(0, 1)
        a, b = mpmath.mpf(x0) - x, mpmath.mpf(v0) - v
        one, two = self.roots
        self.c = (b - two * a) / (one - two), (one * a - b) / (one - two)

    def particular(self, d, order):
        value = self.rest if order == 0 else mpmath.mpf(0)
        for w, c in self.terms:
            value += (c * (1j * w) ** order * mpmath.expj(w * (self.t0 + d))).real
        return value

    def x(self, d, order=0):
        """Return a derivative of x."""
        value = self.particular(d, order)
        for c, r in zip(self.c, self.roots, strict=True):
            value += (c * r**order * mpmath.exp(r * d)).real
        return value

    def load_rate(self, d, order):
        """Return a derivative of u = x - f."""
        value = self.x(d, order)
        for k, size in ((1, 1), (3, self.p[3])):
            w = k * self.w
            value -= (size * (1j * w) ** order * mpmath.expj(w * (self.t0 + d))).real
        return value


@st.composite
def slides(draw):
    """Draw parameters, direction and the state at the start."""
    numbers = [
        draw(st.floats(low, high)) for low, high in ((0.05, 3), (0.02, 0.5), (0, 1), (0, 12))
    ]
    w, force, _, t0 = numbers
    h = draw(st.sampled_from([0.0, 0.3, -0.8]))
    zeta = 10.0 ** draw(st.floats(0.01, 7.0))
    sign = draw(st.sampled_from([1.0, -1.0]))
    x0 = draw(st.floats(-1.5, 1.5))
    v0 = draw(st.sampled_from([0.0, 0.0, sign * draw(st.floats(1e-9, 1.0))]))
    return sign, np.array([w, force, force, h, zeta]), t0, x0, v0


def samples(zeta, end):
    short = np.geomspace(min(1e-4 / zeta, 1e-3 * end), end, 60)
    return [float(d) for d in np.unique(np.concatenate([short, np.linspace(0.0, end, 40)[1:]]))]


@settings(max_examples=25, deadline=None)
@given(slides(), st.floats(-8.0, 1.0))
def test_states_have_all_their_digits(slide, size):
    sign, p, t0, x0, v0 = slide
    with mpmath.workdps(50):
        exact = Slide(sign, p, t0, x0, v0)
        d = 10.0**size
        y = np.empty(2)
        flow(0 if sign > 0 else 1, t0, np.array([x0, v0]), d, p, NONE, y, NOTHING)
        speed = abs(v0) + 3.0 / max(1.0, p[4])
        assert abs(y[0] - exact.x(mpmath.mpf(d))) < 2e-15 * (3 + d)
        assert abs(y[1] - exact.x(mpmath.mpf(d), 1)) < 2e-14 * speed * (1 + d)


@settings(max_examples=25, deadline=None)
@given(slides())
def test_the_first_stop_is_the_first(slide):
    sign, p, t0, x0, v0 = slide
    with mpmath.workdps(50):
        exact = Slide(sign, p, t0, x0, v0)
        if v0 == 0.0:
            assume(
                sign * exact.x(mpmath.mpf(0), 2) > 1e-6
            )  # it leaves its start in its own direction
        y, end = np.empty(2), 60.0
        mode = 0 if sign > 0 else 1
        found = hit(mode, SPEED, 0.0, v0 == 0.0, t0, np.array([x0, v0]), end, p, y)
        stop = end if found < 0 else found
        noise = mpmath.mpf(1e-13) / max(1.0, p[4])
        assert all(
            sign * exact.x(mpmath.mpf(d), 1) > -noise for d in samples(p[4], stop * (1 - 1e-9))
        )
        if found >= 0:
            at = mpmath.mpf(found)
            v, rate = exact.x(at, 1), exact.x(at, 2)
            assume(abs(rate) > 1e-4 / p[4])
            assert abs(v / rate) < 1e-13 * (1 + found) * (1 + 1 / abs(rate * p[4]))
            assert y[1] == 0.0 and abs(y[0] - exact.x(at)) < 1e-14 * (3 + found)


@settings(max_examples=25, deadline=None)
@given(slides(), st.floats(-6.0, 1.3), st.sampled_from([LOAD, SPEED]))
def test_stationary_points_are_all_there_are(slide, size, observable):
    sign, p, t0, x0, v0 = slide
    with mpmath.workdps(50):
        exact, end = Slide(sign, p, t0, x0, v0), 10.0**size
        times, values = np.empty(256), np.empty(256)
        mode = 0 if sign > 0 else 1
        start = np.array([x0, v0])
        count = stationary(mode, observable, t0, start, end, p, times, values)
        assert count >= 0
        near = 8e-10 * (1 + end)
        places = [d for d in samples(p[4], end) if near < d < end - near]
        assume(len(places) > 1)

        def rate(d, order=0):
            if observable == SPEED:
                return exact.x(mpmath.mpf(d), 2 + order)
            return exact.load_rate(mpmath.mpf(d), 1 + order)

        signs = [mpmath.sign(rate(d)) for d in places]
        for left, right, a, b in zip(signs, signs[1:], places, places[1:], strict=False):
            inside = sum(a < t < b for t in times[:count])
            assert inside % 2 == (0 if left == right else 1), (a, b, times[:count])
        for t, value in zip(times[:count], values[:count], strict=True):
            bend = rate(t, 1)
            assert abs(rate(t)) <= 1e-9 * (1 + t) * max(abs(bend), mpmath.mpf(1) / p[4])
            known = (
                exact.x(mpmath.mpf(t), 1)
                if observable == SPEED
                else exact.load_rate(mpmath.mpf(t), 0)
            )
            assert abs(value - known) < 1e-14 * (4 + t)


def test_strong_damping_costs_no_more():
    def seconds(zeta):
        params = {"Omega": 0.5, "S": 0.32, "S0": 0.4, "zeta": zeta}
        cf.simulate("coulomb", params, periods=10)
        best = np.inf
        for _ in range(3):
            began = time.process_time()
            trajectory = cf.simulate("coulomb", params, periods=400)
            best = min(best, time.process_time() - began)
        assert len(trajectory) > 800
        return best

    mild = seconds(1e2)
    for zeta in (1e3, 1e4, 1e6):
        assert seconds(zeta) < 3.0 * mild + 0.02


@pytest.mark.parametrize("w", [-0.3, 0.0, np.nan, np.inf, 1e-300])
@pytest.mark.parametrize("mode", [0, 1, 2])
def test_what_is_no_motion_is_answered_at_once(w, mode):
    times, values, y = np.empty(256), np.empty(256), np.empty(2)
    p = np.array([w, 0.3, 0.4, 0.0, 0.0])
    began = time.process_time()
    for t0, x0, end in (
        (18.9, 1.23, 3.1),
        (1e300, 0.0, 1e300),
        (np.nan, 0.0, 1.0),
        (0.0, 1.0, 1e18),
    ):
        for c in (LOAD, SPEED):
            assert stationary(mode, c, t0, np.array([x0, 0.0]), end, p, times, values) <= 256
            hit(mode, c, 0.4, False, t0, np.array([x0, 0.1]), end, p, y)
    assert time.process_time() - began < 10.0
