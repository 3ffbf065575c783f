r"""No complex pair of multipliers on the unit circle, for all orbits of a box.

Of a complex pair on the circle the product is 1. So it is not there where 1 is no eigenvalue of the second
compound of the derivative P of a Poincare map, the matrix of its minors of two rows and two columns, whose
eigenvalues are the products of two of those of P (K. Guckenheimer, M. Myers and B. Sturmfels, SIAM J. Numer.
Anal. 34 (1997) 1-21). Of two real ones the product may be 1, too (a neutral saddle): in the plane the
discriminant tells these apart. A map of one dimension has no pair: that of every orbit of two states that
sticks.

Where an exit is met without speed (a grazing impact) one of two multipliers has no bound, and the product of
both has one. There the characteristic polynomial of the chain is used, multiplied by that speed as it is.

For a symmetric orbit P is that of half a turn. A pair ``+-i`` there is a double multiplier -1 of the whole
one.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
from flint import acb, acb_mat, arb, arb_mat

from contfric.certify.enclosures.bounds import regular_along
from contfric.certify.equations.chain import Chain, Segments
from contfric.certify.equations.extended import Builder
from contfric.certify.equations.monodromy import monodromy
from contfric.certify.equations.multipliers import dimension, poincare_map, restricted
from contfric.certify.equations.zeros import Closing, zeros_at_joints
from contfric.certify.tubes.tube import Box
from contfric.models.balls.numbers import Vector

#: Most parts of a box that are looked at one by one.
_PARTS = 16
#: Largest maps whose compound is computed: 66 minors.
_LARGEST = 12
#: Steps towards the vector of Perron, any of which will do for a proof, and what keeps it positive.
_POWERS, _SMALL = 8, 1e-3


def has_no_pair(segments: Segments, build: Builder, closing: Closing, box: Box) -> bool:
    """Tell whether no complex pair of multipliers is on the unit circle for any orbit of a box."""
    count = 1
    while count <= _PARTS:
        parts = (box.part(k, count) for k in range(count))
        if all(is_off(segments, build, closing, x) for x in parts):
            return True
        count *= 4
    return False


def is_off(segments: Segments, build: Builder, closing: Closing, x: Vector) -> bool:
    """Tell the same for all solutions (z, p) in some balls; orbits with holds have no pair."""
    if any(pin is not None for pin in segments.pins):
        return True
    chain = Chain(segments, replace(build(x[-1]), slopes=None))
    known = zeros_at_joints(segments, chain.model, closing)
    joints = chain.joints(x[:-1])
    if dimension(chain, joints, known) < 2:  # also up to a tangential stop
        return True
    if segments.turn != 0.0:
        found = monodromy(chain, joints)
        if found is None and segments.states == 2 and not segments.kept:
            return has_real_pair(chain, x[:-1])
        if found is not None and segments.kept:
            found = restricted(found, [one.row for one in segments.kept])
    else:  # where a multiplier 1 belongs to each orbit, which the Poincare map does not have
        found = poincare_map(chain, joints, known)
    return found is not None and no_pair(found)


def has_real_pair(chain: Chain, z: Vector) -> bool:
    """Tell whether a chain of two states has two real multipliers, or a product of them that is not 1.

    They are the roots of ``a mu^2 + b mu + c``, times mu the determinant of the Jacobian with mu times the
    closure: the last joint is on an exit surface, which takes one of three factors mu away.
    """
    plus, minus = (arb_mat(chain.linearised(z, sigma)[1]) for sigma in (1, -1))
    own, closing = (plus + minus) / 2, (plus - minus) / 2
    values = [plus.det(), minus.det(), (own + closing * 2).det()]
    b, outer = (values[0] + values[1]) / 2, (values[0] - values[1]) / 2
    a = (values[2] / 2 - 2 * b - outer) / 3
    c = outer - a
    return not (a - c).contains(0) or bool(b * b - 4 * a * c > 0)


def no_pair(matrix: arb_mat) -> bool:
    """Tell whether a matrix has no complex pair of eigenvalues on the unit circle.

    Examples
    --------
    >>> from flint import arb
    >>> turn = arb_mat([[arb(0.6), arb(-0.8)], [arb(0.8), arb(0.6)]])
    >>> no_pair(turn), no_pair(turn * arb(0.9)), no_pair(arb_mat([[2, 0], [0, 0.5]]))
    (False, True, True)
    """
    size = matrix.nrows()
    if size < 2:
        return True
    if size > _LARGEST:
        return False
    if size == 2:
        trace, det = matrix[0, 0] + matrix[1, 1], matrix.det()
        return not (det - 1).contains(0) or bool(trace * trace - 4 * det > 0)
    if _avoids_circle(matrix):
        return True
    pairs = list(combinations(range(size), 2))
    compound = arb_mat(
        [
            [
                matrix[a, c] * matrix[b, d] - matrix[a, d] * matrix[b, c] - int((a, b) == (c, d))
                for c, d in pairs
            ]
            for a, b in pairs
        ]
    )
    nothing = arb_mat(len(pairs), len(pairs))
    return regular_along([compound, nothing, nothing], 0.0)


def _avoids_circle(matrix: arb_mat) -> bool:
    """Tell whether no eigenvalue is on the unit circle, by discs about those of the middle (Gershgorin).

    The discs are scaled by about the vector of Perron of their radii, each over its way to the circle.
    """
    size = matrix.nrows()
    middle = np.array([[float(x.mid()) for x in row] for row in matrix.tolist()])
    if not np.all(np.isfinite(middle)):
        return False
    basis = acb_mat(
        [[acb(x.real, x.imag) for x in row] for row in np.linalg.eig(middle)[1].tolist()]
    )
    try:
        rows = (basis.inv() * acb_mat(matrix) * basis).tolist()
    except ZeroDivisionError:  # the eigenvectors of the middle do not span the space
        return False
    ways = np.array([float(abs(abs(rows[i][i]) - 1).abs_lower()) for i in range(size)])
    reach = np.array([[float(abs(x).abs_upper()) for x in row] for row in rows])
    np.fill_diagonal(reach, 0.0)
    if not (np.all(ways > 0.0) and np.all(np.isfinite(reach))):
        return False
    scale = np.ones(size)
    for _ in range(_POWERS):
        scale = reach @ scale / ways
        scale = scale / np.max(scale) + _SMALL
    sums = [
        sum((arb(r) * arb(x) for r, x in zip(row, scale, strict=True)), arb(0)) for row in reach
    ]
    return all(bool(total < arb(w) * arb(x)) for total, w, x in zip(sums, ways, scale, strict=True))
