"""Proofs of chaos: the release map in balls holds the sampled one, and horseshoes are covered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flint import arb, ctx

import contfric as cf
from contfric.certify.horseshoe import Horseshoe
from contfric.certify.releases.returns import Release, ReturnMap
from contfric.certify.releases.stretch import LineInS, UndecidedError
from contfric.response.returns import ReleaseMap
from tests.release_oracle import STATED, Releases, changed, false_intervals, proves

PARAMS = {"Omega": 0.396, "S": 0.082, "S0": 0.4}
RELEASE = Release("stick", "F+", "v", 1, 5, "F-")


@pytest.fixture(scope="module")
def sampled() -> ReleaseMap:
    return cf.release_map("coulomb", PARAMS, count=4000)


def test_the_map_in_balls_holds_the_sampled_one(sampled: ReleaseMap) -> None:
    rng = np.random.default_rng(0)
    width, decided = 2e-3, 0
    with ctx.workprec(100):
        returns = ReturnMap(sampled.model, sampled.vector, RELEASE)
        for k in rng.integers(len(sampled), size=12).tolist():
            phase = float(sampled.phases[k])
            try:
                image, _ = returns.follow(LineInS(arb(phase), arb(width), arb(0)))
            except UndecidedError:
                continue
            decided += 1
            near = np.abs(sampled.phases - phase) < width
            for value in sampled.images[near].tolist():
                turns = round((float(image.at.mid()) - value) / sampled.period)
                assert image.whole.overlaps(arb(value + turns * sampled.period, 1e-9))
            # of second order: a secant says the slope
            ends = [
                returns.follow(LineInS(arb(phase + s * width), arb(0), arb(0)))[0].at
                for s in (-1, 1)
            ]
            assert abs((ends[1] - ends[0]) / 2 - image.slope) < image.rest.rad() + 1e-20
            assert image.rest.rad() < 0.1 * abs(image.slope) + 1e-3
    assert decided > 6


@pytest.mark.slow
def test_a_horseshoe_is_proved(sampled: ReleaseMap) -> None:
    found: Horseshoe = sampled.horseshoe(6)
    assert found.proved, found.why
    assert found.entropy > 0.1
    assert len(found.intervals) >= 2
    for (_, b), (c, _) in zip(found.intervals, found.intervals[1:], strict=False):
        assert b < c
    assert all(found.window[0] < a < b < found.window[1] for a, b in found.intervals)
    # the sampled map agrees: the ends of each interval go to both sides of the window
    for interval in found.intervals:
        images = [sampled.cobweb(t, found.returns + 1)[-1] for t in interval]
        assert min(images) < found.window[0]
        assert max(images) > found.window[1]


@pytest.mark.slow
def test_no_false_horseshoe_is_proved() -> None:
    """Decided in 60 digits, by stepping: of windows that end next to the image of an interval, too."""
    rng, refused = np.random.default_rng(11), 0
    assert false_intervals(STATED) == []
    for _ in range(12):
        stated = changed(STATED, rng)
        for interval in false_intervals(stated):
            refused += 1
            assert not proves(stated, interval), stated
    assert refused > 5


@pytest.mark.parametrize(("by", "holds"), [(1e-12, True), (-1e-12, False)])
def test_a_window_that_is_just_covered_is_told_from_one_that_is_not(by: float, holds: bool) -> None:
    """The window ends next to the image of an end of a short piece; the images are those of 60 digits."""
    (a, b), releases = STATED.intervals[0], Releases(STATED.params)
    piece = (a, a + 1e-5 * (b - a))
    turn = float(releases.truth.turn)
    ends = sorted(float(releases.image(t, 6)[0]) % turn for t in piece)
    assert 1e-6 < ends[1] - ends[0] < 0.1
    stated = replace(STATED, window=(ends[0] + by, ends[1] - by), intervals=(piece,))
    assert (false_intervals(stated) == []) is holds
    assert proves(stated, piece) is holds


def test_order_is_undecided() -> None:
    calm = cf.release_map("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4}, count=400)
    found = calm.horseshoe(3)
    assert not found.proved
    assert found.entropy == 0.0
    assert "undecided" in str(found)
