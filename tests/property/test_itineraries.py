"""Words that the return map of a release allows: of linear maps in closed form, and of the oscillator."""

from __future__ import annotations

from math import gcd
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.adding import two_orbit_itineraries as itineraries
from contfric.adding.release_map import Samples, sampled

LONGEST = 7


def allowed(alpha: float, beta: float, longest: int = LONGEST) -> dict[str, tuple[float, float]]:
    """Words of s' = alpha s + x - 1 for s > 0 (a), beta s + x for s < 0 (b), and the parts of 0 < x < 1."""
    end = 1.0 / (1.0 - max(abs(alpha), abs(beta)))
    x = np.linspace(0.0, 1.0, 49)[:, None]
    s = np.linspace(0.0, end, 65)
    samples = {"a": Samples(end, alpha * s + x - 1.0), "b": Samples(-end, -beta * s + x)}
    branches = {letter: itineraries._Images(found) for letter, found in samples.items()}
    parts = branches["a"].parts
    return {
        turns: (where[0] / parts, (where[-1] + 1) / parts)
        for turns, where in itineraries._possible(branches, longest)
    }


def window(turns: str, alpha: float, beta: float) -> tuple[float, float]:
    """Return the x between which all points of an itinerary are on their sides: they are linear in x."""
    count = len(turns)
    slopes = np.array([alpha if letter == "a" else beta for letter in turns])
    shift = np.eye(count)[:, [*range(1, count), 0]] * 1.0  # point k + 1 follows point k
    matrix = shift.T - np.diag(slopes)
    rate = np.linalg.solve(matrix, np.ones(count))
    start = np.linalg.solve(matrix, np.array([-1.0 if letter == "a" else 0.0 for letter in turns]))
    low, high = 0.0, 1.0
    for k, letter in enumerate(turns):
        sign = 1.0 if letter == "a" else -1.0
        if sign * rate[k] == 0.0:
            continue
        root = -start[k] / rate[k]
        low, high = (max(low, root), high) if sign * rate[k] > 0.0 else (low, min(high, root))
    return low, high


@pytest.mark.parametrize("seed", range(12))
def test_every_itinerary_of_a_linear_map_with_a_window_is_allowed_there(seed: int) -> None:
    """Whatever the signs of the slopes, up to expanding itineraries."""
    alpha, beta = np.random.default_rng(seed).uniform(-0.9, 0.9, 2)
    found = allowed(alpha, beta)
    count = 0
    for turns in itineraries._all_itineraries(LONGEST):
        low, high = window(turns, alpha, beta)
        if low < high:
            count += 1
            assert found[turns][0] <= low + 1e-12 and high - 1e-12 <= found[turns][1]
    assert count > 0
    assert len(found) <= count + 8, (
        "and few others: windows next to them, within a part of the range"
    )


def test_a_map_with_a_gap_has_one_itinerary_for_each_fraction() -> None:
    """Both branches increase: the itineraries of the Farey tree, phi(n) of n turns."""
    found = allowed(0.5, 0.5)
    for length in range(2, LONGEST + 1):
        itineraries = [turns for turns in found if len(turns) == length]
        assert len(itineraries) == sum(gcd(k, length) == 1 for k in range(1, length))
        assert sorted(turns.count("b") for turns in itineraries) == [
            k for k in range(1, length) if gcd(k, length) == 1
        ]


#: Fig. 5, where windows overlap; a cascade without overlaps; one with damping.
SCENES = [
    {"S": 0.32, "S0": 0.4},
    {"S": 0.31, "S0": 0.376},
    {"S": 0.288, "S0": 0.373, "zeta": 0.004},
]


@pytest.mark.parametrize("params", SCENES)
def test_itineraries_that_are_left_out_have_no_window(
    params: dict[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All itineraries are tried if the map cannot be sampled: the windows are the same, to the last bit."""
    found = cf.explore(cf.find_orbit("coulomb", {"Omega": 0.5, **params}), "Omega", (0.45, 0.56))
    bridge = next(b for b in found.branches if b.bridge and not b.mirrored)
    maps = []

    def recorded(*given: Any) -> Any:
        maps.append(sampled(*given))
        return maps[-1]

    monkeypatch.setattr(itineraries, "sampled", recorded)
    few = cf.period_adding(bridge, longest=5)
    assert maps != [None], "the map is used"
    monkeypatch.setattr(itineraries, "sampled", lambda *given: None)
    every = cf.period_adding(bridge, longest=5)
    assert [w.turns for w in few] == [w.turns for w in every]
    for one, other in zip(few, every, strict=True):
        assert np.array_equal(one.branch.values, other.branch.values)
        assert np.array_equal(one.branch.joints, other.branch.joints)
