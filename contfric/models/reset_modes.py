"""The modes that an entry of ``resets`` names: those that it leads into (``to``), and acts in (``from``)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from contfric.models.entries import Part, listed
from contfric.models.parts import Lead

#: Their keys.
TO, FROM = "to", "from"


def leads_of(entry: Part, modes: list[str], surfaces: list[str]) -> tuple[Lead, ...]:
    """Return the modes that a reset leads into: one, the first of a list, or the first whose sides hold.

    A mode may be led into from some modes only: ``{heat: {from: waiting}}``.
    """
    found = []
    for mode, sides in _pairs(entry.data[TO]):
        Part({TO: mode}, entry.address).one_of(TO, modes, "mode")
        part = Part({mode: _without_from(sides)}, (*entry.address, TO))
        asked = isinstance(sides, Mapping) and FROM in sides
        after = acts_of(Part(sides, (*part.address, mode)), modes) if asked else ()
        found.append(Lead(mode, part.sides(mode, surfaces), after))
    return tuple(found)


def _pairs(given: Any) -> list[tuple[str, Any]]:
    """Return the modes that are led into, each with its sides, in their order."""
    if isinstance(given, Mapping):
        return [(str(mode), sides) for mode, sides in given.items()]
    return [
        pair
        for item in listed(given)
        for pair in (_pairs(item) if isinstance(item, Mapping) else [(str(item), {})])
    ]


def _without_from(sides: Any) -> Any:
    return {k: v for k, v in sides.items() if k != FROM} if isinstance(sides, Mapping) else sides


def acts_of(entry: Part, modes: list[str]) -> tuple[str, ...]:
    """Return the modes that a reset acts in."""
    named = Part({str(i): v for i, v in enumerate(listed(entry.data[FROM]))}, entry.address)
    return tuple(named.one_of(key, modes, "mode") for key in named.data)


def named_parts(
    resets: Mapping[str, Any], parts: Mapping[str, tuple[str, ...]]
) -> dict[str, dict[str, Any]]:
    """Return resets that name the parts of modes that have been divided, in place of the modes.

    Where a reset leads into modes from some modes, the mode before goes on elsewhere, in any of its parts.
    """

    def named(given: Any) -> list[str]:
        return [part for m in listed(given) for part in parts.get(m, (m,))]

    def led_into(given: Any) -> list[Any]:
        found: list[Any] = []
        for mode, sides in _pairs(given):
            asked = FROM in (sides or {})
            inside = {**sides, FROM: named(sides[FROM])} if asked else sides
            found += [{part: inside} if inside else part for part in parts.get(mode, (mode,))]
        goes_on = [{part: {FROM: [*own]}} for own in parts.values() for part in own]
        return [*found, *goes_on]

    by_key = {TO: led_into, FROM: named}
    return {
        surface: {k: by_key[k](value) if k in by_key else value for k, value in entry.items()}
        for surface, entry in resets.items()
    }
