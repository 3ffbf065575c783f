"""Input and output of the compiled sections: the section, how to follow solutions, points and ends."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from contfric.base.arrays import FloatArray, IntArray

#: Events that are followed between two looks at the section: a period or two of most orbits.
BATCH = 16


class Cut(NamedTuple):
    """A section, as the kernel takes it.

    Attributes
    ----------
    joints : whether a joint counts, by the mode that ends and its exit surface, shape (modes, surfaces)
    inside : whether crossings are looked for inside of the segments of a mode, shape (modes,)
    observable : observable of the section
    surface : surface whose level it takes there; -1 for the level 0
    phase : phase of the excitation, as a share of its period; negative if it is no stroboscopic section
    sense : 1 if the observable rises, -1 if it falls, 0 for either
    """

    joints: IntArray
    inside: IntArray
    observable: int
    surface: int
    phase: float
    sense: int


class Following(NamedTuple):
    """How solutions are followed.

    Attributes
    ----------
    transient, span : periods before points are collected, and all periods
    repeats : difference (relative to 1 + state) below which a return ends a solution; 0 to follow to the end
    most : points after which a solution is left
    carried : 1 if each starts where the one before has ended
    """

    transient: float
    span: float
    repeats: float
    most: int
    carried: int


class SectionPoints(NamedTuple):
    """Points on a section.

    Attributes
    ----------
    number : number found, more than the arrays hold if they are too short, shape (1,)
    cycles, modes : periods completed and mode, shape (k,)
    times, states : phase and state, shapes (k,) and (k, n)
    """

    number: IntArray
    cycles: IntArray
    modes: IntArray
    times: FloatArray
    states: FloatArray

    def at(self, which: Any) -> SectionPoints:
        """Return some of the points, copied: a slice, or a mask."""
        rows: list[Any] = [rows[which].copy() for rows in self[1:]]
        return SectionPoints(np.array([len(rows[0])]), *rows)


class Ends(NamedTuple):
    """What solutions came to, one row each.

    Attributes
    ----------
    outcomes : number of the :class:`~contfric.response.outcome.Outcome`, shape (k,)
    turns : periods after which the solution repeats itself, 0 if it does not, shape (k,)
    upto : points found with it and all before, shape (k,)
    itineraries : a number for the sequence of its segments, shape (k,)
    states : state at the end, shape (k, n)
    """

    outcomes: IntArray
    turns: IntArray
    upto: IntArray
    itineraries: IntArray
    states: FloatArray

    def after(self, done: int) -> Ends:
        """Return the rows after those that are done, as views."""
        rows: list[Any] = [rows[done:] for rows in self]
        return Ends(*rows)


def empty_points(count: int, n: int) -> SectionPoints:
    """Return empty rows for points."""
    cycles, modes = np.zeros((2, count), dtype=np.int64)
    number = np.zeros(1, dtype=np.int64)
    return SectionPoints(number, cycles, modes, np.zeros(count), np.zeros((count, n)))


def empty_ends(count: int, n: int) -> Ends:
    """Return empty rows for the ends of solutions."""
    outcomes, turns, upto, itineraries = np.zeros((4, count), dtype=np.int64)
    return Ends(outcomes, turns, upto, itineraries, np.zeros((count, n)))
