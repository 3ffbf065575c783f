"""Loads of friction contacts that act on each other: which others matter, and what a load then is.

Let ``G = W M^-1 W^T`` be the mobility of all friction contacts and a the rates of their velocities without
any friction. Contacts with ``G_ij = 0`` do not feel each other. Others do: where a set A sticks and B slides
with forces ``lambda_B``, all velocities of A keep the value 0, so that

    G_AA lambda_A = -(a_A + G_AB lambda_B),

and the load of a contact in A is ``-lambda``. It depends on those that stick and can be reached from the
contact over others that stick (its *cluster*), on those that slide next to these, and on no others: what is
beyond a sliding contact is felt through a force that is given. These, with the springs that act on the
cluster and are closed, are the *setting* of a load. Each setting has a load, and surfaces, of its own.

In a mode in which a contact slides, its load is that which it would have if it stuck while all others do
what they do. As ``1 / (G_AA^-1)_jj > 0`` the sign of the acceleration of a contact j with the slip force
``-s S`` is that of ``load - s S``: a contact at rest begins to slide where its load is beyond the limit.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from contfric.models.structures.contacts import Contact, ContactKind, drift
from contfric.models.structures.matrices import is_zero, summed, times

if TYPE_CHECKING:
    from contfric.models.structures.structure import Structure

#: The contacts that a load depends on, each with its state.
Setting = tuple[tuple[Contact, str], ...]
_LIMIT = re.compile(r"(\w+)([+-])((?:\(\w+\))*)")
_OTHER = re.compile(r"\((\w+)_(\w)\)")


class Limit(NamedTuple):
    """A surface where the load of a contact, in a setting, is its limit."""

    contact: Contact
    sign: str
    setting: Setting

    @property
    def name(self) -> str:
        """The name of the surface: ``b2+(b1_s)(b3_p)``; the springs of a contact on its own: ``b2+stop``."""
        return f"{self.contact.name}{self.sign}{suffix(self.setting)}"

    @property
    def other(self) -> Limit:
        """The same load's other limit."""
        return self._replace(sign="-" if self.sign == "+" else "+")


def suffix(setting: Setting) -> str:
    """Return what stands for a setting in the names of its surfaces."""
    if all(c.kind is ContactKind.SPRING for c, _ in setting):
        return "".join(c.name for c, _ in setting)
    return "".join(f"({c.name}_{letter})" for c, letter in setting)


def load_name(contact: Contact, setting: Setting) -> str:
    """Return the name of a load in a setting, as an observable."""
    own = [c.name if c.kind is ContactKind.SPRING else f"{c.name}_{s}" for c, s in setting]
    return "_".join([f"u_{contact.name}", *own])


class SharedLoads:
    """The settings of the loads of a structure."""

    def __init__(self, structure: Structure) -> None:
        self._structure = structure
        self._by_name = {c.name: c for c in structure.contacts}
        self.rubbing = [c for c in structure.contacts if c.kind is ContactKind.FRICTION]
        self._mobility = {
            (a.name, b.name): structure.mobility(a, b) for a in self.rubbing for b in self.rubbing
        }
        self.coupled = {
            a.name: tuple(b for b in self.rubbing if b is not a and self._feels(a, b))
            for a in self.rubbing
        }

    def _feels(self, a: Contact, b: Contact) -> bool:
        return not is_zero(self._mobility[a.name, b.name])

    def couples(self, contact: Contact) -> bool:
        """Tell whether the load of a contact depends on what other friction contacts do."""
        return bool(self.coupled.get(contact.name))

    def cluster(self, contact: Contact, states: Mapping[str, str]) -> list[Contact]:
        """Return a contact, and those that stick and are reached over others that do; far ones last."""
        found = [contact]
        for c in found:
            found += [b for b in self.coupled[c.name] if states[b.name] == "s" and b not in found]
        return found

    def setting(self, contact: Contact, states: Mapping[str, str]) -> Setting:
        """Return what the load of a contact depends on, in the order of the contacts."""
        cluster = self.cluster(contact, states)
        near = {b.name for c in cluster for b in self.coupled[c.name]} - {contact.name}
        near |= {
            s.name
            for c in cluster
            for s in self._structure.springs[c.name]
            if states[s.name] == "c"
        }
        return tuple((c, states[c.name]) for c in self._structure.contacts if c.name in near)

    def limit(self, name: str) -> Limit | None:
        """Return the limit that a surface is, of contacts that act on each other; None if it is not one."""
        found = _LIMIT.fullmatch(name)
        contact = self._by_name.get(found[1]) if found else None
        if found is None or contact is None or not self.couples(contact):
            return None
        others = _OTHER.findall(found[3])
        states = {c.name: c.states[-1] for c in self._structure.contacts if c.states}
        states |= {c.name: "o" for c in self._structure.contacts if c.kind is ContactKind.SPRING}
        if any(other not in states for other, _ in others):
            return None
        limit = Limit(contact, found[2], self.setting(contact, {**states, **dict(others)}))
        return limit if limit.name == name else None

    def load(self, contact: Contact, setting: Setting) -> str:
        """Return the load of a contact that sticks, an expression.

        By Gauss's elimination, the contact last: G is positive definite, so that no pivot vanishes.
        """
        states = {c.name: letter for c, letter in setting}
        acting = [c for c, letter in setting if letter in "cpn"]
        stuck = self.cluster(contact, {**dict.fromkeys(self._by_name, "p"), **states})[::-1]
        free = [self._free(c, [(a, states[a.name]) for a in acting]) for c in stuck]
        over = [[self._mobility[a.name, b.name] for b in stuck] for a in stuck]
        numbers = _numbers(over)
        if numbers is not None:
            shares = np.linalg.solve(numbers, np.eye(len(stuck))[-1])
            return summed([times(repr(float(x)), f) for x, f in zip(shares, free, strict=True)])
        for k in range(len(stuck) - 1):
            for i in range(k + 1, len(stuck)):
                if is_zero(over[i][k]):
                    continue
                factor = f"-({over[i][k]})/({over[k][k]})"
                free[i] = summed([free[i], times(factor, free[k])])
                over[i] = [
                    x if is_zero(y) else summed([x, times(factor, y)])
                    for x, y in zip(over[i], over[k], strict=True)
                ]
        return f"({free[-1]})/({over[-1][-1]})"

    def _free(self, contact: Contact, acting: list[tuple[Contact, str]]) -> str:
        """Return the rate of a contact's velocity without friction but that of contacts that slide."""
        structure = self._structure
        along = summed([structure.free(contact), *self._pushes(contact, acting)])
        apart = drift(contact)
        return along if is_zero(apart) else f"{along} - ({apart})"

    def _pushes(self, contact: Contact, acting: list[tuple[Contact, str]]) -> Iterator[str]:
        for other, letter in acting:
            by = self._structure.mobility(contact, other)
            if not is_zero(by):
                yield times(by, other.pull(letter))


def _numbers(rows: list[list[str]]) -> np.ndarray | None:
    try:
        return np.array([[float(x) for x in row] for row in rows])
    except ValueError:
        return None
