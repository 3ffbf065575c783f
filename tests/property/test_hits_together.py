"""First hits of many motions at once: those of each by itself, and bits that do not depend on the others."""

import math

import numba
import numpy as np
import pytest
from mpmath import mp

import contfric as cf
from contfric.chaos.rows import FollowingLimits, follow
from contfric.compiling.lanes import LANES, read, write
from contfric.flow.oscillator.sines import sine_cosine
from contfric.flow.oscillator.together import together
from contfric.flow.without import SINGLY
from contfric.models import load_model

COUNT = 400
NONE = np.empty(0, dtype=np.int64)


@numba.njit(error_model="numpy")
def sines_of(numbers, found):  # type: ignore[no-untyped-def]
    """Write sines and cosines of rows of numbers."""
    for k in range(numbers.shape[0]):
        sines, cosines = sine_cosine(read(numbers, k))
        write(found, 2 * k, sines)
        write(found, 2 * k + 1, cosines)


def test_sines_are_good_to_a_unit_in_the_last_place() -> None:
    draw = np.random.default_rng(1)
    near = np.arange(-120, 120) * math.pi / 4
    numbers = np.concatenate([draw.uniform(-40, 40, 240), draw.uniform(-1e5, 1e5, 240), near])
    found = np.empty((2 * len(numbers) // LANES, LANES))
    sines_of(numbers.reshape(-1, LANES), found)
    sines, cosines = found[::2].ravel(), found[1::2].ravel()
    with mp.workdps(40):
        for x, s, c in zip(numbers.tolist(), sines.tolist(), cosines.tolist(), strict=True):
            for got, exact in ((s, mp.sin(x)), (c, mp.cos(x))):
                unit = max(math.ulp(float(exact)), 2e-17)  # near zeros that of the reduction
                assert abs(mp.mpf(got) - exact) < 0.9 * unit, x


def starts(draw: np.random.Generator, count: int) -> tuple[np.ndarray, ...]:
    """Return (modes, surfaces, times, states, parameters) of slides from rest, some short, and of rests."""
    p = np.zeros((count, 5))
    p[:, 0] = np.where(draw.random(count) < 0.9, draw.uniform(0.05, 3.0, count), 1.0)
    p[:, 2] = draw.uniform(0.05, 1.0, count)
    p[:, 1] = p[:, 2] * np.where(draw.random(count) < 0.2, 1.0, draw.random(count))
    times = draw.random(count) * 2 * np.pi / p[:, 0]
    modes = draw.integers(0, 3, count)
    side = np.where(modes == 0, 1.0, -1.0)
    beyond = p[:, 2] + np.where(draw.random(count) < 0.5, 0.0, draw.exponential(0.5, count))
    # some loads are hardly beyond the kinetic friction: slides that nearly graze
    beyond = np.where(
        draw.random(count) < 0.2, p[:, 1] + 10.0 ** draw.uniform(-9, -2, count), beyond
    )
    load = np.where(modes == 2, draw.uniform(-1.0, 1.0, count) * p[:, 2], -side * beyond)
    states = np.column_stack([np.cos(p[:, 0] * times) + load, np.zeros(count)])
    return modes, np.full(count, 4), times, states, p


@pytest.mark.parametrize("seed", range(3))
def test_hits_are_those_of_each_motion_by_itself(seed: int) -> None:
    flow = load_model("coulomb").flow
    modes, on, times, states, p = starts(np.random.default_rng(seed), COUNT)
    longest = 1.001 * 2 * np.pi / p[:, 0]
    tau, surfaces = np.zeros(COUNT), np.zeros(COUNT, dtype=np.int64)
    ends, jac = np.zeros((COUNT, 2)), np.zeros((COUNT, 2, 4))
    together(COUNT, modes, on, times, states, p, longest, tau, surfaces, ends, jac)
    decided = np.flatnonzero(surfaces != SINGLY)
    assert len(decided) > 0.75 * COUNT
    for k in decided:
        mode, t, y, end, slopes = (
            int(modes[k]),
            float(times[k]),
            states[k],
            np.empty(2),
            np.empty((2, 4)),
        )
        levels = {0: p[k, 2], 1: -p[k, 2]} if mode == 2 else {2: 0.0}
        found = {}
        for surface, level in levels.items():
            observable = 0 if surface < 2 else 1
            started = surface == 2
            d = flow.hit(mode, observable, level, started, t, y, longest[k], p[k], end)
            if d >= 0.0:
                found[surface] = (d, end.copy())
        first = min(found, key=lambda surface: found[surface][0])
        d, end = found[first]
        assert surfaces[k] == first
        flow.flow(mode, t, y, d, p[k], NONE, np.empty(2), slopes)
        rate = abs(slopes[1, 3]) if mode < 2 else p[k, 0] * abs(math.sin(p[k, 0] * (t + d)))
        assert abs(tau[k] - d) < 1e-13 * (1.0 + d) / min(1.0, rate), (mode, t, y, p[k])
        assert np.max(np.abs(ends[k] - end)) < 1e-13 * (1.0 + np.max(np.abs(end))) / min(1.0, rate)
        assert np.max(np.abs(jac[k] - slopes)) < 1e-12 * (1.0 + d + np.max(np.abs(y))) / min(
            1.0, rate
        )


def test_a_cell_comes_to_the_same_bits_whatever_is_beside_it() -> None:
    model, draw = load_model("coulomb"), np.random.default_rng(3)
    count, limits = 70, FollowingLimits(periods=60, transient=20, tolerance=0.0, confirm=0)
    vectors = np.array(
        [
            model.vector({"Omega": w, "S": s, "S0": 0.4})
            for w, s in zip(
                draw.uniform(0.15, 0.6, count), draw.uniform(0.0, 0.39, count), strict=True
            )
        ]
    )
    states = np.column_stack([np.full(count, 1.36), np.zeros(count)])
    rows = follow(model, vectors, states, 0.0, limits)
    order = draw.permutation(count)
    mixed = follow(model, vectors[order], states[order], 0.0, limits)
    alone = [
        follow(model, vectors[k : k + 1], states[k : k + 1], 0.0, limits)
        for k in range(0, count, 9)
    ]
    for name in rows._fields:
        whole = getattr(rows, name)
        np.testing.assert_array_equal(getattr(mixed, name), whole[order])
        one = np.concatenate([getattr(found, name) for found in alone])
        np.testing.assert_array_equal(one, whole[::9])


def test_an_exponent_is_that_of_its_cell_in_a_map() -> None:
    grid = {"Omega": np.array([0.3, 0.35]), "S": np.array([0.05, 0.1])}
    cells = cf.lyapunov_map("coulomb", grid, {"S0": 0.4}, periods=50, tolerance=0.0)
    params = {"Omega": 0.35, "S": 0.05, "S0": 0.4}
    one = cf.lyapunov_exponent("coulomb", params, periods=50, transient=100, tolerance=0.0)
    assert cells.values[1, 0] == one.largest
