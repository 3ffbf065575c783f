"""A stretch of a branch, and what was proved of it."""

from __future__ import annotations

from dataclasses import dataclass

from contfric.base.arrays import FloatArray
from contfric.certify.inequalities.along_segments import InequalityName
from contfric.certify.verdict import Finding

#: For a number of events that is not known.
UNKNOWN = 2


@dataclass(frozen=True, eq=False)
class Piece:
    """A stretch of a branch, and what was proved of it.

    Attributes
    ----------
    start, stop : where it is, in arclength of the branch
    values : the parameter at its ends
    exists : there is one curve of solutions in a box about it
    admissible : every orbit of it obeys every inequality, up to the end of the branch if it is in the box
    folds : how many folds (SN) are in it: 0, 1 (a quadratic one), or UNKNOWN
    flips : how often a multiplier of a turn is -1 (PD, or BP of a half)
    tori : how often a complex pair of multipliers is on the unit circle (NS): 0 or UNKNOWN
    linked : its curve is that of the piece before
    ends : what ends the branch in its box: the inequalities that change their sign there
    events : labels of the proved events whose orbits are in its box
    knots : the two orbits between which its box is, (time, state) of each joint and the parameter; or none
    """

    start: float
    stop: float
    values: tuple[float, float]
    exists: bool
    admissible: Finding
    folds: int = UNKNOWN
    flips: int = UNKNOWN
    tori: int = UNKNOWN
    linked: bool = True
    ends: tuple[InequalityName, ...] = ()
    events: tuple[str, ...] = ()
    knots: tuple[FloatArray, ...] = ()

    @property
    def proved(self) -> bool:
        """Whether it is one curve of admissible orbits."""
        return self.exists and self.admissible.proved

    @property
    def decided(self) -> bool:
        """Whether it is known how many folds and multipliers on the unit circle are in it."""
        return UNKNOWN not in (self.folds, self.flips, self.tori)

    @property
    def regular(self) -> bool:
        """Whether it is, without a fold and without a multiplier on the unit circle."""
        return self.proved and not (self.folds or self.flips or self.tori)

    @property
    def why(self) -> str:
        """What is not proved; empty if all is."""
        return "" if self.proved else self.admissible.why
