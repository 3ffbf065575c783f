"""Names in a structure: those of its states must differ, those in its matrices and forces must be known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from contfric.errors import ModelError, did_you_mean
from contfric.models.entries import EntryError, Part, mapping_in
from contfric.models.grammar import check_name, names_in, parse
from contfric.models.matrices import matrix_of

COORDINATES = "coordinates"


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
        if name in taken and isinstance(given, Mapping) and given.get("kind") == "jenkins":
            raise EntryError(
                ("contacts", name), f"the stretch of '{name}' has the name of a {taken[name]}"
            )


def check_names(top: Part, key: str, size: int, known: set[str]) -> None:
    """Look up the names in a matrix or in the forces, each in its row."""
    given = top.data.get(key)
    rows: list[tuple[str | int, list[str]]] = (
        [(q, [str(text)]) for q, text in mapping_in(top.data, key).items()]
        if key == "force"
        else list(enumerate(matrix_of(key, given, size, "0")))
    )
    for row, texts in rows:
        for text in texts:
            try:
                foreign = sorted(names_in(parse(text)) - known)
            except ModelError as error:
                raise EntryError((key, row), str(error)) from None
            if foreign:
                hint = did_you_mean(foreign[0], sorted(known))
                raise EntryError((key, row), f"unknown name '{foreign[0]}'{hint}")
