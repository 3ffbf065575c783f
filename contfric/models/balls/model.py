"""A piecewise-affine model at given parameters, in balls.

In a mode the state follows ``y' = A y + b + sum_k (p_k cos(w_k t) + q_k sin(w_k t))``. With the extended
state

    w = (y, 1, cos w_1 t, sin w_1 t, cos w_2 t, ...)

that is ``w' = M w``, so that ``w(t + d) = exp(M d) w(t)``: the flow of every affine mode is one exponential
of a matrix, which Arb encloses. Nothing is divided by, so that resonance (Omega = 1, 1/3), zeta = 0 and
critical damping are ordinary points. Surfaces are rows: ``observable - level = g w``; resets are matrices.

The derivative of all of it by one parameter is a model of the same form (``slopes``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

from flint import arb, arb_mat

from contfric.models.balls.numbers import Vector, numbers

#: A matrix of states; modes and their images; surfaces, their images and the sign of their observables.
Closure = tuple[tuple[float, ...], ...]
Pairs = tuple[tuple[str, str], ...]
SignedPairs = tuple[tuple[str, str, int], ...]


@dataclass(frozen=True, eq=False)
class BallModel:
    """The matrices of a model; or, as ``slopes`` of another, their derivatives by a parameter.

    Attributes
    ----------
    states : int
        Number of states, n.
    frequencies : list of arb
        The frequencies w_k.
    fields : dict
        The matrix M of each mode, shape (D, D), D = n + 1 + 2 len(frequencies).
    surfaces : dict
        The row of each surface, shape (1, D).
    resets : dict
        The map of the extended state at each surface that has one, shape (D, D).
    period : arb
        Period of the excitation, T; 0 without one.
    turns : list of int
        The whole numbers ``w_k T / (2 pi)``.
    slopes : BallModel or None
        Derivatives by the free parameter, if there is one; of a model of slopes the second ones, if they are
        known.
    alike : callable or None
        Returns the surface whose row is the rate of another one along a mode, or its negative, identically in
        the parameters: balls of the two rows do not show it.
    mirrored : callable or None
        Tells whether a symmetry of half a period maps modes, surfaces and resets as it should, identically in
        the parameters: of a closure, of pairs of modes, and of pairs of surfaces with their signs.
    unscaled : dict
        Fields that are these but for a positive factor of the states, and without its rounding; if there are.
    kept : frozenset
        Surfaces and modes that move on them, of which balls of the fields do not show it.
    """

    states: int
    frequencies: list[arb]
    fields: dict[str, arb_mat]
    surfaces: dict[str, arb_mat]
    period: arb
    turns: list[int]
    resets: dict[str, arb_mat] = field(default_factory=dict)
    slopes: BallModel | None = None
    alike: Callable[[str, str], str | None] | None = None
    mirrored: Callable[[Closure, Pairs, SignedPairs], bool] | None = None
    unscaled: dict[str, arb_mat] = field(default_factory=dict)
    kept: frozenset[tuple[str, str]] = frozenset()

    def keeps(self, row: Vector, mode: str) -> bool:
        """Tell whether the rate of an observable vanishes along a mode, exactly."""
        if any(row is self.rows[name] for name, at in self.kept if at == mode):
            return True
        return all(x.is_zero() for x in numbers(arb_mat([row]) * self.fields[mode]))

    @cached_property
    def rows(self) -> dict[str, Vector]:
        """The row of each surface as a list, always the same one: so equal rows are known as such."""
        return {name: numbers(row) for name, row in self.surfaces.items()}

    @cached_property
    def _rates(self) -> dict[tuple[str, str, int], Vector]:
        return {}

    def rate(self, surface: str, mode: str, order: int = 1) -> Vector:
        """Return the row of a derivative of a surface's observable along a mode; always the same list.

        It is by unscaled time, if there is one: it vanishes where that by the time of the model does.
        """
        if order == 0:
            return self.rows[surface]
        key = (surface, mode, order)
        if key not in self._rates:
            below = arb_mat([self.rate(surface, mode, order - 1)])
            self._rates[key] = numbers(below * (self.unscaled or self.fields)[mode])
        return self._rates[key]

    def rate_that_is(self, row: Vector) -> tuple[str, str, int] | None:
        """Return surface, mode and order of the derivative that a list is, if :meth:`rate` returned it."""
        return next((key for key, known in self._rates.items() if known is row), None)

    @property
    def size(self) -> int:
        """Number of entries of the extended state."""
        return self.states + 1 + 2 * len(self.frequencies)

    def extended(self, t: arb, y: Vector) -> Vector:
        """Return the extended state at a time."""
        waves = []
        for w in self.frequencies:
            sine, cosine = (w * t).sin_cos()
            waves += [cosine, sine]
        return [*y, arb(1), *waves]

    def by_time(self, t: arb, order: int) -> Vector:
        """Return a derivative of the extended state by time, of order 1 or more, y held fixed."""
        found = [arb(0)] * (self.states + 1)
        for w in self.frequencies:
            sine, cosine = (w * t).sin_cos()
            for _ in range(order):
                sine, cosine = w * cosine, -w * sine
            found += [cosine, sine]
        return found

    def by_parameter(self, t: arb, order: int) -> Vector:
        """Return the derivative of the extended state by the parameter; of order 1 that of its rate by t."""
        assert self.slopes is not None
        found = [arb(0)] * (self.states + 1)
        for w, dw in zip(self.frequencies, self.slopes.frequencies, strict=True):
            sine, cosine = (w * t).sin_cos()
            if order == 0:
                found += [-dw * t * sine, dw * t * cosine]
            else:
                found += [-dw * (sine + w * t * cosine), dw * (cosine - w * t * sine)]
        return found
