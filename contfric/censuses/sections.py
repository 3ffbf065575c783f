"""Sections that every orbit meets: the joints of one kind of segment, and their coordinates.

A joint ``(t, y)`` of a segment (mode, exit) obeys the exit's equation and those of the surfaces that
the mode moves on. With n states and l such surfaces the joints are a set of dimension ``n - l``: for a
stick of the oscillator it is a **curve** (the displacement at a release is known from its phase: what came
before the stick is forgotten, one multiplier is zero), for a slide a surface.

An orbit is sought on the section of the least dimension that it meets. So all orbits that stick at
least once are periodic points of a map of curves, and a search on the section of the stops has
to look only for orbits that never stick. Of a section and its mirror image one is enough.

Coordinates are the phase (in periods) and, for dimensions above one, a position along an orthonormal
basis of the directions that the section leaves free, over the box in which orbits are sought.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.base.tally import tally
from contfric.censuses.conditions import Arcs
from contfric.censuses.itineraries import letters_of, modes_after
from contfric.models.definition import Model
from contfric.models.mode_domains import exit_domains, mirror_mode
from contfric.remember.journal import remembered
from contfric.signature.reduced import ReducedPair
from contfric.simulation.tables import tables

#: Mode and exit of a segment, the mode after it, and the sign of the rate at which the exit is met.
_End: TypeAlias = tuple[ReducedPair, str, float]
#: Phases at which it is asked whether an exit can be met: an arc narrower than this part of a period
#: may be missed.
_PHASES = 4096
#: Halvings of the step between them: the end of an arc is then known to rounding.
_HALVINGS = 40


@dataclass(frozen=True, eq=False)
class Section:
    """The joints at which one mode is left by an exit into a certain mode.

    Attributes
    ----------
    pair, after : (mode, exit) of the segment that ends, and the mode that follows
    sense : sign of the rate at which the exit is met
    dimension : of the set of joints
    basis : free directions of the state, shape (n, dimension - 1)
    """

    model: Model
    pair: ReducedPair
    after: str
    sense: float
    dimension: int
    basis: FloatArray

    @property
    def indices(self) -> tuple[int, int, int]:
        """Mode, exit and following mode as the engine numbers them."""
        return joint_indices(self.model, self.pair, self.after)

    def __str__(self) -> str:
        return f"{self.pair[0]}|{self.pair[1]} -> {self.after}"


def joint_indices(model: Model, pair: ReducedPair, after: str) -> tuple[int, int, int]:
    """Return a segment's mode, exit and the mode after it as the engine numbers them."""
    return model.mode_index[pair[0]], model.surface_index[pair[1]], model.mode_index[after]


def dimension_of(model: Model, pair: ReducedPair) -> int:
    """Return the dimension of the joints at which a segment ends.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> dimension_of(load_model("coulomb"), ("stick", "F+"))
    1
    """
    mode, exit_, _ = joint_indices(model, pair, pair[0])
    under = int(tables(model).lies_on[mode]) & ~(1 << exit_)
    return len(model.states) - under.bit_count()


def sections_of(model: Model, vector: FloatArray) -> list[Section]:
    """Return the sections, one of each mirror pair, in the order of their dimension."""
    found: list[Section] = []
    seen: set[_End] = set()
    for end in _ends(model):
        if end not in seen:
            seen |= {end, _mirrored(model, *end)}
            found.append(_section(model, *end, vector))
    return sorted(found, key=lambda section: section.dimension)


def _ends(model: Model) -> Iterator[_End]:
    """Yield how a segment may end: its mode and exit, the mode that follows, and the sense of the exit."""
    for pair in letters_of(model):
        for after in sorted(modes_after(model, pair)):
            domains = exit_domains(model, pair[0], pair[1], after)
            for sense in {-float(model.domain_by_name[d].signs[pair[1]]) for d in domains}:
                yield pair, after, sense


def _mirrored(model: Model, pair: ReducedPair, after: str, sense: float) -> _End:
    if model.symmetry is None:
        return pair, after, sense
    images = mirror_mode(model)
    return (images[pair[0]], model.symmetry.surfaces[pair[1]]), images[after], -sense


def _section(
    model: Model, pair: ReducedPair, after: str, sense: float, vector: FloatArray
) -> Section:
    dimension = dimension_of(model, pair)
    return Section(
        model, pair, after, sense, dimension, _free_directions(model, pair, dimension, vector)
    )


