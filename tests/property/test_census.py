"""Whatever the parameters: nothing that another way finds is missing from a census."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import contfric as cf
from contfric.atlas.matching import identity, stops_distance
from contfric.censuses.census import _Census
from contfric.censuses.conditions import Arcs, Fate, least_periods
from contfric.censuses.grid import CensusLimits
from contfric.censuses.itineraries import canonical_pair, closed_itineraries, is_stop, letters_of
from contfric.censuses.sections import sections_of
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.orbit import Orbit, Status
from contfric.orbit.solve import refine
from contfric.signature import ReducedItinerary
from contfric.signature.walks import is_closed_walk

#: Each has an orbit, 3 has two; nine others, some without any, take four fifths of the time.
FAST = (3, 4, 5)
SEEDS = [seed if seed in FAST else pytest.param(seed, marks=pytest.mark.slow) for seed in range(12)]
PERIODS, STOPS = 2, 6


@cache
def scene(seed: int) -> dict[str, float]:
    """Random parameters: two thirds undamped, two thirds with one harmonic."""
    rng = np.random.default_rng(seed)
    S = rng.uniform(0.03, 0.6)
    S0 = S * rng.uniform(1.0, 6.0)
    h = float(rng.choice([0.0, 0.0, rng.uniform(-0.4, 0.4)]))
    zeta = float(rng.choice([0.0, 0.0, rng.uniform(0.0, 0.2)]))
    return {"Omega": rng.uniform(0.25, 0.85), "S": S, "S0": S0, "h": h, "zeta": zeta}


@cache
def census(seed: int) -> cf.Census:
    return cf.census("coulomb", scene(seed), periods=PERIODS, stops=STOPS)


def has(found: cf.Census, orbit: Orbit) -> bool:
    """Tell whether an orbit (or its mirror image) is in a census."""
    return any(
        orbit.periods == other.periods
        and identity(orbit) == identity(other)
        and stops_distance(orbit.stops, other.stops, True) < 1e-7
        for other in found
    )


def asked_for(orbit: Orbit) -> bool:
    return orbit.periods <= PERIODS and len(orbit.stops) <= STOPS and shortest(orbit) is orbit


def attractors(seed: int) -> Iterator[Orbit]:
    """Yield what long simulations from random starts converge to."""
    params, rng = scene(seed), np.random.default_rng(seed + 1000)
    for _ in range(8):
        state, time = rng.uniform(-2.0, 2.0, 2), rng.uniform(0.0, 2.0 * np.pi / params["Omega"])
        try:
            yield cf.find_orbit("coulomb", params, state=state, time=time, longest=1000)
        except cf.ConvergenceError:  # aperiodic, or at rest for ever
            continue


def crossings(branch: cf.Branch, value: float) -> Iterator[Orbit]:
    """Yield the orbits of a branch at a value of its parameter."""
    below = branch.values - value
    for i in np.flatnonzero(below[:-1] * below[1:] <= 0.0):
        step = branch.values[i + 1] - branch.values[i]
        share = 0.0 if step == 0.0 else -below[i] / step
        joints = branch.joints[i] + share * (branch.joints[i + 1] - branch.joints[i])
        vector = branch[int(i)].vector.copy()
        vector[branch[0].model.index_of(branch.parameter)] = value
        guess = Orbit(branch.system, joints, vector, np.inf, Status.NOT_CONVERGED)
        solved = refine(guess, damped=False)
        if solved.converged and solved.admissible:
            yield solved


@pytest.mark.parametrize("seed", SEEDS)
def test_every_attractor_is_listed(seed: int) -> None:
    found = census(seed)
    assert found.complete
    for orbit in attractors(seed):
        if asked_for(orbit):
            assert has(found, orbit), (orbit, orbit.itinerary)


@pytest.mark.parametrize("seed", SEEDS)
def test_every_orbit_of_every_branch_is_listed(seed: int) -> None:
    """Orbits of the census start explorations; whatever passes its parameters is in the census."""
    found, omega = census(seed), scene(seed)["Omega"]
    bounds = (0.93 * omega, 1.07 * omega)
    for start in found.orbits[:2]:
        try:
            diagram = cf.explore(start, "Omega", bounds, max_periods=PERIODS, max_branches=12)
        except cf.ConvergenceError:  # one of a continuum
            continue
        for branch in diagram.branches:
            for orbit in crossings(branch, omega):
                if asked_for(orbit):
                    assert has(found, orbit), (orbit, orbit.itinerary, start)


@pytest.mark.slow
def test_branches_of_fig_5_with_unstable_ones() -> None:
    """One exploration, sixteen values of its parameter, each crossing stable or not."""
    params = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
    diagram = cf.explore(cf.find_orbit("coulomb", params), "Omega", (0.4, 0.6))
    unstable = 0
    for omega in np.linspace(0.4837, 0.5463, 16):
        found = cf.census("coulomb", {**params, "Omega": omega})
        for branch in diagram.branches:
            for orbit in crossings(branch, float(omega)):
                assert has(found, orbit), (omega, orbit)
                unstable += not orbit.stable
    assert unstable > 10


@pytest.mark.parametrize("seed", SEEDS)
def test_orbits_are_solved_admissible_and_within_the_limits(seed: int) -> None:
    for orbit in census(seed):
        assert orbit.converged and orbit.admissible
        assert asked_for(orbit)


def settled_from(orbit: Orbit) -> Orbit:
    """Return what a long simulation converges to that starts on an orbit, half way along a slide."""
    slide = next(i for i, (mode, _) in enumerate(orbit.itinerary) if mode != "stick")
    time = 0.5 * float(orbit.cycle[slide, 0] + orbit.ends[slide, 0])
    return cf.find_orbit("coulomb", orbit.params, state=orbit.state(time), time=time)


@pytest.mark.parametrize("seed", SEEDS)
def test_stable_orbits_attract(seed: int) -> None:
    for orbit in census(seed).stable:
        assert stops_distance(orbit.stops, settled_from(orbit).stops, True) < 1e-7


def test_a_small_basin() -> None:
    """Two symmetric attractors of one itinerary: twelve random simulations met only one of them."""
    params = {"Omega": 0.261, "S": 0.1266, "S0": 0.3053, "zeta": 0.0982}
    found = cf.census("coulomb", params)
    assert [(orbit.name, orbit.stable) for orbit in found] == [("2s", True), ("2s", True)]
    one, other = (settled_from(orbit) for orbit in found)
    assert abs(one.x_max - other.x_max) > 0.1


@pytest.mark.parametrize("seed", SEEDS)
def test_other_nets_find_the_same(seed: int) -> None:
    other = cf.census("coulomb", scene(seed), periods=PERIODS, stops=STOPS, finer=1, seed=seed + 1)
    assert len(other) == len(census(seed))
    for orbit in other:
        assert has(census(seed), orbit)


@pytest.mark.parametrize("seed", SEEDS[:6])
def test_without_the_symmetry_mirror_images_are_found_by_themselves(seed: int) -> None:
    """The same model, said to have no symmetry: no half problems, no sections left out."""
    plain = replace(cf.load_model("coulomb"), name="plain", symmetry=None)
    found = cf.census(plain, scene(seed), periods=PERIODS, stops=STOPS)
    assert len(found) == found.with_mirrors == census(seed).with_mirrors


@pytest.mark.parametrize("seed", SEEDS[:6])
def test_what_is_pruned_has_no_orbit(seed: int) -> None:
    """A search that asks for every walk finds none of those that the conditions rule out."""
    model = cf.load_model("coulomb")
    limits = CensusLimits(PERIODS, STOPS)
    state = _Census(model, model.vector(scene(seed)), limits, 0, 10**6, 3, None)
    state.prepare()
    ruled_out = {walk for walk, fate in state.fates.items() if fate is not None}
    assert len(ruled_out) > 10
    state.fates = dict.fromkeys(state.fates)
    for section in sections_of(model, state.vector):
        state.search(section)
    found = set(state.catalogue.orbits)
    assert len(found) == len(
        {(canonical_pair(model, o.itinerary), o.periods) for o in census(seed)}
    )
    assert not found & ruled_out


# ---------------------------------------------------------------------------------------- itineraries


@pytest.mark.parametrize("stops", [1, 2, 3, 4])
def test_itineraries_are_all_closed_itineraries(stops: int) -> None:
    """Against all sequences of letters, tested one by one."""
    model = cf.load_model("coulomb")
    brute: set[ReducedItinerary] = set()
    for length in range(1, 2 * stops + 1):
        for itinerary in product(letters_of(model), repeat=length):
            if sum(is_stop(model, pair) for pair in itinerary) <= stops and is_closed_walk(
                itinerary, model
            ):
                brute.add(canonical_pair(model, itinerary))
    itineraries = closed_itineraries(model, stops)
    assert len(itineraries) == len(set(itineraries))
    assert set(itineraries) == brute


@pytest.mark.parametrize("stops", [5, 8, 10])
def test_number_of_itineraries(stops: int) -> None:
    """Burnside's lemma: closed walks of [[1, 2], [2, 1]] up to rotation and mirror image.

    After a slide come three choices: reversal, a stick released onwards, a stick released back. The
    mirror image exchanges the directions; a rotation by r with it fixes the itineraries whose first r
    letters are followed by their mirror image, and so on: (3^g - (-1)^g) of them, g = gcd(n, r), if
    n / g is even.
    """
    total = 0
    for n in range(1, stops + 1):
        fixed = 0
        for r in range(n):
            g = int(np.gcd(n, r)) if r else n
            fixed += 3**g + (-1) ** g
            if (n // g) % 2 == 0:
                fixed += 3**g - (-1) ** g
        assert fixed % (2 * n) == 0
        total += fixed // (2 * n)
    assert len(closed_itineraries(cf.load_model("coulomb"), stops)) == total


@st.composite
def arcs(draw: st.DrawFn) -> dict[tuple[str, str], Arcs]:
    """Two exits whose arcs begin and end on a coarse grid, none of them at once."""
    found = {}
    for name in ("F+", "F-"):
        marks = draw(st.lists(st.integers(0, 11), min_size=2, max_size=4, unique=True))
        marks = sorted(marks)[: 2 * (len(marks) // 2)]
        pairs = zip(marks[::2], marks[1::2], strict=True)
        found["stick", name] = tuple((a / 12.0, b / 12.0) for a, b in pairs)
    return found


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(arcs(), st.lists(st.sampled_from(["F+", "F-"]), min_size=1, max_size=4))
def test_turns_against_all_phases(found: dict[tuple[str, str], Arcs], exits: list[str]) -> None:
    """The least number of periods, against all choices of phases on a grid inside of the arcs."""
    chain = [found["stick", name] for name in exits]
    inside = [
        [k for k in range(360) if any(first < k / 360.0 < last for first, last in arc)]
        for arc in chain
    ]
    least = np.inf
    for start in inside[0]:
        at = start
        for later in inside[1:]:
            # phases at one instant are one after the other, however near
            at = min(k + 360 * turn for k in later for turn in range(10) if k + 360 * turn >= at)
        least = min(least, max(1.0, np.ceil((at - start) / 360.0)))
    itinerary = tuple(("stick", name) for name in exits)
    assert least_periods(itinerary, found) == least


def test_ledger_counts_every_walk() -> None:
    found = census(0)
    assert len(found.walks) == PERIODS * len(closed_itineraries(found.model, STOPS))
    assert sum(found.itineraries.values()) == len(found.walks)
    assert sum(walk.orbits for walk in found.walks) == len(found)
    assert {walk.fate for walk in found.walks if walk.orbits} == {Fate.FOUND}
