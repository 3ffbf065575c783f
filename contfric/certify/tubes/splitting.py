r"""The branch that leaves a period doubling, or a symmetric orbit (BP), in one box with the event.

At the event two turns of the new orbits become the same turn: the equations of their chain are singular
there. Let ``Phi(e)`` be the residual of the chain of one turn at ``u + e v``, closed to the other turn,
``u - e v``. The orbits of two turns are the zeros of Phi(e) and Phi(-e). Split into a symmetric and an
antisymmetric part,

    G = ( (Phi(e) + Phi(-e)) / 2,  (Phi(e) - Phi(-e)) / (2 e),  c v - 1 )

for the unknowns (u, v, p), they are the zeros of a system that is regular at e = 0: there it is the extended
system of the event (:mod:`contfric.certify.equations.extended`), as Phi(0) = F(u), Phi' (0) = J_-(u) v, with
the closure of a disturbance that changes its sign. Krawczyk's operator is used for all e in [-r, r] at once,
with

    G_1 = F(u) + e^2 / 2 Phi'',        G_2 = J_-(u) v + e^2 / 6 Phi''' ,

the derivatives somewhere on the way from u - e v to u + e v. So for each e there is one such orbit in the
box; e and
-e are the same one, begun a turn later (or are images of each other). By ``h = e^2``

    G_x x' = - (Phi'' / 2, Phi''' / 6, 0),

and where p' has a sign over the whole box the new branch lies on one side of the event, and has no fold
there: the cubic coefficient of the bifurcation does not vanish. (M. Golubitsky and D. G. Schaeffer,
Singularities and groups in bifurcation theory I, 1985, chapter VI.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from math import comb

import numpy as np
from flint import arb, arb_mat

from contfric.base.arrays import FloatArray
from contfric.certify.enclosures.bounds import regular_along, supersolution, upper
from contfric.certify.enclosures.krawczyk import approximate_inverse, enclosed
from contfric.certify.equations.chain import Chain, Segments
from contfric.certify.equations.extended import Builder, with_multiplier
from contfric.certify.tubes.passing import null_vectors
from contfric.certify.verdict import Verdict
from contfric.models.balls.numbers import Vector, around, column, dot, identity, numbers

#: Least half-widths, relative to 1 + the size of each number: rounding of 80 bits.
_LEAST = 2.0**-60
#: Parts into which the reach of a box is cut.
_PARTS = 12
#: Half-widths of the box in units of what Krawczyk's operator asks for first.
_MORE = 2.0


@dataclass(frozen=True, eq=False)
class Split:
    """A box that holds an event and the orbits of two turns that leave it.

    Attributes
    ----------
    size : number of unknowns u
    reach : the largest e
    functional : c
    centre, radii : of (u, v, p)
    slope : balls of the derivative of (u, v, p) by e^2
    """

    size: int
    reach: arb
    functional: Vector
    centre: Vector
    radii: Vector
    slope: Vector

    @property
    def box(self) -> Vector:
        """All u, v and p."""
        return [around(c, r) for c, r in zip(self.centre, self.radii, strict=True)]

    @property
    def turn(self) -> Vector:
        """Balls of the joints and the parameter of all turns of all orbits in it."""
        return spread(self.box, self.size, self.reach)

    def pairs(self) -> list[tuple[Vector, Vector]]:
        """Return balls of both turns of its orbits, part by part of the way to e = reach.

        At -e there is the orbit of e, begun a turn later.
        """
        u, v = self.box[: self.size], self.box[self.size : -1]
        edges = [self.reach * k / _PARTS for k in range(_PARTS + 1)]
        parts = [a.union(b) for a, b in pairwise(edges)]
        line = list(zip(u, v, strict=True))
        return [([a + e * b for a, b in line], [a - e * b for a, b in line]) for e in parts]

    @property
    def one_sided(self) -> bool:
        """Whether all orbits of two turns lie on one side of the event, and the parameter is monotone."""
        return not self.slope[-1].contains(0)

    def holds(self, first: Vector, second: Vector, value: arb) -> bool:
        """Tell whether an orbit, known to lie in some balls, is one of this box, by its two turns."""
        u = [(a + b) / 2 for a, b in zip(first, second, strict=True)]
        w = [(a - b) / 2 for a, b in zip(first, second, strict=True)]
        e = dot(self.functional, w)
        if e.contains(0) or not abs(e) < self.reach:
            return False
        point = [*u, *(c / e for c in w), value]
        pairs = zip(point, self.centre, self.radii, strict=True)
        return all(abs(x - c) < r for x, c, r in pairs)

    def amplitude(self, pair: tuple[Vector, Vector]) -> float:
        """Return the e of an orbit, by its two turns."""
        half = [(a - b) / 2 for a, b in zip(*pair, strict=True)]
        return float(dot(self.functional, half).mid())

    def at(self, e: arb) -> tuple[Vector, Vector, arb]:
        """Return the turns of about the orbit at e, and its parameter."""
        x = [(c + e * e * s).mid() for c, s in zip(self.centre, self.slope, strict=True)]
        pairs = list(zip(x[: self.size], x[self.size : -1], strict=True))
        return [u + e * v for u, v in pairs], [u - e * v for u, v in pairs], x[-1]


def spread(x: Vector, size: int, reach: arb) -> Vector:
    """Return balls of ``u + e v``, |e| <= reach, and of p."""
    e = arb(0, reach.abs_upper())
    return [*(u + e * v for u, v in zip(x[:size], x[size:-1], strict=True)), x[-1]]


def event_of(segments: Segments, build: Builder, near: Vector) -> tuple[Vector, Vector] | None:
    """Return (u, v, p) at the event, exact numbers near a printed one, and c."""
    _, rows = Chain(segments, build(near[-1])).linearised(near[:-1], -1)
    edges = null_vectors(arb_mat([row[:-1] for row in rows]))
    if edges is None:
        return None
    c = edges[1]
    equations = with_multiplier(segments, build, -1, c)
    tiny = arb(2) ** -60
    found = enclosed(equations, [*near[:-1], *c, near[-1]], tiny)
    if found.verdict is not Verdict.PROVED:
        return None
    return [x.mid() for x in found.zero], c


def split_box(
    segments: Segments, build: Builder, centre: Vector, c: Vector, reach: float
) -> Split | None:
    """Return the box about an event with all orbits up to e = reach, or None if it is not proved."""
    size = (len(centre) - 1) // 2
    residual, jacobian = with_multiplier(segments, build, -1, c)(centre)
    inverse = approximate_inverse(jacobian)
    if inverse is None:
        return None
    square = arb(0, reach * reach)
    bends = _Ways(segments, build, centre, reach).bends()
    residual = [r + square * b for r, b in zip(residual, bends, strict=True)]
    moved = upper(inverse * column(residual))[:, 0]
    least = np.array([_LEAST * float(1 + x.abs_upper()) for x in centre])
    radii = _MORE * moved + least
    for _ in range(3):
        box = [around(x, arb(float(r))) for x, r in zip(centre, radii, strict=True)]
        ways = _Ways(segments, build, box, reach)
        gap = ways.gap(inverse, c)
        if not np.all(np.isfinite(gap)):
            return None
        if np.all((gap @ radii + moved) * (1 + 1e-9) < radii):
            known = numbers(inverse * column(ways.bends()) * -1)
            error = supersolution(gap, gap @ upper(column(known))[:, 0])
            if error is None:
                return None
            slope = [
                around(k, arb(float(r))) for k, r in zip(known, error * (1 + 1e-9), strict=True)
            ]
            return Split(size, arb(reach), c, centre, [arb(float(r)) for r in radii], slope)
        wanted = supersolution(gap, moved)
        if wanted is None:
            return None
        radii = 1.3 * wanted + least
    return None


class _Ways:
    """What is known on the way from u - e v to u + e v, for all (u, v, p) of a box and all e up to a reach.

    Even functions of e change by its square only. So the reach is cut into parts, and what is even is
    evaluated at e and -e at once.
    """

    def __init__(self, segments: Segments, build: Builder, box: Vector, reach: float) -> None:
        self.size = (len(box) - 1) // 2
        self.chain = Chain(segments, build(box[-1]))
        self.plain = Chain(segments, replace(self.chain.model, slopes=None))
        self.u, self.v = box[: self.size], box[self.size : -1]
        edges = [arb(reach * k / _PARTS) for k in range(_PARTS + 1)]
        self.parts = [a.union(b) for a, b in pairwise(edges)]

    def _pair(self, e: arb) -> list[Vector]:
        return [
            [u + e * v for u, v in zip(self.u, self.v, strict=True)],
            [u - e * v for u, v in zip(self.u, self.v, strict=True)],
        ]

    def bends(self) -> Vector:
        """Return balls of half the second derivative of Phi, a sixth of the third one, and 0."""
        found: Vector = []
        for e in self.parts:
            value: Vector = []
            for order, factor in ((2, 4), (3, 12)):
                one, other = (along(self.plain, at, self.v, order) for at in self._pair(e))
                value += [(a + b) / factor for a, b in zip(one, other, strict=True)]
            found = [a.union(b) for a, b in zip(found, value, strict=True)] if found else value
        return [*found, arb(0)]

    def gap(self, inverse: arb_mat, c: Vector) -> FloatArray:
        """Return bounds of ``1 - C G_x`` for all e."""
        size, width = self.size, 2 * self.size + 1
        one = identity(width)
        bent: arb_mat | None = None
        found = np.zeros((width, width))
        for e in self.parts:
            pair = self._pair(e)
            plus = [arb_mat(self.chain.linearised(at)[1]) for at in pair]
            minus = [arb_mat(self.chain.linearised(at, -1)[1]) for at in pair]
            curved = [arb_mat(self.chain.bent(at, self.v, -1)) for at in pair]
            even = (curved[0] + curved[1]) / 2
            bent = even if bent is None else _hull(bent, even)
            mean, other = (plus[0] + plus[1]) / 2, (minus[0] + minus[1]) / 2
            half = (minus[0] - minus[1]) * e / 2
            rows = [
                [*a[:size], *b[:size], a[-1]]
                for pairs in ((mean, half), (bent, other))
                for a, b in zip(pairs[0].tolist(), pairs[1].tolist(), strict=True)
            ]
            rows.append([*[arb(0)] * size, *c, arb(0)])
            found = np.maximum(found, upper(one - inverse * arb_mat(rows)))
        return found


def _hull(a: arb_mat, b: arb_mat) -> arb_mat:
    both = zip(a.entries(), b.entries(), strict=True)
    return arb_mat(a.nrows(), a.ncols(), [x.union(y) for x, y in both])


def along(chain: Chain, x: Vector, step: Vector, order: int) -> Vector:
    r"""Return a derivative of the residual in the direction of a disturbance that changes sign after a turn.

    With ``w(e) = w(t + e t', y + e y')`` and the duration ``d + e d'`` it is, of a segment,
    ``sum_j binom(k, j) d'^j M^j exp(M d) w^(k - j)``.
    """
    z, m = chain.joints(x), chain.m
    change = [step[i * m : (i + 1) * m] for i in range(chain.segments.count)]
    change.append([-c for c in chain.closed_change(change[0])])
    found: Vector = []
    for i in range(chain.segments.count):
        move, longer = chain.move(i, z), change[i + 1][0] - change[i][0]
        total = arb_mat(chain.model.size, 1)
        for j in range(order + 1):
            term = _moved(chain, z[i], change[i], order - j)
            term = move.flow * (term if move.reset is None else move.reset * term)
            for _ in range(j):
                term = move.field * term * longer
            total += term * comb(order, j)
        found += [total[k, 0] for k in range(chain.n)]
        at, row, _ = chain.condition(i)
        found.append((row * _moved(chain, z[at], change[at], order))[0, 0])
    return found


def _moved(chain: Chain, joint: Vector, change: Vector, order: int) -> arb_mat:
    """Return a derivative of the extended state at a joint in the direction of a disturbance."""
    if order == 0:
        return column(chain.model.extended(joint[0], joint[1:]))
    found = [c * change[0] ** order for c in chain.model.by_time(joint[0], order)]
    if order == 1:
        for k in range(chain.n):
            found[k] += change[1 + k]
    return column(found)


def has_no_flip(segments: Segments, build: Builder, x: Vector) -> bool:
    """Tell whether no multiplier of a turn is -1 for all solutions in some balls."""
    _, rows = Chain(segments, build(x[-1])).linearised(x[:-1], -1)
    square = arb_mat([row[:-1] for row in rows])
    nothing = arb_mat(square.nrows(), square.ncols())
    return regular_along([square, nothing, nothing], 0.0)
