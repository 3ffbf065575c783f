"""Forces and dissipated power of contacts, mode by mode: ``force(brake)``, ``work(brake)``.

The force of a contact is that on the structure along the direction of its velocity or gap: against the
velocity where friction slides, the multiplier of the constraint where it sticks, ``-stiffness*stretch`` of
a Jenkins element, ``-stiffness*gap`` of a spring. The power that it dissipates is minus the force times the
velocity of what slides: 0 where nothing does, and of a spring. An impact dissipates the kinetic energy of
the relative motion that it takes, ``(1 - e^2) w^2/(2 W . M^-1 W)``.

In a written-out model::

    forces:
      brake:
        modes: {p: '0', s: '1'}
        texts: {force 0: -(S), power 0: (S)*(v1), force 1: -(u_brake), power 1: 0}
        rest: q1

Where a contact rests that never slips: the displacement of what sticks, minus the stretch of a Jenkins
element (``rest``), which may be said (``at``). Friction against what moves by itself has no such position.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from contfric.models.structures.contacts import Contact, ContactKind, is_at_rest
from contfric.models.structures.matrices import summed, times

if TYPE_CHECKING:
    from contfric.models.language.names import Names
    from contfric.models.structures.structure import Structure

KEY = "forces"
_LOSS = "loss"
_POSITION = ("rest", "at")


@dataclass(frozen=True)
class ContactLaws:
    """What a contact carries and dissipates.

    Attributes
    ----------
    modes : which of its laws holds in each mode
    texts : the expressions of each law, and of what is lost at an impact
    rest : expression of the position that it keeps while it sticks, linear in the states; empty without one
    at : where it rests if it never slips, an expression of the parameters; empty if the motion decides
    """

    name: str
    modes: Mapping[str, str]
    texts: Mapping[str, str]
    rest: str = ""
    at: str = ""

    def force(self, mode: str) -> str:
        """Return the force in a mode, an expression."""
        return self.texts[f"force {self.modes[mode]}"]

    def power(self, mode: str) -> str:
        """Return the power that is dissipated in a mode, an expression."""
        return self.texts[f"power {self.modes[mode]}"]

    @property
    def loss(self) -> str:
        """The energy that is lost where its surface is met, an expression; 0 if none is."""
        return self.texts.get(_LOSS, "0")


def laws_of(structure: Structure, modes: Mapping[str, Mapping[str, str]]) -> dict[str, Any]:
    """Return the laws of all contacts, as they are written out.

    Parameters
    ----------
    modes : the states of the contacts in each mode
    """
    return {contact.name: _written(structure, contact, modes) for contact in structure.contacts}


def _written(
    structure: Structure, contact: Contact, modes: Mapping[str, Mapping[str, str]]
) -> dict[str, Any]:
    laws: dict[tuple[str, str], str] = {}
    in_mode = {}
    for mode, states in modes.items():
        law = law_of(structure, contact, states)
        in_mode[mode] = laws.setdefault(law, str(len(laws)))
    texts: dict[str, str] = {}
    for (force, power), number in laws.items():
        texts |= {f"force {number}": force, f"power {number}": power}
    if contact.kind is ContactKind.IMPACT:
        e, over = contact.texts["restitution"], structure.mobility(contact, contact)
        w = structure.approach(contact)
        texts[_LOSS] = f"(1 - ({e})**2)*({w})**2/(2*({over}))"
    return {"modes": in_mode, "texts": texts, **rest_of(structure, contact)}


def rest_of(structure: Structure, contact: Contact) -> dict[str, str]:
    """Return what a contact keeps while it sticks, and where it is to rest, as they are written out."""
    fixed = contact.kind is ContactKind.FRICTION and is_at_rest(contact)
    if not (fixed or contact.kind is ContactKind.JENKINS):
        return {}
    unit = structure.length
    parts = [times(repr(unit * w), structure.coordinates[i]) for i, w in contact.direction.items()]
    stretch = [] if fixed else [f"-{times(repr(unit), contact.name)}"]
    return {"rest": summed([*parts, *stretch]), **({"at": contact.at} if contact.at else {})}


def law_of(structure: Structure, contact: Contact, states: Mapping[str, str]) -> tuple[str, str]:
    """Return force and dissipated power of a contact in a mode."""
    state = states.get(contact.name, "")
    if contact.kind is ContactKind.FRICTION and state == "s":
        return f"-({structure.load(contact, structure.loads.setting(contact, states))})", "0"
    force = contact.pull(state)
    if state not in ("p", "n"):
        return force, "0"
    friction = contact.kind is ContactKind.FRICTION
    velocity = contact.texts["velocity"] if friction else structure.speed(contact)
    power = times(force, velocity)
    return force, f"-({power if structure.length == 1.0 else times(repr(structure.length), power)})"


def check_laws(laws: tuple[ContactLaws, ...], names: Names, timed: bool) -> None:
    """Look up every name in the laws of contacts."""
    for contact in laws:
        for key, text in contact.texts.items():
            names.check((KEY, contact.name, "texts", key), text, timed)
        for key in _POSITION:
            if text := getattr(contact, key):
                names.check((KEY, contact.name, key), text, False)


def written(laws: tuple[ContactLaws, ...]) -> dict[str, Any]:
    """Return laws in the schema of the files."""
    return {
        c.name: {
            **{"modes": dict(c.modes), "texts": dict(c.texts)},
            **{key: text for key in _POSITION if (text := getattr(c, key))},
        }
        for c in laws
    }
