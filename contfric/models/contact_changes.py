"""What a structure does at the surfaces of its contacts: where motion on them leaves to, and impacts."""

from __future__ import annotations

from typing import Any

from contfric.models.contact_surfaces import ContactSurfaces, subsets
from contfric.models.contacts import Contact, ContactKind
from contfric.models.matrices import times
from contfric.models.shared_loads import Limit
from contfric.models.structure import Structure


def departures_of(surfaces: ContactSurfaces) -> list[dict[str, Any]]:
    """Return where motion on the surfaces of all contacts leaves to."""
    return [found for c in surfaces.contacts for found in _departures(surfaces, c)]


def _departures(surfaces: ContactSurfaces, c: Contact) -> list[dict[str, Any]]:
    if c.kind is ContactKind.JENKINS:
        return _stops(surfaces, c) if surfaces.stop_of(c)[0] == c.name else []
    if c.kind is not ContactKind.FRICTION:
        return []
    found, springs = [], surfaces.structure.springs[c.name]
    for closed in subsets(springs):
        gaps = {s.name: "-" if s in closed else "+" for s in springs}
        for sign in "+-":  # friction that has reached its limit slides
            limit = Limit(c, sign, tuple((s, "c") for s in closed))
            where = {c.name: "0", limit.name: sign, **gaps}
            found.append({"where": where, "leaves": {c.name: sign}})
    return found


def _stops(surfaces: ContactSurfaces, first: Contact) -> list[dict[str, Any]]:
    """Return what sticks when a velocity changes its sign: all elements along it that slide, at once."""
    along = [
        (c, ways)
        for c in surfaces.contacts
        if c.kind is ContactKind.JENKINS
        for stop, ways in [surfaces.stop_of(c)]
        if stop == first.name
    ]
    found = []
    for sliding in reversed(subsets(along)):  # the largest set that slides is all of them
        for side in "+-" if sliding else "":
            limits = [
                (f"{c.name}{'+' if ways['p'] == side else '-'}", "+-"[ways["p"] == side])
                for c, ways in sliding
            ]
            where = {**dict.fromkeys((name for name, _ in limits), "0")}
            found.append(
                {
                    "where": where | {first.name: "-" if side == "+" else "+"},
                    "leaves": dict(limits),
                }
            )
    return found


def resets_of(structure: Structure) -> dict[str, dict[str, Any]]:
    """Return what an impact does to the velocities, of each contact that has impacts."""
    found: dict[str, dict[str, Any]] = {}
    for c in structure.contacts:
        if c.kind is ContactKind.IMPACT:
            over = structure.mobility(c, c)
            kick = f"-(1 + ({c.texts['restitution']}))*({structure.approach(c)})/({over})"
            moved = structure.mass.of({i: repr(w) for i, w in c.direction.items()})
            found[c.name] = {
                structure.velocities[i]: f"{structure.velocities[i]} + {times(w, kick)}"
                for i, w in moved.items()
            }
            if c.chatter:
                found[c.name]["chatter"] = True
    return found
