"""Decides which contacts at rest stick and which slide: a linear complementarity problem with bounds.

Contacts at rest have accelerations ``a = b + G lambda`` (G positive definite). Each

* sticks (s): ``a_j = 0`` and ``|lambda_j| <= S0_j``, or
* slides up (p): ``a_j >= 0`` with the force ``lambda_j = -S_j``, or
* slides down (n): ``a_j <= 0`` with ``lambda_j = S_j``.

For S0 = S the force is the minimum of ``lambda . G lambda / 2 + b . lambda`` over a box: there is exactly one
solution [1]_. It is found by exchanging one contact a time, from all that stick: the one that violates its
condition most, and the first of these (Murty's rule [2]_, which ends for such G) where that does not end.

For S0 > S several solutions are possible. *What sticks stays stuck* while forces within S0 exist, which is
the first state that is looked at; then what is beyond S0 lets go, the worst first, and what slides against
its acceleration sticks again.

.. [1] R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem, SIAM (2009), section 3.1.
.. [2] K. G. Murty, Note on a Bard-type scheme for solving the complementarity problem, Opsearch 11 (1974)
   123-130.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from contfric.base.arrays import FloatArray

#: Exchanges a contact by the worst violation, before the first one is taken.
_BY_WORST = 3
#: Exchanges in all, and contacts of which all states are tried where these do not end.
_MOST, _MOST_TRIED = 1000, 6
#: A violation this small, relative to the forces, is rounding.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class ContactsAtRest:
    """Contacts at rest.

    Attributes
    ----------
    mobility, free : G and b, shapes (k, k) and (k,)
    pulls : the forces with which each slides up, and down, shape (2, k)
    static : the largest forces with which each sticks, shape (k,)
    """

    mobility: FloatArray
    free: FloatArray
    pulls: FloatArray
    static: FloatArray

    def forces(self, letters: str) -> FloatArray:
        """Return the forces if the contacts have some states."""
        up, down = self.pulls
        found: FloatArray = np.where([a == "p" for a in letters], up, down)
        stuck = np.array([a == "s" for a in letters])
        if stuck.any():
            apart = self.free + self.mobility[:, ~stuck] @ found[~stuck]
            found[stuck] = -np.linalg.solve(self.mobility[np.ix_(stuck, stuck)], apart[stuck])
        return found

    def changes(self, letters: str) -> list[tuple[float, str]]:
        """Return by how much each contact violates its condition, as a force, and the state for it then."""
        forces = self.forces(letters)
        moved = self.free + self.mobility @ forces
        rounding = _ROUNDING * (np.abs(self.static) + np.max(np.abs(forces), initial=0.0))
        found = []
        for j, letter in enumerate(letters):
            if letter == "s":
                by, other = abs(forces[j]) - self.static[j], "p" if forces[j] < 0.0 else "n"
            else:
                by, other = moved[j] * (-1.0 if letter == "p" else 1.0) / self.mobility[j, j], "s"
            found.append((by if by > rounding[j] else 0.0, other))
        return found

    def states(self, given: str) -> str | None:
        """Return the states of the contacts, a letter for each, or None.

        Parameters
        ----------
        given : the letter of each that is known already, a blank for others
        """
        letters = given.replace(" ", "s")
        for turn in range(_MOST):
            changes = [
                (by if given[j] == " " else 0.0, other)
                for j, (by, other) in enumerate(self.changes(letters))
            ]
            wrong = [j for j, (by, _) in enumerate(changes) if by > 0.0]
            if not wrong:
                return letters
            j = wrong[0]
            if turn < _BY_WORST * len(letters):
                j = max(wrong, key=lambda k: changes[k][0] / (self.static[k] or 1.0))
            letters = letters[:j] + changes[j][1] + letters[j + 1 :]
        return self._tried(given)

    def _tried(self, given: str) -> str | None:
        """Return the first states of all that obey every condition."""
        if given.count(" ") > _MOST_TRIED:
            return None
        choices = ["spn" if letter == " " else letter for letter in given]
        for letters in map("".join, itertools.product(*choices)):
            changes = self.changes(letters)
            if not any(by > 0.0 for (by, _), g in zip(changes, given, strict=True) if g == " "):
                return letters
        return None
