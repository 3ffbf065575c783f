r"""What an orbit keeps, by its equations: where a contact never slips, the offset of its stuck slider.

Let l be a row with ``l M = 0`` in the mode of every segment, kept by its resets and by the closure. Then l y
is the same at all joints, whatever it is: the orbits are a continuum, and the chain says ``l y_N = l y_0``
twice. It is given once: ``l y_0`` is what the printed joints keep, in the place of the equation of one state
at the end of the last segment. Nothing is lost: ``l r = 0`` holds for the residual r of that segment, of
which all entries but that one vanish, so that it vanishes, too. What is proved then is one orbit among those
that keep the same.

The rows l are sought by elimination in rational numbers, among the states whose rates are known exactly.
What is not exactly kept counts as not kept.
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_mat, fmpq, fmpq_mat

from contfric.certify.chain import Segments
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector


@dataclass(frozen=True, eq=False)
class Kept:
    """A linear function of the state that an orbit keeps.

    Attributes
    ----------
    row : l, by the states
    state : one with ``l`` = 1 there, in which all others of the same orbit are 0
    """

    row: Vector
    state: int


def kept_by_chain(segments: Segments, model: BallModel) -> list[Kept]:
    """Return a basis of the linear functions of the state that a chain keeps at every value of them."""
    n = segments.states
    size = model.size
    matrices = [model.fields[mode] for mode in dict.fromkeys(segments.modes)]
    for name in dict.fromkeys(name for name in segments.resets if name):
        matrices.append(_less_identity(model.resets[name]))
    closure = [[arb(c) for c in row] + [arb(0)] * (size - n) for row in segments.closure]
    matrices.append(_less_identity(arb_mat(closure)))
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
        found.append(Kept(row, exact[free]))
    return found


def with_kept(
    residual: Vector, rows: list[Vector], kept: list[Kept], x: Vector, printed: Vector
) -> tuple[Vector, list[Vector]]:
    """Return the equations of a chain that keeps what some printed joints do."""
    if not kept:
        return residual, rows
    residual, rows = list(residual), list(rows)
    n = len(kept[0].row)
    for one in kept:
        at = len(residual) - (n + 1) + one.state
        pairs = zip(one.row, x[1 : n + 1], printed[1 : n + 1], strict=True)
        residual[at] = sum((c * (y - p) for c, y, p in pairs), arb(0))
        rows[at] = [arb(0), *one.row, *[arb(0)] * (len(rows[at]) - n - 1)]
    return residual, rows


def _less_identity(matrix: arb_mat) -> arb_mat:
    entries = matrix.tolist()
    return arb_mat([[c - (j == k) for j, c in enumerate(row)] for k, row in enumerate(entries)])


def _rational(number: arb) -> fmpq:
    mantissa, exponent = (int(part) for part in number.mid().man_exp())
    return fmpq(mantissa) * fmpq(2) ** exponent
