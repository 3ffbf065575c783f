"""Two switching surfaces, each with its own sliding: a self-excited oscillator with a dead band.

``x'' + 2 zeta x' + x = -S M(x'/V)`` with zeta < 0, M = sgn beyond the band and 0 within: autonomous,
symmetric, and nowhere with a jump of the flow (a system of Filippov).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import contfric as cf

dead_band = cf.load_model(Path(__file__).parents[1] / "models" / "band_friction.yaml")

PARAMS = {"zeta": -0.1, "V": 1.0, "S": 0.8}


@cache
def diagram() -> cf.Diagram:
    return cf.explore(cf.find_orbit(dead_band, PARAMS), "S", (0.2, 1.5))


def test_chain_of_signatures_is_found_by_exploring() -> None:
    """4 segments (rest in the band's edges), 6 (beyond it, then rest), 4 (beyond it, no rest)."""
    lengths = [2 * len(branch.system.itinerary) for branch in diagram().branches]
    order = np.argsort([-branch.values.mean() for branch in diagram().branches])
    rests = [branch[0].signature.stops for branch in diagram().branches]
    assert sorted(zip([lengths[i] for i in order], [rests[i] for i in order], strict=True)) == [
        (4, 0),
        (4, 2),
        (6, 2),
    ]
    assert all(branch.symmetric for branch in diagram().branches)
    assert diagram().connected and not diagram().loose_ends


def test_ends_say_that_the_motion_is_continuous() -> None:
    ends = {str(end) for branch in diagram().branches for end in branch.ends}
    assert not any("jumps" in end for end in ends)


@pytest.mark.parametrize("beside", [-1e-3, 1e-3])
def test_events_by_simulation_on_both_sides(beside: float) -> None:
    """The itineraries near each event are those of the branches that meet there."""
    checked = 0
    for node in diagram().nodes:
        b = node.bifurcation
        if b.kind.value not in ("CS", "SS"):
            continue
        params = {**b.params, "S": b.params["S"] + beside}
        found = cf.find_orbit(dead_band, params)
        itineraries = {frozenset(diagram().branches[i][0].itinerary) for i in node.branches}
        assert frozenset(found.itinerary) in itineraries
        checked += 1
    assert checked == 2


def test_orbits_are_those_of_the_simulation() -> None:
    for branch in diagram().branches:
        stable = branch.stable
        assert stable is not None
        for k in np.flatnonzero(stable)[5::60]:
            known = branch[int(k)]
            found = cf.find_orbit(dead_band, known.params)
            assert found.period == pytest.approx(known.period, rel=1e-9)
            assert found.x_max == pytest.approx(known.x_max, rel=1e-9)


def test_half_and_whole_have_the_same_multipliers() -> None:
    half = next(b for b in diagram().branches if not b[0].signature.stops)[20]
    whole = half.as_whole()
    assert half.system.half and not whole.system.half
    assert whole.period == pytest.approx(half.period, rel=1e-14)
    np.testing.assert_allclose(half.multipliers, whole.multipliers, rtol=1e-9)
    assert whole.as_half().joints == pytest.approx(half.joints, abs=1e-14)
    assert whole.doubled().period == pytest.approx(2 * half.period)
    assert whole.mirror().x_max == pytest.approx(half.x_max)


def test_multiplier_agrees_with_differences() -> None:
    found = cf.find_orbit(dead_band, {**PARAMS, "S": 0.4})
    (multiplier,) = found.multipliers.real
    exit_ = found.cycle[0]  # on a surface: its state moves along it in x alone
    h = 1e-6

    def mapped(x: float) -> float:
        walked = cf.simulate(
            dead_band,
            found.params,
            state=[x, exit_[2]],
            domain=found.trajectory(8)[2][1],
            periods=1.2 * found.period,
        )
        at = [k for k, pair in enumerate(walked.itinerary) if pair == found.itinerary[-1]]
        return float(walked.states[at[0], 0])

    brute = (mapped(exit_[1] + h) - mapped(exit_[1] - h)) / (2 * h)
    assert multiplier == pytest.approx(brute, abs=1e-7)
