"""A rigid block that comes to rest upright by infinitely many impacts, on either foot in turn.

Where the ground's acceleration a cos(W t) is below that of tipping (1) a block that stands stays upright.
Above, it leaves to one side, falls back, and rocks to rest; half a period later it does so to the other side.
The reference are its flights in closed form, ``theta = s + A exp(t) + B exp(-t) + a cos(W t)/(1 + W^2)``,
followed in 50 digits until impacts have less speed than counts.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from typed import typed

import contfric as cf

BLOCK = """
name: block
states: [theta, omega]
parameters: {a: 1.1, W: 4.0, r: 0.5}
period: 2*pi/W
surfaces: {upright: {observable: theta}}
modes:
  right: {in: {upright: +}, field: {theta: omega, omega: theta - 1 - a*cos(W*t)}}
  left: {in: {upright: -}, field: {theta: omega, omega: theta + 1 - a*cos(W*t)}}
resets: {upright: {omega: r*omega, chatter: true}}
symmetry: theta -> -theta, omega -> -omega, t -> t + T/2
"""
REST = [0.0, 0.0]


@pytest.fixture(scope="module")
def block(tmp_path_factory) -> cf.Model:
    return typed(tmp_path_factory.mktemp("block"), BLOCK)


def flight(side, start, speed, a, W):
    """Return (theta, omega) as functions of the time since an impact; ``side`` is 1 to the right, else -1."""
    k = a / (1 + W**2)
    value, slope = -side - k * mpmath.cos(W * start), speed + k * W * mpmath.sin(W * start)
    up, down = (value + slope) / 2, (value - slope) / 2

    def theta(tau):
        e = mpmath.exp(tau)
        return side + up * e + down / e + k * mpmath.cos(W * (start + tau))

    def omega(tau):
        e = mpmath.exp(tau)
        return up * e - down / e - k * W * mpmath.sin(W * (start + tau))

    return theta, omega


def comes_back(theta, side, short):
    """Return the first zero after the start, looked for from a short time on; None if there is none in 2."""
    tau = short
    while side * theta(tau) > 0:
        tau *= mpmath.mpf("1.2")
        if tau > 2:
            return None
    return mpmath.findroot(theta, (tau / mpmath.mpf("1.2"), tau), solver="anderson", tol=1e-90)


def impacts(a, W, r):
    """Return the times of the impacts after the block has left to the right, and the time at which it rests.

    That is None if it is thrown to the other side before.
    """
    t, side, speed = (mpmath.pi - mpmath.acos(1 / a)) / W, 1, mpmath.mpf(0)
    theta, omega = flight(side, t, speed, a, W)
    short, times, thrown = mpmath.mpf("0.01"), [], (2 * mpmath.pi - mpmath.acos(1 / a)) / W
    while True:
        tau = comes_back(theta, side, short)
        if tau is None or t + tau > thrown:
            return times, None
        arrives = omega(tau)
        t, side, speed = t + tau, -side, r * arrives
        times.append(t)
        if abs(speed) < mpmath.mpf(10) ** -16:
            return times, t
        theta, omega = flight(side, t, speed, a, W)
        short = abs(speed) / 2  # it is drawn back by at most 1 + a


@pytest.mark.parametrize(("a", "r"), [(1.02, 0.5), (1.1, 0.5), (1.12, 0.6), (1.05, 0.8)])
def test_the_block_comes_to_rest_on_both_sides_in_turn(block, a: float, r: float) -> None:
    orbit = cf.find_orbit(block, {"a": a, "r": r}, state=REST)
    assert orbit.residual < 1e-12
    assert np.all(orbit.multipliers == 0.0)  # a block that has come to rest has forgotten all
    whole = orbit.as_whole()
    itinerary = [mode for mode, _ in whole.itinerary]
    assert sorted(itinerary) == ["chatter", "chatter", "left", "right"]
    k = itinerary.index("right")
    with mpmath.workdps(50):
        times, rests = impacts(mpmath.mpf(a), mpmath.mpf(4), mpmath.mpf(r))
        lifts = (mpmath.pi - mpmath.acos(1 / mpmath.mpf(a))) / 4
    left = float(lifts)
    assert (whole.begins[k, 0] - left) % orbit.period == pytest.approx(0, abs=1e-12) or (
        left - whole.begins[k, 0]
    ) % orbit.period == pytest.approx(0, abs=1e-12)
    assert whole.ends[k, 0] - whole.begins[k, 0] == pytest.approx(float(times[0] - lifts), abs=1e-9)
    flow, j = block.view(orbit.vector), (k + 1) % len(itinerary)
    begin = whole.begins[j]
    for share, still in ((0.999, False), (1.001, True)):
        lasts = share * float(rests - times[0])
        state = flow.state("chatter", float(begin[0]), begin[1:].copy(), lasts)
        assert (
            np.max(np.abs(state)) < 1e-14
        ) == still  # between impacts before the limit, at rest after it


def test_the_block_does_not_come_to_rest_where_it_is_thrown_before(block) -> None:
    """The branch ends where the last impacts come just when the block is thrown to the other side."""
    orbit = cf.find_orbit(block, state=REST)
    branch = cf.continue_orbit(orbit, "a", (1.001, 1.5))
    assert "incomplete chatter" in str(branch.ends[1])

    def rests_in_time(a):
        _, rests = impacts(a, mpmath.mpf(4), mpmath.mpf("0.5"))
        return rests is not None

    with mpmath.workdps(50):
        low, high = mpmath.mpf("1.1459"), mpmath.mpf("1.1461")
        for _ in range(12):
            middle = (low + high) / 2
            low, high = (middle, high) if rests_in_time(middle) else (low, middle)
    assert branch.params["a"].max() == pytest.approx(float(low), abs=1e-6)


def test_a_block_that_comes_to_rest_is_found_without_being_told(tmp_path) -> None:
    orbit = cf.find_orbit(
        typed(tmp_path, BLOCK.replace(", chatter: true", "")), {"a": 1.05}, state=[1e-4, 0.0]
    )
    assert [mode for mode, _ in orbit.as_whole().itinerary].count("chatter") == 2


def test_quantities_of_a_block_that_comes_to_rest(block) -> None:
    """Its flights are on both sides: their means, from the flights in closed form."""
    orbit = cf.find_orbit(block, {"a": 1.1}, state=REST)
    assert orbit.quantity("mean(theta)") == pytest.approx(0.0, abs=1e-12)
    with mpmath.workdps(50):
        a, W, r = mpmath.mpf("1.1"), mpmath.mpf(4), mpmath.mpf("0.5")
        times, _ = impacts(a, W, r)
        total, t, side, speed = (
            mpmath.mpf(0),
            (mpmath.pi - mpmath.acos(1 / a)) / W,
            1,
            mpmath.mpf(0),
        )
        for end in times[:12]:  # those that follow have a share of 1e-10
            _, omega = flight(side, t, speed, a, W)
            total += mpmath.quad(lambda tau, omega=omega: omega(tau) ** 2, [0, end - t])
            t, side, speed = end, -side, r * omega(end - t)
        exact = float(2 * total / (2 * mpmath.pi / W))
    assert orbit.quantity("mean(omega**2)") == pytest.approx(exact, rel=1e-8)
