"""A description evaluated at points, in numbers of any kind: what needs no compiled code."""

from __future__ import annotations

import ast
import math
import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from contfric.base.attributes import kept
from contfric.models.entries import EntryError
from contfric.models.language.grammar import FLOATS, PERIOD, TIME, Algebra, parse
from contfric.models.language.python_code import Function, function_of

if TYPE_CHECKING:
    from contfric.models.described.description import Description

T = TypeVar("T")

#: Points that sides and identities are judged by: enough that a coincidence is no explanation.
_TRIES, _STEPS = 400, 30
#: A state is on a surface where the observable differs by less than this, relative to 1.
_ON = 1e-12
#: Central differences: the cube root of the rounding error.
_DIFFERENCE = 6e-6
#: Near a surface: far beyond rounding, and nothing against a rate that matters.
_NEARBY = 1e-9


@dataclass(frozen=True, eq=False)
class Evaluator(Generic[T]):
    """Fields, observables and levels of a description in an algebra."""

    description: Description
    algebra: Algebra[T]

    @cached_property
    def _observable(self) -> dict[str, str]:
        return {o.name: o.formula for o in self.description.observables}

    @cached_property
    def _fields(self) -> dict[str, tuple[str, ...]]:
        return {m.name: m.field for m in self.description.modes}

    @cached_property
    def _surface(self) -> dict[str, tuple[str, str]]:
        return {s.name: (s.observable, s.level) for s in self.description.surfaces}

    def value(
        self, text: str, params: Mapping[str, T], t: T | None = None, y: Sequence[T] = (), **more: T
    ) -> T:
        """Return the value of any expression; ``more`` are names that the model does not have."""
        values = dict(params) | more
        if t is not None:
            values[TIME] = t
        values.update(zip(self.description.states, y, strict=False))
        return self.description.names.scope(self.algebra, values).evaluate(self._tree(text))

    @kept
    def _tree(self, text: str) -> ast.expr:
        return parse(text)

    def formula_of(self, observable: str) -> str:
        """Return the expression of an observable."""
        return self._observable[observable]

    def rates_of(self, mode: str) -> tuple[str, ...]:
        """Return the expressions of the rates of all states in a mode."""
        return self._fields[mode]

    def observable(self, name: str, params: Mapping[str, T], t: T, y: Sequence[T]) -> T:
        """Return the value of an observable."""
        return self.value(self._observable[name], params, t, y)

    @kept
    def _function(self, text: str) -> Function:
        """Return an expression as a function of ordinary numbers."""
        return function_of(self.description.names, text)

    def height(self, surface: str, params: Mapping[str, T], t: T, y: Sequence[T]) -> T:
        """Return (observable - level) of a surface."""
        observable, level = self._surface[surface]
        if self.algebra is FLOATS:
            here: Any = self._function(self._observable[observable])(params, t, y)  # type: ignore[arg-type]
            return here - self._function(level)(params, t, y)  # type: ignore[arg-type,no-any-return]
        above = self.observable(observable, params, t, y)
        return above - self.value(level, params)  # type: ignore[operator,no-any-return]

    @kept
    def moving(self, surface: str) -> tuple[int, ...]:
        """Return which of time (0) and states (from 1) the observable of a surface depends on."""
        observable, _ = self._surface[surface]
        leaves = self.description.names.leaves_of(self._observable[observable])
        names = (TIME, *self.description.states)
        return tuple(i for i, name in enumerate(names) if name in leaves)

    def field(self, mode: str, params: Mapping[str, T], t: T, y: Sequence[T]) -> list[T]:
        """Return the rates of all states in a mode."""
        rates = self._fields[mode]
        if self.algebra is FLOATS:
            return [self._function(rate)(params, t, y) for rate in rates]  # type: ignore[arg-type,misc]
        return [self.value(rate, params, t, y) for rate in rates]

    def period(self, params: Mapping[str, T]) -> T | None:
        """Return the period of the excitation, or None."""
        text = self.description.period
        return self.value(text, params) if text else None

    def image(self, params: Mapping[str, T], t: T, y: Sequence[T], period: T) -> tuple[T, list[T]]:
        """Return time and state under the declared symmetry."""
        images = self.description.symmetry or {}
        states = self.description.states
        lasts = {} if PERIOD in states else {PERIOD: period}
        found = [self.value(images.get(s, s), params, t, y, **lasts) for s in states]
        return self.value(images.get(TIME, TIME), params, t, y, **lasts), found


def floats(description: Description) -> Evaluator[float]:
    """Return the description in ordinary numbers; nan where there is no value."""
    return Evaluator(description, FLOATS)


