"""First roots and stationary points: none is missed, none is invented.

Reference: the textbook solution (undetermined coefficients) sampled densely, each change of sign
refined by Brent's method, and each extremum near the target refined too, so that a pair of roots
between two samples is seen. Where a minimum is so near to the target that rounding decides, either
answer is right and the case is drawn again.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize_scalar

from contfric.flow.oscillator.flow import flow, hit, observe
from contfric.flow.oscillator.flow import stationary as kernel
from contfric.flow.oscillator.roots import AT_STATIONARY

LOAD, SPEED = range(2)
STICK = 2
#: Values nearer to zero than this are decided by rounding (states here are of order 1 to 10).
UNSURE = 1e-12
#: Nearer to a joint than this share of 1 + the duration a stationary point is the joint itself.
AT_JOINT = 2 * AT_STATIONARY


class Motion:
    """Observables and their rates along one segment, vectorised, from the textbook solution."""

    def __init__(self, mode, p, t0, y0):
        self.mode, self.p, self.t0, self.y0 = mode, p, t0, y0
        omega, _, _, h, zeta = p
        self.s = {0: 1.0, 1: -1.0, STICK: 0.0}[mode]
        if mode == STICK:
            return
        self.terms = [
            (k * omega, size / (1 - (k * omega) ** 2 + 2j * zeta * k * omega))
            for k, size in ((1, 1.0), (3, h))
        ]
        root = np.sqrt(complex(zeta * zeta - 1))
        self.roots = -zeta + root, -zeta - root
        x, v = self.particular(t0)
        a, b = y0[0] - x, y0[1] - v
        one, two = self.roots
        self.c = (b - two * a) / (one - two), (one * a - b) / (one - two)

    def particular(self, t):
        x = -self.s * self.p[1] + sum((c * np.exp(1j * w * t)).real for w, c in self.terms)
        return x, sum((1j * w * c * np.exp(1j * w * t)).real for w, c in self.terms)

    def force(self, t):
        omega, _, _, h, _ = self.p
        f = np.cos(omega * t) + h * np.cos(3 * omega * t)
        return f, -omega * (np.sin(omega * t) + 3 * h * np.sin(3 * omega * t))

    def state(self, tau):
        if self.mode == STICK:
            return self.y0[0] + 0 * tau, 0 * tau
        x, v = self.particular(self.t0 + tau)
        for c, r in zip(self.c, self.roots, strict=True):
            x = x + (c * np.exp(r * tau)).real
            v = v + (c * r * np.exp(r * tau)).real
        return x, v

    def observable(self, c, tau):
        x, v = self.state(tau)
        return v if c == SPEED else x - self.force(self.t0 + tau)[0]

    def rate(self, c, tau):
        x, v = self.state(tau)
        f, f1 = self.force(self.t0 + tau)
        if c == LOAD:
            return v - f1
        return f - 2 * self.p[4] * v - x - self.s * self.p[1]


def sure_roots(function, low, high, samples=3001):
    """All roots of a function in (low, high); None where rounding decides how many there are."""
    t = np.linspace(low, high, samples)
    q = function(t)
    roots = []
    for k in range(samples - 1):
        if q[k] * q[k + 1] < 0:
            roots.append(brentq(function, t[k], t[k + 1], xtol=1e-15))
    for k in range(1, samples - 1):
        inward = np.sign(q[k])
        if not (inward * q[k] <= inward * q[k - 1] and inward * q[k] <= inward * q[k + 1]):
            continue
        bend = abs(q[k - 1] - 2 * q[k] + q[k + 1])
        if abs(q[k]) > bend:
            continue  # a parabola through the samples stays away from zero
        lowest = minimize_scalar(
            lambda x, inward=inward: inward * function(x),
            bounds=(t[k - 1], t[k + 1]),
            method="bounded",
            options={"xatol": 1e-12},
        )
        if abs(lowest.fun) < UNSURE:
            return None
        if lowest.fun < 0:
            roots += [
                brentq(function, t[k - 1], lowest.x, xtol=1e-15),
                brentq(function, lowest.x, t[k + 1], xtol=1e-15),
            ]
    return sorted(set(roots))


def first_hit(mode, c, target, on, t0, y0, longest, p):
    state, vector, there, after = np.array(y0, float), np.array(p, float), np.empty(2), np.empty(2)
    tau = hit(mode, c, target, on, t0, state, longest, vector, there)
    if tau >= 0.0:
        none = np.empty(0, dtype=np.int64)
        flow(mode, t0, state, tau, vector, none, after, np.empty((0, 0)))
        assert np.max(np.abs(there - after)) < 1e-13 * (1 + np.max(np.abs(after)) + tau)
    return tau


def stationary(mode, c, t0, y0, dt, p):
    times, values = np.empty(256), np.empty(256)
    vector = np.array(p, float)
    count = kernel(mode, c, t0, np.array(y0, float), dt, vector, times, values)
    assert count >= 0
    none, empty, after = np.empty(0, dtype=np.int64), np.empty(0), np.empty(2)
    for tau, value in zip(times[:count], values[:count], strict=True):
        flow(mode, t0, np.array(y0, float), tau, vector, none, after, np.empty((0, 0)))
        there = observe(c, t0 + tau, after, vector, none, empty)
        assert value == pytest.approx(there, abs=1e-13 * (1 + np.max(np.abs(after))))
    return times[:count]


@st.composite
def parameters(draw):
    omega = draw(st.floats(0.02, 5.0))
    zeta = draw(st.sampled_from([0.0, 0.0, 0.02, 0.3, 1.5, -0.03]))
    h = draw(st.sampled_from([0.0, 0.3, -0.2, 1.1]))
    # the reference divides by these; the flow near resonance is tested against many digits elsewhere
    assume(min(abs(omega - 1), abs(3 * omega - 1)) > 1e-3 or zeta > 0)
    S = draw(st.floats(0.0, 1.0))
    S0 = S + draw(st.floats(0.0, 0.5))
    return omega, S, S0, h, zeta


phases = st.floats(0.0, 2 * math.pi)
places = st.floats(-2.0, 2.0)
shares = st.floats(0.01, 1.0)


def longest(omega):
    """Long enough for many turns of both solutions, short enough for the samples to see them all."""
    return min(40.0, 6 * math.pi / omega + 10.0)


@settings(max_examples=75, deadline=None)
@given(parameters(), phases, places, st.floats(1e-3, 2.0), st.booleans())
def test_a_slide_ends_at_its_first_zero_of_v(p, phase, x0, v0, up) -> None:
    mode, v0 = (0, v0) if up else (1, -v0)
    t0, end = phase / p[0], longest(p[0])
    motion = Motion(mode, p, t0, (x0, v0))
    roots = sure_roots(lambda tau: motion.observable(SPEED, tau), 0.0, end)
    assume(roots is not None)
    found = first_hit(mode, SPEED, 0.0, False, t0, (x0, v0), end, p)
    if not roots:
        assert found == -1.0
    else:
        assert found == pytest.approx(roots[0], abs=1e-9)


@settings(max_examples=75, deadline=None)
@given(parameters(), phases, st.floats(1e-3, 1.5), st.booleans())
def test_a_slide_from_rest_leaves_its_own_root(p, phase, excess, up) -> None:
    """It starts at v = 0, pushed by |u| = S + excess; the zero at the start is not an end."""
    mode, s = (0, 1.0) if up else (1, -1.0)
    t0, end = phase / p[0], longest(p[0])
    f = math.cos(phase) + p[3] * math.cos(3 * phase)
    y0 = (f - s * (p[1] + excess), 0.0)
    motion = Motion(mode, p, t0, y0)
    # the zero at the start is divided out; the limit there is the acceleration
    start = 1e-6
    roots = sure_roots(lambda tau: motion.observable(SPEED, tau) / tau, start, end)
    assume(roots is not None)
    found = first_hit(mode, SPEED, 0.0, True, t0, y0, end, p)
    if not roots:
        assert found == -1.0
    else:
        assert found == pytest.approx(roots[0], abs=1e-7 * (1 + 1 / excess) ** 0.5)


@settings(max_examples=75, deadline=None)
@given(parameters(), phases, places, st.floats(-2.0, 2.0), st.integers(0, 2), st.booleans())
def test_the_load_meets_a_level_for_the_first_time(p, phase, x0, v0, mode, top) -> None:
    t0, end = phase / p[0], longest(p[0])
    y0 = (x0, 0.0 if mode == STICK else v0)
    target = p[2] if top else -p[2]
    motion = Motion(mode, p, t0, y0)
    assume(abs(motion.observable(LOAD, 0.0) - target) > 1e-9)
    roots = sure_roots(lambda tau: motion.observable(LOAD, tau) - target, 0.0, end)
    assume(roots is not None)
    found = first_hit(mode, LOAD, target, False, t0, y0, end, p)
    if not roots:
        assert found == -1.0
    else:
        assert found == pytest.approx(roots[0], abs=1e-8)


@settings(max_examples=100, deadline=None)
@given(
    parameters(), phases, places, st.floats(-2.0, 2.0), st.integers(0, 2), st.integers(0, 1), shares
)
def test_every_stationary_point_is_found(p, phase, x0, v0, mode, c, share) -> None:
    assume(not (mode == STICK and c == SPEED))
    t0, end = phase / p[0], share * longest(p[0])
    y0 = (x0, 0.0 if mode == STICK else v0)
    motion = Motion(mode, p, t0, y0)
    assume(abs(motion.rate(c, 0.0)) > 1e-9 and abs(motion.rate(c, end)) > 1e-9)
    roots = sure_roots(lambda tau: motion.rate(c, tau), 0.0, end)
    assume(roots is not None)
    # one within its own error of a joint is at the joint (`interior_of`): its value differs by 1e-16
    clear = 2 * AT_JOINT * (1.0 + end)
    assume(all(clear < root < end - clear for root in roots))
    found = stationary(mode, c, t0, y0, end, p)
    assert len(found) == len(roots), (found, roots)
    assert np.allclose(found, roots, rtol=0.0, atol=1e-7)


@st.composite
def grazings(draw):
    """A slide whose velocity has a minimum of a given height at a given time, from its start there."""
    p = draw(parameters())
    omega, S, _, h, zeta = p
    s = draw(st.sampled_from([1.0, -1.0]))
    phase = draw(phases)
    if s * (math.sin(phase) + 3 * h * math.sin(3 * phase)) > 0:
        phase = 2 * math.pi - phase  # f' has the sign of s
    f = math.cos(phase) + h * math.cos(3 * phase)
    f1 = -omega * (math.sin(phase) + 3 * h * math.sin(3 * phase))
    assume(s * f1 > 0.01)  # v'' there, so that it is a minimum of s v
    height = draw(st.sampled_from([1e-5, -1e-5, 1e-12, -1e-12, 3e-13, -3e-13, 1e-9, -1e-9]))
    t = phase / omega
    v = s * height
    y = np.array([f - s * S - 2 * zeta * v, v])  # acceleration zero
    mode = 0 if s > 0 else 1
    duration = draw(st.floats(0.05, 2.0))
    start = np.empty(2)
    none = np.empty(0, dtype=np.int64)
    flow(mode, t, y, -duration, np.array(p, float), none, start, np.empty((0, 0)))
    motion = Motion(mode, p, t - duration, start)
    # nothing else happens on the way there: what is left is the parabola next to the minimum
    near = max(0.01 * duration, 3.0 * math.sqrt(2.0 * abs(height) / (s * f1)))
    assume(near < duration)
    way = s * motion.observable(SPEED, np.linspace(0, duration - near, 2001))
    assume(np.all(way > 1e-5 * s * f1 * duration**2) and np.all(np.abs(start) < 20))
    return mode, p, t - duration, start, duration, height, s * f1


@settings(max_examples=100, deadline=None)
@given(grazings())
def test_a_grazing_is_neither_missed_nor_invented(case) -> None:
    mode, p, t0, y0, duration, height, bend = case
    # |v''| = bend: the root lies sqrt(2 |height| / bend) before the minimum
    ahead = math.sqrt(2 * abs(height) / bend)
    found = first_hit(mode, SPEED, 0.0, False, t0, y0, duration, p)
    if height > 0:
        assert found == -1.0, "v stays above zero"
    else:
        assert found > 0.0, "v falls below zero"
        if height > -1e-8:  # so near to the minimum that a parabola is all there is
            assert found - duration == pytest.approx(-ahead, abs=0.2 * ahead + 2 * ahead**2)
            return
        motion = Motion(mode, p, t0, y0)
        way = np.linspace(0.0, duration, 2001)
        left = way[np.flatnonzero(motion.observable(SPEED, way) * (1 - 2 * mode) > 0.0)[-1]]
        wanted = brentq(lambda tau: motion.observable(SPEED, tau), left, duration, xtol=1e-14)
        assert found == pytest.approx(wanted, abs=1e-6 * ahead)


def stationary_phases(h: float) -> list[float]:
    """Phases in (0, 2 pi) where f' = -Omega sin(a) (1 + 9 h - 12 h sin(a)^2) vanishes."""
    found = [math.pi]
    square = (1 + 9 * h) / (12 * h) if h else -1.0
    if 0.0 < square < 1.0:
        a = math.asin(math.sqrt(square))
        found += [a, math.pi - a, math.pi + a, 2 * math.pi - a]
    return sorted(found)


