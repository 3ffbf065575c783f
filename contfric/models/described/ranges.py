"""Ranges of states in which solutions are sought, from ``spread`` of a model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from contfric.models.described.description import Description, Range
from contfric.models.described.evaluate import defaults, floats
from contfric.models.entries import EntryError, known_keys
from contfric.models.language.names import Names


def spread_of(spread: Mapping[str, Any], states: tuple[str, ...]) -> tuple[str, ...]:
    """Return the half-width of each state; of a range, half of its length."""
    known_keys(spread, states, ("spread",))
    half = {s: f"(({w[1]}) - ({w[0]}))/2" if isinstance(w, list) else w for s, w in spread.items()}
    return tuple(half.get(state, "1") for state in states)


def ranges_of(spread: Mapping[str, Any], states: tuple[str, ...]) -> tuple[Range, ...]:
    """Return the lowest and the highest value of each state that has a range, nothing of others."""
    found: dict[str, Range] = {s: (w[0], w[1]) for s, w in spread.items() if isinstance(w, list)}
    return tuple(found.get(state, ()) for state in states) if found else ()


def check_ranges(found: Description, names: Names) -> None:
    """Look up every name of the ranges, and see that they are not empty at the defaults."""
    for state, ends in zip(found.states, found.ranges, strict=False):
        for text in ends:
            names.check(("spread", state), text, only_parameters=True)
        if ends:
            evaluator, values = floats(found), defaults(found)
            low, high = (evaluator.value(text, values) for text in ends)
            if not low < high:
                raise EntryError(
                    ("spread", state),
                    f"a range has a lowest and a highest value; by default it is from {low:g} to {high:g}",
                )
