"""Names in a structure: those of its states must differ, those in its matrices and forces must be known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from contfric.errors import ModelError, did_you_mean
from contfric.models.entries import EntryError
from contfric.models.language.grammar import check_name, names_in, parse

#: Keys of a model: the structure that modes are made from, and its coordinates.
STRUCTURE, COORDINATES = "structure", "coordinates"


def check_states(
    coordinates: tuple[str, ...], velocities: tuple[str, ...], contacts: Mapping[str, Any]
) -> None:
    """Refuse names of coordinates and of stretches that are those of other states, each in its line."""
    taken = dict.fromkeys(velocities, "velocity")
    for i, name in enumerate(coordinates):
        try:
            check_name(name, "coordinate")
        except ModelError as error:
            raise EntryError((COORDINATES, i), str(error)) from None
        if name in taken:
            raise EntryError(
                (COORDINATES, i), f"the coordinate '{name}' has the name of a {taken[name]}"
            )
        taken[name] = "coordinate"
    for name, given in contacts.items():
        if name in taken and given["kind"] == "jenkins":
            raise EntryError(
                ("contacts", name), f"the stretch of '{name}' has the name of a {taken[name]}"
            )


def check_known(address: tuple[str | int, ...], text: str, known: set[str]) -> None:
    """Refuse names in an expression that are not known, at its address.

    Raises
    ------
    EntryError
        For the first one.
    """
    try:
        foreign = sorted(names_in(parse(text)) - known)
    except ModelError as error:
        raise EntryError(address, str(error)) from None
    if foreign:
        hint = did_you_mean(foreign[0], sorted(known))
        raise EntryError(address, f"unknown name '{foreign[0]}'{hint}")
