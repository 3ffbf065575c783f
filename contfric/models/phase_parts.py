"""Which modes of a structure with many contacts the phase divides, and the names of the parts.

A mode in which an orbit may stay has two parts (:mod:`contfric.models.phases`): the first has its name, the
second that name with :data:`PART`. Which modes these are follows from the states of their contacts.
"""

from __future__ import annotations

from collections.abc import Sequence

from contfric.models.contacts import Contact, ContactKind

#: What the name of the second part of a mode ends with.
PART = "-"


class PhaseParts:
    """The parts of the modes of a structure.

    Parameters
    ----------
    acting : the contacts that have states, a letter of a mode's name for each
    coordinates : how many the structure has
    surface : the surface of the phase; empty if no mode is divided
    """

    def __init__(self, acting: Sequence[Contact], coordinates: int, surface: str) -> None:
        self._acting, self._coordinates, self._surface = acting, coordinates, surface
        self._divided: dict[str, bool] = {}

    def whole(self, name: str) -> str:
        """Return the mode that a mode is a part of, most often itself."""
        return name.removesuffix(PART)

    def is_divided(self, name: str) -> bool:
        """Tell whether the phase divides a mode: one in which an orbit may stay."""
        whole = self.whole(name)
        if whole not in self._divided:
            self._divided[whole] = bool(self._surface) and self._may_stay(whole)
        return self._divided[whole]

    def part(self, name: str, side: int) -> str:
        """Return the part of a mode on one side of the phase; the mode itself if that is not divided."""
        whole = self.whole(name)
        return whole + PART if side < 0 and self.is_divided(whole) else whole

    def side(self, name: str) -> int:
        """Return the side of the phase that a part of a mode lies on; 0 of a mode that is not divided."""
        return (-1 if name.endswith(PART) else 1) * self.is_divided(name)

    def _may_stay(self, whole: str) -> bool:
        """Tell whether something moves in a mode, and no contact slides to one side for ever.

        Where the velocity of a contact is that of masses alone, what slides in one direction goes away.
        """
        states = list(zip(self._acting, whole, strict=True))
        held = sum(letter == "s" for c, letter in states if c.kind is ContactKind.FRICTION)
        if held == self._coordinates:
            return False
        sliding = (c for c, letter in states if letter in ("p", "n"))
        return all(c.kind is ContactKind.FRICTION and _is_carried(c) for c in sliding)


def _is_carried(contact: Contact) -> bool:
    """Tell whether the velocity of a contact has a given part, as that of a belt."""
    return any(kind != "y" for kind, _ in contact.form.parts)
