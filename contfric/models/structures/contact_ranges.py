"""Allowed values of contact parameters: friction that drives, or a wall that pulls, is a mistake.

==========  ==============================================================================================
friction    ``0 <= kinetic <= static``; 0 means no friction
jenkins     ``stiffness > 0`` and ``limit > 0``
spring      ``stiffness >= 0``; 0 means no spring. One that pulls belongs to the stiffness matrix
impact      ``0 <= restitution <= 1``: energy is lost, or kept
==========  ==============================================================================================

What depends on parameters only is looked at where the model is read, at the defaults, and where it is linear
in them it is a constraint of the model, that every other value obeys too. What depends on time or states is
the author's. A gap may be negative at rest: the parts are then pressed together.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from contfric.errors import ModelError
from contfric.models.entries import EntryError
from contfric.models.language.grammar import FLOATS, Scope, names_in, parse
from contfric.models.language.linear import linear_form
from contfric.models.structures.contacts import Contact, ContactKind


@dataclass(frozen=True)
class Range:
    """An inequality ``left <= right`` or ``left < right``; each is a key of the contact, or a number.

    ``key`` is the entry that is wrong where it does not hold, ``valid`` says what is.
    """

    key: str
    left: str
    sign: str
    right: str
    valid: str


_RESTITUTION = "a restitution is at least 0 (nothing comes back) and at most 1 (no loss)"
_FRICTION = "friction is at least 0, kinetic friction no larger than static friction"
RANGES = {
    ContactKind.FRICTION: (
        Range("kinetic", "0", "<=", "kinetic", _FRICTION),
        Range("static", "kinetic", "<=", "static", _FRICTION),
    ),
    ContactKind.JENKINS: (
        Range("stiffness", "0", "<", "stiffness", "the stiffness of an element is above 0"),
        Range("limit", "0", "<", "limit", "the force at which an element slips is above 0"),
    ),
    ContactKind.SPRING: (
        Range("stiffness", "0", "<=", "stiffness", "the stiffness of a spring is at least 0"),
    ),
    ContactKind.IMPACT: (
        Range("restitution", "0", "<=", "restitution", _RESTITUTION),
        Range("restitution", "restitution", "<=", "1", _RESTITUTION),
    ),
}


def check_ranges(
    contacts: Sequence[Contact], params: Mapping[str, float], define: Mapping[str, str]
) -> None:
    """Refuse contacts whose numbers are not valid at the defaults.

    Raises
    ------
    EntryError
        For the first one; it says where, and what is valid.
    """
    scope = Scope(FLOATS, dict(params), {name: parse(text) for name, text in define.items()})
    for contact, asked, (left, right) in _asked(contacts):
        try:
            low, high = (scope.evaluate(parse(text)) for text in (left, right))
        except ModelError:  # of time or states, or of a parameter that follows others
            continue
        if not (low < high if asked.sign == "<" else low <= high):
            own = contact.texts.get(asked.key, "")
            value = scope.evaluate(parse(own))
            is_number = not names_in(parse(own))
            raise EntryError(
                ("contacts", contact.name, asked.key),
                f"{asked.valid}; '{contact.name}' has {asked.key} "
                + (f"{value:g}" if is_number else f"{own} = {value:g} at the defaults"),
            )


def constraints_of(
    contacts: Sequence[Contact], params: Mapping[str, float]
) -> Iterator[tuple[str, str]]:
    """Yield (inequality, meaning) of what depends on parameters, and on these linearly."""
    for contact, asked, (low, high) in _asked(contacts):
        for left, right in _parts(low, high, params):
            difference = parse(f"({left}) - ({right})")
            names = names_in(difference)
            if names and names <= set(params) and linear_form(difference, sorted(names)):
                yield f"{left} {asked.sign} {right}", f"Contact '{contact.name}': {asked.valid}."


def _asked(
    contacts: Sequence[Contact],
) -> Iterator[tuple[Contact, Range, tuple[str, str]]]:
    """Yield the inequalities of the contacts with the expressions on both sides."""
    for contact in contacts:
        for asked in RANGES[contact.kind]:
            if asked.key in contact.texts:
                left, right = (contact.texts.get(s, s) for s in (asked.left, asked.right))
                yield contact, asked, (left, right)


def _parts(left: str, right: str, params: Mapping[str, float]) -> list[tuple[str, str]]:
    """Return inequalities that an inequality of products follows from: ``mu*N >= 0`` if each factor is.

    What both sides have as a factor (``mu*N <= mu0*N``) is left out of them. Only where no factor is negative
    at the defaults; anything else is one inequality.
    """
    sides = [_factors(text) for text in (left, right)]
    names = [f for side in sides for f in side or () if not _is_number(f)]
    if None in sides or any(not params.get(name, -1.0) >= 0.0 for name in names):
        return [(left, right)]
    low, high = (list(side or ()) for side in sides)
    for factor in list(low):
        if factor in high and not _is_number(factor):
            low.remove(factor)
            high.remove(factor)
    rest = "*".join(low) or "1", "*".join(high) or "1"
    if left == "0":
        return [("0", factor) for factor in dict.fromkeys(high) if not _is_number(factor)]
    return [rest]


def _factors(text: str) -> list[str] | None:
    """Return the factors of a product of names and numbers; None of anything else."""
    parts = [part.strip() for part in text.split("*")]
    return parts if all(_is_number(p) or p.isidentifier() for p in parts) else None


def _is_number(text: str) -> bool:
    return text.replace(".", "", 1).isdigit()
