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
    given = entry.data[TO]
    named = given if isinstance(given, Mapping) else {mode: {} for mode in listed(given)}
    whole = {str(mode): sides for mode, sides in named.items()}
    plain = {mode: _without_from(sides) for mode, sides in whole.items()}
    part, found = Part(plain, (*entry.address, TO)), []
    for mode, sides in whole.items():
        Part({TO: mode}, entry.address).one_of(TO, modes, "mode")
        asked = isinstance(sides, Mapping) and FROM in sides
        after = acts_of(Part(sides, (*part.address, mode)), modes) if asked else ()
        found.append(Lead(mode, part.sides(mode, surfaces), after))
    return tuple(found)


def _without_from(sides: Any) -> Any:
    return {k: v for k, v in sides.items() if k != FROM} if isinstance(sides, Mapping) else sides


def acts_of(entry: Part, modes: list[str]) -> tuple[str, ...]:
    """Return the modes that a reset acts in."""
    named = Part({str(i): v for i, v in enumerate(listed(entry.data[FROM]))}, entry.address)
    return tuple(named.one_of(key, modes, "mode") for key in named.data)


def named_parts(
    resets: Mapping[str, Any], parts: Mapping[str, tuple[str, ...]]
) -> dict[str, dict[str, Any]]:
    """Return resets that name the parts of modes that have been divided, in place of the modes."""

    def named(given: Any) -> Any:
        if isinstance(given, Mapping):
            return {
                part: {**sides, FROM: named(sides[FROM])} if FROM in (sides or {}) else sides
                for m, sides in given.items()
                for part in parts.get(m, (m,))
            }
        return [part for m in listed(given) for part in parts.get(m, (m,))]

    return {
        surface: {key: named(value) if key in (TO, FROM) else value for key, value in entry.items()}
        for surface, entry in resets.items()
    }
