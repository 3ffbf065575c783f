"""Edits of reduced words: operations on walks of the transition graph.

Everything is derived from the transitions of the model: which modes slide, and where a surface
leads from a domain. No edit returns a word that the graph cannot walk.

An :class:`Edit` is a local change of a word: segments dropped, given another exit, or inserted behind
one. Edits at several places are joined by ``|``. With it are made

* **insert** and **drop**: a segment of length zero appears or vanishes,
* **swap**: stick and reversal at a stop (:func:`swap_stops`),
* **split**: a segment ends earlier, and others follow it,

and of whole words **double** (:func:`double`), **mirror**
(:func:`~contfric.signature.reduced.mirror_word`) and **concatenate** (:func:`concatenate`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

from contfric.errors import NotationError, did_you_mean
from contfric.models import Model
from contfric.models.composed import ComposedModel
from contfric.signature.holds import is_hold, without_holds
from contfric.signature.reduced import NEVER, ReducedPair, ReducedWord, fuses


@dataclass(frozen=True)
class Edit:
    """A local change of a word; segments are counted before the change.

    Attributes
    ----------
    dropped : segments that go
    renamed : new exits of segments
    inserted : segments that come in behind others
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

    def _touched(self) -> frozenset[int]:
        return self.dropped | frozenset(self.renamed) | frozenset(self.inserted)


def drop(*segments: int) -> Edit:
    """Return the edit that leaves segments out.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> word = (("slide+", "v"), ("stick", "F+"), ("slide-", "v"), ("stick", "F-"))
    >>> apply_edit(word, drop(1), load_model("coulomb"))
    (('slide+', 'v'), ('slide-', 'v'), ('stick', 'F-'))
    """
    return Edit(dropped=frozenset(segments))


def insert(behind: int, *pairs: ReducedPair) -> Edit:
    """Return the edit that puts segments behind one."""
    return Edit(inserted={behind: pairs})


def split(segment: int, exit_surface: str, *pairs: ReducedPair) -> Edit:
    """Return the edit that ends a segment at another surface, with others behind it."""
    return Edit(renamed={segment: exit_surface}, inserted={segment: pairs} if pairs else {})


def apply_edit(word: Sequence[ReducedPair], edit: Edit, model: Model) -> ReducedWord:
    """Return the word after an edit, in the same rotation.

    Raises
    ------
    NotationError
        If the graph has no such walk.
    """
    edited = tuple(pair for _, pair in edited_pieces(word, edit))
    if not is_closed_walk(edited, model):
        raise NotationError(
            f"{show(word)} cannot become {show(edited)}: the transitions of model '{model.name}' "
            "do not allow it"
        )
    return edited


def edited_pieces(
    word: Sequence[ReducedPair], edit: Edit
) -> list[tuple[tuple[int, int], ReducedPair]]:
    """Return the segments after an edit, each with where it comes from.

    (segment, -1) for one that was there, (segment, k) for the k-th one put in behind a segment.
    """
    pieces: list[tuple[tuple[int, int], ReducedPair]] = []
    for index, (mode, exit_) in enumerate(word):
        if index not in edit.dropped:
            pieces.append(((index, -1), (mode, edit.renamed.get(index, exit_))))
        for k, pair in enumerate(edit.inserted.get(index, ())):
            pieces.append(((index, k), pair))
    return pieces


def concatenate(*words: Sequence[ReducedPair]) -> ReducedWord:
    """Return words run through one after the other, each in the rotation given.

    Examples
    --------
    >>> concatenate((("slide+", "v"),), (("stick", "F-"),))
    (('slide+', 'v'), ('stick', 'F-'))
    """
    return tuple(pair for word in words for pair in word)


