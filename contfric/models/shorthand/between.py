"""Modes between levels: of a model that gives one field, with kinks or jumps at its surfaces.

Saturation, a dead zone, Chua's diode: a textbook writes one formula, with a kink at each level. Each way to
lie below, between or above the levels is a mode, in which the formula is smooth.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Any

from contfric.models.entries import EntryError
from contfric.models.shorthand.clocks import value_at_defaults

#: Modes that are made: as many as three observables with three levels each have. More are written down.
_MOST = 64


def modes_between(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a mode for each way to lie between the levels of all observables.

    It is called by the observables: ``x-``, ``x0`` and ``x+`` between two levels, ``x0`` to ``x3`` between
    three. An observable without a name has that of its surface.

    Examples
    --------
    >>> levels = {"b": {"observable": "x", "level": "1"}, "a": {"observable": "x", "level": "-1"}}
    >>> [*modes_between({"surfaces": levels, "parameters": {}, "define": {}})]
    ['x-', 'x0', 'x+']
    """
    levels: dict[str, list[str]] = {}
    for name, entry in data["surfaces"].items():
        levels.setdefault(entry["observable"], []).append(name)
    regions = [_regions(observable, names, data) for observable, names in levels.items()]
    found: dict[str, Any] = {}
    for parts in product(*regions):
        name = "".join(own for own, _ in parts)
        found[name] = {"in": {s: side for _, sides in parts for s, side in sides.items()}}
        if len(found) > _MOST:
            raise EntryError(
                ("modes",),
                f"between {len(data['surfaces'])} surfaces there are more than {_MOST} modes: write down "
                "those that there are, such as modes: {free: {in: {wall: -}}}",
            )
    return found


def _regions(
    observable: str, names: list[str], data: Mapping[str, Any]
) -> list[tuple[str, dict[str, str]]]:
    """Return the parts between levels of an observable, from the lowest: names, and sides of surfaces."""
    values = {n: value_at_defaults(data["surfaces"][n].get("level", "0"), data) for n in names}
    upwards = sorted(names, key=values.__getitem__)
    label = observable if observable.isidentifier() else names[0].rstrip("+-") or names[0]
    marks = {1: [*"-+"], 2: [*"-0+"]}.get(len(names), [str(k) for k in range(len(names) + 1)])
    return [
        (f"{label}{mark}", {n: "+" if i < k else "-" for i, n in enumerate(upwards)})
        for k, mark in enumerate(marks)
    ]
