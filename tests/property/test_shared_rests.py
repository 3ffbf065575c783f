"""Orbits that pass one rest may follow each other in any order: the diagram says so where it is cut."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.matching import guesses
from contfric.atlas.shared_rests import SharedRest, shared_rest
from contfric.bvp.system import build_system
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

#: Its stick at a maximum of the load (x = 0.913120818) is passed by orbits with holds over most of the range.
SCENE = {
    "Omega": 0.07244939602203591,
    "S": 0.04862562060559524,
    "S0": 0.09429067194772685,
    "h": -0.4181325122359131,
    "zeta": -0.02,
}
RANGE = (-0.054703472165212264, 0.04387727196968545)
PLACE = 0.913120818


@pytest.fixture(scope="module")
def diagram() -> cf.Diagram:
    orbit = cf.find_orbit("coulomb", SCENE, longest=1000)
    return cf.explore(orbit, "zeta", RANGE, max_periods=1, max_branches=26)


def cut_at_rest(orbit: Orbit) -> tuple[list[tuple[str, str]], np.ndarray] | None:
    """Return itinerary and joints of an orbit from the rest on; None if it does not pass it once."""
    whole = orbit.as_whole()
    at = [h.segment for h in whole.system.holds if abs(whole.cycle[h.segment, 1] - PLACE) < 1e-8]
    if len(at) != 1:
        return None
    k = at[0]
    joints = np.roll(whole.cycle, -k, axis=0)
    joints[len(joints) - k :, 0] += whole.period
    return [*whole.itinerary[k:], *whole.itinerary[:k]], joints


def test_the_note_counts_the_orbits_of_one_rest(diagram: cf.Diagram) -> None:
    branches = [b for b in diagram.branches if not b.mirrored]
    found = shared_rest(branches)
    assert isinstance(found, SharedRest)
    assert found.periods == 1
    assert found.orbits > 1
    assert not diagram.complete
    assert str(found) in diagram.notes


def test_every_two_orbits_of_a_rest_are_an_orbit_of_two_periods(diagram: cf.Diagram) -> None:
    """Put together at the rest, without any correction, they solve the equations."""
    value, pairs = 0.0009, 0
    loops = []
    for branch in diagram.branches:
        vector = branch[0].vector.copy()
        vector[branch.model.index_of("zeta")] = value
        for _, guess in guesses(branch, vector, value):
            solved = refine(replace(guess, vector=vector), damped=False)
            cut = cut_at_rest(solved) if solved.converged and solved.admissible else None
            loops += [] if cut is None else [(solved, *cut)]
    for (one, first, a), (_, second, b) in combinations(loops, 2):
        second_joints = b.copy()
        turns = round((a[0, 0] - b[0, 0]) / one.period) + 1
        second_joints[:, 0] += turns * one.period
        # the first segment is no hold: the stick that comes to the rest
        itinerary = (*first[1:], *second, first[0])
        last = a[:1].copy()
        last[:, 0] += 2 * one.period
        joints = np.concatenate((a[1:], second_joints, last))
        shift = next(i for i, (_, exit_) in enumerate(itinerary) if not exit_.startswith("hold@"))
        itinerary = (*itinerary[shift:], *itinerary[:shift])
        joints = np.roll(joints, -shift, axis=0)
        joints[len(joints) - shift :, 0] += 2 * one.period
        together = Orbit(build_system(one.model, itinerary, 2), joints, one.vector, np.inf)
        solved = refine(together, damped=False)
        assert solved.converged
        assert solved.admissible
        assert np.max(np.abs(solved.joints - joints)) < 1e-7
        pairs += 1
    assert pairs > 1
