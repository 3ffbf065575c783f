"""Rests that several orbits pass: there their number grows with their periods as that of sequences does.

A hold begins where the solutions of the inclusion are not unique. Where two orbits of the same parameters
have a hold that begins at the same phase and in the same state, a solution may go on from there with either
of them each time: every sequence of the two is an orbit. Of k orbits of one period each there are as many of
n periods as there are aperiodic necklaces, nearly k^n / n (:mod:`contfric.events.incident.sequences`), some
of which may be symmetry images of each other. They belong to one diagram where events join them; what bounds
its size is ``max_periods`` alone.

So it is with a rest whose load comes to its limit at a maximum in time: place and phase of that rest are
given by the load. They do not depend on what came before, and persist as the parameter changes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from contfric.atlas.matching import guesses
from contfric.base.arrays import FloatArray, with_entries
from contfric.continuation.branch import Branch
from contfric.orbit.canonical.slides import modulo
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

#: States that agree to this (relative to 1 + their size) are the same: both are solved, and a touch is known
#: to the root of rounding.
_SAME = 1e-7


@dataclass(frozen=True)
class SharedRest:
    """A rest that several orbits pass.

    Attributes
    ----------
    parameter, value : where the orbits are
    periods : of each of the orbits
    orbits : how many they are, up to symmetry
    """

    parameter: str
    value: float
    periods: int
    orbits: int

    def __str__(self) -> str:
        length = "1 period" if self.periods == 1 else f"{self.periods} periods"
        return (
            f"{self.orbits} orbits of {length} pass one rest at {self.parameter} = {self.value:.6g}: every "
            f"sequence of n is an orbit, and they are about {self.orbits}^n / n; max_periods bounds it"
        )


def shared_rest(branches: Sequence[Branch]) -> SharedRest | None:
    """Return the rest that most of the shortest orbits of a diagram pass, where most of them exist.

    None if no two of them have one in common.
    """
    branches = [b for b in branches if not b.model.autonomous]
    periods = min((b.system.periods for b in branches), default=0)
    shortest = [b for b in branches if b.system.periods == periods and b.bridge]
    if len(shortest) < 2:
        return None
    value = _busiest([(float(np.min(b.values)), float(np.max(b.values))) for b in shortest])
    orbits = _orbits_at(shortest, value)
    rests = [_hold_starts(orbit) for orbit in orbits]
    cycle = orbits[0].period / orbits[0].periods if orbits else np.inf
    most = max((_passing(place, rests, cycle) for found in rests for place in found), default=0)
    return SharedRest(shortest[0].parameter, value, periods, most) if most > 1 else None


def _busiest(ranges: list[tuple[float, float]]) -> float:
    """Return a value that lies in most of the ranges, halfway between two of their ends."""
    ends = np.unique(np.array(ranges))
    middles = 0.5 * (ends[1:] + ends[:-1])
    if not len(middles):
        return float(ends[0])
    low, high = np.array(ranges).T
    inside = np.sum((low[:, None] < middles) & (middles < high[:, None]), axis=0)
    return float(middles[int(np.argmax(inside))])


def _orbits_at(branches: Iterable[Branch], value: float) -> list[Orbit]:
    """Return the orbits of branches at a value of their parameter."""
    found = []
    for branch in branches:
        vector = with_entries(branch[0].vector, branch.model.index_of(branch.parameter), value)
        for _, guess in guesses(branch, vector, value):
            solved = refine(replace(guess, vector=vector), damped=False)
            if solved.converged:
                found.append(solved.as_whole())
    return found


def _hold_starts(orbit: Orbit) -> list[FloatArray]:
    """Return time and state at the start of each hold of an orbit, and those of its symmetry image."""
    symmetry, half = orbit.model.symmetry, 0.5 * orbit.period / orbit.periods
    found = [orbit.begins[first.segment] for first, _ in orbit.system.ends_of_holds]
    if symmetry is not None:
        found += [np.array([p[0] + half, *(symmetry.array() @ p[1:])]) for p in found]
    return found


def _passing(place: FloatArray, rests: list[list[FloatArray]], cycle: float) -> int:
    """Return how many orbits, of which each has some rests, pass one place; times are modulo the cycle."""
    near = _SAME * (1.0 + float(np.abs(place[1:]).max()))

    def apart(there: FloatArray) -> float:
        gaps = np.abs(there - place)
        gaps[0] = modulo(gaps[:1], cycle)[0]
        return float(np.max(gaps))

    return sum(any(apart(there) < near for there in found) for found in rests)
