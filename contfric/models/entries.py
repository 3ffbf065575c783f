"""Entries of a model's description, read one by one: each mistake is reported where it stands."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

from contfric.base.yaml_lines import Address, as_truth, comma_hint
from contfric.errors import ModelError, did_you_mean

#: How a side of a surface can be written.
SIDES = {
    **{"+": 1, "-": -1, "0": 0, "above": 1, "below": -1, "on": 0},
    **{"1": 1, "-1": -1, "+1": 1},
}


class EntryError(ModelError):
    """A mistake in one entry; ``address`` says in which."""

    def __init__(self, address: Address, message: str) -> None:
        super().__init__(message)
        self.address = address


def mapping_in(data: Mapping[str, Any], key: str) -> dict[str, Any]:
    """Return a part of a model's data that is a mapping, as a copy; an empty one if it is not there."""
    value = data.get(key)
    return {str(k): v for k, v in value.items()} if isinstance(value, Mapping) else {}


def constraints_in(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return a model's constraints with their meanings, however declared: those of a list have none."""
    given = data.get("constraints") or {}
    return dict(given if isinstance(given, Mapping) else dict.fromkeys(map(str, given), ""))


def as_identifier(name: str) -> str:
    """Return a name that an observable may have: modes and surfaces may be named F+, observables not.

    Examples
    --------
    >>> as_identifier("F+"), as_identifier("free-:a")
    ('Fp', 'freen_a')
    """
    return re.sub(r"\W", "_", name.replace("+", "p").replace("-", "n"))


def listed(value: object) -> list[Any]:
    """Return the entries of a list, the keys of a mapping, or what stands alone as a list of one."""
    return list(value) if isinstance(value, (list, tuple, Mapping)) else [value]


@dataclass(frozen=True)
class Part:
    """A mapping inside a description, with its place."""

    data: Mapping[str, Any]
    address: Address = ()

    def fail(self, key: str | int | None, message: str) -> NoReturn:
        """Report a mistake in one of the entries, or in the part itself."""
        raise EntryError(self.address if key is None else (*self.address, key), message)

    def only(self, valid: Iterable[str]) -> None:
        """Refuse keys that have no meaning."""
        known = tuple(valid)
        for key in self.data:
            if key not in known:
                hint = comma_hint(key, self.data[key]) or did_you_mean(key, known)
                self.fail(key, f"unknown key '{key}'{hint}")

    def needs(self, key: str, wanted: str) -> Any:
        """Return an entry that must be there."""
        if key not in self.data or self.data[key] is None:
            self.fail(None, f"key '{key}' is missing; it must be {wanted}")
        return self.data[key]

    def text(self, key: str, default: str | None = None) -> str:
        """Return an entry that is a line of text."""
        value = self.data.get(key)
        if value in (None, "") and default is not None:
            return default
        if not isinstance(value, str) or not value.strip():
            self.fail(key if key in self.data else None, f"'{key}' must be a text, got {value!r}")
        return " ".join(value.split())

    def texts(self, key: str) -> tuple[str, ...]:
        """Return an entry that is a list of texts, empty if it is not there."""
        value = self.data.get(key)
        if value is None:
            return ()
        if not isinstance(value, (list, tuple)) or not all(isinstance(v, str) for v in value):
            self.fail(key, f"'{key}' must be a list of texts, got {value!r}")
        return tuple(" ".join(v.split()) for v in value)

    def part(self, key: str, wanted: str, required: bool = False) -> Part:
        """Return an entry that is a mapping; an empty one if it is not there."""
        value = self.needs(key, wanted) if required else self.data.get(key)
        if value is None:
            value = {}
        if not isinstance(value, Mapping):
            self.fail(key, f"'{key}' must be {wanted}, got {value!r}")
        return Part({str(k): v for k, v in value.items()}, (*self.address, key))

    def one_of(self, key: str, valid: Iterable[str], what: str, default: str | None = None) -> str:
        """Return an entry that is a name out of a list."""
        names = tuple(valid)
        value = self.data.get(key, default)
        if value not in names:
            hint = did_you_mean(str(value), names)
            self.fail(key if key in self.data else None, f"'{key}': no {what} '{value}'{hint}")
        return str(value)

    def expression(self, key: str) -> str:
        """Return an entry that is an expression."""
        value = self.data[key]
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            hint = comma_hint(key, value)
            self.fail(key, f"'{key}' must be an expression, got {value!r}{hint}")
        return " ".join(str(value).split())

    def flag(self, key: str) -> bool | None:
        """Return an entry that is true or false, None if it is not there."""
        value = as_truth(self.data.get(key))
        if value is not None and not isinstance(value, bool):
            self.fail(key, f"'{key}' must be true or false, got {value!r}")
        return value

    def sides(self, key: str, surfaces: Iterable[str]) -> dict[str, int]:
        """Return a mapping from surfaces to sides: +, - or 0."""
        names = tuple(surfaces)
        part = self.part(key, "a mapping of surfaces to a side, such as {v: +, F+: -}")
        found = {}
        for surface, value in part.data.items():
            if surface not in names:
                part.fail(surface, f"no surface '{surface}'{did_you_mean(surface, names)}")
            side = None if isinstance(value, bool) else SIDES.get(str(value))
            if side is None:
                part.fail(
                    surface,
                    f"the side of '{surface}' is + (above), - (below) or 0 (on), got {value!r}",
                )
            found[surface] = side
        return found


def is_number(value: object) -> bool:
    """Tell whether an entry is a number; true and false are not."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)
