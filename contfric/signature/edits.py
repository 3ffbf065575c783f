"""Edits of reduced itineraries: operations on walks of the transition graph.

Everything is derived from the transitions of the model: which modes slide, and where a surface
leads from a domain. No edit returns an itinerary that the graph cannot walk.

An :class:`Edit` is a local change of an itinerary: segments dropped, given another exit, or inserted after
one. Edits at several places are joined by ``|``. With it are made

* **insert** and **drop**: a segment of length zero appears or vanishes,
* **swap**: stick and reversal at a stop (:func:`swap_stops`),
* **split**: a segment ends earlier, and others follow it,

and of whole itineraries **double** (:func:`double`), **mirror**
(:func:`~contfric.signature.reduced.mirror_itinerary`) and **concatenate** (:func:`concatenate`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

from contfric.errors import NotationError, did_you_mean
from contfric.models import Model
from contfric.signature.holds import is_hold
from contfric.signature.reduced import NEVER, ReducedItinerary, ReducedPair
from contfric.signature.walks import entered, is_closed_walk, show


@dataclass(frozen=True)
class Edit:
    """A local change of an itinerary; segments are counted before the change.

    Attributes
    ----------
    dropped : segments that go
    renamed : new exits of segments
    inserted : segments that come in after others
    """

    dropped: frozenset[int] = frozenset()
    renamed: Mapping[int, str] = field(default_factory=dict)
    inserted: Mapping[int, tuple[ReducedPair, ...]] = field(default_factory=dict)

    def __or__(self, other: Edit) -> Edit:
        """Return both changes at once.

        Raises
        ------
        NotationError
            If both change the same segment.
        """
        clash = self._touched() & other._touched()
        if clash:
            raise NotationError(
                f"two edits change segment {min(clash) + 1}: they exclude each other"
            )
        return Edit(
            self.dropped | other.dropped,
            {**self.renamed, **other.renamed},
            {**self.inserted, **other.inserted},
        )

    @property
    def holds(self) -> bool:
        """Whether a hold comes in, or a segment becomes one."""
        comes = (exit_ for pairs in self.inserted.values() for _, exit_ in pairs)
        return any(map(is_hold, (*self.renamed.values(), *comes)))

    def _touched(self) -> frozenset[int]:
        return self.dropped | frozenset(self.renamed) | frozenset(self.inserted)


def drop(*segments: int) -> Edit:
    """Return the edit that leaves segments out.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> itinerary = (("slide+", "v"), ("stick", "F+"), ("slide-", "v"), ("stick", "F-"))
    >>> apply_edit(itinerary, drop(1), load_model("coulomb"))
    (('slide+', 'v'), ('slide-', 'v'), ('stick', 'F-'))
    """
    return Edit(dropped=frozenset(segments))


def insert(segment: int, *pairs: ReducedPair) -> Edit:
    """Return the edit that puts segments after one."""
    return Edit(inserted={segment: pairs})


def split(segment: int, exit_surface: str, *pairs: ReducedPair) -> Edit:
    """Return the edit that ends a segment at another surface, with others after it."""
    return Edit(renamed={segment: exit_surface}, inserted={segment: pairs} if pairs else {})


def apply_edit(itinerary: Sequence[ReducedPair], edit: Edit, model: Model) -> ReducedItinerary:
    """Return the itinerary after an edit, in the same rotation.

    Raises
    ------
    NotationError
        If the graph has no such walk.
    """
    return checked_itinerary(itinerary, edited_pieces(itinerary, edit), model)


def checked_itinerary(
    itinerary: Sequence[ReducedPair],
    pieces: Sequence[tuple[tuple[int, int], ReducedPair]],
    model: Model,
) -> ReducedItinerary:
    """Return the itinerary of the pieces that an edit makes of one.

    Raises
    ------
    NotationError
        If the graph has no such walk.
    """
    edited = tuple([pair for _, pair in pieces])
    if not is_closed_walk(edited, model):
        raise NotationError(
            f"{show(itinerary)} cannot become {show(edited)}: the transitions of model '{model.name}' "
            "do not allow it"
        )
    return edited


def edited_pieces(
    itinerary: Sequence[ReducedPair], edit: Edit
) -> list[tuple[tuple[int, int], ReducedPair]]:
    """Return the segments after an edit, each with where it comes from.

    (segment, -1) for one that was there, (segment, k) for the k-th one put in after a segment.
    """
    pieces: list[tuple[tuple[int, int], ReducedPair]] = []
    for index, (mode, exit_) in enumerate(itinerary):
        if index not in edit.dropped:
            pieces.append(((index, -1), (mode, edit.renamed.get(index, exit_))))
        if index in edit.inserted:
            pieces += [((index, k), pair) for k, pair in enumerate(edit.inserted[index])]
    return pieces


def concatenate(*itineraries: Sequence[ReducedPair]) -> ReducedItinerary:
    """Return itineraries run through one after the other, each in the rotation given.

    Examples
    --------
    >>> concatenate((("slide+", "v"),), (("stick", "F-"),))
    (('slide+', 'v'), ('stick', 'F-'))
    """
    return tuple(pair for itinerary in itineraries for pair in itinerary)


def swap_stops(
    segments: Sequence[ReducedPair], events: Mapping[int, str], model: Model
) -> ReducedItinerary:
    """Swap stick and reversal at stops, all at once: the edit of the event CS.

    Parameters
    ----------
    segments : sequence of (mode, exit)
        The reduced itinerary, in any rotation. The result keeps it; if the stick is the first segment
        and its joint the last, the result starts at the second.
    events : mapping of int to str
        For the slide that ends at each stop the surface that is met there: the inserted stick ends there, and
        a stick that ends elsewhere has no length zero and cannot be removed.

    Raises
    ------
    NotationError
        If one of the joints is no stop, or the graph has no such walk.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> itinerary = (("slide+", "v"), ("slide-", "v"), ("stick", "F-"))
    >>> swap_stops(itinerary, {0: "F+"}, load_model("coulomb"))
    (('slide+', 'v'), ('stick', 'F+'), ('slide-', 'v'), ('stick', 'F-'))
    """
    return apply_edit(segments, swap_edit(segments, events, model), model)


def swap_edit(segments: Sequence[ReducedPair], events: Mapping[int, str], model: Model) -> Edit:
    """Return the edit that swaps stick and reversal at stops; see :func:`swap_stops`."""
    pairs = tuple((mode, surface) for mode, surface in segments)
    return _swap_edit(pairs, tuple(events.items()), model)


@cache
def _swap_edit(
    segments: ReducedItinerary, events: tuple[tuple[int, str], ...], model: Model
) -> Edit:
    itinerary = _checked(segments, model)
    edit = Edit()
    for joint, surface in events:
        following = _stop(itinerary, joint, surface, model)
        if model.lies_on(itinerary[following][0], itinerary[joint][1]):
            edit |= drop(_removable(itinerary, following, surface))
        else:
            edit |= insert(joint, _new_stick(itinerary, joint, surface, model))
    return edit


def double(itinerary: Sequence[ReducedPair]) -> ReducedItinerary:
    """Return the itinerary taken twice: what a period doubling starts from.

    Examples
    --------
    >>> double((("slide+", "v"), ("stick", "F-")))
    (('slide+', 'v'), ('stick', 'F-'), ('slide+', 'v'), ('stick', 'F-'))
    """
    if len(itinerary) == 1 and itinerary[0][1] == NEVER:
        return tuple(itinerary)
    return (*itinerary, *itinerary)


def _checked(segments: Sequence[ReducedPair], model: Model) -> ReducedItinerary:
    itinerary = tuple((mode, surface) for mode, surface in segments)
    if not is_closed_walk(itinerary, model):
        raise NotationError(
            f"the itinerary '{show(itinerary)}' is no closed walk of the transitions of model '{model.name}'"
        )
    return itinerary


def _stop(itinerary: ReducedItinerary, joint: int, surface: str, model: Model) -> int:
    """Return the index of the segment after the stop at a joint."""
    if not 0 <= joint < len(itinerary):
        raise NotationError(
            f"no joint {joint}: the itinerary '{show(itinerary)}' has 0..{len(itinerary) - 1}"
        )
    if surface not in model.surface_by_name:
        hint = did_you_mean(surface, model.surface_by_name)
        raise NotationError(f"model '{model.name}' has no surface '{surface}'{hint}")
    mode, exit_surface = itinerary[joint]
    slides = model.lies_on(mode, exit_surface) or not model.rests_on(exit_surface)
    if slides or not model.surface_by_name[exit_surface].switching:
        raise NotationError(
            f"segment {joint} of '{show(itinerary)}' does not end at a stop: only a slide that ends "
            "on a switching surface does"
        )
    return (joint + 1) % len(itinerary)


def _removable(itinerary: ReducedItinerary, index: int, surface: str) -> int:
    if itinerary[index][1] != surface:
        raise NotationError(
            f"the stick {index} of '{show(itinerary)}' ends at {itinerary[index][1]}, not at {surface}: it "
            "cannot vanish there"
        )
    return index


def _new_stick(itinerary: ReducedItinerary, joint: int, surface: str, model: Model) -> ReducedPair:
    """Return the sliding segment that can be inserted after a joint."""
    mode, stop = itinerary[joint]
    next_mode = itinerary[(joint + 1) % len(itinerary)][0]
    slides = [domain.name for domain in model.domains_of(mode)]
    after_stop = {
        model.domain_by_name[t].mode for d in slides for t in model.targets.get((d, stop), ())
    }
    for stick in sorted((m for m in after_stop if model.lies_on(m, stop)), key=model.mode_order):
        held = entered(slides, stop, model, mode, stick)
        if entered(held, surface, model, stick, next_mode):
            return stick, surface
    raise NotationError(
        f"no stick that ends at {surface} fits between '{mode}' and '{next_mode}' "
        f"(joint {joint} of '{show(itinerary)}', model '{model.name}')"
    )