def defaults(description: Description) -> dict[str, float]:
    """Return the default of every parameter."""
    return {p.name: p.default for p in description.parameters}


def check_period(description: Description) -> None:
    """Refuse a period that is not above 0 at the defaults.

    Raises
    ------
    EntryError
        With the address of the period.
    """
    period = floats(description).value(description.period, defaults(description))
    if not period > 0.0:
        raise EntryError(
            ("period",),
            f"a period is above 0; '{description.period}' is {period:g} at the defaults",
        )


@dataclass(frozen=True, eq=False)
class Sampler:
    """Random states in the region where motion takes place, always the same for the same seed.

    ``scale`` makes the region larger, but for states whose range the model says.
    """

    evaluator: Evaluator[float]
    params: Mapping[str, float]
    seed: int = 1
    scale: float = 1.0

    @cached_property
    def region(self) -> list[tuple[float, float]]:
        """Lowest and highest value of each state: its range, else twice what starts are drawn from."""
        value, description = self.evaluator.value, self.evaluator.description
        found = [abs(value(text, self.params)) for text in description.spread]
        wide = [2.0 * w if 0.0 < w < math.inf else 2.0 for w in found]
        ranges = description.ranges or ((),) * len(wide)
        return [
            (value(ends[0], self.params), value(ends[1], self.params))
            if ends
            else (-w * self.scale, w * self.scale)
            for w, ends in zip(wide, ranges, strict=True)
        ]

    def states(self, count: int) -> Iterator[tuple[float, list[float]]]:
        """Yield times and states."""
        draw = random.Random(self.seed)
        span = self.evaluator.period(self.params) or 10.0
        for _ in range(count):
            yield draw.uniform(0.0, span), [draw.uniform(*ends) for ends in self.region]

    def on(
        self, surface: str, sides: Mapping[str, int], most: int, tries: int = _TRIES
    ) -> Iterator[tuple[float, list[float]]]:
        """Yield up to ``most`` times and states on a surface, on the given sides of others."""
        found = 0
        for t, y in self.states(tries):
            landed = self.landed(surface, t, y)
            if landed is None or self.sides(*landed, sides) != dict(sides):
                continue
            yield landed
            found += 1
            if found == most:
                return

    def sides(self, t: float, y: Sequence[float], surfaces: Iterable[str]) -> dict[str, int]:
        """Return the sides of some surfaces that a state is on."""
        found = {}
        for name in surfaces:
            above = self.evaluator.height(name, self.params, t, y)
            found[name] = 0 if abs(above) <= _ON else 1 if above > 0 else -1
        return found

    def landed(
        self, surface: str, t: float, y: Sequence[float]
    ) -> tuple[float, list[float]] | None:
        """Return a time and state on a surface, near others: Newton's method along the gradient.

        The time moves only if the surface does not depend on the state.
        """
        state = list(y)
        for _ in range(_STEPS):
            above = self.evaluator.height(surface, self.params, t, state)
            slope = self.gradient(surface, t, state)
            if abs(above) <= _ON:
                return t, state
            if any(slope[1:]):
                slope[0] = 0.0
            square = sum(g * g for g in slope)
            if not 0.0 < square < math.inf or not abs(above) < math.inf:
                return None
            t -= above * slope[0] / square
            state = [s - above * g / square for s, g in zip(state, slope[1:], strict=True)]
        return None

    def gradient(self, surface: str, t: float, y: Sequence[float]) -> list[float]:
        """Return the derivatives of an observable by time and state, by differences."""
        point = [t, *y]
        found = [0.0] * len(point)
        for i in self.evaluator.moving(surface):
            ahead, behind = list(point), list(point)
            ahead[i] += _DIFFERENCE
            behind[i] -= _DIFFERENCE
            up = self.evaluator.height(surface, self.params, ahead[0], ahead[1:])
            down = self.evaluator.height(surface, self.params, behind[0], behind[1:])
            found[i] = (up - down) / (2 * _DIFFERENCE)
        return found

    def rate(self, mode: str, surface: str, side: int, t: float, y: Sequence[float]) -> float:
        """Return the rate at which a mode moves off a surface, upwards, just next to it.

        The field is that of the side: on the surface itself ``sign`` would be 0.
        """
        slope = self.gradient(surface, t, y)
        size = math.sqrt(sum(g * g for g in slope)) or 1.0
        nearby = [a + side * _NEARBY * g / size for a, g in zip((t, *y), slope, strict=True)]
        velocity = [1.0, *self.evaluator.field(mode, self.params, nearby[0], nearby[1:])]
        return sum(g * v for g, v in zip(slope, velocity, strict=True))
