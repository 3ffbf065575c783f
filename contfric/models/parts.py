"""The parts of a model's definition: parameters, observables, surfaces, modes, domains, resets, symmetry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from contfric.base.arrays import FloatArray


@dataclass(frozen=True)
class Parameter:
    """A real parameter: its name, default value and meaning (nondimensional)."""

    name: str
    default: float
    meaning: str


@dataclass(frozen=True)
class Constraint:
    """A linear inequality ``constant + sum(c * p) >= 0`` (``> 0`` if strict) that parameters obey."""

    text: str
    coefficients: Mapping[str, float]
    strict: bool = False
    meaning: str = ""
    constant: float = 0.0

    def value(self, params: Mapping[str, float]) -> float:
        """Return the left-hand side of the inequality."""
        return self.constant + sum(c * params[name] for name, c in self.coefficients.items())


@dataclass(frozen=True)
class Observable:
    """A scalar function of time and state whose level sets are surfaces."""

    name: str
    formula: str


@dataclass(frozen=True)
class Surface:
    """A level set of an observable; ``switching`` if solutions are cut there, as the field changes.

    A switching surface has another mode on each side. Where their fields agree everywhere it is a section,
    which is not switching.
    """

    name: str
    observable: str
    level: str
    switching: bool = False


#: Sides are the bits of one signed number of 64. Surfaces after these, which come as solutions visit their
#: modes, have none: no rule asks for their sides, and nothing lies on them.
MOST_SURFACES = 62


@dataclass(frozen=True)
class Mode:
    """One smooth vector field.

    ``rank`` is the number of independent directions that survive it (a stick keeps one of two:
    one multiplier becomes exactly zero); ``sliding`` says that solutions stay on a surface; ``derived``
    that nobody wrote the mode: it follows from the fields on both sides of its surface.
    """

    name: str
    rank: int
    sliding: bool = False
    derived: bool = False


@dataclass(frozen=True)
class Domain:
    """A region of one mode: the sign of (observable - level) for every surface, 0 = on it.

    ``declared`` is the mode as it was declared, where that is one with others
    (:mod:`contfric.models.deriving.sections`).
    """

    name: str
    mode: str
    signs: Mapping[str, int]
    label: str = ""
    declared: str = ""

    @property
    def own_mode(self) -> str:
        """The mode that the model declares for this region."""
        return self.declared or self.mode


@dataclass(frozen=True)
class Lead:
    """A mode that a reset leads into.

    From images on some sides of surfaces, on any if it names none; and from some modes, from all likewise.
    """

    mode: str
    where: Mapping[str, int]
    after: tuple[str, ...] = ()


def led(landed: Sequence[Domain], leads: Sequence[Lead], before: str) -> list[Domain]:
    """Return the domains after a reset: of modes that overlap there the first that it leads into.

    A mode that it names is preferred to sliding on a surface next to it. Where it leads into none of them,
    the mode before it goes on.
    """
    found = list(landed)
    for lead in (*leads, Lead(before, {})):
        if lead.after and before not in lead.after:
            continue
        kept = [
            d.signs
            for d in found
            if d.own_mode == lead.mode and all(d.signs[s] == v for s, v in lead.where.items())
        ]
        nearby = kept if lead.mode != before else []
        found = [
            d
            for d in found
            if d.own_mode == lead.mode
            or not (d.signs in kept or any(_is_next_to(d.signs, signs) for signs in nearby))
        ]
    return found


def across(
    landed: Sequence[Domain], surface: str, modes: Set[str], domains: Sequence[Domain]
) -> list[Domain]:
    """Return the domains on the other side of a surface that an image lies on, in modes that hold on both.

    The surface is a label there: solutions may go on to either side.
    """
    turned = [
        (d.own_mode, {**d.signs, surface: -d.signs[surface]})
        for d in landed
        if d.own_mode in modes and d.signs[surface]
    ]
    return [d for d in domains if d not in landed and (d.own_mode, d.signs) in turned]


def _is_next_to(sliding: Mapping[str, int], signs: Mapping[str, int]) -> bool:
    """Return whether a region lies next to what slides on one of its surfaces."""
    return all(side in (0, signs[surface]) for surface, side in sliding.items())


@dataclass(frozen=True)
class Departure:
    """Where a state at rest on a switching surface cannot stay, and the side it leaves to."""

    where: Mapping[str, int]
    leaves: Mapping[str, int]


#: The side of a surface to which some images leave it, others to the other one: a kick against the velocity.
EITHER = 2


@dataclass(frozen=True)
class Reset:
    """A map of the state where it meets a surface, ``y+ = R(t, y; p)``: an impact, a switch, a firing.

    The flow has the map (:data:`contfric.compiled.reset_signature`). The state after it is on the surface
    still (an impact on a wall, or through the surface), on another one, or on none.

    Attributes
    ----------
    surface : the surface, not switching
    formula : the map, for the reader
    changes : observables whose values the map changes; the domains that can follow are those that differ in
        the signs of these
    lands : surfaces that every image lies on, and the side to which solutions leave them. For the reset's own
        surface that is +1 where it goes back (a wall), -1 where it passes. 0 where it goes on sliding there,
        :data:`EITHER` where the domain after it tells the side
    ways : domains in which images leave the surfaces that they lie on; empty if their sides are known
    leads : the modes after the reset, the first that holds; else the mode before it where that holds, or
        another one
    modes : modes in which it acts; by default (empty) those that lie on one side of the surface
    wraps : whether it takes an angle back by a turn, which is nothing to the solution: it bounds nothing
    """

    surface: str
    formula: str
    changes: tuple[str, ...] = ()
    lands: Mapping[str, int] = field(default_factory=dict)
    leads: tuple[Lead, ...] = ()
    modes: tuple[str, ...] = ()
    wraps: bool = False
    ways: frozenset[str] = frozenset()

    @property
    def sides(self) -> dict[str, int]:
        """The sides to which all images leave the surfaces that they lie on."""
        return {surface: side for surface, side in self.lands.items() if side != EITHER}

    @property
    def chooses_by(self) -> set[str]:
        """Surfaces on whose sides it depends which mode it leads into: across them the map jumps."""
        return {surface for lead in self.leads for surface in lead.where}

    @property
    def stays(self) -> bool:
        """Whether the image lies on the surface of the reset."""
        return self.surface in self.lands


@dataclass(frozen=True)
class Chatter:
    """Infinitely many impacts in finite time, and the contact after them, as one mode of its own.

    Attributes
    ----------
    surface : the wall, which has a reset
    mode, flight : the mode, and that in which the impacts are
    lift : surface (and observable) of the gap's acceleration in flight, which vanishes where the wall lets go
    other, other_lift : the same on the other side of a surface that impacts pass, as a block that rocks
    """

    surface: str
    mode: str
    flight: str
    lift: str
    other: str = ""
    other_lift: str = ""

    @property
    def ways(self) -> tuple[tuple[str, str], ...]:
        """The ways out of the contact: (surface that is met, flight that follows)."""
        both = (self.lift, self.flight), (self.other_lift, self.other)
        return both if self.other else both[:1]


@dataclass(frozen=True)
class Symmetry:
    """The map ``(t, y) -> (t + fraction * T, matrix @ y)`` that takes solutions to solutions.

    Of an autonomous model it is a map of states only, and the fraction means nothing.
    ``surfaces`` names the image of each surface; the sign of (observable - level) is reversed, but for
    those in ``kept``, such as the tick of a clock. ``modes`` names the modes whose field is the image of
    that of a mode: where modes overlap, the sides of the surfaces do not tell which one it is.
    """

    matrix: tuple[tuple[float, ...], ...]
    fraction: float
    surfaces: Mapping[str, str]
    kept: frozenset[str] = frozenset()
    modes: Mapping[str, frozenset[str]] = field(default_factory=dict)

    def sense(self, surface: str) -> int:
        """Return what the sign of a surface is multiplied by at the image."""
        return 1 if surface in self.kept else -1

    def array(self) -> FloatArray:
        """Return the state matrix, shape (n, n); not to be changed."""
        return self._array

    @cached_property
    def _array(self) -> FloatArray:
        found: FloatArray = np.array(self.matrix, dtype=np.float64)
        found.flags.writeable = False
        return found
