r"""A fold or a multiplier -1 in a box of a tube: there is one at most, and it is passed with speed.

Let ``J(s)`` be the Jacobian of the chain by the joints along the curve of a box, with sigma times the
closure: it is singular at a fold (sigma = 1), or where a multiplier of a turn is -1. With fixed vectors b
and c near its null vectors the bordered matrix

    B = [[J, b], [c, 0]],      B (phi, g) = e,      (psi, g) B = e,      e the last unit vector,

is regular, and J is singular where the number g vanishes. Along the curve, T its direction,

    g' = - psi J' phi ,        J' phi = (derivative of J(X) phi, phi held fixed) T .

Where the balls of g' over the whole box do not contain 0, g is monotone: it has one zero at most, and that is
simple. At a fold it says that the fold is quadratic, at a multiplier -1 that it passes with speed. (A.
Griewank and G. W. Reddien, IMA J. Numer. Anal. 4 (1984) 295-303.)
"""

from __future__ import annotations

import numpy as np
from flint import arb, arb_mat

from contfric.certify.enclosures.bounds import Bounds
from contfric.certify.equations.chain import Chain, Segments
from contfric.certify.equations.extended import Builder
from contfric.certify.tubes.tube import OVERLAP, Box, squared
from contfric.models.balls.numbers import Vector, dot


def passes_once(segments: Segments, build: Builder, box: Box, sigma: int) -> bool:
    """Tell whether the Jacobian with sigma times the closure is singular at one orbit of a box at most."""
    if box.tangent is None or any(segments.resets):  # second derivatives after resets are not known
        return False
    square = squared(box.linear, sigma)
    edges = null_vectors(square[0])
    if edges is None:
        return False
    half = 0.5 + OVERLAP
    right = Bounds.of(bordered(square, *edges), half)
    left = Bounds.of(bordered([m.transpose() for m in square], *edges[::-1]), half)
    if right is None or left is None:
        return False
    phi, psi = right.solution(), left.solution()
    if phi is None or psi is None:
        return False
    chain = Chain(segments, build(box.all[-1]))
    rows = chain.bent(box.all[:-1], phi[:-1], sigma)
    slope = sum((p * dot(row, box.tangent) for p, row in zip(psi[:-1], rows, strict=True)), arb(0))
    return not slope.contains(0)


def null_vectors(matrix: arb_mat) -> tuple[Vector, Vector] | None:
    """Return unit vectors near the left and the right null vector of a matrix."""
    plain = np.array([[float(x.mid()) for x in row] for row in matrix.tolist()])
    if not np.all(np.isfinite(plain)):
        return None
    left, _, right = np.linalg.svd(plain)
    return [arb(float(x)) for x in left[:, -1]], [arb(float(x)) for x in right[-1]]


def bordered(matrices: list[arb_mat], b: Vector, c: Vector) -> list[arb_mat]:
    """Return value, slope and rest of a matrix with a column b and a row c."""
    nothing = [arb(0)] * len(b)
    edges = ((b, c), (nothing, nothing), (nothing, nothing))
    return [
        arb_mat([*([*row, x] for row, x in zip(m.tolist(), right, strict=True)), [*below, arb(0)]])
        for m, (right, below) in zip(matrices, edges, strict=True)
    ]
