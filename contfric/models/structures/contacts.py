"""Contacts between the parts of a structure: each has a few states, surfaces between them, and forces.

``friction``
    sticks (s) until its load reaches the static limit, slides up (p) or down (n) with the kinetic one;
``jenkins``
    a spring in series with a slider: its stretch is a state; the slider sticks (s) until the force is the
    limit, and slides (p, n) until the velocity changes its sign;
``spring``
    a gap that is open (o), or closed (c) with a force ``-stiffness * gap``;
``impact``
    a gap at whose end the relative velocity is reversed, times the restitution.

A contact acts along a direction W of the coordinates: the gradient of its velocity, gap or displacement. With
the mass matrix M, the forces f and the relative velocity ``w = W . v - w0(t)`` a friction contact that sticks
carries the load ``u = (W . M^-1 f - w0') / (W . M^-1 W)``: it slides when that is the static limit
(Lagrange's multiplier of the constraint w = 0 [1]_). Where ``W_i . M^-1 W_j = 0`` for any two of them, the
load of each is a function of time and state alone; others share it
(:mod:`contfric.models.structures.shared_loads`).

.. [1] F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley (1996), chapters 3 and 5.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

from contfric.base.yaml_lines import Address
from contfric.errors import ModelError
from contfric.models.entries import EntryError
from contfric.models.language.coefficient_texts import text_of
from contfric.models.language.coefficients import AFFINE, CONSTANT, Affine, symbols
from contfric.models.language.grammar import Scope, check_name, parse
from contfric.models.language.not_affine import NotAffineError


class ContactKind(str, Enum):
    """Kinds of contacts, by their names in a model's file."""

    FRICTION = "friction"
    JENKINS = "jenkins"
    SPRING = "spring"
    IMPACT = "impact"


#: Keys of a contact that are not expressions of what it carries: where it rests, and whether it chatters.
_AT, _CHATTER = "at", "chatter"
#: What the direction of each kind is the gradient of.
_DIRECTION = {
    ContactKind.FRICTION: "velocity",
    ContactKind.JENKINS: "displacement",
    ContactKind.SPRING: "gap",
    ContactKind.IMPACT: "gap",
}


@dataclass(frozen=True)
class Contact:
    """A contact as it is declared.

    Attributes
    ----------
    texts : its expressions by their keys
    direction : (coordinate, weight), the entries of W that are not zero
    form : what W is the gradient of, an affine form of states and time
    chatter : whether impacts may come to rest, a mode of its own
    at : where it rests if it never slips, an expression of the parameters; empty if the motion decides
    """

    name: str
    kind: ContactKind
    texts: Mapping[str, str]
    direction: Mapping[int, float]
    form: Affine = field(repr=False)
    chatter: bool = False
    at: str = ""

    @property
    def states(self) -> str:
        """A letter for each state."""
        return {"friction": "spn", "jenkins": "spn", "spring": "oc", "impact": ""}[self.kind.value]

    def pull(self, state: str) -> str:
        """Return the force along its direction, apart from that of friction which sticks."""
        if self.kind is ContactKind.FRICTION and state in "pn":
            return f"{'-' if state == 'p' else ''}({self.texts['kinetic']})"
        if self.kind is ContactKind.JENKINS:
            return f"-({self.texts['stiffness']})*{self.name}"
        if self.kind is ContactKind.SPRING and state == "c":
            return f"-({self.texts['stiffness']})*({self.texts['gap']})"
        return "0"


