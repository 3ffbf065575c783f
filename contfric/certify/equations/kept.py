r"""What an orbit keeps: the offset of a stuck slider, the position of a contact that never slips.

Let l be a row with ``l M = 0`` in the mode of every segment, kept by its resets and by the closure. Then l y
is the same at all joints, whatever it is: the orbits are a continuum, and the chain says ``l y_N = l y_0``
twice. It is given once: ``l y_0 = c`` in the place of the equation of one state at the end of the last
segment. Nothing is lost: ``l r = 0`` holds for the residual r of that segment, of which all entries but that
one vanish, so that it vanishes, too. So what is proved is proved among the orbits that keep the same.

Where the closure of half a turn changes the sign of l y, an orbit has ``l y = 0``, and half a turn the
multiplier -1: then c = 0.

The disturbances of a chain with this equation have ``l phi = 0``: those of all other multipliers do anyway.

A contact that never slips keeps its velocity at exactly 0, so that it keeps its position: a row l whose rates
are multiples of what is kept at zero is kept, too.

The rows l are sought by elimination in rational numbers, among the states whose rates are known exactly, at
all values of a free parameter. What is not exactly kept counts as not kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from flint import arb, arb_mat, fmpq, fmpq_mat

from contfric.base.arrays import FloatArray
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector

if TYPE_CHECKING:
    from contfric.certify.equations.chain import Segments

#: A value this small, relative to the largest state, is taken for 0: less than an orbit is printed to.
_NOTHING = 2.0**-60


@dataclass(frozen=True, eq=False)
class Kept:
    """A linear function of the state that an orbit keeps.

    Attributes
    ----------
    row : l, by the states
    state : one with ``l`` = 1 there, in which all others of the same orbit are 0
    value : c, an exact number
    """

    row: Vector
    state: int
    value: arb

    def equation(self, x: Vector) -> arb:
        """Return ``l y_0 - c`` of some unknowns."""
        return sum((c * y for c, y in zip(self.row, x[1:], strict=False)), -self.value)

    def place(self, count: int) -> int:
        """Return the number of the equation in whose place it is, of so many."""
        return count - (len(self.row) + 1) + self.state

    def filled(self, width: int) -> Vector:
        """Return the derivatives of the equation by all of the unknowns."""
        return [arb(0), *self.row, *[arb(0)] * (width - len(self.row) - 1)]

    def same(self, other: Kept) -> bool:
        """Tell whether another one is exactly this."""
        pairs = zip([*self.row, self.value], [*other.row, other.value], strict=True)
        return all((a - b).is_zero() for a, b in pairs)


def with_kept(segments: Segments, model: BallModel, joint: FloatArray) -> Segments:
    """Return a chain with the equations of what it keeps, as much of it as an orbit with such a joint does.

    Parameters
    ----------
    model : over all values of the parameter that are meant
    joint : time and state
    """
    found: list[Kept] = []
    for still in (False, True):
        zero = [one for one in found if one.value.is_zero()]
        if still and not zero:
            break
        for sign in (1, -1):
            for row, state in _rows_kept(segments, model, sign, zero):
                new = row
                for one in found:  # which is kept, too
                    new = [x - new[one.state] * y for x, y in zip(new, one.row, strict=True)]
                if not new[state].is_zero() and all(one.row[state].is_zero() for one in found):
                    found.append(Kept(new, state, _value(new, joint) if sign == 1 else arb(0)))
    return replace(segments, kept=tuple(found))


def _value(row: Vector, joint: FloatArray) -> arb:
    """Return the value of a function at a joint; 0 where it is that but for rounding."""
    value = float(sum(float(c) * y for c, y in zip(row, joint[1:], strict=True)))
    return arb(0 if abs(value) < _NOTHING * float(abs(joint[1:]).max()) else value)


def keep_residual(kept: Sequence[Kept], residual: Vector, x: Vector) -> Vector:
    """Return the residuals of a chain with those of what it keeps."""
    for one in kept:
        residual[one.place(len(residual))] = one.equation(x)
    return residual


def keep_rows(kept: Sequence[Kept], rows: list[Vector], order: int = 1) -> list[Vector]:
    """Return the derivatives of a chain's equations with those of what it keeps; of second order 0."""
    for one in kept:
        width = len(rows[0])
        rows[one.place(len(rows))] = one.filled(width) if order == 1 else [arb(0)] * width
    return rows


def _rows_kept(
    segments: Segments, model: BallModel, sign: int, zero: Sequence[Kept]
) -> list[tuple[Vector, int]]:
    """Return a basis of the linear functions of the state that a chain keeps, each with its state.

    Parameters
    ----------
    sign : that they have after the closure
    zero : functions that are kept at zero: rates that are multiples of them vanish
    """
    n = segments.states
    size = model.size
    matrices = [model.fields[mode] for mode in dict.fromkeys(segments.modes)]
    for name in dict.fromkeys(name for name in segments.resets if name):
        matrices.append(_less_identity(model.resets[name]))
    closure = [[sign * arb(c) for c in row] + [arb(0)] * (size - n) for row in segments.closure]
    matrices.append(_less_identity(arb_mat(closure)))
    matrices = [_without(m, zero) for m in matrices]
    exact = [k for k in range(n) if all(m[k, j].is_exact() for m in matrices for j in range(size))]
    # an equation l A = 0 for each column A of them
    rows = [[_rational(m[k, j]) for k in exact] for m in matrices for j in range(size)]
    rows = [row for row in rows if any(row)]
    if not exact or len(rows) == 0:
        return []
    reduced, rank = fmpq_mat(rows).rref()
    pivots = [next(k for k in range(len(exact)) if reduced[i, k] != 0) for i in range(int(rank))]
    found = []
    for free in (k for k in range(len(exact)) if k not in pivots):
        row = [arb(0)] * n
        row[exact[free]] = arb(1)
        for i, k in enumerate(pivots):
            row[exact[k]] = -arb(reduced[i, free])
        found.append((row, exact[free]))
    return found


def _without(matrix: arb_mat, zero: Sequence[Kept]) -> arb_mat:
    """Return a matrix as it acts on states at which some functions vanish."""
    rows = matrix.tolist()
    for one in zero:
        for row in rows:
            factor = row[one.state]
            if not factor.is_zero():
                for j, c in enumerate(one.row):
                    row[j] -= factor * c
                row[one.state] = arb(0)
    return arb_mat(rows)


def _less_identity(matrix: arb_mat) -> arb_mat:
    entries = matrix.tolist()
    return arb_mat([[c - (j == k) for j, c in enumerate(row)] for k, row in enumerate(entries)])


def _rational(number: arb) -> fmpq:
    mantissa, exponent = (int(part) for part in number.mid().man_exp())
    return fmpq(mantissa) * fmpq(2) ** exponent
