"""Entries of a model's description: each mistake is reported where it stands."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from contfric.base.yaml_lines import Address
from contfric.errors import ModelError, did_you_mean

#: How a side of a surface can be written.
SIDES = {"+": 1, "-": -1, "0": 0, "above": 1, "below": -1, "on": 0, "1": 1, "-1": -1, "+1": 1}
#: Units that are chosen by the sizes of the states.
AUTO = "auto"


class EntryError(ModelError):
    """A mistake in one entry; ``address`` says in which."""

    def __init__(self, address: Address, message: str) -> None:
        super().__init__(message)
        self.address = address


def plain(value: Any) -> Any:
    """Return data as a YAML file has them: keys are texts, arrays and tuples are lists, numbers Python's."""
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    array = value.toarray() if hasattr(value, "toarray") else value  # of scipy's sparse matrices
    return array.tolist() if hasattr(array, "tolist") else array


def as_identifier(name: str) -> str:
    """Return a name that an observable may have: modes and surfaces may be named F+, observables not.

    Examples
    --------
    >>> as_identifier("F+"), as_identifier("free-:a")
    ('Fp', 'freen_a')
    """
    return re.sub(r"\W", "_", name.replace("+", "p").replace("-", "n"))


def one_of(name: str, valid: Iterable[str], what: str, address: Address) -> str:
    """Return a name that is one of a list, at the address of the entry that says it."""
    names = tuple(valid)
    if name not in names:
        hint = did_you_mean(name, names)
        raise EntryError(address, f"'{address[-1]}': no {what} '{name}'{hint}")
    return name


def known_keys(keys: Iterable[str], valid: Iterable[str], address: Address) -> None:
    """Refuse keys of a mapping that name nothing."""
    names = tuple(valid)
    for key in keys:
        if key not in names:
            raise EntryError((*address, key), f"unknown key '{key}'{did_you_mean(key, names)}")


def known_sides(sides: dict[str, int], surfaces: Iterable[str], address: Address) -> dict[str, int]:
    """Return the sides of surfaces, and refuse those of unknown names."""
    names = tuple(surfaces)
    for surface in sides:
        if surface not in names:
            hint = did_you_mean(surface, names)
            raise EntryError((*address, surface), f"no surface '{surface}'{hint}")
    return sides
