"""Where motion is looked for: half-widths of states about 0, or ranges, as ``spread`` of a model says."""

from __future__ import annotations

from contfric.models.description import Description, Range
from contfric.models.entries import EntryError, Part
from contfric.models.evaluate import defaults, floats
from contfric.models.names import Names


def spread_of(top: Part, states: tuple[str, ...]) -> tuple[str, ...]:
    """Return the half-width of each state; of a range, half of its length."""
    part = top.part("spread", "a mapping of states to half-widths, or to ranges such as [0, 1]")
    part.only(states)
    ranges = dict(zip(states, ranges_of(top, states), strict=False))
    half = {state: f"(({ends[1]}) - ({ends[0]}))/2" for state, ends in ranges.items() if ends}
    given = {name: half.get(name) or part.expression(name) for name in part.data}
    return tuple(given.get(state, "1") for state in states)


def ranges_of(top: Part, states: tuple[str, ...]) -> tuple[Range, ...]:
    """Return the lowest and the highest value of each state that has a range, nothing of others."""
    part = top.part("spread", "a mapping of states to half-widths, or to ranges such as [0, 1]")
    found: dict[str, Range] = {}
    for name, value in part.data.items():
        if not isinstance(value, (list, tuple)):
            continue
        if len(value) != 2:
            part.fail(
                name, f"a range has a lowest and a highest value, such as [0, 1], got {value!r}"
            )
        ends = Part({"lowest": value[0], "highest": value[1]}, (*part.address, name))
        found[name] = ends.expression("lowest"), ends.expression("highest")
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
