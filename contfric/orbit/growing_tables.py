"""The tables of a simulation whose modes come as solutions visit them."""

from __future__ import annotations

from functools import cache

import numpy as np

from contfric.models.columns import Column
from contfric.models.composed import ComposedModel
from contfric.orbit.tables import (
    Tables,
    bits_of,
    chatter_table,
    check_surfaces,
    flight_table,
    moves_on,
    sides_of,
    surfaces_under,
)

#: In a rule, the first number that stands for a mode which was not visited yet; others are below.
UNVISITED = -2


class GrowingTables:
    """The tables of the modes that were visited; a row is written once.

    A rule that leads to a mode without a number has one below zero, until the mode is visited.
    """

    def __init__(self, model: ComposedModel) -> None:
        check_surfaces(model)
        self._model, self._done = model, 0
        self._bounds, self._first, self._sliding, self._under = (
            Column(),
            Column([0]),
            Column(),
            Column(),
        )
        self._rules = Column()
        self._waiting: dict[str, int] = {}
        self._names: list[str] = []

    def visit(self, number: int) -> int:
        """Return the number of a mode that had one below zero: it is visited now."""
        return self._model.mode_index[self._names[UNVISITED - number]]

    def tables(self) -> Tables:
        """Return the tables, with a row for each mode that was visited."""
        model = self._model
        for mode in model.modes[self._done :]:
            self._write(mode.name)
        surfaces = len(model.surfaces)
        observables = [model.observable_index[s.observable] for s in model.surfaces]
        every = bits_of(model, model.surface_by_name)
        return Tables(
            np.array(observables, dtype=np.int64),
            self._bounds.array[: self._done * surfaces].reshape(-1, surfaces),
            self._first.array,
            self._rules.array[: len(self._rules)].reshape(-1, 3),
            self._sliding.array,
            self._under.array,
            np.full(surfaces, every, dtype=np.int64),
            np.array([bits_of(model, {s}) for s in model.surface_by_name], dtype=np.int64),
            0,
            chatter_table(model, self._done),
            flight_table(model, self._done),
        )

    def _write(self, name: str) -> None:
        model = self._model
        ways, mode = model.composition.ways(name), model.mode_by_name[name]
        for surface in model.surface_by_name:
            self._bounds.append(int(surface in ways))
            for way in ways.get(surface, ()):
                self._rules += (*sides_of(model, way.where, ()), self._number(way.mode))
            self._first.append(len(self._rules) // 3)
        self._sliding.append(int(mode.sliding) * (1 + int(moves_on(model, mode))))
        self._under.append(surfaces_under(model, name))
        if name in self._waiting:
            targets = self._rules.array[: len(self._rules)].reshape(-1, 3)[:, 2]
            targets[targets == self._waiting.pop(name)] = self._done
        self._done += 1

    def _number(self, name: str) -> int:
        if self._model.was_visited(name):
            return self._model.mode_index[name]
        if name not in self._waiting:
            self._waiting[name] = UNVISITED - len(self._names)
            self._names.append(name)
        return self._waiting[name]


@cache
def growing_tables(model: ComposedModel) -> GrowingTables:
    """Return the growing tables of a model."""
    return GrowingTables(model)
