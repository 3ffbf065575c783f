"""Lyapunov exponents of solutions that nobody has chosen: random parameters, every kind of motion."""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric import Motion
from contfric.chaos.rows import FollowingLimits, follow

SEEDS = range(60)


def scene(seed: int) -> dict[str, float]:
    """Parameters over all the model knows: h and damping, negative too, in some; chaos in a few."""
    rng = np.random.default_rng(seed)
    irregular = rng.random() < 0.4  # the part of the plane where the reference found chaos
    S = rng.uniform(0.0, 0.2 if irregular else 0.6)
    return {
        "Omega": rng.uniform(0.2, 0.5) if irregular else rng.uniform(0.08, 1.3),
        "S": S,
        "S0": max(S, rng.uniform(0.3, 0.8)) if irregular else S * rng.uniform(1.0, 3.0) + 0.1,
        "h": rng.uniform(-0.2, 0.2) * (rng.random() < 0.4),
        "zeta": rng.uniform(-0.02, 0.3) * (rng.random() < 0.4),
    }


@pytest.mark.parametrize(
    "seed", [*SEEDS[:30], *(pytest.param(seed, marks=pytest.mark.slow) for seed in SEEDS[30:])]
)
def test_agrees_with_the_orbit_that_is_found(seed: int) -> None:
    """The orbit is found by another search and solved by elimination."""
    params = scene(seed)
    found = cf.lyapunov_exponent("coulomb", params, periods=600)
    try:
        orbit = cf.find_orbit("coulomb", params)
    except (
        cf.ConvergenceError
    ):  # aperiodic, stuck for ever, or unbounded; it looks up to 64 periods
        assert found.periods == 0 or found.periods > 64
        return
    assert found.motion is not Motion.CHAOTIC
    assert found.motion is not Motion.HELD
    if found.motion is Motion.PERIODIC:
        sizes = np.abs(orbit.multipliers)
        kept = sizes > 0.0
        assert found.periods == orbit.periods
        assert np.all(found.exponents[~kept] == -np.inf)
        expected = np.log(sizes[kept]) / orbit.period
        np.testing.assert_allclose(found.exponents[kept], expected, rtol=0.0, atol=1e-8)


def test_the_scenes_are_of_every_kind() -> None:
    """What the test above compares is mostly, but not only, periodic motion."""
    kinds = [cf.lyapunov_exponent("coulomb", scene(s), periods=600).motion for s in SEEDS]
    assert kinds.count(Motion.PERIODIC) > len(SEEDS) // 2
    assert Motion.CHAOTIC in kinds
    assert Motion.HELD in kinds


@pytest.mark.parametrize("seed", range(10))
def test_mirror_image_has_the_same_exponents(seed: int) -> None:
    """(x, v, t) -> (-x, -v, t + pi/Omega) takes motions to motions."""
    params = {**scene(seed), "S": 0.3, "S0": 0.4, "Omega": 0.45 + 0.01 * seed}
    start = np.array([1.1, 0.3])
    one = cf.lyapunov_exponent("coulomb", params, state=start, periods=600)
    other = cf.lyapunov_exponent(
        "coulomb", params, state=-start, time=np.pi / params["Omega"], periods=600
    )
    assert one.motion is other.motion
    if one.motion.exact:
        np.testing.assert_allclose(one.exponents, other.exponents, rtol=0.0, atol=1e-8)


@pytest.mark.slow
def test_errors_are_what_they_say() -> None:
    """Averages over 600 periods of many chaotic solutions, against those over 15000.

    In units of the errors the differences have a spread of one or, as the larger of two estimates is
    the error, a little less; 60 of them have it to a tenth.
    """
    model = cf.load_model("coulomb")
    rng = np.random.default_rng(3)
    count = 1200
    vectors = np.zeros((count, 5))
    vectors[:, 2] = rng.uniform(0.3, 0.8, count)
    vectors[:, 0] = rng.uniform(0.2, 0.5, count)
    vectors[:, 1] = rng.uniform(0.02, 0.4, count) * vectors[:, 2]
    states = np.zeros((count, 2))
    states[:, 0] = 1.0 + 0.9 * vectors[:, 2]
    short = follow(model, vectors, states, 0.0, FollowingLimits(100, 600, 0.0))
    chaotic = np.flatnonzero(short.motions == Motion.CHAOTIC.code)[:60]
    assert len(chaotic) == 60
    long = follow(model, vectors[chaotic], states[chaotic], 0.0, FollowingLimits(100, 15_000, 0.0))
    still = long.motions == Motion.CHAOTIC.code
    difference = short.exponents[chaotic, 0] - long.exponents[:, 0]
    scaled = difference / np.hypot(short.errors[chaotic, 0], long.errors[:, 0])
    assert np.sum(still) >= 55
    assert 0.5 < np.std(scaled[still]) < 1.3
    assert abs(np.mean(scaled[still])) < 4.0 / np.sqrt(np.sum(still))
