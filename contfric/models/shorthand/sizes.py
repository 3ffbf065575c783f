"""Sizes of states and time, from the formulas of a model: the units that ``units: auto`` chooses.

Time is measured in ``period/(2 pi)``, of a clock too, or, without either, in the inverse of the middle one of
the rates of the first mode that does not slide. A state is as large as its ``spread`` says; else as what the
forces at rest move it by in that mode. States whose range the model says are at its middle there, and rates
are differences within it. All of it changes with the units of the formulas as the states do, so that the
same model in other units is solved as the same numbers.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contfric.models.described.description import Description
from contfric.models.described.evaluate import Evaluator, Sampler, defaults, floats
from contfric.models.entries import EntryError
from contfric.models.language.grammar import TIME
from contfric.models.shorthand.clocks import CLOCK, is_clock

#: Phases of an excitation at which its force is looked at.
_PHASES = 16
#: Passes of the linear response: the first takes steps of 1, the others steps of the sizes that were found,
#: so that rounding of large numbers does not reach small ones.
_PASSES = 4
#: Digits of a unit: it is read by people, and needs to be right to a factor only.
_DIGITS = 3


def chosen_units(
    found: Description,
    spread: Collection[str],
    angles: Collection[str],
    alike: Collection[Collection[str]] = (),
) -> dict[str, float]:
    """Return a unit for each state that may have one, and for time.

    Parameters
    ----------
    spread : the states whose size the model says
    angles : the states that are angles: they have no unit
    alike : groups of states that have one unit, that of the largest: the coordinates of a structure

    Raises
    ------
    EntryError
        If the size of a state, or of time, cannot be told.
    """
    params = defaults(found)
    regions = dict(zip(found.states, Sampler(floats(found), params).region, strict=True))
    known = {s: ends for s, ends in regions.items() if s in spread}
    response = _Response(floats(found), params, known)
    sizes = {s: 0.5 * max(map(abs, ends)) for s, ends in known.items()}
    free = [s for s in found.states if not is_clock(s) and s not in angles]
    if any(s not in spread for s in free):
        sizes = response.sizes | sizes
    wanted = {**{s: sizes.get(s, 0.0) for s in free}, TIME: response.time}
    for group in alike:
        wanted |= dict.fromkeys(group, max(wanted[s] for s in group))
    unknown = [name for name, size in wanted.items() if not 1e-100 < size < 1e100]
    if unknown:
        raise EntryError(
            ("units",),
            f"units cannot be chosen: nothing tells the size of {', '.join(unknown)}. Write "
            "them down, such as {x: 1.0e-3, t: 1.0e-3}, or the size of each state in 'spread'",
        )
    return {name: rounded(size) for name, size in wanted.items()}


def rounded(size: float) -> float:
    """Return a size with the digits of a unit.

    Examples
    --------
    >>> rounded(0.00312345)
    0.00312
    """
    return float(f"{size:.{_DIGITS}g}")


@dataclass(frozen=True, eq=False)
class _Response:
    """What the first mode that does not slide does at rest, or in the middle of the ranges of states."""

    evaluator: Evaluator[float]
    params: Mapping[str, float]
    regions: Mapping[str, tuple[float, float]]

    @cached_property
    def _mode(self) -> str:
        modes = self.evaluator.description.modes
        return next((m.name for m in modes if 0 not in m.sides.values()), modes[0].name)

    def _field(self, t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.array(self.evaluator.field(self._mode, self.params, t, y.tolist()))

    @cached_property
    def _places(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where rates are differences, and over which distances: inside the range of a state that has one."""
        states = self.evaluator.description.states
        ranged = self.evaluator.description.ranges or ((),) * len(states)
        inside = {s: self.regions[s] for s, ends in zip(states, ranged, strict=True) if ends}
        middle = [0.5 * sum(inside.get(s, (0.0, 0.0))) for s in states]
        halves = {s: 0.25 * (ends[1] - ends[0]) for s, ends in inside.items()}
        return np.array(middle), np.array([halves.get(s, 1.0) for s in states])

    def _matrix(self, sizes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the derivatives of the rates by the states, by differences over the sizes of these."""
        middle = self._places[0]
        columns = [
            (self._field(0.0, middle + step) - self._field(0.0, middle - step)) / (2.0 * size)
            for step, size in zip(np.diag(sizes), sizes, strict=True)
        ]
        return np.array(columns).T

    @cached_property
    def time(self) -> float:
        """The time in which a phase goes on by 1, of the excitation or of the middle rate; 0 if none."""
        period = self.evaluator.period(self.params) or self._between_ticks
        if period:
            return period / math.tau
        matrix = self._matrix(self._places[1])
        if not np.isfinite(matrix).all():
            return 0.0
        rates = np.abs(np.linalg.eigvals(matrix))
        rate = float(np.median(rates)) or float(rates.max())
        return 1.0 / rate if rate > 0.0 else 0.0

    @property
    def _between_ticks(self) -> float:
        """The period of the clock of a model; 0 if it has none."""
        ticks = (s for s in self.evaluator.description.surfaces if s.observable == CLOCK)
        levels = [self.evaluator.value(s.level, self.params) for s in ticks]
        return max(levels, default=0.0)

    @cached_property
    def sizes(self) -> dict[str, float]:
        """How far forces move each state; 0 where they do not, or where that is not known.

        It is the response at ``s = (1 + i)/time``: in resonance, and without damping, it is bounded.
        """
        states = self.evaluator.description.states
        n, step = len(states), math.tau / _PHASES * self.time
        middle, sizes = self._places
        force = np.max(np.abs([self._field(k * step, middle) for k in range(_PHASES)]), axis=0)
        response, said = np.zeros(n), np.array([s in self.regions for s in states])
        for _ in range(_PASSES):
            system = (1.0 + 1.0j) * np.eye(n) - self.time * self._matrix(sizes)
            scaled = system * sizes / sizes[:, None]
            if not (np.isfinite(scaled).all() and np.isfinite(force).all()):
                return {}
            try:
                response = np.abs(np.linalg.solve(scaled, self.time * force / sizes)) * sizes
            except np.linalg.LinAlgError:
                return {}
            sizes = np.where((response > 0.0) & ~said, response, sizes)
        return dict(zip(states, response.tolist(), strict=True))
