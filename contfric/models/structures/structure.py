"""A structure with contacts as it is declared: ``M q'' + C q' + K q = f(t)``, and what its contacts carry."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from contfric.models.entries import EntryError, known_keys
from contfric.models.structures.contact_ranges import check_ranges
from contfric.models.structures.contacts import (
    Contact,
    ContactKind,
    drift,
    factor_of,
    read_contacts,
)
from contfric.models.structures.matrices import (
    Mass,
    Texts,
    folded,
    is_zero,
    mass_of,
    matrix_of,
    summed,
    times,
)
from contfric.models.structures.names import check_known, check_states
from contfric.models.structures.shared_loads import Setting, SharedLoads

#: Most combinations of states of contacts that are listed, each a mode with regions of its own.
_MOST_MODES = 243
#: Friction contacts from which on modes are made when they are visited: each has seven regions, four of them
#: 2401 that are read in a second, and five would take nine seconds. What needs all modes is for fewer.
_MANY_FRICTION = 5


@dataclass(frozen=True)
class Structure:
    """A structure as it is declared.

    Attributes
    ----------
    forces : of the coordinates, without contacts: ``f - C q' - K q``
    """

    data: Mapping[str, Any]
    coordinates: tuple[str, ...]
    velocities: tuple[str, ...]
    mass: Mass
    forces: tuple[str, ...]
    contacts: tuple[Contact, ...]

    @classmethod
    def read(cls, data: Mapping[str, Any]) -> Structure:
        """Return the structure of data in the form of :mod:`contfric.models.reading.schema`.

        Raises
        ------
        EntryError
            For the first mistake.
        """
        coordinates = tuple(data["coordinates"])
        size = len(coordinates)
        velocities = tuple(f"v{i}" for i in range(1, size + 1))
        check_states(coordinates, velocities, data["contacts"])
        params = defaults_of(data)
        mass = mass_of(matrix_of("mass", data["mass"], size), params)
        damping, stiffness = (matrix_of(key, data[key], size) for key in ("damping", "stiffness"))
        known_keys(data["force"], coordinates, ("force",))
        forces = tuple(
            _force(data["force"].get(q, "0"), i, coordinates, velocities, damping, stiffness)
            for i, q in enumerate(coordinates)
        )
        contacts = read_contacts(data, coordinates, velocities, tuple(params))
        if not contacts:
            raise EntryError(("contacts",), "a structure has at least one contact")
        known = {*coordinates, *velocities, "t", "pi", *data["contacts"]}
        known |= {*data["define"], *data["observables"], *data["parameters"]}
        for key, rows in ("damping", damping), ("stiffness", stiffness):
            for row, texts in enumerate(rows):
                for text in texts:
                    check_known((key, row), text, known)
        for name, text in data["force"].items():
            check_known(("force", name), text, known)
        known |= {"T", *(f"f_{q}" for q in coordinates)}
        for contact in contacts:
            for key, text in contact.texts.items():
                check_known(("contacts", contact.name, key), text, known)
        found = cls(data, coordinates, velocities, mass, forces, tuple(contacts))
        found.check()
        check_ranges(contacts, params, data["define"])
        return found

    # ------------------------------------------------------------------------------- checks

    @property
    def composes(self) -> bool:
        """Whether modes are made when a solution visits them, and not listed (:mod:`..composition`)."""
        few = len(self.loads.rubbing) < _MANY_FRICTION and self._combinations <= _MOST_MODES
        return (self.coupled or not few) and self._made_when_visited

    @property
    def _made_when_visited(self) -> bool:
        """Whether modes can be made when a solution visits them."""
        numbers = set(defaults_of(self.data)) == set(self.data["parameters"])
        return numbers and not self._has_impacts

    @property
    def length(self) -> float:
        """The unit of its coordinates, if it is in units."""
        return float(self.data.get("in_units", {}).get(self.coordinates[0], 1.0))

    @cached_property
    def loads(self) -> SharedLoads:
        """What the loads of friction contacts depend on."""
        return SharedLoads(self)

    @cached_property
    def coupled(self) -> bool:
        """Whether the load of a friction contact depends on what other ones do."""
        return any(map(self.loads.couples, self.loads.rubbing))

    @property
    def _has_impacts(self) -> bool:
        return any(c.kind is ContactKind.IMPACT for c in self.contacts)

    @property
    def _combinations(self) -> int:
        return math.prod(max(1, len(c.states)) for c in self.contacts)

    @property
    def _why_listed(self) -> str:
        return "impacts" if self._has_impacts else "parameters that follow others"

    def check_count(self) -> None:
        """Refuse more modes than can be listed."""
        if self._combinations > _MOST_MODES:
            raise EntryError(
                ("contacts",),
                f"these contacts have {self._combinations} combinations of states, and with "
                f"{self._why_listed} each is "
                f"listed as a mode: at most {_MOST_MODES} (five contacts of three states)",
            )

    def check(self) -> None:
        """Refuse what cannot be written out."""
        rubbing = [c for c in self.contacts if c.kind is ContactKind.FRICTION]
        self._check_locks(rubbing)
        if self.coupled and not self._made_when_visited:
            pair = next(c for c in rubbing if self.loads.couples(c))
            other = self.loads.coupled[pair.name][0]
            raise EntryError(
                ("contacts", other.name),
                f"the loads of '{pair.name}' and '{other.name}' depend on each other (W . M^-1 W' is not 0); "
                f"that is for models without impacts, and parameters that follow others, and here are "
                f"{self._why_listed}. Friction on masses of their own, or Jenkins elements, are for all",
            )

    def _check_locks(self, rubbing: list[Contact]) -> None:
        """Refuse contacts whose forces are not determined, and those that act at one place."""
        directions = np.zeros((len(rubbing), len(self.coordinates)))
        for row, contact in enumerate(rubbing):
            directions[row, list(contact.direction)] = list(contact.direction.values())
            if np.linalg.matrix_rank(directions[: row + 1]) <= row:
                others = ", ".join(f"'{c.name}'" for c in rubbing[:row])
                raise EntryError(
                    ("contacts", contact.name),
                    f"'{contact.name}' locks with {others}: where they stick the force of each is not "
                    "determined (statically indeterminate). Leave it out, or make it a Jenkins element",
                )
        for one, other in itertools.combinations(self.contacts, 2):
            kinds = {one.kind, other.kind}
            if kinds <= {ContactKind.SPRING, ContactKind.IMPACT} and one.form == other.form:
                raise EntryError(
                    ("contacts", other.name),
                    f"'{other.name}' has the gap of '{one.name}': leave one out",
                )
            if kinds == {ContactKind.FRICTION, ContactKind.JENKINS} and factor_of(one, other):
                raise EntryError(
                    ("contacts", other.name),
                    f"'{one.name}' and '{other.name}' act along one direction: friction that sticks holds "
                    "the element, too. Put a mass between them, or two Jenkins elements",
                )

    def mobility(self, one: Contact, other: Contact) -> str:
        """Return ``W . M^-1 W'`` of two contacts, an expression."""
        moved = self.mass.of({i: repr(w) for i, w in other.direction.items()})
        parts = [times(repr(w), moved[i]) for i, w in one.direction.items() if i in moved]
        return folded(parts)

    # ---------------------------------------------------------------------------- expressions

    def free(self, contact: Contact) -> str:
        """Return the rate of a contact's velocity by the forces and Jenkins elements, an expression."""
        pulls: dict[int, list[str]] = {i: [f"f_{q}"] for i, q in enumerate(self.coordinates)}
        for other in self.contacts:
            if other.kind is ContactKind.JENKINS:
                for i, w in other.direction.items():
                    pulls[i].append(times(repr(w), other.pull("s")))
        moved = self.mass.of({i: summed(parts) for i, parts in pulls.items()})
        return summed(
            [times(repr(w), moved[i]) for i, w in contact.direction.items() if i in moved]
        )

    def load(self, contact: Contact, setting: Setting) -> str:
        """Return the load that friction carries where it sticks."""
        return self.loads.load(contact, setting)

    def speed(self, contact: Contact) -> str:
        """Return the velocity along a direction of coordinates."""
        return summed([times(repr(w), self.velocities[i]) for i, w in contact.direction.items()])

    def approach(self, contact: Contact) -> str:
        """Return the rate of a gap: the wall may move."""
        given = drift(contact)  # minus the rate of what is given: a gap is W . q + g(t)
        speed = self.speed(contact)
        return speed if is_zero(given) else f"{speed} - ({given})"

    @cached_property
    def springs(self) -> dict[str, tuple[Contact, ...]]:
        """The springs that the load of each friction contact depends on."""
        every = [c for c in self.contacts if c.kind is ContactKind.SPRING]
        return {
            c.name: tuple(s for s in every if not is_zero(self.mobility(c, s)))
            for c in self.contacts
            if c.kind is ContactKind.FRICTION
        }


def defaults_of(data: Mapping[str, Any]) -> dict[str, float]:
    """Return the defaults of the parameters that are numbers, and follow no others."""
    return {n: entry["default"] for n, entry in data["parameters"].items() if "default" in entry}


def _force(
    given: str,
    i: int,
    coordinates: tuple[str, ...],
    velocities: tuple[str, ...],
    damping: Texts,
    stiffness: Texts,
) -> str:
    parts = [] if is_zero(given) else [given]
    for texts, names in ((damping, velocities), (stiffness, coordinates)):
        parts += [
            f"-{times(text, name)}"
            for text, name in zip(texts[i], names, strict=True)
            if not is_zero(text)
        ]
    return summed(parts)
