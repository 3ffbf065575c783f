"""The tables of a simulation whose modes come as solutions visit them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.deriving.visited_modes import Way
from contfric.models.mode_domains import cut_bounds
from contfric.simulation.tables import (
    SOLVED,
    Tables,
    bits_of,
    chatter_table,
    check_surfaces,
    declared_surfaces,
    flight_table,
    moves_on,
    side_of,
    sides_of,
    surfaces_under,
)


class GrowingTables:
    """The tables of the modes that were visited; a row is written once.

    A rule that leads to a mode without a number has one below zero, until the mode is visited.
    """

    def __init__(self, model: ComposedModel) -> None:
        check_surfaces(model)
        self._model = model
        # of each mode, by surface: sides (mask, value) of others, and what follows; "" where it is solved for
        self._rules: list[dict[int, list[tuple[tuple[int, int], str]]]] = []
        self._sliding: list[int] = []
        self._under: list[int] = []
        self._waiting: dict[str, int] = {}  # the number of each, by its name in their order
        self._names: list[str] = []
        self._tables: Tables | None = None
        self._size = 0, 0

    def visit(
        self, number: int, last: tuple[int, int], t: float, y: FloatArray, vector: FloatArray
    ) -> int:
        """Return the number of a mode that had one below zero: it is visited now.

        Parameters
        ----------
        last : mode and surface of the last event
        t, y, vector : time, state and parameters there
        """
        model = self._model
        if number < SOLVED:
            return model.mode_index[self._names[SOLVED - 1 - number]]
        mode, surface = model.modes[last[0]].name, model.surfaces[last[1]].name
        place = model.mapping(vector), t, y.tolist()
        after = model.composition.after(mode, surface, place)
        return model.mode_index[model.part_at(after, t, y, vector)]

    def tables(self) -> Tables:
        """Return the tables, with a row for each mode that was visited."""
        model = self._model
        size = len(model.modes), len(model.surfaces)
        if self._tables is None or self._size != size:
            self._tables, self._size = self._written(), size
        return self._tables

    def _written(self) -> Tables:
        model = self._model
        for mode in model.modes[len(self._rules) :]:
            self._write(mode.name)
        done, surfaces = len(self._rules), len(model.surfaces)
        bounds = np.zeros((done, surfaces), dtype=np.int64)
        inside = np.zeros_like(bounds)
        counts = np.zeros(done * surfaces, dtype=np.int64)
        for k, rules in enumerate(self._rules):
            for surface, own in rules.items():
                bounds[k, surface] = 1
                inside[k, surface] = side_of(
                    model, model.modes[k].name, model.surfaces[surface].name
                )
                counts[k * surfaces + surface] = len(own)
        written = [
            (*sides, self._number(to))
            for rules in self._rules
            for _, own in sorted(rules.items())
            for sides, to in own
        ]
        every = bits_of(model, (s.name for s in declared_surfaces(model)))
        return Tables(
            np.array(
                [model.observable_index[s.observable] for s in model.surfaces], dtype=np.int64
            ),
            bounds,
            inside,
            np.concatenate([[0], np.cumsum(counts)]),
            np.array(written, dtype=np.int64).reshape(-1, 3),
            np.array(self._sliding, dtype=np.int64),
            np.array(self._under, dtype=np.int64),
            np.full((done, surfaces), every, dtype=np.int64),
            np.array([[bits_of(model, {s.name}) for s in model.surfaces]] * done, dtype=np.int64),
            0,
            chatter_table(model, done),
            flight_table(model, done),
        )

    def _write(self, name: str) -> None:
        model, mode, found = self._model, self._model.mode_by_name[name], {}
        for surface, ways in model.composition.ways(name).items():
            if model.composition.is_solved(name, surface):
                rules = [((0, 0), "")]
            else:
                rules = [rule for way in ways for rule in self._rules_of(way)]
            found[model.surface_index[surface]] = rules
        for surface in cut_bounds(model)[name]:
            if (name, surface) in model.sections:
                found[model.surface_index[surface]] = [((0, 0), model.transitions[name, surface])]
        self._rules.append(found)
        self._sliding.append(int(mode.sliding) * (1 + int(moves_on(model, mode))))
        self._under.append(surfaces_under(model, name))

    def _rules_of(self, way: Way) -> Iterator[tuple[tuple[int, int], str]]:
        """Yield the rules by which a mode follows, each of its parts on its side of the phase."""
        model = self._model
        for domain in model.domains_of(way.mode):
            where = {s: side for s, side in domain.signs.items() if s == model.phase}
            yield sides_of(model, {**way.where, **where}, ()), domain.name

    def _number(self, name: str) -> int:
        if not name:
            return SOLVED
        if self._model.was_visited(name):
            return self._model.mode_index[name]
        if name not in self._waiting:
            self._waiting[name] = SOLVED - 1 - len(self._names)
            self._names.append(name)
        return self._waiting[name]


@cache
def growing_tables(model: ComposedModel) -> GrowingTables:
    """Return the growing tables of a model."""
    return GrowingTables(model)
