"""The symmetry (x, v, t) -> (-x, -v, t + pi / Omega): mirror images of orbits, branches, diagrams."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import contfric as cf
from contfric.orbit.solve import refine
from contfric.signature import canonical_itinerary, mirror_itinerary

CASES = {
    "1a": {"Omega": 0.5, "S": 0.32, "S0": 0.4},
    "2a": {"Omega": 0.4905, "S": 0.32, "S0": 0.4},
    "2s": {"Omega": 0.45, "S": 0.32, "S0": 0.4},
    "0s": {"Omega": 0.58, "S": 0.32, "S0": 0.4},
    "2a-14seg": {"Omega": 0.5, "S": 0.06, "S0": 0.4},
    "1a-9seg": {"Omega": 0.5, "S": 0.04, "S0": 0.4},
}
each_case = pytest.mark.parametrize("name", CASES)
SYMMETRIC = ("2s", "0s")


@cache
def orbit_of(name: str) -> cf.Orbit:
    return cf.solve_orbit("coulomb", name, CASES[name])


@cache
def fig05() -> cf.Diagram:
    return cf.explore(orbit_of("1a"), "Omega", (0.4, 0.6))


def gap(a: cf.Orbit, b: cf.Orbit) -> float:
    """Distance of two orbits as cyclic lists of joints: the best over all rotations and periods."""
    assert len(a.cycle) == len(b.cycle)
    period = 2 * np.pi / a.params["Omega"]
    best = np.inf
    for k in range(len(a.cycle)):
        turned = np.roll(b.cycle, -k, axis=0)
        slip = (turned[:, 0] - a.cycle[:, 0] + 0.5 * period) % period - 0.5 * period
        apart = max(np.max(np.abs(slip)), np.max(np.abs(turned[:, 1:] - a.cycle[:, 1:])))
        best = min(best, float(apart))
    return best


@each_case
def test_mirror_image_is_an_orbit(name: str) -> None:
    orbit = orbit_of(name)
    image = orbit.mirror()
    solved = refine(image, damped=False)
    assert solved.converged and solved.residual < 1e-13
    assert np.max(np.abs(solved.joints - image.joints)) < 1e-11, "nothing is left to correct"
    assert image.admissible, image.violations()
    assert np.allclose(image.margins.min(), orbit.margins.min(), rtol=0, atol=1e-12)
    assert canonical_itinerary(image.itinerary, image.model) == mirror_itinerary(
        orbit.itinerary, orbit.model
    )
    assert np.allclose(image.multipliers, orbit.multipliers, rtol=1e-12, atol=1e-12)
    assert (image.x_max, image.x_min) == (-orbit.x_min, -orbit.x_max)
    assert image.asymmetry == orbit.asymmetry
    assert image.name == orbit.name


@each_case
def test_mirror_image_is_simulated_as_such(name: str) -> None:
    """The image from the definition of the symmetry alone, not from the joints of mirror()."""
    orbit = orbit_of(name)
    image = orbit.mirror()
    half = np.pi / orbit.params["Omega"]
    for time in np.linspace(0.0, orbit.period, 23):
        assert np.max(np.abs(image.state(time + half) + orbit.state(time))) < 1e-12


@each_case
def test_mirror_twice_is_the_orbit(name: str) -> None:
    orbit = orbit_of(name)
    twice = orbit.mirror().mirror()
    assert twice.system is orbit.system or twice.itinerary == orbit.itinerary
    assert gap(orbit, twice) < 1e-14
    assert twice.signature == orbit.signature


@each_case
def test_symmetric_orbits_are_their_own_mirror_images(name: str) -> None:
    orbit = orbit_of(name)
    symmetric = name in SYMMETRIC
    assert orbit.symmetric == symmetric == orbit.system.half
    apart = (
        gap(orbit, orbit.mirror())
        if len(orbit.itinerary) == len(orbit.mirror().itinerary)
        else np.inf
    )
    assert (apart < 1e-12) == symmetric
    assert (orbit.asymmetry < 1e-12) == symmetric


@pytest.mark.parametrize("name", SYMMETRIC)
def test_half_and_whole_problem_have_the_same_solution(name: str) -> None:
    half = orbit_of(name)
    whole = half.as_whole()
    assert not whole.system.half and whole.system.segments == 2 * half.system.segments
    # start the whole problem off the symmetric subspace: it comes back to it
    rng = np.random.default_rng(4)
    start = replace(whole, joints=whole.joints + 1e-4 * rng.standard_normal(whole.joints.shape))
    solved = refine(start)
    assert solved.converged
    assert np.max(np.abs(solved.joints - whole.joints)) < 1e-12
    assert np.allclose(np.sort(solved.multipliers), np.sort(half.multipliers), rtol=0, atol=1e-12)
    assert np.allclose(half.turn_multipliers**2, half.multipliers)
    assert solved.as_half().system.half
    assert solved.admissible and half.admissible
    assert solved.signature == half.signature


def test_an_asymmetric_orbit_has_no_half() -> None:
    orbit = orbit_of("1a")
    assert orbit.as_half() is orbit


def test_mirror_branches_of_a_diagram() -> None:
    branches = [branch for branch in fig05().branches if not branch.bridge]
    computed = [b for b in branches if not b.mirrored and not b.symmetric]
    assert sorted(b.name for b in computed) == ["1a", "2a"]
    for branch in computed:
        (image,) = (b for b in branches if b.mirrored and b.name == branch.name)
        assert np.array_equal(image.values, branch.values)
        assert np.array_equal(image.x_max, -branch.x_min)
        assert np.array_equal(image.turn_multipliers, branch.turn_multipliers)
        kinds = [b.kind for b in branch.bifurcations]
        assert [b.kind for b in image.bifurcations] == kinds
        assert [end.reason for end in image.ends] == [end.reason for end in branch.ends]
        for i in range(0, len(branch), 7):
            assert gap(image[i], branch[i].mirror()) < 1e-13
        for i in range(1, len(image) - 1, 7):
            assert image[i].admissible
            run = cf.simulate(
                "coulomb", image[i].params, state=image[i].state(0.3), time=0.3, periods=1
            )
            assert np.max(np.abs(run.last[2] - image[i].state(0.3))) < 1e-11
        for own, mirrored in zip(branch.bifurcations, image.bifurcations, strict=True):
            assert own.params == mirrored.params
            assert gap(own.orbit.mirror(), mirrored.orbit) < 1e-13
    for branch in branches:
        if branch.symmetric:
            assert not branch.mirrored, "a symmetric branch is not listed twice"
            assert np.max(np.abs(branch.x_max + branch.x_min)) < 1e-12


def test_the_mirror_branches_meet_at_the_branch_point() -> None:
    """Both leave it in the same way: x_max of one is -x_min of the other, and they meet there."""
    (point,) = fig05().of_kind("BP")
    one, two = (b for b in fig05().branches if b.name == "2a")
    for branch in (one, two):
        near = int(np.argmin(np.abs(branch.values - point.params["Omega"])))
        assert near in (0, len(branch) - 1)
        assert gap(branch[near], point.orbit.as_whole()) < 1e-6


def test_starting_from_the_mirror_image_gives_the_same_diagram() -> None:
    other = cf.explore(orbit_of("1a").mirror(), "Omega", (0.4, 0.6))
    assert len(other.branches) == len(fig05().branches)
    for a, b in zip(fig05().bifurcations, other.bifurcations, strict=True):
        assert a.kind == b.kind
        assert a.params["Omega"] == pytest.approx(b.params["Omega"], rel=1e-11)
