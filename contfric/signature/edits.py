"""Edits of reduced words: what follows the events at which a signature changes.

Everything is derived from the transitions of the model: which modes slide, and where a surface
leads from a domain. No edit returns a word that the transition graph cannot walk.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from contfric.errors import NotationError, did_you_mean
from contfric.models import Model
from contfric.signature.reduced import NEVER, ReducedPair, ReducedWord, fuses


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
    word = _checked(segments, model)
    dropped: set[int] = set()
    added: dict[int, ReducedPair] = {}
    for joint, surface in events.items():
        following = _stop(word, joint, surface, model)
        if model.mode_by_name[word[following][0]].sliding:
            dropped.add(_removable(word, following, surface))
        else:
            added[joint] = _new_stick(word, joint, surface, model)
    edited: list[ReducedPair] = []
    for index, pair in enumerate(word):
        if index not in dropped:
            edited.append(pair)
        if index in added:
            edited.append(added[index])
    if not is_closed_walk(edited, model):
        raise NotationError(
            f"swapping the stop(s) {dict(events)} of {show(word)} gives {show(edited)}, which the "
            f"transitions of model '{model.name}' do not allow"
        )
    return tuple(edited)


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
    modes = [mode for mode, _ in word]
    if len(word) == 1 and word[0][1] == NEVER:
        return _has_cycle(modes[0], model)
    surfaces = {surface for _, surface in word}
    if not word or not (model.mode_by_name.keys() >= set(modes)):
        return False
    if not (model.surface_by_name.keys() >= surfaces):
        return False
    for entry in (domain.name for domain in model.domains if domain.mode == modes[0]):
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
    targets = (model.transitions.get((d, surface)) for d in _within(entries, model, mode))
    return {t for t in targets if t is not None and model.domain_by_name[t].mode == next_mode}


def _within(entries: Iterable[str], model: Model, mode: str) -> set[str]:
    """Return all domains of a mode that can be reached from the entries without leaving it."""
    reached = set(entries)
    waiting = list(reached)
    while waiting:
        source = waiting.pop()
        for (start, surface), target in model.transitions.items():
            inside = fuses(model, mode, surface, model.domain_by_name[target].mode)
            if start == source and inside and target not in reached:
                reached.add(target)
                waiting.append(target)
    return reached


def _has_cycle(mode: str, model: Model) -> bool:
    """Return whether a walk can go round within a mode without leaving it."""
    for (start, surface), target in model.transitions.items():
        modes = {model.domain_by_name[name].mode for name in (start, target)}
        inside = modes == {mode} and fuses(model, mode, surface, mode)
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
    if model.mode_by_name[mode].sliding or not model.surface_by_name[exit_surface].switching:
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
    slides = [domain.name for domain in model.domains if domain.mode == mode]
    for stick in (m.name for m in model.modes if m.sliding):
        held = entered(slides, stop, model, mode, stick)
        if entered(held, surface, model, stick, next_mode):
            return stick, surface
    raise NotationError(
        f"no stick that ends at {surface} fits between '{mode}' and '{next_mode}' "
        f"(joint {joint} of '{show(word)}', model '{model.name}')"
    )
