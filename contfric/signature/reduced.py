"""Reduced itineraries: signatures without the surfaces across which the vector field is the same.

Whether a slide crosses ``F+`` inside is a label and no part of the dynamics. In the reduced itinerary
consecutive domains of one mode, joined by a transparent surface, are one segment; orbits before
and after an event T have the same reduced itinerary.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TypeAlias

from contfric.errors import NotationError
from contfric.models import Model
from contfric.signature.cyclic import least_rotation, primitive_length, rotated
from contfric.signature.holds import TOUCH, hold_at, is_hold, known_hold, mirror_exit, mode_of
from contfric.signature.impacts import is_impact
from contfric.signature.notation import Signature

#: Stands for the surface at the end of a segment that is the whole orbit and has no end. None of
#: those that it crosses inside will do: they are labels, and would make the itinerary depend on them.
NEVER = ""

#: (mode, surface at its end).
ReducedPair: TypeAlias = tuple[str, str]
ReducedItinerary: TypeAlias = tuple[ReducedPair, ...]


@dataclass(frozen=True)
class ReducedSegment:
    """One smooth piece: its mode, the surface at its end and the domains that it passes."""

    mode: str
    exit: str
    domains: tuple[str, ...]

    @property
    def pair(self) -> ReducedPair:
        """What the reduced itinerary keeps of it."""
        return self.mode, self.exit


def reduce_signature(signature: Signature) -> tuple[ReducedSegment, ...]:
    """Return the reduced segments, in an order that does not depend on the signature's rotation.

    The first one makes :func:`reduced_itinerary` least; where the itinerary repeats itself, the domains
    decide. A walk that never changes its mode is a single segment, and its end is :data:`NEVER`.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> from contfric.signature.notation import parse_signature
    >>> walk = parse_signature("x0v+ -> stick -> x-v+", load_model("coulomb"))
    >>> [segment.domains for segment in reduce_signature(walk)]
    [('x-v+', 'x0v+'), ('stick',)]
    """
    pieces = _fused(signature)
    model = signature.model
    pieces = rotated(pieces, least_rotation([_key(piece.pair, model) for piece in pieces]))
    block = primitive_length([piece.pair for piece in pieces])
    known, order = model.domain_by_name, model.domain_order
    path = [tuple(order(n) if n in known else -1 for n in piece.domains) for piece in pieces]
    blocks = [tuple(path[i : i + block]) for i in range(0, len(path), block)]
    return rotated(pieces, block * least_rotation(blocks))


def reduced_itinerary(signature: Signature) -> ReducedItinerary:
    """Return the (mode, exit) pairs of the reduced segments, in canonical rotation.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> from contfric.signature.notation import parse_signature
    >>> reduced_itinerary(parse_signature("x0v+ -> stick -> x-v+", load_model("coulomb")))
    (('slide+', 'v'), ('stick', 'F-'))
    """
    return tuple(segment.pair for segment in reduce_signature(signature))


def canonical_itinerary(itinerary: ReducedItinerary, model: Model) -> ReducedItinerary:
    """Return the least rotation of an itinerary, by the order of modes and surfaces in the model."""
    itinerary = tuple(itinerary)
    return rotated(itinerary, least_rotation([_key(pair, model) for pair in itinerary]))


@cache
def mirror_pair(pair: ReducedPair, model: Model) -> ReducedPair:
    """Return the image of one (mode, exit) pair under the symmetry of the model.

    Raises
    ------
    NotationError
        If the model has no symmetry, or the pair is not of this model.
    """
    if model.symmetry is None:
        raise NotationError(f"model '{model.name}' has no symmetry: there is no mirror image")
    mode, surface = pair
    surfaces = {NEVER: NEVER, **model.symmetry.surfaces}
    section = pair in model.sections
    known = surface in surfaces or (is_hold(surface) and known_hold(surface, model))
    for domain in model.domains if section else model.domains_of(model.whole_mode(mode)):
        own = domain.own_mode if section else domain.mode
        if known and own == (mode if section else model.whole_mode(mode)):
            image = model.domain_by_name[model.mirror_domain[domain.name]]
            mirrored = mirror_exit(surface, surfaces)
            return (
                model.section_pair(image.own_mode, mirrored) if section else (image.mode, mirrored)
            )
    raise NotationError(f"model '{model.name}' has no mode '{mode}' with surface '{surface}'")


def mirror_itinerary(itinerary: ReducedItinerary, model: Model) -> ReducedItinerary:
    """Return the mirror image of an itinerary in canonical rotation, ready to be compared.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> mirror_itinerary((("slide+", "v"), ("stick", "F-")), load_model("coulomb"))
    (('slide-', 'v'), ('stick', 'F+'))
    """
    return canonical_itinerary(tuple(mirror_pair(pair, model) for pair in itinerary), model)


def fuses(model: Model, mode: str, surface: str, next_mode: str) -> bool:
    """Return whether the field is the same on both sides of a joint."""
    same = model.whole_mode(mode) == model.whole_mode(next_mode)
    return same and model.reset_at(mode, surface) is None


def section_ends(model: Model, pairs: Sequence[ReducedPair]) -> list[int]:
    """Return the joints by which a cycle that meets nothing but sections is found: one each way.

    Of several crossings the first will do: they are crossings of one cycle.

    Parameters
    ----------
    pairs : (mode as it was declared, surface at its end) of each domain
    """
    for surface in model.surface_by_name:
        at = [k for k, pair in enumerate(pairs) if pair in model.sections and pair[1] == surface]
        sides = {model.section_sides[pairs[k]]: k for k in reversed(at)}
        if at:
            return sorted(sides.values())
    return []


def _key(pair: ReducedPair, model: Model) -> tuple[int, int]:
    mode, surface = pair
    exits = (NEVER, *model.surface_by_name, TOUCH, *map(hold_at, model.surface_by_name))
    try:
        return model.mode_order(mode), exits.index(surface)
    except (KeyError, ValueError):
        raise NotationError(f"model '{model.name}' has no segment {pair}") from None


def _fused(signature: Signature) -> tuple[ReducedSegment, ...]:
    """Fuse the segments; the first piece starts at the first joint that does not fuse."""
    model = signature.model
    canonical = Signature(model, signature.canonical, signature.periods)
    pairs = zip(signature.canonical, canonical.surfaces, strict=True)
    names, surfaces = zip(*(pair for pair in pairs if not is_impact(pair[0])), strict=True)
    modes = [mode_of(model, names, i) for i in range(len(names))]
    count = len(names)
    after = rotated(tuple(modes), 1)
    nearby = [is_hold(names[i]) or is_hold(names[(i + 1) % count]) for i in range(count)]
    ends = [
        i for i in range(count) if nearby[i] or not fuses(model, modes[i], surfaces[i], after[i])
    ]
    if not ends:
        modes = [model.domain_by_name[name].own_mode for name in names]
        ends = section_ends(model, list(zip(modes, surfaces, strict=True)))
        modes = [
            model.section_pair(m, s)[0] if k in ends else m
            for k, (m, s) in enumerate(zip(modes, surfaces, strict=True))
        ]
    if not ends:
        return (ReducedSegment(modes[0], NEVER, names),)
    starts = [ends[-1] - count, *ends]
    return tuple(
        # start may be negative: the first piece can begin before the end of the list
        ReducedSegment(
            modes[end], surfaces[end], tuple(names[i] for i in range(start + 1, end + 1))
        )
        for start, end in pairwise(starts)
    )
