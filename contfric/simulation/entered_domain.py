"""The domain that a solution goes into from a state on surfaces, such as a joint of an orbit.

A joint lies on its surfaces to rounding: which sides it is on says nothing. The solution is in a domain
if that is on the sides of all other surfaces, and the solution of its mode keeps to its side of those that
the state is on. The side is that of the first change of the observable that is more than rounding, so
that a surface may be left with its rate, or with the second or third power of time.

Where several domains hold, one that stays on the surfaces comes first: at rest within the limits of the
static force the solution does not go on. A solution that would stand on the boundary of its domain (rest
whose load stays at its limit) is the last choice, after what the signs say as they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.base.attributes import kept
from contfric.models.definition import Domain, Model, Surface
from contfric.models.deriving.growing_model import ComposedModel
from contfric.models.mode_domains import cut_bounds
from contfric.models.view import FlowView
from contfric.simulation.time_scale import clock_period, time_scale

#: A state lies on a surface within this share of what its observable is summed up from: what evaluating it
#: may be off by. Nearer than that its sides are rounding; farther away they are what was given, even if the
#: surface is met in no time.
_ON = 16.0 * float(np.finfo(float).eps)
#: Shares of a period after which it is asked to which side an observable has moved, and the change that
#: counts, against the same: a hundred roundings. Steps are as short as the change allows.
_STEPS, _MOVED = tuple(10.0**k for k in range(-8, -2)), 2e-14


@dataclass(frozen=True, eq=False)
class StartState:
    """A state at a time, and the surfaces that it lies on."""

    model: Model
    t: float
    y: FloatArray
    vector: FloatArray

    @cached_property
    def _view(self) -> FlowView:
        return self.model.view(self.vector)

    @cached_property
    def heights(self) -> dict[str, float]:
        """How far the state is above each surface that there is by now."""
        return {surface.name: self._height(surface) for surface in self.model.surfaces}

    @kept
    def _observed(self, observable: str) -> float:
        return self._view.observe(observable, self.t, self.y)

    @kept
    def _terms(self, observable: str) -> float:
        """Return how large the terms are that an observable is summed up from."""
        return float(np.abs(self._view.gradient(observable, self.t, self.y)) @ self._widths)

    def _height(self, surface: Surface) -> float:
        """Return how far the state is above a surface, one of a mode that was visited just now, too."""
        return self._observed(surface.observable) - self._view.level(surface.name)

    @cached_property
    def _widths(self) -> FloatArray:
        """How large the time and the states are, or are where a solution moves.

        Not more than 1 + the largest state: near a resonance solutions may grow a thousand times larger.
        """
        sizes = np.abs(self.y)
        spread = np.minimum(
            _spread(self.model, self.vector.tobytes()), 1.0 + sizes.max(initial=0.0)
        )
        return np.array([abs(self.t), *(sizes + spread).tolist()])

    @cached_property
    def _unit(self) -> float:
        period = self._view.period
        return period or max(clock_period(self.model, self.vector), time_scale(self.model))

    def _size(self, surface: Surface) -> float:
        """Return what the height over a surface is summed up from: its rounding is relative to that."""
        return abs(self._view.level(surface.name)) + self._terms(surface.observable)

    def lies_on(self, name: str) -> bool:
        """Tell whether the state lies on a surface, but for rounding."""
        surface = self.model.surface_by_name[name]
        return abs(self._height(surface)) <= _ON * self._size(surface)

    def side_ahead(self, mode: str, name: str) -> int:
        """Return the side of a surface that the solution of a mode leads to; 0 if it stays on it."""
        surface = self.model.surface_by_name[name]
        here = self._observed(surface.observable)
        least = _MOVED * self._size(surface)
        for step in (share * self._unit for share in _STEPS):
            later = self._view.state(mode, self.t, self.y, step)
            change = self._view.observe(surface.observable, self.t + step, later) - here
            if abs(change) > least:
                return 1 if change > 0.0 else -1
        return 0

    def left_by(self, domain: Domain) -> str:
        """Return a surface that the state lies on and the solution of a domain leaves it by; "" if none."""
        for name, side in self._met(domain):
            if self.side_ahead(domain.mode, name) == -side:
                return name
        return ""

    def stands(self, domain: Domain) -> bool:
        """Tell whether the solution of a domain stays on a surface that ends it, as at an equilibrium."""
        return any(not self.side_ahead(domain.mode, name) for name, _ in self._met(domain))

    def _met(self, domain: Domain) -> Iterator[tuple[str, int]]:
        """Yield the surfaces that end a domain and that the state lies on, and its side of each."""
        bounds = cut_bounds(self.model)[domain.own_mode]
        for name, side in domain.signs.items():
            if side != 0 and (self.model.cuts(name) or name in bounds) and self.lies_on(name):
                yield name, side


@lru_cache(maxsize=64)
def _spread(model: Model, vector: bytes) -> FloatArray:
    """Return the natural sizes of the states; many starts are tried at the same parameters."""
    return np.abs(model.spread(model.mapping(np.frombuffer(vector))))


def entered_domain(
    start: StartState, signs: Mapping[str, int], standing: bool = False
) -> str | None:
    """Return the domain that the solution goes into; None if none is found, or the state is on no surface.

    Parameters
    ----------
    signs : sides of all surfaces, 0 of those that the state lies on
    standing : whether it may stand on the boundary of the domain
    """
    if 0 not in signs.values():
        return None
    if isinstance(start.model, ComposedModel):
        return _composed(start.model, start, signs)
    likely = (d for d in _likely(start, signs) if not start.left_by(d))
    return next((d.name for d in likely if standing or not start.stands(d)), None)


def _likely(start: StartState, signs: Mapping[str, int]) -> Iterator[Domain]:
    """Yield the domains next to a state, those first that lie on most of its surfaces.

    Chatter is left out: impacts of any speed begin on its wall.
    """
    model = start.model
    first = model.domain_of(signs, start.t, start.y, start.vector)
    if first is not None and model.domain_by_name[first].own_mode not in model.chatter_by_mode:
        yield model.domain_by_name[first]
    near = [
        d
        for d in model.domains
        if d.own_mode not in model.chatter_by_mode
        and all(sign in (0, d.signs[name]) for name, sign in signs.items())
    ]
    yield from sorted(near, key=lambda d: -sum(side == 0 for side in d.signs.values()))


def _composed(model: ComposedModel, start: StartState, signs: Mapping[str, int]) -> str | None:
    """Do the same where modes are made: from one to the next, as long as the solution leaves it at once."""
    name = model.domain_of(signs, start.t, start.y, start.vector)
    for _ in range(2 * len(model.states)):
        if name is None:
            return None
        surface = start.left_by(model.domain_by_name[name])
        if not surface:
            return name
        name = _following(model, start, signs, (name, surface))
    return None


def _following(
    model: ComposedModel, start: StartState, signs: Mapping[str, int], left: tuple[str, str]
) -> str | None:
    """Return the mode that follows where a solution leaves one."""
    if left in model.sections:
        return model.transitions[left]
    composition = model.composition
    if composition.is_solved(*left):
        there = model.mapping(start.vector), start.t, start.y.tolist()
        return model.part_at(composition.after(*left, there), start.t, start.y, start.vector)
    for way in composition.ways(left[0])[left[1]]:
        if all(signs.get(name, 0) in (0, side) for name, side in way.where.items()):
            return model.part_at(way.mode, start.t, start.y, start.vector)
    return None
