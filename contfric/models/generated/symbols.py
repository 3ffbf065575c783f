"""The formulas of a described model, in symbols: fields, observables, levels, resets; and which are affine.

This module imports sympy; it is loaded when a model is built for the first time.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import sympy

from contfric.base.yaml_lines import Address
from contfric.errors import ModelError
from contfric.models.described.description import Description
from contfric.models.described.regions import engine_order, known_sides
from contfric.models.entries import EntryError
from contfric.models.functions import as_text
from contfric.models.generated.affine import AffineForm, affine_form
from contfric.models.language.formulas import FORMULAS, formula, resolved
from contfric.models.language.grammar import TIME, parse
from contfric.models.language.not_affine import NotAffineError


class Formulas:
    """The formulas of a description, in the symbols t, s0 ... and p0 ..."""

    def __init__(self, description: Description) -> None:
        self.description = description
        self.surfaces = engine_order(description)
        self.t = sympy.Symbol("t")
        self.y = sympy.symbols(f"s:{len(description.states)}")
        self.p = sympy.symbols(f"p:{len(description.parameters)}")
        names = [TIME, *description.states, *(p.name for p in description.parameters)]
        values = dict(zip(names, (self.t, *self.y, *self.p), strict=True))
        self._scope = description.names.scope(FORMULAS, values)
        for name, text in description.define:
            self.read(("define", name), text)

    def read(self, address: Address, text: str) -> Any:
        """Return one expression as a formula."""
        try:
            return formula(parse(text), self._scope)
        except EntryError:
            raise
        except ModelError as error:
            raise EntryError(address, str(error)) from None

    @property
    def moving(self) -> tuple[Any, ...]:
        """Time and states: all that changes along a solution."""
        return (self.t, *self.y)

    @cached_property
    def _named(self) -> dict[Any, Any]:
        """States and parameters by the names that expressions have for them."""
        names = (*self.description.states, *(p.name for p in self.description.parameters))
        return dict(zip((*self.y, *self.p), map(sympy.Symbol, names), strict=True))

    def text(self, formula: Any) -> str:
        """Return a formula as an expression of the model."""
        return as_text(formula.xreplace(self._named))

    @property
    def defaults(self) -> dict[Any, float]:
        """The parameters with their defaults."""
        return {p: q.default for p, q in zip(self.p, self.description.parameters, strict=True)}

    def observables(self) -> list[Any]:
        """Return the formula of each observable."""
        return [self.read(("observables", o.name), o.formula) for o in self.description.observables]

    def levels(self) -> list[Any]:
        """Return the level of each surface, in the order of the description."""
        return [
            self.read(("surfaces", s.name, "level"), s.level) for s in self.description.surfaces
        ]

    def heights(self) -> dict[str, Any]:
        """Return the height above each surface: its observable less its level."""
        names = (o.name for o in self.description.observables)
        seen = dict(zip(names, self.observables(), strict=True))
        pairs = zip(self.description.surfaces, self.levels(), strict=True)
        return {surface.name: seen[surface.observable] - level for surface, level in pairs}

    def period(self) -> Any:
        """Return the period, or 0."""
        return self.read(("period",), self.description.period or "0")

    @cached_property
    def fields(self) -> list[list[Any]]:
        """The field of each piece of each mode, without the kinks that the piece does not see."""
        observables = {
            o.name: f for o, f in zip(self.description.observables, self.observables(), strict=True)
        }
        found, moving, heights = [], self.moving, self.heights()
        for mode, bits in itertools.product(self.description.modes, self.pieces):
            signs = {
                observables[name]: bit
                for name, bit in zip(self.description.kinks, bits, strict=True)
            }
            known = known_sides(mode, self.surfaces)
            for name, above in heights.items():
                side = known.get(name, 0)
                if side != 0 and not above.is_number:
                    signs[above] = side
            found.append(
                [
                    resolved(self.read(("modes", mode.name, "field", state), rate), signs, moving)
                    for state, rate in zip(self.description.states, mode.field, strict=True)
                ]
            )
        return found

    def affine(self, formulas: list[Any]) -> list[AffineForm] | str:
        """Return formulas as affine forms, or why one of them is not affine."""
        states, found = self.description.states, []
        for i, f in enumerate(formulas):
            try:
                found.append(affine_form(f, self.t, self.y, states))
            except NotAffineError as error:
                what = f"the rate of {states[i]}: " if len(formulas) == len(states) else ""
                return f"{what}{error}"
        return found

    def affine_fields(self) -> list[list[AffineForm] | str]:
        """Return the field of each piece as affine forms, or why it is not affine.

        A model that asks for an implicit method has fast decays, along which a series takes many steps.
        """
        method = self.description.method
        if method != "explicit":
            return [f"the model asks for the method '{method}'" for _ in self.fields]
        return [self.affine(field) for field in self.fields]

    @property
    def pieces(self) -> list[tuple[int, ...]]:
        """Signs of the kinks in each piece of a mode, in the order of their bits."""
        count = len(self.description.kinks)
        return [
            tuple(1 if piece >> k & 1 else -1 for k in range(count)) for piece in range(1 << count)
        ]

    def rate(self, formula: Any, field: Sequence[Any]) -> Any:
        """Return the rate of a formula of time and states along a field."""
        pairs = zip(self.y, field, strict=True)
        return sympy.expand_mul(formula.diff(self.t)) + sum(formula.diff(s) * f for s, f in pairs)

    def rates(self) -> list[list[Any]]:
        """Return the rate of each observable along each piece of each mode."""
        observables = self.observables()
        return [[self.rate(o, field) for o in observables] for field in self.fields]

    def projections(self) -> list[list[Any]]:
        """Return the state on the surfaces that each mode moves on, near a state: one Newton step.

        A mode that slides forgets what its start has off its surfaces.
        """
        found, heights = [], self.heights()
        for mode in self.description.modes:
            on = [above for name, above in heights.items() if mode.sides.get(name) == 0]
            pairs = zip(self.y, step_off(on, self.y), strict=True)
            found.append([sympy.expand(s - b) for s, b in pairs])
        return found

    def scales(self) -> list[Any]:
        """Return the natural size of each state: its spread."""
        return [
            self.read(("spread", state), text)
            for state, text in zip(self.description.states, self.description.spread, strict=True)
        ]

    def positive(self) -> list[int]:
        """Return the states that are never negative, and may become as small as they like.

        Their range begins at 0, and in some mode they stay 0 where they are 0 together, as the infected and
        the infectious do. A state that is driven away from 0 (a speed, the current of a coil) is not small
        for long, and no share of it is known where it begins at 0.
        """
        states, ranges = self.description.states, self.description.ranges
        lowest = [
            self.read(("spread", state), ends[0]) if ends else None
            for state, ends in zip(states, ranges or ((),) * len(states), strict=True)
        ]
        from_0 = {k for k, low in enumerate(lowest) if low is not None and low == 0}
        if not from_0:
            return []
        return sorted(set().union(*(self._kept(from_0, field) for field in self.fields)))

    def _kept(self, kept: set[int], field: list[Any]) -> set[int]:
        """Return those of some states that stay 0 in a field where they are 0 together, and else move."""
        while True:
            none = {self.y[k]: sympy.Integer(0) for k in kept}
            left = {k for k in kept if field[k].subs(none) == 0}
            if left == kept:
                return {k for k in kept if field[k] != 0}
            kept = left

    def resets(self) -> list[list[Any]]:
        """Return the map of the state at each surface."""
        found = []
        for surface in self.description.surfaces:
            texts = self.description.resets.get(surface.name, {})
            found.append(
                [
                    self.read(("resets", surface.name, state), texts.get(state, state))
                    for state in self.description.states
                ]
            )
        return found


def step_off(heights: Sequence[Any], states: Sequence[Any]) -> list[Any]:
    """Return how far states lie off the surfaces on which some heights vanish, to first order.

    All at once, the shortest way: surfaces need not be at right angles.
    """
    if not heights:
        return [sympy.Integer(0)] * len(states)
    slopes = sympy.Matrix([[above.diff(s) for s in states] for above in heights])
    return list(slopes.T * (slopes * slopes.T).inv() * sympy.Matrix(heights))


def moves_in_closed_form(description: Description, forms: Sequence[object]) -> bool:
    """Tell whether a mode in which something moves is affine: for rest alone a second flow does not pay."""
    pieces = 1 << len(description.kinks)
    return any(
        not isinstance(form, str) and 0 not in description.modes[i // pieces].sides.values()
        for i, form in enumerate(forms)
    )


def integrated_modes(description: Description) -> dict[str, str]:
    """Return the modes that are not affine, each with the reason."""
    formulas = Formulas(description)
    pieces, found = 1 << len(description.kinks), {}
    forms = formulas.affine_fields()
    for m, mode in enumerate(description.modes):
        reasons = [f for f in forms[m * pieces : (m + 1) * pieces] if isinstance(f, str)]
        if not reasons and not moves_in_closed_form(description, forms):
            reasons = ["closed forms would be those of rest alone"]
        if reasons:
            found[mode.name] = reasons[0]
    return found
