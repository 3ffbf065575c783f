"""The modes that an entry of ``resets`` names: those that it leads into (``to``), and acts in (``from``)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from contfric.base.yaml_lines import Address
from contfric.models.entries import known_sides, one_of
from contfric.models.parts import Lead

#: Their keys.
TO, FROM = "to", "from"


def leads_of(
    entry: Mapping[str, Any], modes: list[str], surfaces: list[str], address: Address
) -> tuple[Lead, ...]:
    """Return the modes that a reset leads into: one, the first of a list, or the first whose sides hold.

    A mode may be led into from some modes only: ``{heat: {from: waiting}}``.
    """
    found = []
    for led in entry[TO]:
        for mode, asked in led.items():
            one_of(mode, modes, "mode", (*address, TO))
            place = (*address, TO, mode)
            sides = {surface: side for surface, side in asked.items() if surface != FROM}
            after = acts_of(asked, modes, place) if FROM in asked else ()
            found.append(Lead(mode, known_sides(sides, surfaces, place), after))
    return tuple(found)


def pairs_of(given: Any) -> list[Any]:
    """Return the modes that are led into as a list of ``{mode: sides}``, in their order."""
    if isinstance(given, Mapping):
        return [{mode: {} if sides is None else sides} for mode, sides in given.items()]
    items = given if isinstance(given, (list, tuple)) else [given]
    return [
        pair for x in items for pair in (pairs_of(x) if isinstance(x, Mapping) else [{str(x): {}}])
    ]


def acts_of(entry: Mapping[str, Any], modes: list[str], address: Address) -> tuple[str, ...]:
    """Return the modes that a reset acts in."""
    return tuple(one_of(mode, modes, "mode", (*address, FROM)) for mode in entry[FROM])


def named_parts(
    resets: Mapping[str, Any], parts: Mapping[str, tuple[str, ...]]
) -> dict[str, dict[str, Any]]:
    """Return resets that name the parts of modes that have been divided, in place of the modes.

    Where a reset leads into modes from some modes, the mode before goes on elsewhere, in any of its parts.
    """

    def named(given: list[str]) -> list[str]:
        return [part for m in given for part in parts.get(m, (m,))]

    def led_into(given: Any) -> list[Any]:
        found: list[Any] = []
        for pair in pairs_of(given):
            for mode, sides in pair.items():
                inside = {**sides, FROM: named(sides[FROM])} if FROM in sides else sides
                found += [{part: inside} for part in parts.get(mode, (mode,))]
        goes_on = [{part: {FROM: [*own]}} for own in parts.values() for part in own]
        return [*found, *goes_on]

    by_key = {TO: led_into, FROM: named}
    return {
        surface: {k: by_key[k](value) if k in by_key else value for k, value in entry.items()}
        for surface, entry in resets.items()
    }