def read_contacts(
    data: Mapping[str, Any],
    coordinates: tuple[str, ...],
    velocities: tuple[str, ...],
    parameters: tuple[str, ...],
) -> list[Contact]:
    """Read the contacts of a structure.

    Raises
    ------
    EntryError
        For the first mistake.
    """
    given = data["contacts"]
    own = tuple(n for n, entry in given.items() if entry["kind"] == ContactKind.JENKINS.value)
    scope = Scope(
        AFFINE,
        symbols((*coordinates, *velocities, *own), parameters),
        {name: parse(text) for name, text in data["define"].items()},
    )
    found = []
    for name, entry in given.items():
        address = ("contacts", name)
        try:
            check_name(name, "contact")
        except ModelError as error:
            raise EntryError(address, str(error)) from None
        if name in (*coordinates, *velocities, *parameters):
            raise EntryError(
                address,
                f"'{name}' is a coordinate, velocity or parameter: give the contact another name",
            )
        kind = ContactKind(entry["kind"])
        texts = {k: text for k, text in entry.items() if k not in ("kind", _AT, _CHATTER)}
        place, count = (*address, _DIRECTION[kind]), len(coordinates)
        form = _form(place, entry[_DIRECTION[kind]], scope)
        shift = count if kind is ContactKind.FRICTION else 0
        direction = _direction(place, form, shift, count)
        contact = Contact(name, kind, texts, direction, form, bool(entry.get(_CHATTER)))
        found.append(replace(contact, at=_position(address, entry.get(_AT, ""), contact, scope)))
    return found


def _position(address: Address, text: str, contact: Contact, scope: Scope[Affine]) -> str:
    """Return where a contact is to rest; empty if nothing is said."""
    place = (*address, _AT)
    if text and set(_form(place, text, scope).parts) - {CONSTANT}:
        raise EntryError(
            place, f"'{_AT}' is made of numbers and parameters, such as 0.12, got {text}"
        )
    if text and contact.kind is ContactKind.FRICTION and not is_at_rest(contact):
        raise EntryError(
            place,
            f"what '{contact.name}' rubs on moves ({contact.texts['velocity']}), so that it has no place "
            "of rest: leave 'at' out",
        )
    return text


def is_at_rest(contact: Contact) -> bool:
    """Tell whether the velocity of a friction contact is one of coordinates alone: nothing else moves."""
    return all(kind == "y" for kind, _ in contact.form.parts)


def _form(address: Address, text: str, scope: Scope[Affine]) -> Affine:
    try:
        return scope.evaluate(parse(text))
    except NotAffineError as reason:
        raise EntryError(address, f"'{address[-1]}' is linear in the states: {reason}") from None
    except ModelError as error:
        raise EntryError(address, str(error)) from None


def _direction(address: Address, form: Affine, shift: int, count: int) -> dict[int, float]:
    """Return the gradient of an affine form by the coordinates (or, shifted, by the velocities)."""
    key, what = address[-1], "velocities" if shift else "coordinates"
    found: dict[int, float] = {}
    for (kind, which), slope in form.parts.items():
        if kind != "y":
            continue
        weight = slope.number
        if weight is None:
            raise EntryError(
                address, f"the factors of the {what} in '{key}' are numbers, not parameters"
            )
        if not shift <= which < shift + count:
            example = "v1 - v2" if shift else "0.1 - q1"
            raise EntryError(
                address,
                f"'{key}' is made of {what}, numbers, parameters and t, such as {example}",
            )
        found[which - shift] = weight
    if not found:
        raise EntryError(address, f"'{key}' has none of the {what}: nothing moves this contact")
    return found


def drift(contact: Contact) -> str:
    """Return the derivative of the given part ``w0(t)`` of a contact's velocity by time."""
    parts = []
    for (kind, which), by in contact.form.parts.items():
        if (kind, which) == CONSTANT or kind == "y":
            continue
        w = text_of(which)
        wave, sign = ("sin", "") if kind == "cos" else ("cos", "-")  # w0 is minus what stands in w
        parts.append(f"{sign}({text_of(by)})*({w})*{wave}(({w})*t)")
    return " + ".join(parts) or "0"


def factor_of(one: Contact, other: Contact) -> float:
    """Return by which factor the direction of one contact is that of another one; 0 if it is not."""
    if one.direction.keys() != other.direction.keys():
        return 0.0
    i, *_ = other.direction
    factor = other.direction[i] / one.direction[i]
    same = all(
        math.isclose(w, factor * one.direction[j], rel_tol=1e-12)
        for j, w in other.direction.items()
    )
    return factor if same else 0.0
