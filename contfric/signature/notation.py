"""Signatures: the cyclic list of domains that a periodic orbit visits, and its notation.

A signature is a closed walk on the transition graph of its model; one that is not cannot be
constructed. Two signatures are equal if they differ by a rotation only.
"""

from __future__ import annotations

import re
from collections import ChainMap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from contfric.base.shown import Shown
from contfric.errors import NotationError, number_and, shown
from contfric.models import Model, load_model, model_names
from contfric.signature.cyclic import least_rotation, rotated
from contfric.signature.graph import crossing, successors, unknown_domain
from contfric.signature.holds import TOUCH, hold_at, hold_fault, is_hold, surface_into
from contfric.signature.impacts import (
    impact_at,
    impact_fault,
    is_event,
    is_impact,
    mirror_name,
    stays_on,
    struck_surface,
)

#: Number of segments that a name leaves unsaid: that of the four typical orbits of the reference.
TYPICAL_SEGMENTS = 6

ARROW = "->"
_ARROWS = re.compile(r"->|→")
#: Table 1 of the reference calls the stick by its signs, like every other domain.
_ALIASES = {"x0v0": "stick"}


@dataclass(frozen=True, eq=False, repr=False)
class Signature(Shown):
    """A closed walk through the domains of a model, and how many forcing periods it takes.

    Attributes
    ----------
    model : Model
        The model, or its name; compared by its name.
    segments : tuple of str
        Names of the domains in the order of the visit, or their notation as one text; the last leads back
        to the first. Between two of them may stand a hold (``hold@F+``) or an impact (``impact@wall``),
        or another reset (``reset@tick``).
        The two may be given the other way round, as a signature is printed.
    periods : int
        Number of periods of the excitation.
    symmetric : bool or None
        Whether the orbit is its own mirror image: True for 2s, False for 2a, which has the same
        segments; None if unknown.
    name : str or None
        What it is called; no part of the identity.
    example : mapping or None
        Parameters at which an orbit of this signature is known to exist.

    Raises
    ------
    NotationError
        If the segments are no closed walk, or the other fields contradict each other.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> parse_signature("stick -> x-v+ -> x0v+", load_model("coulomb")).surfaces
    ('F-', 'F-', 'v')
    >>> Signature("stick -> x-v+ -> x0v+", "coulomb").stops
    1
    """

    model: Model
    segments: tuple[str, ...]
    periods: int = 1
    symmetric: bool | None = None
    name: str | None = None
    example: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        model, segments = _read_pair(self.model, self.segments)
        object.__setattr__(self, "model", model)
        object.__setattr__(self, "segments", segments)
        fault = walk_fault(self.model, self.segments)
        if fault is not None:
            raise NotationError(fault.message)
        if not _is_count(self.periods):
            raise NotationError(f"periods must be a whole number >= 1, got {self.periods!r}")
        if self.symmetric and not self.is_mirror_symmetric:
            raise NotationError(
                f"an orbit of '{self}' over {number_and(self.periods, 'period')} cannot be symmetric: the "
                "second half of the segments is not the mirror image of the first"
            )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Signature):
            return NotImplemented
        return self._identity == other._identity

    def __hash__(self) -> int:
        return hash(self._identity)

    def __str__(self) -> str:
        return f" {ARROW} ".join(self.segments)

    def __repr__(self) -> str:
        named = "" if self.name is None else f", name={self.name!r}"
        return f"Signature({str(self)!r}, {self.model.name!r}, periods={self.periods}{named})"

    @property
    def _identity(self) -> tuple[str, tuple[str, ...], int]:
        return self.model.name, self.canonical, self.periods

    @cached_property
    def canonical(self) -> tuple[str, ...]:
        """The least rotation of the segments, by the order of the domains in the model."""
        holds = [TOUCH, *(hold_at(surface.name) for surface in self.model.surfaces)]
        impacts = (impact_at(self.model, s) for s in self.model.reset_by_surface)
        events = {name: (1, i) for i, name in enumerate([*holds, *impacts])}
        order = [events.get(s) or (0, self.model.domain_order(s)) for s in self.segments]
        return rotated(self.segments, least_rotation(order))

    @cached_property
    def surfaces(self) -> tuple[str, ...]:
        """The surface that ends each segment; the own name of a hold, and of an impact."""
        found = (_exit(self.model, self.segments, i) for i in range(len(self.segments)))
        return tuple(surface for surface in found if surface is not None)

    @property
    def stops(self) -> int:
        """Number of sticks: segments of a sliding mode."""
        return sum(
            self.model.is_sliding(segment) for segment in self.segments if not is_event(segment)
        )

    @property
    def holds(self) -> int:
        """Number of holds; an orbit with one lies on a bridge. One that goes on in other modes is one."""
        return sum(
            is_hold(segment) and not is_hold(self.segments[k - 1])
            for k, segment in enumerate(self.segments)
        )

    @property
    def impacts(self) -> int:
        """Number of impacts: resets on whose surface the state stays."""
        return sum(is_impact(s) and stays_on(self.model, s) for s in self.segments)

    @property
    def resets(self) -> int:
        """Number of other resets: after them the state is somewhere else."""
        return sum(is_impact(s) and not stays_on(self.model, s) for s in self.segments)

    @cached_property
    def is_mirror_symmetric(self) -> bool:
        """Whether the walk allows a symmetric orbit: half a turn on, it is its mirror image.

        Half of an even number of periods is no odd number of half periods of the excitation, so
        that an orbit of an even number of periods cannot be symmetric.
        """
        half, odd = divmod(len(self.segments), 2)
        if odd or self.periods % 2 == 0 or self.model.symmetry is None:
            return False
        return _mirrored(self.model, self.segments) == rotated(self.segments, half)

    def half(self) -> tuple[str, ...]:
        """Return the first half of the segments; the second is its mirror image.

        Raises
        ------
        NotationError
            If the walk is not mirror-symmetric.
        """
        if not self.is_mirror_symmetric:
            raise NotationError(f"'{self}' is not mirror-symmetric: it has no half")
        return self.segments[: len(self.segments) // 2]

    def mirror(self) -> Signature:
        """Return the signature of the mirror image of an orbit; it keeps its name.

        Raises
        ------
        NotationError
            If the model has no symmetry.
        """
        return replace(self, segments=_mirrored(self.model, self.segments))

    def rotate(self, k: int) -> Signature:
        """Return the same signature written from segment k (from 0, cyclic)."""
        return replace(self, segments=rotated(self.segments, k))

    def doubled(self) -> Signature:
        """Return the walk taken twice: what a period doubling starts from."""
        return Signature(self.model, self.segments * 2, periods=2 * self.periods)

    def auto_name(self, symmetric: bool) -> str:
        """Return the name in the manner of the reference, such as ``2s`` or ``2a, 14seg``.

        Parameters
        ----------
        symmetric : bool
            Whether the orbit is symmetric; the segments alone do not tell.
        """
        name = f"{self.stops}{'s' if symmetric else 'a'}"
        held = sum(map(is_hold, self.segments))
        count = len(self.segments) - held - self.impacts - self.resets
        name = name if count == TYPICAL_SEGMENTS else f"{name}, {count}seg"
        name = f"{name}, {self.impacts}imp" if self.impacts else name
        name = f"{name}, {self.resets}reset" if self.resets else name
        return f"{name}, {self.holds}hold" if self.holds else name


@dataclass(frozen=True)
class Fault:
    """The first thing wrong with a list of segments, and the index of the segment."""

    index: int
    message: str


def parse_signature(
    text: str | Iterable[str],
    model: Model,
    periods: int = 1,
    *,
    symmetric: bool | None = None,
    name: str | None = None,
    example: Mapping[str, float] | None = None,
) -> Signature:
    """Read a signature from its notation: domains joined by ``->`` or U+2192, or a list of them.

    Raises
    ------
    NotationError
        If the text cannot be read or is no closed walk; the message says where and what is valid.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> parse_signature("x0v+ -> x0v0 -> x-v+", load_model("coulomb")).auto_name(False)
    '1a, 3seg'
    """
    return Signature(model, split_segments(text, model), periods, symmetric, name, example)


def split_segments(text: str | Iterable[str], model: Model) -> tuple[str, ...]:
    """Return the segments of a text or list, aliases replaced; they are not checked."""
    if isinstance(text, str):
        parts = [part.strip() for part in _ARROWS.split(text)] if text.strip() else []
    else:
        parts = [str(part).strip() for part in text]
    return tuple(_unalias(part, model) for part in parts)


def _read_pair(model: object, segments: object) -> tuple[Model, tuple[str, ...]]:
    """Return the model and the segments of what a user gave for them, in either order.

    Raises
    ------
    NotationError
        If they are no segments.
    ParameterError
        If there is no such model.
    """
    if not isinstance(model, Model) and _is_model(segments):
        model, segments = segments, model
    if isinstance(model, (str, Path)):
        model = load_model(model)
    if not isinstance(model, Model):
        raise NotationError(f"a signature needs a model, or the name of one, got {shown(model)}")
    if isinstance(segments, str):
        return model, split_segments(segments, model)
    try:
        listed: tuple[Any, ...] = tuple(segments)  # type: ignore[arg-type] # whatever was given
    except TypeError:
        listed = (segments,)
    if not all(isinstance(segment, str) for segment in listed):
        raise NotationError(
            "the segments of a signature are names of domains, as a list or joined by '->', got "
            f"{shown(segments)}"
        )
    return model, listed


def _is_model(value: object) -> bool:
    return isinstance(value, Model) or (isinstance(value, str) and value in model_names())


def walk_fault(model: Model, segments: Sequence[str]) -> Fault | None:
    """Return the first reason why the segments are no closed walk; None if they are one."""
    if not segments:
        return Fault(0, "a signature needs segments, got none")
    for index, segment in enumerate(segments):
        if segment not in model.domain_by_name and not is_event(segment):
            return Fault(index, f"segment {index + 1}: {_not_a_domain(model, segment)}")
    if len(segments) == 1:
        return Fault(0, f"the single segment '{segments[0]}' is no closed walk: it never ends")
    for index in range(len(segments)):
        following = (index + 1) % len(segments)
        if is_hold(segments[index]):
            fault = hold_fault(model, segments, index)
            if fault is not None:
                return Fault(index, f"segment {index + 1}: {fault}")
        elif is_impact(segments[index]):
            fault = impact_fault(model, segments, index)
            if fault is not None:
                return Fault(index, f"segment {index + 1}: {fault}")
        elif (
            not is_event(segments[following])
            and crossing(model, segments[index], segments[following]) is None
        ):
            return Fault(following, _impossible(model, segments, index, following))
    return None


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 1


def _unalias(part: str, model: Model) -> str:
    target = _ALIASES.get(part, part)
    known = model.domain_by_name
    return target if target in known and part not in known else part


def _not_a_domain(model: Model, segment: str) -> str:
    if segment == "":
        return f"nothing between two arrows; write one domain between each pair of '{ARROW}'"
    if all(part in model.domain_by_name for part in segment.split()):
        return f"'{segment}' lacks an arrow; write {f' {ARROW} '.join(segment.split())}"
    return unknown_domain(model, segment)


def _impossible(model: Model, segments: Sequence[str], index: int, following: int) -> str:
    first, second = segments[index], segments[following]
    exits = successors(model, first).items()
    possible = ", ".join(f"{target} (through {surface})" for surface, target in exits)
    advice = f"After {first} can come: {possible or 'nothing'}"
    if following == 0:
        return (
            f"the walk is not closed: the last segment {index + 1} '{first}' cannot lead back "
            f"to the first, '{second}'. {advice}"
        )
    return f"segment {index + 1} '{first}' cannot be followed by segment {following + 1} '{second}'. {advice}"


def _mirrored(model: Model, segments: Iterable[str]) -> tuple[str, ...]:
    if model.symmetry is None:
        raise NotationError(f"model '{model.name}' has no symmetry: there is no mirror image")
    surfaces = model.symmetry.surfaces
    images = ChainMap(model.mirror_domain, dict(surfaces))
    found = [mirror_name(s, images) if is_event(s) else images[s] for s in segments]
    return tuple(model.without_phase(found))


def _exit(model: Model, segments: Sequence[str], index: int) -> str | None:
    following = (index + 1) % len(segments)
    if is_event(segments[index]):
        return segments[index]
    if is_hold(segments[following]):
        return surface_into(model, segments, index)
    if is_impact(segments[following]):
        return struck_surface(segments[following])
    return crossing(model, segments[index], segments[following])