def swap_stop(
    segments: Sequence[ReducedPair], joint: int, exit_surface: str, model: Model
) -> ReducedWord:
    """Swap stick and reversal at one stop: the edit of the event CS.

    Parameters
    ----------
    segments : sequence of (mode, exit)
        The reduced word, in any rotation. The result keeps it; if the stick is the first segment
        and ``joint`` the last, the result starts at the second.
    joint : int
        Index of the slide that ends at the stop.
    exit_surface : str
        The surface that the state meets at the stop: the inserted stick ends there, and a stick
        that ends elsewhere has no length zero and cannot be removed.
    model : Model
        The model that the word is of.

    Raises
    ------
    NotationError
        If there is no stop at the joint, or the graph has no such walk.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> word = (("slide+", "v"), ("slide-", "v"), ("stick", "F-"))
    >>> swap_stop(word, 0, "F+", load_model("coulomb"))
    (('slide+', 'v'), ('stick', 'F+'), ('slide-', 'v'), ('stick', 'F-'))
    """
    return swap_stops(segments, {joint: exit_surface}, model)


def swap_stops(
    segments: Sequence[ReducedPair], events: Mapping[int, str], model: Model
) -> ReducedWord:
    """Swap stick and reversal at several stops at once; see :func:`swap_stop`.

    Parameters
    ----------
    events : mapping of int to str
        The surface met, for each joint; the indices are those of the word before the edit.

    Raises
    ------
    NotationError
        If one of the joints is no stop, or the graph has no such walk.
    """
    return apply_edit(segments, swap_edit(segments, events, model), model)


def swap_edit(segments: Sequence[ReducedPair], events: Mapping[int, str], model: Model) -> Edit:
    """Return the edit that swaps stick and reversal at stops; see :func:`swap_stops`."""
    word = _checked(segments, model)
    edit = Edit()
    for joint, surface in events.items():
        following = _stop(word, joint, surface, model)
        if model.lies_on(word[following][0], word[joint][1]):
            edit |= drop(_removable(word, following, surface))
        else:
            edit |= insert(joint, _new_stick(word, joint, surface, model))
    return edit


def double(word: Sequence[ReducedPair]) -> ReducedWord:
    """Return the word taken twice: what a period doubling starts from.

    Examples
    --------
    >>> double((("slide+", "v"), ("stick", "F-")))
    (('slide+', 'v'), ('stick', 'F-'), ('slide+', 'v'), ('stick', 'F-'))
    """
    if len(word) == 1 and word[0][1] == NEVER:
        return tuple(word)
    return (*word, *word)


def is_closed_walk(word: Sequence[ReducedPair], model: Model) -> bool:
    """Return whether some closed walk through the domains of the model has this word.

    Inside of a segment the walk may cross any transparent surface within its mode.

    Examples
    --------
    >>> from contfric.models import load_model
    >>> is_closed_walk((("slide+", "v"), ("stick", "F+")), load_model("coulomb"))
    False
    """
    return _is_closed_walk(tuple(word), model)


@cache
def _is_closed_walk(word: ReducedWord, model: Model) -> bool:
    if any(is_hold(exit_) for _, exit_ in word):
        try:
            word = without_holds(word, model)
        except NotationError:
            return False
    modes = [mode for mode, _ in word]
    if len(word) == 1 and word[0][1] == NEVER:
        return _has_cycle(modes[0], model)
    surfaces = {surface for _, surface in word}
    if not word or not all(mode in model.mode_by_name for mode in modes):
        return False
    if not all(surface in model.surface_by_name for surface in surfaces):
        return False
    first = model.whole_mode(modes[0])
    for entry in (domain.name for domain in model.domains_of(first)):
        reached = {entry}
        for index, (mode, surface) in enumerate(word):
            reached = entered(reached, surface, model, mode, modes[(index + 1) % len(word)])
        if entry in reached:
            return True
    return False


def show(word: Iterable[ReducedPair]) -> str:
    """Return a word as text, such as ``slide+|v stick|F+``."""
    return " ".join(mode if surface == NEVER else f"{mode}|{surface}" for mode, surface in word)


