"""First roots and stationary points of observables that are as wild as they can be, grazing ones above all.

A trigonometric sum of four harmonics is watched from a state at rest. Its stationary points are
eigenvalues (of the companion matrix); between two of them there is at most one root. Searched are a motion
that is integrated and one in closed form.
"""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from catalogue import HARMONICS, REST, hit
from catalogue import stationary as kernel
from harmonic_sum import definition
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from typed import typed

SUM = 2
#: Values within this of the level are decided by rounding (sums here are of order 1 to 10).
UNSURE = 1e-13


def sums(a, t):
    """The sum and its first two derivatives."""
    k = np.arange(1, HARMONICS + 1)[:, None]
    c, s = np.cos(k * t), np.sin(k * t)
    even, odd = a[1::2, None], a[2::2, None]
    value = a[0] + np.sum(even * c + odd * s, axis=0)
    return value, np.sum(k * (odd * c - even * s), axis=0), -np.sum(k * k * (even * c + odd * s), 0)


def stationary(a):
    """Stationary points in one turn: the eigenvalues on the unit circle."""
    k = np.arange(1, HARMONICS + 1)
    half = 0.5j * k * (a[1::2] - 1j * a[2::2])
    z = np.roots(np.concatenate([half[::-1], [0.0], half.conj()]))
    t = np.angle(z[np.abs(np.abs(z) - 1.0) < 1e-6])
    for _ in range(3):
        _, slope, bend = sums(a, t)
        t = t - slope / bend
    return np.sort(t % (2.0 * math.pi))


def first_root(a, nodes, values):
    """First sign change between stationary points, bisected."""
    for i, before in enumerate(values[:-1]):
        if before * values[i + 1] < 0.0:
            low, high = nodes[i], nodes[i + 1]
            for _ in range(60):
                middle = 0.5 * (low + high)
                inside = sums(a, np.array([middle]))[0][0] * before > 0.0
                low, high = (middle, high) if inside else (low, middle)
            return low
    return None


@pytest.fixture(scope="module", params=["integrated", "closed form"])
def search(request, tmp_path_factory):
    """Return hit and turning of the sum along a state at rest: of (a, t0, dt, where to write)."""
    if request.param == "integrated":

        def at(a):
            return np.array([0.0, 1e-12, *a])

        return (
            lambda a, t0, dt, y1: hit(REST, SUM, 0.0, False, t0, np.zeros(2), dt, at(a), y1),
            lambda a, t0, dt, *out: kernel(REST, SUM, t0, np.zeros(2), dt, at(a), *out),
        )
    model = typed(tmp_path_factory.mktemp("models"), json.dumps(definition(HARMONICS)))
    flow = model.flow
    assert not model.integrated
    return (
        lambda a, t0, dt, y1: flow.hit(
            0, 0, 0.0, False, t0, np.zeros(2), dt, np.array([1.0, *a]), y1
        ),
        lambda a, t0, dt, *out: flow.stationary(
            0, 0, t0, np.zeros(2), dt, np.array([1.0, *a]), *out
        ),
    )


coefficient = st.floats(-1, 1).map(lambda x: 0.0 if abs(x) < 1e-3 else x)


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(
    rest=st.lists(coefficient, min_size=8, max_size=8),
    offset=st.floats(-3, 3),
    grazes=st.booleans(),
    which=st.integers(0, 7),
    miss=st.tuples(st.sampled_from([-1.0, 1.0]), st.floats(-12, -2)),
    t0=st.floats(0, 6),
    dt=st.floats(0.1, 12),
)
def test_first_root_and_stationary_points(search, rest, offset, grazes, which, miss, t0, dt):
    a = np.array([offset, *rest])
    assume(np.abs(rest).max() > 0.05)
    turn = stationary(a)
    assume(len(turn) > 0 and np.abs(sums(a, turn)[2]).min() > 1e-3)
    if grazes:  # the level is missed, or crossed twice, by as little as 1e-12
        a[0] += miss[0] * 10.0 ** miss[1] - sums(a, turn)[0][which % len(turn)]
    every = (turn[None, :] + 2.0 * math.pi * np.arange(-1, 4)[:, None]).ravel()
    assume(min(np.abs(every - t0).min(), np.abs(every - t0 - dt).min()) > 1e-6)
    inside = np.sort(every[(every > t0) & (every < t0 + dt)])
    hit_of, stationary_of = search

    times, values = np.empty(64), np.empty(64)
    n = stationary_of(a, t0, dt, times, values)
    assert n == len(inside)
    assert np.all(np.abs(t0 + times[:n] - inside) < 1e-8)
    assert np.all(np.abs(values[:n] - sums(a, inside)[0]) < UNSURE)

    nodes = np.concatenate([[t0], inside, [t0 + dt]])
    at_nodes = sums(a, nodes)[0]
    assume(np.abs(at_nodes).min() > UNSURE)
    expected, y1 = first_root(a, nodes, at_nodes), np.empty(2)
    tau = hit_of(a, t0, dt, y1)
    assert (tau >= 0.0) == (expected is not None)
    if expected is not None:
        rate = abs(sums(a, np.array([expected]))[1][0])
        assert abs(t0 + tau - expected) * rate < 1e-13
