r"""One box of a tube about a branch: for every value of a section there is exactly one orbit in it.

Between two orbits A and B of the curve, ``X = (z, p)``, let ``c(s) = m + s d``, m the middle, d = B - A. The
sections are the planes ``n (X - m) = s`` with ``n = d / |d|^2``. For each s of an interval [-h, h] a little
longer than (-1/2, 1/2), Krawczyk's operator (:mod:`contfric.certify.enclosures.krawczyk`) of

    G(X) = (F(X), n (X - m) - s)

is used on ``X_s = c(s) +- R`` with a preconditioner that depends on s, too. With the Jacobian
``J_0 + s J_1 + J_r`` in the box (:mod:`contfric.certify.equations.ray`), C near the inverse of J_0,
``B = C J_1`` it is ``C(s) = (1 - s B) C``, and

    1 - C(s) J = (1 - s B) (1 - C J_0) + s^2 B^2 - (1 - s B) C J_r ,

which is of second order in |d|. So are ``F(c(s)) = F(m) + s J_0 d + s^2 J_1 d / 2 + s J_r d`` (J_r of the
chord) and R. So the solutions are one smooth curve through the box, whose direction T solves
``G_X T = (0, 1)``: where its last entry has a sign, p is monotone along the box (no fold is in it). Where
the Jacobian with a closure of the other sign is regular, no multiplier of a turn is -1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat

from contfric.base.arrays import FloatArray
from contfric.certify.enclosures.bounds import Bounds, regular_along, supersolution
from contfric.certify.enclosures.krawczyk import approximate_inverse, krawczyk
from contfric.certify.equations.chain import Chain, Segments
from contfric.certify.equations.extended import Builder
from contfric.certify.equations.ray import Chord, Linear, Ray
from contfric.certify.verdict import Verdict
from contfric.models.balls.numbers import Vector, around, column, dot, numbers

#: How far a box reaches beyond its two orbits, as a share of it: boxes of a tube overlap.
OVERLAP = 0.02
#: Half-widths of a box in units of what would suffice if it were narrow, and how often others are tried.
_MORE, _TRIES = 1.3, 3
#: How much wider than the last box the next one may be: the Jacobian is looked at in that.
_NEAR = 2.0
#: Most steps of Newton's method, and how much smaller a correction is to be for a Jacobian to be kept.
_NEWTON, _FAST = 10, 0.05
#: Least half-widths, relative to 1 + the size of each number: rounding of 80 bits.
_LEAST = 2.0**-60


@dataclass(frozen=True, eq=False)
class Box:
    """A box that holds exactly one curve of solutions.

    Attributes
    ----------
    first, last : the orbits A and B, (z, p)
    normal : of the planes that are its sections
    all : enclosure of all solutions in it
    radii : half-widths R about the chord
    tangent : balls of the direction T of the curve, over the whole box; None if none are found
    no_flip : whether no multiplier of a turn is -1 in it
    linear : the Jacobian over the box
    bounds : what is left over of it by the preconditioner
    at_once : whether it was found in one go, by the half-widths of another one
    """

    first: Vector
    last: Vector
    normal: Vector
    all: Vector
    radii: Vector
    tangent: Vector | None
    no_flip: bool
    linear: Linear
    bounds: Bounds
    at_once: bool = False

    @property
    def monotone(self) -> bool:
        """Whether the parameter is monotone along it: the last entry of T has a sign."""
        return self.tangent is not None and not self.tangent[-1].contains(0)

    def part(self, k: int, count: int) -> Vector:
        """Return balls of all solutions of part k of ``count`` along it."""
        edges = [-0.5 - OVERLAP + (1 + 2 * OVERLAP) * arb(j) / count for j in (k, k + 1)]
        s = edges[0].union(edges[1])
        middle = [((a + b) / 2).mid() for a, b in zip(self.first, self.last, strict=True)]
        difference = [(b - a).mid() for a, b in zip(self.first, self.last, strict=True)]
        line = zip(middle, difference, self.radii, strict=True)
        return [around(m + s * d, r) for m, d, r in line]

    def holds(self, point: Vector) -> bool:
        """Tell whether a solution that is known to lie in some balls is on the curve of this box."""
        difference = [(b - a).mid() for a, b in zip(self.first, self.last, strict=True)]
        middle = [((a + b) / 2).mid() for a, b in zip(self.first, self.last, strict=True)]
        off = [p - m for p, m in zip(point, middle, strict=True)]
        s = dot(self.normal, off)
        if not abs(s) < 0.5 + OVERLAP:
            return False
        return all(abs(o - s * c) < r for o, c, r in zip(off, difference, self.radii, strict=True))


def solved(
    segments: Segments, build: Builder, plain: Builder, near: Vector, plane: Vector
) -> Vector | None:
    """Return the orbit in a plane through a point, by Newton's method; exact numbers, or None.

    The Jacobian is computed again only where the corrections do not shrink fast.

    Parameters
    ----------
    build, plain : the model with and without derivatives by the parameter
    near : point in the plane, (z, p)
    plane : its normal
    """
    x, inverse, last = [c.mid() for c in near], None, math.inf
    for _ in range(_NEWTON):
        if inverse is None:
            residual, rows = Chain(segments, build(x[-1])).linearised(x[:-1])
            inverse = approximate_inverse(arb_mat([*rows, plane]))
            if inverse is None:
                return None
        else:
            residual = Chain(segments, plain(x[-1])).residual(x[:-1])
        off = sum((n * (c - a) for n, c, a in zip(plane, x, near, strict=True)), arb(0))
        step = numbers((inverse * column([*residual, off])).mid())
        if not all(c.is_finite() for c in step):
            return None
        x = [(c - s).mid() for c, s in zip(x, step, strict=True)]
        if all(abs(s) < _LEAST for s in step):
            return x
        size = max(abs(float(s)) for s in step)
        inverse, last = (inverse if size < _FAST * last else None), size
    return None


def box_between(
    segments: Segments, build: Builder, first: Vector, last: Vector, like: Box | None = None
) -> Box | None:
    """Return the box between two orbits of a curve, or None if it is not proved.

    Parameters
    ----------
    like : a box of the curve nearby: one whose half-widths are as large for its length is tried first
    """
    difference = [(b - a).mid() for a, b in zip(first, last, strict=True)]
    square = sum((c * c for c in difference), arb(0))
    if not square > 0:
        return None
    normal = [(c / square).mid() for c in difference]
    middle = [((a + b) / 2).mid() for a, b in zip(first, last, strict=True)]
    central, half = build(middle[-1]), arb(0, 0.5 + OVERLAP)
    line = [m + half * d for m, d in zip(middle, difference, strict=True)]

    def linear(radii: FloatArray) -> Linear:
        chord = Chord(middle, difference, [arb(r) for r in radii], half)
        return Ray(segments, central, build(chord.box[-1]), chord).linear()

    def box(radii: FloatArray, found: Linear, bounds: Bounds, at_once: bool = False) -> Box:
        return Box(
            first,
            last,
            normal,
            [around(c, arb(r)) for c, r in zip(line, radii, strict=True)],
            [arb(r) for r in radii],
            bounds.solution(),
            regular_along(squared(found, -1), 0.5 + OVERLAP),
            found,
            bounds,
            at_once,
        )

    least = np.array([_LEAST * float(1 + m.abs_upper()) for m in middle])
    if like is not None:  # in one go, if the curve bends as there
        wide = _scaled(like, square)
        found = linear(wide)
        bounds = Bounds.of(_bordered(found, normal), 0.5 + OVERLAP)
        if bounds is not None:
            moved = bounds.moved([*found.residual, arb(0)], difference)
            wanted = supersolution(bounds.gap, moved)
            radii = wide if wanted is None else _MORE * wanted + least
            if np.all(radii <= wide) and _contracts(bounds, radii, moved):
                return box(radii, found, bounds, True)
    found = linear(np.zeros(len(middle)))  # on the chord itself
    straight = Bounds.of(_bordered(found, normal), 0.5 + OVERLAP)
    if straight is None:
        return None
    moved = straight.moved([*found.residual, arb(0)], difference)
    bounds = straight
    for _ in range(_TRIES):
        wanted = supersolution(bounds.gap, moved)
        if wanted is None:
            return None
        radii = _MORE * wanted + least
        found = linear(radii)
        bounds = straight.over(_bordered(found, normal))
        if _contracts(bounds, radii, moved):
            return box(radii, found, bounds)
    return None


def _contracts(bounds: Bounds, radii: FloatArray, moved: FloatArray) -> bool:
    return bool(np.all((bounds.gap @ radii + moved) * (1 + 1e-9) < radii))


def _scaled(like: Box, square: arb) -> FloatArray:
    """Return half-widths as those of another box, which are of second order in its length, and a little more.

    Parameters
    ----------
    square : of the length that they are wanted for
    """
    before = sum(((b - a).mid() ** 2 for a, b in zip(like.first, like.last, strict=True)), arb(0))
    ratio = float((square / before).mid())
    return _NEAR * ratio * np.array([float(r.abs_upper()) for r in like.radii])


def _bordered(found: Linear, normal: Vector) -> list[arb_mat]:
    """Return the Jacobian with the row of the sections: value, slope, rest."""
    nothing = [arb(0)] * len(normal)
    rows = (normal, nothing, nothing)
    return [arb_mat([*m.tolist(), row]) for m, row in zip(found.whole(1), rows, strict=True)]


def squared(found: Linear, sigma: int) -> list[arb_mat]:
    """Return the Jacobian by the joints, with sigma times the closure."""
    return [arb_mat([row[:-1] for row in m.tolist()]) for m in found.whole(sigma)]


def orbit_in(segments: Segments, build: Builder, at: Vector, plane: Vector) -> Vector | None:
    """Return balls of the only orbit next to a point, in a plane through it."""

    def equations(x: Vector) -> tuple[Vector, arb_mat]:
        residual, rows = Chain(segments, build(x[-1])).linearised(x[:-1])
        off = sum((c * (a - b) for c, a, b in zip(plane, x, at, strict=True)), arb(0))
        return [*residual, off], arb_mat([*rows, plane])

    found = krawczyk(equations, at, [_LEAST * 16 * (1 + c.abs_upper()) for c in at])
    return found.zero if found.verdict is Verdict.PROVED else None


def section(segments: Segments, plain: Builder, box: Box, last: bool) -> Vector | None:
    """Return balls of the orbit of a box in the plane of its sections through its first or last point.

    By C(s) there ``|X - c(s)| <= gap |X - c(s)| + |C(s) G(c(s))|``: no other Jacobian is needed.
    """
    s = arb(0.5 if last else -0.5)
    middle = [((a + b) / 2).mid() for a, b in zip(box.first, box.last, strict=True)]
    line = [m + s * (b - a).mid() for m, a, b in zip(middle, box.first, box.last, strict=True)]
    residual = Chain(segments, plain(line[-1])).residual(line[:-1])
    off = sum((n * (c - m) for n, c, m in zip(box.normal, line, middle, strict=True)), -s)
    error = supersolution(box.bounds.gap, box.bounds.applied([*residual, off], s))
    if error is None:
        return None
    zero = [around(c, arb(float(r))) for c, r in zip(line, error, strict=True)]
    return zero if box.holds(zero) else None


def are_linked(segments: Segments, plain: Builder, before: Box, after: Box) -> bool:
    """Tell whether the curve of a box goes on as that of the next one: both hold one and the same orbit."""
    zero = section(segments, plain, before, True)
    return zero is not None and after.holds(zero)
