"""A stretch of a branch, and what was proved of it."""

from __future__ import annotations

from dataclasses import dataclass

from contfric.certify.inequalities import Name
from contfric.certify.verdict import Finding


@dataclass(frozen=True, eq=False)
class Piece:
    """A stretch of a branch, and what was proved of it.

    Attributes
    ----------
    start, stop : where it is, in arclength of the branch
    values : the parameter at its ends
    exists : there is one curve of solutions in a box about it
    admissible : every orbit of it obeys every inequality, up to the end of the branch if it is in the box
    folds : how many folds (SN) are in it at most: 0, 1 (a simple one), or 2 for not known
    flips : how many multipliers -1 of a turn (PD, or BP of a half)
    tori : how many complex pairs of multipliers on the unit circle (NS); never 1
    linked : it goes on in the next piece
    ends : what ends the branch in its box: the inequalities that change their sign there
    events : labels of the proved events whose orbits are in its box
    """

    start: float
    stop: float
    values: tuple[float, float]
    exists: bool
    admissible: Finding
    folds: int = 2
    flips: int = 2
    tori: int = 2
    linked: bool = True
    ends: tuple[Name, ...] = ()
    events: tuple[str, ...] = ()

    @property
    def proved(self) -> bool:
        """Whether it is one curve of admissible orbits."""
        return self.exists and self.admissible.proved

    @property
    def regular(self) -> bool:
        """Whether it is, without a fold and without a multiplier on the unit circle."""
        return self.proved and not (self.folds or self.flips or self.tori)

    @property
    def why(self) -> str:
        """What is not proved; empty if all is."""
        return "" if self.proved else self.admissible.why
