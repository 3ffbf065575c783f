"""Bridges whose passages turn by themselves: every sequence of arms is there, whatever the start."""

from __future__ import annotations

from functools import cache
from itertools import product
from math import comb

import numpy as np
import pytest
import restarts

import contfric as cf
from contfric.bvp.linear import assembled
from contfric.continuation.points import settings_of
from contfric.continuation.singular_points.arms import arms_at, passages, turning_passages
from contfric.continuation.singular_points.vertices import undoubled_part
from contfric.events.bifurcation import Kind
from contfric.events.incident.sequences import count, lengths
from contfric.orbit.canonical.distance import cyclic_apart, farthest_apart

#: Random scenes (of seed 31) with folds of bridges of several holds, and most periods of their orbits.
SCENES = [(163, 1), (179, 1), (179, 2)]


@cache
def _explored(index: int, periods: int) -> cf.Diagram:
    found = restarts.scene(31, index)
    orbit = cf.find_orbit("coulomb", found.params, longest=1000)
    return cf.explore(orbit, found.vary, found.range, max_periods=periods, copies=periods)


def _folds(diagram: cf.Diagram) -> list[cf.Bifurcation]:
    """Return the folds at which passages turn by themselves."""
    found = (b for b in diagram.bifurcations if b.kind is Kind.SN and b.orbit.system.holds)
    return [b for b in found if arms_at(b.orbit) is not None]


@pytest.mark.parametrize(
    ("index", "periods", "most"),
    [(163, 1, 4), (179, 2, 3), pytest.param(179, 2, 99, marks=pytest.mark.slow)],
)
def test_the_same_from_every_branch(index: int, periods: int, most: int) -> None:
    diagram = _explored(index, periods)
    assert _folds(diagram)
    found = diagram.verify(restarts=most)
    assert found.passed, str(found)
    assert not found.degenerate
    assert len(found.restarts) >= min(most, 30)


@pytest.mark.parametrize(("index", "periods"), SCENES)
def test_all_sequences_are_judged_and_balance(index: int, periods: int) -> None:
    """Over n passages the index of a sequence is ``-prod s_i``: they add up to 0, as without any."""
    diagram = _explored(index, periods)
    for fold in _folds(diagram):
        arms = arms_at(fold.orbit)
        assert arms is not None
        unit = arms.unit
        wanted = lengths(unit.periods, unit.half, max(periods, unit.periods))
        if arms.letters == 2 and wanted == [1]:
            continue
        told = [p for p in fold.proposals if "one after the other" in p.reason]
        assert len(told) >= sum(count(arms.letters, n) for n in wanted)
        assert all(p.verdict.value != "refused" for p in told), told
    assert all(b.holds for b in diagram.verify(restarts=0).balances)
    assert all(sum((-1) ** k * comb(n, k) for k in range(n + 1)) == 0 for n in range(1, 9))


def test_a_unit_that_turns_as_one_has_all_sequences() -> None:
    """Over two units there are two null vectors, and three cyclic sequences: two arms, and one of each."""
    scene = restarts.scene(34, 61)
    orbit = cf.find_orbit("coulomb", scene.params, longest=1000)
    found = cf.explore(orbit, scene.vary, scene.range)
    (fold,) = (b for b in found.events if b.bifurcation.label == "SN_4a, 14seg, 1hold")
    arms = arms_at(fold.bifurcation.orbit)
    assert arms is not None
    assert arms.as_one and not turning_passages(arms.fold)
    told = [p for p in fold.proposals if "one after the other" in p.reason]
    assert [p.verdict.value for p in told] == ["known", "known", "accepted"]
    assert all(b.holds for b in found.verify(restarts=0).balances)


def test_a_passage_turns_by_itself() -> None:
    """Its null vector moves nothing but its own joints, and all of its hold's length."""
    diagram = _explored(179, 2)
    for fold in _folds(diagram):
        orbit = fold.orbit.as_whole()
        full = assembled(orbit.system, orbit.joints, orbit.vector)
        for hold, vector in turning_passages(orbit).items():
            joints = passages(orbit.system)[hold]
            assert vector[joints[0], 0] == pytest.approx(1.0)
            still = np.setdiff1d(np.arange(len(vector)), joints[:-1])
            assert np.max(np.abs(vector[still]), initial=0.0) == 0.0
            size = np.linalg.norm(full) * np.linalg.norm(vector)
            assert np.linalg.norm(full @ vector.ravel()) < 1e-6 * size


def test_a_composed_orbit_solves_its_equations_at_once() -> None:
    """Passages of solved orbits, put together in another order, are an orbit without any correction."""
    diagram = _explored(179, 2)
    fold = next(f for f in _folds(diagram) if f.orbit.as_half().system.half or f.symmetric)
    arms = arms_at(fold.orbit)
    assert arms is not None
    bounds = diagram.range
    settings = settings_of(fold.orbit, diagram.parameter, bounds, None, False, 1000)
    near = arms.solved_near(1e-3, settings)
    assert near is not None
    lengths_of = set()
    for sequence in ((0, 0, 0, 1), (0, 0, 1, 1), (0, 1, 1, 1)):
        orbit = near.orbit(sequence)
        assert orbit.converged
        assert orbit.admissible
        holds = [h.segment for h in orbit.system.holds]
        lasts = (orbit.ends - orbit.cycle)[holds, 0]
        middle = 0.5 * (lasts.min() + lasts.max())
        lengths_of.add(int(np.sum(lasts > middle)))
    assert lengths_of == {1, 2, 3}


@pytest.mark.parametrize("seed", range(5))
def test_joints_in_another_order_are_another_motion(seed: int) -> None:
    """A rotation changes nothing, an exchange of two joints does; as sets they are the same."""
    rng = np.random.default_rng(seed)
    joints = rng.uniform(size=(6, 3))
    free = np.full(3, np.inf)
    assert cyclic_apart(joints, np.roll(joints, 2, axis=0), free) == 0.0
    other = joints[[1, 0, 2, 3, 4, 5]]
    assert farthest_apart(joints, other, free) == 0.0
    assert cyclic_apart(joints, other, free) > 0.0
    brute = min(np.max(np.abs(joints - np.roll(other, k, axis=0))) for k in range(6))
    assert cyclic_apart(joints, other, free) == pytest.approx(brute)


@pytest.mark.parametrize("seed", range(4))
def test_many_turns_next_to_a_fold_are_those_of_one(seed: int) -> None:
    """Where orbits of four turns meet a fold they are one turn: of two turns it would be another event."""
    rng = np.random.default_rng(seed)
    found = restarts.scene(51, 39)
    vary, bounds = found.vary, found.range
    params = {k: v * rng.uniform(0.99, 1.01) for k, v in found.params.items()}
    diagram = cf.explore(
        cf.find_orbit("coulomb", params, longest=1000), vary, bounds, max_periods=1
    )
    folds = [arms for b in _folds(diagram) if not (arms := arms_at(b.orbit)).unit.half]
    assert folds
    parts: list[int] = []
    # nearer than the root of rounding it is luck whether both arms are solved: several distances are tried
    for distance, arms in product(10.0 ** rng.uniform(-7.5, -6.2, 9), folds):
        if parts and arms is folds[0]:
            break
        near = arms.solved_near(distance, settings_of(arms.fold, vary, bounds, None, False, 1000))
        for sequence in ((0, 0, 0, 1), (0, 0, 1, 1)) if near else ():
            part = undoubled_part(near.orbit(sequence), arms.fold.model.index_of(vary))
            parts += [] if part is None else [part.periods // arms.fold.periods]
    assert parts
    assert set(parts) == {1}
