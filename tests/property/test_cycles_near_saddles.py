"""Cycles that end near a saddle: solutions next to them may run through shorter cycles several times."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.exploration import Exploration
from contfric.continuation.ends.at_events import lost_in_end
from contfric.continuation.points import settings_of
from contfric.orbit.canonical.repetition import shortest

MODEL = Path(__file__).resolve().parents[1] / "models" / "switched.yaml"


@pytest.mark.parametrize("seed", range(4))
def test_no_branch_runs_through_a_shorter_cycle(seed: int) -> None:
    rng = np.random.default_rng([621, seed])
    stiffness = 0.833733252307 + float(rng.uniform(-2e-3, 2e-3)) * (seed > 0)
    begun = cf.find_orbit(MODEL, {"A": 0.82, "C": stiffness}, longest=1000)
    range_ = (0.55, 1.0)
    first = cf.explore(begun, "A", range_, max_periods=2)
    doubled = next(b for b in first.branches if b[0].periods == 2)
    again = cf.explore(doubled[len(doubled) // 2], "A", range_, max_step=0.02, max_periods=2)
    for branch in again.branches:
        orbit = branch[len(branch) // 2]
        assert shortest(orbit).periods == orbit.periods, branch
    assert not [b for b in again.bifurcations if b.kind is cf.Kind.BP], (
        "a doubling is no branch point"
    )


@pytest.mark.parametrize("seed", range(4))
def test_next_to_a_homoclinic_orbit_a_branch_ends_where_only_its_period_grows(seed: int) -> None:
    r"""The distance to the end falls as :math:`e^{-\lambda T}`, with the unstable eigenvalue of the saddle.

    Before the end rounding, which the passage multiplies, makes no event and no point that is not admissible.
    """
    rng = np.random.default_rng([622, seed])
    stiffness = float(rng.uniform(0.78, 0.9))
    begun = cf.find_orbit(MODEL, {"A": 0.85, "C": stiffness}, longest=1000)
    branch = cf.continue_orbit(begun, "A", (0.55, 1.0))
    assert sorted(end.reason.name for end in branch.ends) == ["PD", "PERIOD"]
    assert all(orbit.admissible for orbit in branch)
    assert all(b.located and b.accuracy < 1e-6 for b in branch.bifurcations)
    last = branch.values[0 if branch.ends[0].reason is cf.EndReason.PERIOD else -1]
    periods = np.array([orbit.period for orbit in branch])
    near = (periods > 20.0) & (periods < 35.0)
    rate = np.polyfit(periods[near], np.log(np.abs(branch.values[near] - last)), 1)[0]
    unstable = max(np.roots([1.0, last, stiffness, -1.0]), key=lambda root: float(root.real))
    assert rate == pytest.approx(-unstable.real, rel=0.05)


@pytest.mark.parametrize("seed", range(4))
def test_events_are_lost_in_an_endless_period_by_value_and_by_states(seed: int) -> None:
    """An event that only happens to be at the value of such an end is one, and every restart has it."""
    rng = np.random.default_rng([622, seed])
    stiffness = float(rng.uniform(0.78, 0.9))
    begun = cf.find_orbit(MODEL, {"A": 0.85, "C": stiffness}, longest=1000)
    branch = cf.continue_orbit(begun, "A", (0.55, 1.0))
    k = next(k for k in (0, -1) if branch.ends[k].reason is cf.EndReason.PERIOD)
    end, width = branch[k], 0.45
    event = max(branch.bifurcations, key=lambda b: abs(b.params["A"] - end.params["A"]))

    def moved(orbit: cf.Orbit, rise: float) -> cf.Bifurcation:
        """The event as if it had the states of an orbit, this far from the end."""
        vector = end.vector.copy()
        vector[end.model.index_of("A")] += rise
        there = replace(orbit, vector=vector)
        return replace(event, orbit=there, params=there.params)

    assert lost_in_end(moved(end, 0.5e-8 * width), end, "A", width)
    assert not lost_in_end(moved(end, 2e-8 * width), end, "A", width)
    assert not lost_in_end(moved(event.orbit, 0.0), end, "A", width)


@pytest.mark.parametrize("seed", range(20))
def test_events_of_one_branch_are_told_apart_however_well_they_are_known(seed: int) -> None:
    """Two branches may have the same event; one branch has others, one after the other, and some twice."""
    rng = np.random.default_rng([628, seed])
    low, high = (0.83, 0.9)
    begun = cf.find_orbit(MODEL, {"A": 0.85, "C": 0.8}, longest=1000)
    settings = settings_of(begun, "A", (low, high), None, True, 100)
    kind = (cf.Kind.SN, cf.Kind.PD)[seed % 2]
    rise = 10.0 ** rng.uniform(-7.5, -6.0) * (high - low)
    one = cf.Bifurcation(kind, begun.params, begun, bound=1e-6)
    near = begun.vector.copy()
    near[begun.model.index_of("A")] += rise
    other = replace(begun, vector=near)
    next_one = cf.Bifurcation(kind, other.params, other, bound=1e-6)
    for events, branches, count in (
        ((one, next_one), (0, 0), 2),
        ((one, next_one), (0, 1), 1),
        ((one, one), (0, 0), 1),
    ):
        state = Exploration(settings, 2, 1, 100, True, None)
        for event, branch in zip(events, branches, strict=True):
            state._meet(event, branch)
        assert len(state.events) == count
