"""A model's compiled functions as plain Python functions, at one set of parameters."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.attributes import kept
from contfric.models.definition import Model
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.view import FlowView

if TYPE_CHECKING:
    from contfric.models.generated.symbols import Formulas

#: Newton's method onto a surface: it converges in a few steps or not at all.
_STEPS = 30
#: Of 17,700 starts that came to a surface none took more than 4 steps that led farther away from it; of those
#: that came to none all took 7 or more.
_FARTHER = 6
#: A step of no more than this share of a number is lost in its rounding.
_STILL = 2.0**-53
#: On a surface: rounding of an observable of size 1.
ON = 1e-12
#: Modes up to which each is looked at in as many states as one mode alone is.
FEW_MODES = 9

T = TypeVar("T")
#: A time and a state.
Place = tuple[float, FloatArray]


def field_of(model: Model) -> Any:
    """Return the compiled field of the modes of a model, without the flow, which takes longer.

    It is that of the flow's own definition, without names and titles: another text is another module. Modes
    that are made when they are visited have theirs in the flow that grows with them.
    """
    from contfric.models.generated.build import GeneratedFlow, load_module
    from contfric.models.generated.table_flow import coded_flow

    if isinstance(model, ComposedModel):
        return model.coded.field
    flow = model.flow_factory
    definition = flow.definition if isinstance(flow, GeneratedFlow) else model.definition
    found = coded_flow(definition)
    return load_module(definition).field_of if found is None else found.field


class _Region(NamedTuple):
    """Surfaces that a mode moves on, surfaces that it knows, and the sides of these in its domains."""

    on: tuple[str, ...]
    known: tuple[str, ...]
    sides: set[tuple[int, ...]]


@dataclass(frozen=True, eq=False)
class Probe:
    """Values and gradients at single states.

    Gradients are by time, then by state; fields that are not generated come from the flow over no time.
    """

    model: Model
    params: Mapping[str, float]
    seed: int = 1

    @cached_property
    def vector(self) -> FloatArray:
        """The parameters as the engine has them."""
        return self.model.vector(self.params)

    @cached_property
    def flow(self) -> FlowView:
        """The model's flow at these parameters."""
        return self.model.view(self.vector)

    @cached_property
    def formulas(self) -> Formulas | None:
        """The formulas of a model that is declared by its equations (loads sympy)."""
        from contfric.models.generated.symbols import Formulas

        return Formulas(self.model.description) if self.model.definition else None

    @property
    def period(self) -> float:
        """Period of the excitation; 0 without one."""
        return self.flow.period

    def share(self, states: int) -> int:
        """Return in how many states each mode is looked at: of many modes in fewer."""
        return max(1, states * FEW_MODES // max(FEW_MODES, len(self.model.modes)))

    def height(self, surface: str, t: float, y: FloatArray) -> float:
        """Return (observable - level) of a surface."""
        observable = self.model.surface_by_name[surface].observable
        return self.flow.observe(observable, t, y) - self._levels[surface]

    @cached_property
    def _levels(self) -> dict[str, float]:
        return {s.name: self.flow.level(s.name) for s in self.model.surfaces}

    @cached_property
    def _regions(self) -> dict[str, _Region]:
        """The surfaces that each mode moves on, those that bound it, and their sides in its domains.

        A mode that is made when it is visited knows the surfaces of its own contacts only.
        """
        order = [s.name for s in self.model.surfaces]
        found: dict[str, _Region] = {}
        for domain in self.model.domains:
            on = tuple(name for name, side in domain.signs.items() if side == 0)
            known = tuple(name for name in order if name in domain.signs)
            region = found.setdefault(domain.own_mode, _Region(on, known, set()))
            region.sides.add(tuple(domain.signs[name] for name in known))
        return found

    def is_in(self, mode: str, signs: Mapping[str, int]) -> bool:
        """Tell whether the sides of all surfaces are those of a domain of a mode."""
        region = self._regions[mode]
        return tuple(signs[name] for name in region.known) in region.sides

    def slope(self, surface: str, t: float, y: FloatArray) -> FloatArray:
        """Return the gradient of a surface's observable, shape (1 + n,)."""
        return self.flow.gradient(self.model.surface_by_name[surface].observable, t, y)

    def rate(self, mode: str, surface: str, t: float, y: FloatArray) -> float:
        """Return the rate of a surface's observable along a mode."""
        return self.flow.rate(mode, self.model.surface_by_name[surface].observable, t, y)

    def field(self, mode: str, t: float, y: FloatArray) -> FloatArray:
        """Return the rates of all states in a mode."""
        n = len(y)
        if self.model.definition:  # without the flow, which takes much longer to compile
            out, field = np.empty(n), field_of(self.model)
            m, none = self.model.mode_index[mode], np.empty(0, dtype=np.int64)
            field(m, t, y, self.vector, none, out, np.empty((0, 0)))
            return out
        return self.flow.jacobian(mode, t, y, 0.0)[:, 1 + n].copy()

    def slopes(self, mode: str, t: float, y: FloatArray) -> FloatArray:
        """Return the derivatives of these rates by time and by state, shape (n, 1 + n), from the formulas."""
        n = len(y)
        out, jac = np.empty(n), np.empty((n, 1 + n))
        m, none = self.model.mode_index[mode], np.empty(0, dtype=np.int64)
        field_of(self.model)(m, t, y, self.vector, none, out, jac)
        return jac

    def reset(self, surface: str, t: float, y: FloatArray) -> FloatArray:
        """Return the state after the reset at a surface."""
        return self.flow.reset(surface, t, y)

    def states(self, count: int) -> Iterator[Place]:
        """Yield times in one period and states in twice the region that starts are drawn from."""
        for t, y in self._drawn.first(count):
            yield t, y.copy()

    @cached_property
    def _drawn(self) -> Prefix[Place]:
        """What is drawn, always the same."""
        draw, period = random.Random(self.seed), self.period or 10.0
        region = np.column_stack(self.model.region(self.vector, 2.0)).tolist()
        return Prefix(
            (draw.uniform(0.0, period), np.array([draw.uniform(*ends) for ends in region]))
            for _ in itertools.count()
        )

    def on(self, surface: str, count: int) -> Iterator[Place]:
        """Yield times and states on a surface, near so many states."""
        return self.on_all((surface,), count)

    def on_all(self, surfaces: tuple[str, ...], count: int) -> Iterator[Place]:
        """Yield times and states on some surfaces, near so many states."""
        yield from _copied(self._on(surfaces).first(count))

    @kept
    def _on(self, surfaces: tuple[str, ...]) -> Prefix[Place | None]:
        """Return what is found on some surfaces near the first states, each asked for once."""
        return Prefix(self.landed(surfaces, t, y.copy()) for t, y in self._drawn.first())

    @kept
    def _inside(self, mode: str) -> Prefix[Place | None]:
        """Return the same inside of a mode."""
        return Prefix(self.inside(mode, t, y.copy()) for t, y in self._drawn.first())

    def places(self, mode: str, drawn: int, most: int | None = None) -> Iterator[Place]:
        """Yield places of a mode, at most so many, near states of which so many are drawn."""
        yield from itertools.islice(_copied(self._inside(mode).first(drawn)), most)

    def shown(self, t: float, y: FloatArray) -> str:
        """Return a time and a state in words; no time where nothing depends on it."""
        values = ", ".join(f"{s} = {v:.6g}" for s, v in zip(self.model.states, y, strict=True))
        return values if self.model.autonomous else f"t = {t:.6g}, {values}"

    def inside(self, mode: str, t: float, y: FloatArray) -> Place | None:
        """Return a state of a mode near a state: on the surfaces that it moves on; None if outside.

        None as well where a formula has no value, such as a root of a negative level.
        """
        place = self.in_region(mode, t, y)
        return place if place is not None and self.is_defined(mode, *place) else None

    def in_region(self, mode: str, t: float, y: FloatArray) -> Place | None:
        """Return a state of a mode near a state, whether its field has a value there or not."""
        on = self._regions[mode].on
        place = self.landed(on, t, y) if on else (t, y)
        if place is None:
            return None
        signs = {**self.signs(*place), **dict.fromkeys(on, 0)}
        return place if self.is_in(mode, signs) else None

    def is_defined(self, mode: str, t: float, y: FloatArray) -> bool:
        """Tell whether the field of a mode and all observables have values at a state."""
        observed = [self.flow.observe(name, t, y) for name in self.model.observable_index]
        return bool(np.all(np.isfinite(self.field(mode, t, y))) and np.all(np.isfinite(observed)))

    def landed(self, surfaces: tuple[str, ...], t: float, y: FloatArray) -> Place | None:
        """Return a time and state on some surfaces near others; the time moves only if it must."""
        point, last, farther = np.array([t, *y]), math.inf, 0
        for _ in range(_STEPS):
            above = np.array([self.height(s, point[0], point[1:]) for s in surfaces])
            distance = float(np.abs(above).max(initial=0.0))
            if distance <= ON:
                return float(point[0]), point[1:]
            farther, last = farther + (not distance < last), distance
            slopes = np.array([self.slope(s, point[0], point[1:]) for s in surfaces])
            if farther > _FARTHER or not (math.isfinite(distance) and np.isfinite(slopes).all()):
                return None
            step, rank = _shortest(slopes[:, 1:], above)
            step = np.array([0.0, *step])
            if rank < len(surfaces):
                step, _ = _shortest(slopes, above)
            if np.all(np.abs(step) <= _STILL * np.abs(point)):
                return None  # the nearest place to surfaces that do not meet
            point = point - step
        return None

    def signs(self, t: float, y: FloatArray) -> dict[str, int]:
        """Return the side of every surface that a state is on."""
        found, values = {}, dict[str, float]()
        for surface in self.model.surfaces:
            if surface.observable not in values:
                values[surface.observable] = self.flow.observe(surface.observable, t, y)
            above = values[surface.observable] - self._levels[surface.name]
            found[surface.name] = 0 if abs(above) <= ON else int(math.copysign(1, above))
        return {**found, **self.model.fixed_sides}


class Prefix(Generic[T]):
    """The first elements of an endless iterator, each computed once."""

    def __init__(self, elements: Iterator[T]) -> None:
        self._elements = elements
        self._known: list[T] = []

    def first(self, count: int | None = None) -> Iterator[T]:
        """Yield the first elements, or all of them."""
        for k in itertools.count() if count is None else range(count):
            if k == len(self._known):
                self._known.append(next(self._elements))
            yield self._known[k]


def _copied(places: Iterable[Place | None]) -> Iterator[Place]:
    """Yield copies of the places that there are."""
    return ((place[0], place[1].copy()) for place in places if place is not None)


def _shortest(slopes: FloatArray, heights: FloatArray) -> tuple[FloatArray, int]:
    """Return the shortest x of those for which ``slopes @ x`` is nearest to heights, and the rank."""
    if len(heights) == 1:  # without a decomposition, in a tenth of the time
        length = math.hypot(*slopes[0])
        unit = slopes[0] / (length or 1.0)
        return unit * (heights[0] / (length or 1.0)), int(length > 0.0)
    found, _, rank, _ = np.linalg.lstsq(slopes, heights, rcond=None)
    return np.asarray(found), int(rank)
