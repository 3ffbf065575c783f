"""The quantities that a model's file declares, checked in their place.

    quantities:
      energy: integral(c*v**2 + S*abs(v))
      power: energy/period

A quantity may use those above it, the bundled names and parameters; inside of a functional stand the names
that any expression of the model may have.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from contfric.base.yaml_lines import Address
from contfric.errors import ModelError, did_you_mean
from contfric.models.entries import EntryError
from contfric.models.language.grammar import PI, check_name
from contfric.models.language.names import Names
from contfric.models.language.quantity_texts import (
    BUNDLED,
    FUNCTIONALS,
    LIST,
    WORK,
    no_contact,
    read,
)

KEY = "quantities"


def check_quantities(
    quantities: tuple[tuple[str, str], ...], names: Names, timed: bool, contacts: Sequence[str] = ()
) -> None:
    """Read every quantity and look all of its names up.

    Parameters
    ----------
    timed : whether the model is autonomous, so that no expression has the time in it
    contacts : of a structure, whose forces and work are measured

    Raises
    ------
    EntryError
        For the first mistake, with the address of its entry.
    """
    above: dict[str, str] = {}
    for name, text in quantities:
        address: Address = (KEY, name)
        try:
            _check_own_name(name, names)
            parsed = read(text)
        except ModelError as error:
            raise EntryError(address, str(error)) from None
        for functional in parsed.functionals.values():
            for contact in sorted(functional.contacts - set(contacts)):
                raise EntryError(address, no_contact(contact, contacts))
            if functional.kind != WORK:
                names.check(address, functional.plain, timed)
        known = [*(b for b in BUNDLED if b != LIST), *above, *names.parameters]
        for used in sorted(parsed.names - {*known, PI}):
            raise EntryError(address, _unknown(used, names, known))
        above[name] = text


def _check_own_name(name: str, names: Names) -> None:
    check_name(name, "quantity")
    groups: tuple[tuple[str, Mapping[str, str] | tuple[str, ...]], ...] = (
        ("bundled quantity", BUNDLED),
        ("functional", FUNCTIONALS),
        ("state", names.states),
        ("parameter", names.parameters),
        ("definition", names.define),
        ("observable", names.observables),
    )
    for what, taken in groups:
        if name in taken:
            raise ModelError(f"the quantity '{name}' has the name of a {what}")


def _unknown(name: str, names: Names, known: list[str]) -> str:
    if name in (*names.states, *names.parts, "t"):
        return f"'{name}' varies along an orbit: write a functional of it, such as mean({name})"
    return f"unknown name '{name}'{did_you_mean(name, known)} (quantities may use those above them)"