def entered(
    entries: Iterable[str], surface: str, model: Model, mode: str, next_mode: str
) -> set[str]:
    """Return the domains of the next mode that a segment can lead to from its entries."""
    if isinstance(model, ComposedModel):
        return {next_mode} if any(model.follows(d, surface, next_mode) for d in entries) else set()
    inside = _within(entries, model, mode)
    side = model.section_sides.get((mode, surface), 0)
    inside = {d for d in inside if side in (0, model.domain_by_name[d].signs.get(surface, 0))}
    targets = {t for d in inside for t in model.targets.get((d, surface), ())}
    return {t for t in targets if model.domain_by_name[t].mode == model.whole_mode(next_mode)}


def _within(entries: Iterable[str], model: Model, mode: str) -> set[str]:
    """Return all domains of a mode that can be reached from the entries without leaving it."""
    reached, steps = set(entries), _steps_within(model, mode)
    waiting = list(reached)
    while waiting:
        for target in steps.get(waiting.pop(), ()):
            if target not in reached:
                reached.add(target)
                waiting.append(target)
    return reached


@cache
def _steps_within(model: Model, mode: str) -> dict[str, list[str]]:
    """Return where each domain leads to without leaving a mode."""
    steps: dict[str, list[str]] = {}
    for start in (domain.name for domain in model.domains_of(model.whole_mode(mode))):
        for surface, target in model.exits_of(start):
            if fuses(model, mode, surface, model.domain_by_name[target].mode):
                steps.setdefault(start, []).append(target)
    return steps


def _has_cycle(mode: str, model: Model) -> bool:
    """Return whether a walk can go round within a mode without leaving it."""
    for start in (domain.name for domain in model.domains_of(mode)):
        for surface, target in model.exits_of(start):
            inside = model.domain_by_name[target].mode == mode and fuses(model, mode, surface, mode)
            if inside and start in _within({target}, model, mode):
                return True
    return False


def _checked(segments: Sequence[ReducedPair], model: Model) -> ReducedWord:
    word = tuple((mode, surface) for mode, surface in segments)
    if not is_closed_walk(word, model):
        raise NotationError(
            f"the word '{show(word)}' is no closed walk of the transitions of model '{model.name}'"
        )
    return word


def _stop(word: ReducedWord, joint: int, surface: str, model: Model) -> int:
    """Return the index of the segment after the stop at a joint."""
    if not 0 <= joint < len(word):
        raise NotationError(f"no joint {joint}: the word '{show(word)}' has 0..{len(word) - 1}")
    if surface not in model.surface_by_name:
        hint = did_you_mean(surface, model.surface_by_name)
        raise NotationError(f"model '{model.name}' has no surface '{surface}'{hint}")
    mode, exit_surface = word[joint]
    slides = model.lies_on(mode, exit_surface) or not model.rests_on(exit_surface)
    if slides or not model.surface_by_name[exit_surface].switching:
        raise NotationError(
            f"segment {joint} of '{show(word)}' does not end at a stop: only a slide that ends "
            "on a switching surface does"
        )
    return (joint + 1) % len(word)


def _removable(word: ReducedWord, index: int, surface: str) -> int:
    if word[index][1] != surface:
        raise NotationError(
            f"the stick {index} of '{show(word)}' ends at {word[index][1]}, not at {surface}: it "
            "cannot vanish there"
        )
    return index


def _new_stick(word: ReducedWord, joint: int, surface: str, model: Model) -> ReducedPair:
    """Return the sliding segment that can be inserted after a joint."""
    mode, stop = word[joint]
    next_mode = word[(joint + 1) % len(word)][0]
    slides = [domain.name for domain in model.domains_of(mode)]
    behind = {
        model.domain_by_name[t].mode for d in slides for t in model.targets.get((d, stop), ())
    }
    for stick in sorted((m for m in behind if model.lies_on(m, stop)), key=model.mode_order):
        held = entered(slides, stop, model, mode, stick)
        if entered(held, surface, model, stick, next_mode):
            return stick, surface
    raise NotationError(
        f"no stick that ends at {surface} fits between '{mode}' and '{next_mode}' "
        f"(joint {joint} of '{show(word)}', model '{model.name}')"
    )
