r"""Matrices that depend on a number s in [-h, h]: ``A(s) in A_0 + s A_1 + A_r``.

A_0 is a ball at s = 0, A_1 a matrix of numbers, A_r a matrix of balls about 0. So what is linear in s is not
lost in the width of balls: of a product of two only the second order is.
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_mat


@dataclass(frozen=True, eq=False)
class AffineMatrix:
    """A matrix that is known up to second order in s.

    Attributes
    ----------
    at : A_0
    slope : A_1
    rest : A_r
    half : ball of all s, [-h, h]
    """

    at: arb_mat
    slope: arb_mat
    rest: arb_mat
    half: arb

    def __mul__(self, other: AffineMatrix) -> AffineMatrix:
        """Return the matrix product."""
        slope = self.slope * other.at + self.at * other.slope
        linear = self.slope * self.half
        rest = (
            self.rest * other.whole
            + linear * (other.slope * self.half)
            + (self.at + linear) * other.rest
        )
        return AffineMatrix(self.at * other.at, slope, rest, self.half)

    def __add__(self, other: AffineMatrix) -> AffineMatrix:
        """Return the sum."""
        return AffineMatrix(
            self.at + other.at, self.slope + other.slope, self.rest + other.rest, self.half
        )

    def __sub__(self, other: AffineMatrix) -> AffineMatrix:
        """Return the difference."""
        return AffineMatrix(
            self.at - other.at, self.slope - other.slope, self.rest - other.rest, self.half
        )

    def entry(self, a: int, b: int) -> tuple[arb, arb, arb]:
        """Return value, slope and rest of an entry."""
        return self.at[a, b], self.slope[a, b], self.rest[a, b]

    @property
    def whole(self) -> arb_mat:
        """All values, for all s."""
        return self.at + self.slope * self.half + self.rest


def enclosing(at: arb_mat, slope: arb_mat, change: arb_mat, half: arb) -> AffineMatrix:
    """Return a function of s from its value at 0, and an enclosure of its derivative for all s.

    Parameters
    ----------
    slope : about the derivative at 0
    change : encloses the derivative for all s; balls of what does not depend on s may be added to the rest
    """
    slope = slope.mid()
    return AffineMatrix(at, slope, (change - slope) * half, half)
