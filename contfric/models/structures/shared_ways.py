"""Outcomes where one of several contacts that share their loads slips or comes to rest.

The contacts that are at rest then, and feel each other over others that are, decide together
(:mod:`contfric.models.structures.complementarity`): the one whose state changes, and those of its cluster
(:mod:`contfric.models.structures.shared_loads`). Each combination of their states is possible under
conditions on loads in the setting after the event: of what sticks within the limits, of what slides beyond.
Where one solution exists exactly one of them holds.

A simulation solves for the states at the joint. Of the combinations only those that are near are listed: in
which one contact beyond that which changes does so too (all of three contacts); another one is known once a
solution has taken it, or is asked for by name.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from contfric.base.attributes import kept
from contfric.errors import ContfricError
from contfric.models.language.python_code import Function, function_of
from contfric.models.structures.complementarity import ContactsAtRest
from contfric.models.structures.contacts import Contact, ContactKind, drift
from contfric.models.structures.matrices import is_zero, times
from contfric.models.structures.shared_loads import Limit
from contfric.models.structures.structure import Structure

if TYPE_CHECKING:
    from contfric.models.described.description import Description

#: Contacts that decide together of which all combinations are listed.
_ALL = 3
#: States in which contacts have a force that is given; that of Jenkins elements is a state of the model.
_ACTS = dict.fromkeys(ContactKind, ()) | {
    ContactKind.FRICTION: ("p", "n"),
    ContactKind.SPRING: ("c",),
}
States = Mapping[str, str]
#: Parameters, time and state.
Place = tuple[Mapping[str, float], float, Sequence[float]]


class SharedWays:
    """What follows in a structure whose friction contacts share loads."""

    def __init__(self, structure: Structure, description: Description) -> None:
        self._structure, self._loads = structure, structure.loads
        self._names = description.names

    def listed(self, contact: Contact, states: States) -> Iterator[dict[str, str]]:
        """Yield states that may follow where a contact changes its own, the simplest first."""
        others = self._loads.cluster(contact, states)[1:]
        keeps = states[contact.name] == "s" and not jumps(contact)
        for own in self._own(contact, states):
            after = {**states, contact.name: own}
            yield after
            if keeps:
                continue
            if len(others) < _ALL:
                for letters in itertools.product("spn", repeat=len(others)):
                    if set(letters) != {"s"}:
                        yield {**after, **_named(others, letters)}
            else:
                for other, letter in itertools.product(others, "pn"):
                    yield {**after, other.name: letter}

    def _own(self, contact: Contact, states: States) -> str:
        """Return the states that a contact may change to: one that stops sticks or reverses."""
        return {"s": "pn", "p": "sn", "n": "sp"}[states[contact.name]]

    def may_follow(self, contact: Contact, states: States, after: States) -> bool:
        """Tell whether only the contacts that decide together have other states."""
        changed = {name for name, letter in after.items() if states[name] != letter}
        deciding = {c.name for c in self._loads.cluster(contact, states)}
        return contact.name in changed <= deciding

    def conditions(self, contact: Contact, states: States, after: States) -> dict[str, int]:
        """Return the sides of the surfaces of loads for which some states follow."""
        found: dict[str, int] = {}
        for c in self._loads.cluster(contact, states):
            if c is contact and states[c.name] == "s":
                continue  # it is at its limit
            upper = Limit(c, "+", self._loads.setting(c, after))
            letter = after[c.name]
            if letter != "n":
                found[upper.name] = -1 if letter == "s" else 1
            if letter != "p":
                found[upper.other.name] = 1 if letter == "s" else -1
        if states[contact.name] == "s" and not jumps(contact):
            return {}  # the loads are the same on both sides
        return found

    # ------------------------------------------------------------------------------ in numbers

    def solved(
        self,
        resting: Sequence[Contact],
        states: States,
        place: Place,
        given: Mapping[str, str],
    ) -> dict[str, str]:
        """Return the states of contacts at rest.

        Parameters
        ----------
        states : of all others
        place : parameters, time and state
        given : states of contacts at rest that are known

        Raises
        ------
        ContfricError
            If there are none.
        """
        letters = "".join(given.get(c.name, " ") for c in resting)
        found = self._rest(resting, states, place).states(letters)
        if found is None:
            names = ", ".join(f"'{c.name}'" for c in resting)
            raise ContfricError(
                f"no states of the contacts {names} agree with their forces at t = {place[1]:g}: with static "
                "friction above kinetic friction there may be none"
            )
        return _named(resting, found)

    def _rest(
        self,
        resting: Sequence[Contact],
        states: States,
        place: Place,
    ) -> ContactsAtRest:
        names = {c.name for c in resting}
        acting = [
            (c.name, letter)
            for c in self._structure.contacts
            if (letter := states.get(c.name, "")) in _ACTS[c.kind] and c.name not in names
        ]

        def value(*key: str) -> float:
            function = self._function(*key)
            return 0.0 if function is None else function(*place)

        def free(name: str) -> float:
            return value("free", name) + sum(value("push", name, *other) for other in acting)

        own = [c.name for c in resting]
        return ContactsAtRest(
            np.array([[value("mobility", a, b) for b in own] for a in own]),
            np.array([free(name) for name in own]),
            np.array([[value("pull", name, letter) for name in own] for letter in "pn"]),
            np.array([value("static", name) for name in own]),
        )

    @kept
    def _function(self, *key: str) -> Function | None:
        text = self._text(*key)
        return None if is_zero(text) else function_of(self._names, text)

    def _text(self, what: str, name: str, other: str = "", letter: str = "") -> str:
        """Return a number of the problem as an expression."""
        structure, by_name = self._structure, {c.name: c for c in self._structure.contacts}
        c = by_name[name]
        if what == "free":
            return f"{structure.free(c)} - ({drift(c)})"
        if what == "pull":
            return c.pull(other)
        if what == "static":
            return c.texts.get("static", c.texts["kinetic"])
        by = structure.mobility(c, by_name[other])
        return by if what == "mobility" or is_zero(by) else times(by, by_name[other].pull(letter))


def jumps(contact: Contact) -> bool:
    """Tell whether the force of a contact jumps where it lets go."""
    kinetic = contact.texts["kinetic"]
    return contact.texts.get("static", kinetic) != kinetic


def _named(contacts: Sequence[Contact], letters: Sequence[str]) -> dict[str, str]:
    return {c.name: letter for c, letter in zip(contacts, letters, strict=True)}
