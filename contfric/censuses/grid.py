"""A grid of starts on a section, refined where it is asked for, and the itineraries that they take.

Nodes are points of a lattice of integers (2**bits of them an axis, shifted by the seed), so that cells
of any size share them; each node is simulated once. What a node keeps of its trajectory are its events
within the limits: their letters (mode, exit, mode that follows), their times and states.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray, IntArray
from contfric.censuses.itineraries import is_stop, letters_of, modes_after
from contfric.censuses.sections import (
    Section,
    SectionSweep,
    dimension_of,
    joint_indices,
    sweep_from,
)
from contfric.models.definition import Model
from contfric.models.mode_domains import mirror_mode
from contfric.orbit.itinerary.itineraries import mirror_pairs
from contfric.signature import ReducedItinerary
from contfric.simulation.simulate import SimulationEnd

#: Starts that are simulated at once: rows of events for more would not stay in the processor's cache.
_AT_ONCE = 4096
#: Periods followed beyond the longest orbit: nodes on both sides of a return have to see it.
_BEYOND = 0.5
#: Multiplier of the hash of an itinerary: odd, and random in all its bits (that of Knuth's generator MMIX).
_HASH = np.uint64(6364136223846793005)


#: Code that no event has (-1 stands for no event).
_NO_LETTER = -2


@dataclass(frozen=True)
class CensusLimits:
    """What a census asks for: the most periods and stops of an orbit."""

    periods: int
    stops: int


@dataclass(eq=False)
class Grid:
    """Starts on one section and their trajectories.

    Attributes
    ----------
    shift : of the lattice, in units of its axes, shape (dimension,)
    bits : of the lattice of each axis
    reach : half-width of the box of positions
    code, lift, state : letter (-1: none), time in periods since the start (inf: none) and state of
        each event of each node, shapes (K, E), (K, E), (K, E, n)
    time, start : phase in periods and state of each node, shapes (K,), (K, n)
    held, cut : starts that come to rest for ever, and that make more stops than the limit allows
    followed : an example of each itinerary from the section back to it or to its mirror image, by its hash
    """

    section: Section
    vector: FloatArray
    limits: CensusLimits
    shift: FloatArray
    bits: int
    reach: float
    code: IntArray = field(init=False)
    lift: FloatArray = field(init=False)
    state: FloatArray = field(init=False)
    time: FloatArray = field(init=False)
    start: FloatArray = field(init=False)
    count: int = 0
    held: int = 0
    cut: int = 0
    followed: dict[int, tuple[int, ...]] = field(default_factory=dict)
    _index: dict[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n, events = len(self.model.states), self.events
        self.code = np.empty((0, events), dtype=np.int64)
        self.lift, self.state = np.empty((0, events)), np.empty((0, events, n))
        self.time, self.start = np.empty(0), np.empty((0, n))

    @property
    def model(self) -> Model:
        """The model that moves."""
        return self.section.model

    @cached_property
    def period(self) -> float:
        """Period of the excitation."""
        return self.model.view(self.vector).period

    @cached_property
    def events(self) -> int:
        """Most events of an orbit within the limits: its stops, and what slides between them."""
        sliding = sum(not is_stop(self.model, pair) for pair in letters_of(self.model))
        return self.limits.stops * (1 + min(sliding, self._longest_slide))

    @cached_property
    def _longest_slide(self) -> int:
        """Most segments between two stops."""
        letters = [pair for pair in letters_of(self.model) if not is_stop(self.model, pair)]
        longest = dict.fromkeys(letters, 1)
        for _ in letters:  # no cycle among them: census_itineraries has refused it
            for pair in letters:
                after = modes_after(self.model, pair)
                longest[pair] = 1 + max((longest[q] for q in letters if q[0] in after), default=0)
        return max(longest.values(), default=0)

    # ---------------------------------------------------------------------------------- letters

    @cached_property
    def own(self) -> int:
        """Code of the section's own letter."""
        return self.code_of(*self.section.indices)

    @cached_property
    def image(self) -> int:
        """Code of the mirror image of the section's letter; without a symmetry one that never is."""
        if self.model.symmetry is None:
            return _NO_LETTER
        (pair,) = mirror_pairs(self.model, (self.section.pair,))
        after = mirror_mode(self.model)[self.section.after]
        return self.code_of(*joint_indices(self.model, pair, after))

    def code_of(self, mode: int, exit_: int, after: int) -> int:
        """Return the code of a letter."""
        return (mode * len(self.model.surfaces) + exit_) * len(self.model.modes) + after

    def itinerary_of(self, codes: tuple[int, ...]) -> ReducedItinerary:
        """Return the (mode, exit) pairs of letters."""
        modes, surfaces = self.model.modes, self.model.surfaces
        pairs = (divmod(code // len(modes), len(surfaces)) for code in codes)
        return tuple((modes[mode].name, surfaces[exit_].name) for mode, exit_ in pairs)

    @property
    def useful(self) -> bool:
        """Whether an itinerary without a letter of lower dimension can pass the section."""
        return bool(self._letters[1][self.own])

    @cached_property
    def _letters(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Whether the letter of each code is a stop, and whether this section's search has it.

        Itineraries with a letter of lower dimension are sought on the section of that letter.
        """
        model, least = self.model, self.section.dimension
        size = len(model.modes) ** 2 * len(model.surfaces)
        stop, here = np.zeros(size, dtype=bool), np.zeros(size, dtype=bool)
        dimensions = {pair: dimension_of(model, pair) for pair in letters_of(model)}
        for pair, dimension in dimensions.items():
            for after in modes_after(model, pair):
                goes_on = any(d >= least for q, d in dimensions.items() if q[0] == after)
                code = self.code_of(*joint_indices(model, pair, after))
                stop[code], here[code] = is_stop(model, pair), dimension >= least and goes_on
        return stop, here

    # ------------------------------------------------------------------------------------ nodes

    def rows(self, lattice: IntArray) -> IntArray:
        """Return the rows of nodes, shape (K, dimension) -> (K,); new ones are simulated."""
        keys = self._keys(lattice)
        new = [i for i, key in enumerate(keys) if key not in self._index]
        fresh = {keys[i]: i for i in new}
        if fresh:
            first = self.count
            self._simulate(lattice[list(fresh.values())])
            self._index.update((key, first + k) for k, key in enumerate(fresh))
        return np.array([self._index[key] for key in keys], dtype=np.int64)

    def _keys(self, lattice: IntArray) -> list[int]:
        folded = lattice.copy()
        folded[:, 0] %= 1 << self.bits
        if folded.shape[1] == 1:
            return folded[:, 0].tolist()  # type: ignore[no-any-return]
        keys = [0] * len(folded)
        for axis in folded.T.tolist():  # whole numbers of Python: they do not overflow
            keys = [(key << (self.bits + 1)) + value for key, value in zip(keys, axis, strict=True)]
        return keys

    def coordinates(self, lattice: IntArray) -> FloatArray:
        """Return phases (periods) and positions of lattice points, shape (K, dimension)."""
        share = lattice / float(1 << self.bits) + self.shift
        share[:, 0] %= 1.0
        share[:, 1:] = (2.0 * share[:, 1:] - 1.0) * self.reach
        return share

    def _simulate(self, lattice: IntArray) -> None:
        for i in range(0, len(lattice), _AT_ONCE):
            at = self.coordinates(lattice[i : i + _AT_ONCE])
            phases, positions = at[:, 0].copy(), at[:, 1:].copy()
            followed = self.limits.periods + _BEYOND
            done = sweep_from(self.section, self.vector, phases, positions, followed, self.events)
            self._keep(phases, done)

    def _keep(self, phases: FloatArray, done: SectionSweep) -> None:
        code = self._codes(done)
        lift = np.where(code >= 0, done.clocks, np.inf)
        self._note_itineraries(code)
        self.held += int(
            np.sum(done.outcome[:, 2] == list(SimulationEnd).index(SimulationEnd.HELD))
        )
        last = self.count + len(phases)
        while len(self.time) < last:
            self._grow(max(2 * len(self.time), _AT_ONCE))
        new = slice(self.count, last)
        self.code[new], self.lift[new], self.state[new] = code, lift, done.states
        self.time[new], self.start[new], self.count = phases, done.starts, last

    def _grow(self, capacity: int) -> None:
        for name in ("code", "lift", "state", "time", "start"):
            old = getattr(self, name)
            larger = np.empty((capacity, *old.shape[1:]), dtype=old.dtype)
            larger[: len(old)] = old
            setattr(self, name, larger)

    def _codes(self, done: SectionSweep) -> IntArray:
        """Return the letters of the events within the limits, -1 after them."""
        stop, here = self._letters
        count, events = done.joints.shape[:2]
        place = np.arange(events)
        modes, exits = done.joints[..., 0], done.joints[..., 1]
        after = np.empty((count, events), dtype=np.int64)
        after[:, :-1] = modes[:, 1:]
        happened = place < done.outcome[:, :1]
        final = place == done.outcome[:, :1] - 1
        after = np.where(final, done.outcome[:, 1:2], after)
        surfaces, kinds = len(self.model.surfaces), len(self.model.modes)
        code = np.where(happened, (modes * surfaces + exits) * kinds + after, 0)
        going = np.logical_and.accumulate(happened & here[code], axis=1)
        few = np.cumsum(stop[code] & happened, axis=1) <= self.limits.stops
        early = done.clocks <= self.limits.periods
        full = going & few & early
        self.cut += int(np.sum((going & ~few & early).any(axis=1) | full[:, -1]))
        return np.where(going & few, code, -1)

    def _note_itineraries(self, code: IntArray) -> None:
        """Keep one example of each itinerary from the section back to it, or to its mirror image."""
        if not len(code):
            return
        hashes = np.empty(code.shape, dtype=np.uint64)
        running = np.zeros(len(code), dtype=np.uint64)
        for j in range(code.shape[1]):
            running = running * _HASH + (code[:, j] + 2).astype(np.uint64)
            hashes[:, j] = running
        for kind in (self.own, self.image):
            row, event = np.nonzero(code == kind)
            found, first = np.unique(hashes[row, event], return_index=True)
            for value, i in zip(found.tolist(), first.tolist(), strict=True):
                if value not in self.followed:
                    self.followed[value] = tuple(code[row[i], : event[i] + 1].tolist())