def _free_directions(
    model: Model, pair: ReducedPair, dimension: int, vector: FloatArray
) -> FloatArray:
    """Return an orthonormal basis of the directions that a section leaves to the state at rest."""
    mode, exit_, _ = joint_indices(model, pair, pair[0])
    table, n = tables(model), len(model.states)
    held = [
        k for k in range(len(model.surfaces)) if k == exit_ or int(table.lies_on[mode]) >> k & 1
    ]
    flow = model.view(vector)
    rows = [flow.gradient(model.surfaces[k].observable, 0.0, np.zeros(n))[1:] for k in held]
    free = np.linalg.svd(np.array(rows))[2][len(held) :].T
    return np.ascontiguousarray(free[:, : dimension - 1])


@dataclass(frozen=True)
class SectionSweep:
    """Trajectories from one section.

    Attributes
    ----------
    starts : states that were placed on the section, shape (K, n)
    joints : mode that ends and exit at each event, shape (K, E, 2)
    clocks : time of each event, in periods since the start of the first one, shape (K, E)
    states : state at each event, shape (K, E, n)
    outcome : number of events (-1: no start), last mode, end of the simulation, shape (K, 3)
    """

    starts: FloatArray
    joints: IntArray
    clocks: FloatArray
    states: FloatArray
    outcome: IntArray


@remembered()
def sweep_from(
    section: Section,
    vector: FloatArray,
    phases: FloatArray,
    positions: FloatArray,
    periods: float,
    events: int,
) -> SectionSweep:
    """Follow trajectories from a section.

    Parameters
    ----------
    phases : in periods, from 0 to 1, shape (K,)
    positions : along the section's basis, shape (K, dimension - 1)
    periods : time to follow, in periods
    events : most events of each
    """
    from contfric.censuses.sweep import sweep

    model, count = section.model, len(phases)
    n, period = len(model.states), model.view(vector).period
    starts = np.ascontiguousarray(positions @ section.basis.T)
    joints = np.empty((count, events, 2), dtype=np.int64)
    cycles = np.zeros((count, events), dtype=np.int64)
    clocks, states = np.zeros((count, events)), np.zeros((count, events, n))
    outcome = np.empty((count, 3), dtype=np.int64)
    mode, exit_, after = section.indices
    tally()[3] += sweep(
        model.flow.functions(),
        tables(model),
        mode,
        exit_,
        after,
        section.sense,
        np.ascontiguousarray(phases) * period,
        starts,
        vector,
        float(periods),
        joints,
        cycles,
        clocks,
        states,
        outcome,
    )
    lifts = cycles + clocks / period - phases[:, None]
    return SectionSweep(starts, joints, lifts, states, outcome)


def arcs_of(section: Section, vector: FloatArray) -> Arcs:
    """Return the phases at which the exit of a section of dimension one can be met, as open arcs."""

    def met(phases: FloatArray) -> NDArray[np.bool_]:
        nowhere = np.empty((len(phases), 0))
        return sweep_from(section, vector, phases % 1.0, nowhere, 0.0, 0).outcome[:, 0] >= 0

    phases = np.arange(_PHASES) / _PHASES
    inside = met(phases)
    if inside.all():
        return ((0.0, 1.0),)
    at = np.flatnonzero(inside != np.roll(inside, -1))
    low, high = phases[at], phases[at] + 1.0 / _PHASES
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        same = met(middle) == inside[at]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    ends = 0.5 * (low + high)
    firsts, lasts = ends[~inside[at]], ends[inside[at]]
    if len(firsts) and lasts[0] < firsts[0]:  # the first arc begins before phase 0
        lasts = np.append(lasts[1:], lasts[0] + 1.0)
    return tuple(zip(firsts.tolist(), lasts.tolist(), strict=True))


def exit_arcs(model: Model, vector: FloatArray) -> dict[ReducedPair, Arcs]:
    """Return the arcs of every segment whose end is a section of dimension one."""
    arcs: dict[ReducedPair, list[tuple[float, float]]] = {
        pair: [] for pair in letters_of(model) if dimension_of(model, pair) == 1
    }
    for pair, after, sense in _ends(model):
        if pair in arcs:
            arcs[pair] += arcs_of(_section(model, pair, after, sense, vector), vector)
    return {pair: tuple(sorted(found)) for pair, found in arcs.items()}