@pytest.mark.parametrize("omega", [0.02, 1 / 3, 1.0, 5.0])
@pytest.mark.parametrize(
    "h",
    [
        *(0.0, 0.2, 0.5, -0.4, -0.11),
        *(-1 / 9 * (1 + e) for e in (1e-6, -1e-6, 1e-10)),
        *(1 / 3 * (1 + e) for e in (1e-6, -1e-6, 1e-12, -1e-12)),
    ],
)
def test_stationary_load_at_rest_in_closed_form(omega: float, h: float) -> None:
    """Also where two or three of them come together: at h = -1/9 (three, at 0 and pi) and 1/3 (two)."""
    phase = 0.7
    expected = sorted((a - phase) % (2 * math.pi) for a in [0.0, *stationary_phases(h)])
    p = (omega, 0.3, 0.4, h, 0.0)
    found = stationary(STICK, LOAD, phase / omega, (0.1, 0.0), 2 * math.pi / omega, p)
    phases_found = found * omega
    # a root of order n is resolved to the nth root of rounding; within it any number may be found
    gaps = np.abs(phases_found[:, None] - np.array(expected)[None, :])
    limit = 2e-5 if abs(h + 1 / 9) < 1e-3 else 2e-8
    assert np.all(gaps.min(axis=1) < limit) and np.all(gaps.min(axis=0) < limit)
    if abs(h + 1 / 9) > 1e-8:
        assert len(found) == len(expected), (phases_found, expected)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("h", [0.0, 0.2])
def test_a_stick_that_touches_its_limit(gap: float, h: float) -> None:
    """At rest at x the load is largest at the phase pi: x + 1 + h. Just below S0 it holds."""
    omega, S0 = 0.7, 0.4
    p = (omega, 0.3, S0, h, 0.0)
    length = 2 * math.pi / omega * 0.9
    for sign in (1, -1):
        x = S0 - 1 - h + sign * gap
        found = first_hit(STICK, LOAD, S0, False, 0.3 / omega, (x, 0.0), length, p)
        if sign < 0:
            assert found == -1.0
        else:
            # f'' = Omega^2 (1 + 9 h) there
            before = math.sqrt(2 * gap / (omega**2 * (1 + 9 * h)))
            peak = (math.pi - 0.3) / omega
            assert found - peak == pytest.approx(-before, rel=0.02)
