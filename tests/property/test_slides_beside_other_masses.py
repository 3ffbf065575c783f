"""A slide of no length between a hold and a stick, while other masses move on.

The solution is that of the itinerary that sticks all along, and so are its period and what begins at its
events.
"""

from __future__ import annotations

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.completeness.verification import differences
from contfric.base.attributes import altered
from contfric.bvp.system import build_system
from contfric.events.incident.unit import unit_of
from contfric.orbit.canonical.slides import SAME_SOLUTION, SHORT, slides_of
from contfric.orbit.measured.samples import state_within
from contfric.orbit.orbit import Orbit

#: The joints of a frame, in the order in which modes name them.
JOINTS = ("low", "middle", "high")


def held(orbit: Orbit, i: int, length: float, share: float) -> Orbit:
    """The same solution with a hold and a slide of some length in the stick of a joint that has stopped."""
    (before, stops), (mode, exit_) = orbit.itinerary[i - 1], orbit.itinerary[i]
    k = JOINTS.index(stops)
    left, sign = ("p", "+") if before[k] == "n" else ("n", "-")
    parts = (mode, f"hold@{stops}{sign}"), (mode[:k] + left + mode[k + 1 :], stops), (mode, exit_)
    start = share * (float(orbit.durations[i]) - length)
    begins = [orbit.begins[i]]
    for later in (start, start + length):
        begins.append(np.array([orbit.begins[i, 0] + later, *state_within(orbit, i, later)]))
    itinerary = orbit.itinerary[:i] + parts + orbit.itinerary[i + 1 :]
    joints = np.vstack([orbit.cycle[:i], begins, orbit.cycle[i + 1 : len(orbit.itinerary)]])
    return altered(orbit, system=build_system(orbit.model, itinerary, orbit.periods), joints=joints)


def sticks(orbit: Orbit) -> list[int]:
    """The segments in which a joint sticks for some time after it has stopped, while others move."""
    found = []
    for i in range(1, len(orbit.itinerary)):
        stops, mode = orbit.itinerary[i - 1][1], orbit.itinerary[i][0]
        lasts = bool(orbit.durations[i] > 10.0 * SHORT)
        if lasts and stops in JOINTS and mode[JOINTS.index(stops)] == "s":
            found.append(i)
    assert found
    return found


@pytest.mark.parametrize("seed", range(3))
def test_a_slide_of_no_length_divides_no_solution(seed: int) -> None:
    """Other masses have moved on during it; over two periods it is in one of them alone."""
    rng = np.random.default_rng(seed)
    params = {
        "W": rng.uniform(0.55, 0.7),
        "S": rng.uniform(0.08, 0.1),
        "S0": rng.uniform(0.1, 0.12),
    }
    orbit = cf.find_orbit("storeys", params, longest=1000).as_whole()
    own = orbit.begins[slides_of(orbit)]
    for _ in range(20):
        length, share = SHORT * float(10.0 ** rng.uniform(-3.0, -0.5)), float(rng.uniform(0.1, 0.9))
        i = int(rng.choice(sticks(orbit)))
        found = held(orbit, i, length, share)
        assert np.abs(found.begins[slides_of(found)] - own).max() < SAME_SOLUTION
        twice = held(orbit.doubled(), i, length, share)
        assert unit_of(twice).periods == unit_of(orbit).periods


def test_a_slide_of_some_length_is_one() -> None:
    """Neither what it goes on from nor what it ends in reaches over it."""
    rng = np.random.default_rng(7)
    orbit = cf.find_orbit("storeys", {"W": 0.6}, longest=1000).as_whole()
    for i in sticks(orbit):
        length = float(rng.uniform(1.5 * SHORT, 0.9 * orbit.durations[i]))
        found = held(orbit, i, length, float(rng.uniform(0.1, 0.9)))
        assert len(slides_of(found)) > len(slides_of(orbit))


@pytest.mark.slow
def test_a_diagram_is_the_same_from_its_bridges() -> None:
    """Bridges of one and two periods that are narrow: most of their points are at one value."""
    params = {
        "W": 0.5772749788801339,
        "F": 0.15348418067235797,
        "k": 1.1281435744778392,
        "c": 0.11680660026046029,
        "S": 0.09095623036896427,
        "S0": 0.09271583846885771,
        "M": 2.6241817860139833,
        "kn": 1.2360645595047064,
        "d": 1.1009806138977427,
        "e": 0.49719650320326475,
    }
    bounds, rng = (0.5713431569051368, 0.5965061163575267), np.random.default_rng(5)
    orbit = cf.find_orbit("storeys", params, longest=1000)
    diagram = cf.explore(orbit, "W", bounds, max_periods=2)
    bridges = [branch for branch in diagram.branches if branch.bridge]
    assert {branch.system.periods for branch in bridges} == {orbit.periods, 2 * orbit.periods}
    for branch in bridges:
        k, step = int(rng.integers(2, len(branch) - 2)), float(rng.uniform(0.003, 0.006))
        again = cf.explore(branch[k], "W", bounds, max_periods=2, max_step=step)
        assert list(differences(again, diagram)) == list(differences(diagram, again)) == []
