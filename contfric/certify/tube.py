r"""One box of a tube about a branch: for every value of a section there is exactly one orbit in it.

Between two orbits A and B of the curve, ``X = (z, p)``, let ``c(s) = A + s (B - A)``. The sections are
the planes ``n (X - A) = s`` with ``n = d / |d|^2``, d = B - A. For all s of an interval a little longer
than (0, 1),

    G(X) = (F(X), n (X - A) - s) = 0

has exactly one solution in ``c(s) +- R`` if Krawczyk's image of it, with the interval of s in the place
of a number, lies inside (:mod:`contfric.certify.krawczyk`). There the residual is bounded by the mean
value theorem,

    G(c(s)) = (F(c(1/2)) + F_X(c) d (s - 1/2), 0),

which is of second order in |d|, as d is nearly tangential. So the solutions are one smooth curve through
the box. Its direction T solves ``G_X T = (0, 1)``: where its last entry has a sign, p is monotone along
the box and there is no fold in it. Where the Jacobian with a closure of the opposite sign is regular, no
multiplier of a turn is -1.
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_mat

from contfric.certify.chain import Chain, Segments, Wide
from contfric.certify.extended import Builder
from contfric.certify.krawczyk import approximate_inverse, krawczyk
from contfric.certify.verdict import Verdict
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector, around, column, numbers, row_norm

#: How far a box reaches beyond its two orbits, as a share of it: boxes of a tube overlap.
OVERLAP = 0.02
#: First half-widths of a box, in units of how far the curve is from its chord at the middle, and how often
#: they are doubled.
_WIDE, _TRIES = 4, 3
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
    monotone : whether the parameter is monotone along it
    no_flip : whether no multiplier of a turn is -1 in it
    """

    first: Vector
    last: Vector
    normal: Vector
    all: Vector
    radii: Vector
    monotone: bool
    no_flip: bool

    def holds(self, point: Vector) -> bool:
        """Tell whether a solution that is known to lie in some balls is on the curve of this box."""
        difference = [b - a for a, b in zip(self.first, self.last, strict=True)]
        off = [p - a for p, a in zip(point, self.first, strict=True)]
        whole, part = (
            sum((n * c for n, c in zip(self.normal, other, strict=True)), arb(0))
            for other in (difference, off)
        )
        s = part / whole
        if not (s > -OVERLAP and s < 1 + OVERLAP):
            return False
        return all(abs(o - s * c) < r for o, c, r in zip(off, difference, self.radii, strict=True))


def solved(segments: Segments, build: Builder, near: Vector, plane: Vector) -> Vector | None:
    """Return the orbit in a plane through a point, by Newton's method; exact numbers, or None.

    Parameters
    ----------
    near : point in the plane, (z, p)
    plane : its normal
    """
    x = [c.mid() for c in near]
    for _ in range(6):
        residual, rows = Chain(segments, build(x[-1])).linearised(x[:-1])
        off = sum((n * (c - a) for n, c, a in zip(plane, x, near, strict=True)), arb(0))
        matrix = arb_mat([*rows, plane]).mid()
        try:
            step = numbers(matrix.solve(column([*residual, off]).mid(), algorithm="approx"))
        except ZeroDivisionError:
            return None
        if not all(c.is_finite() for c in step):
            return None
        x = [(c - s).mid() for c, s in zip(x, step, strict=True)]
        if all(abs(s) < _LEAST for s in step):
            return x
    return None


def box_between(segments: Segments, build: Builder, first: Vector, last: Vector) -> Box | None:
    """Return the box between two orbits of a curve, or None if it is not proved."""
    difference = [(b - a).mid() for a, b in zip(first, last, strict=True)]
    square = sum((c * c for c in difference), arb(0))
    if not square > 0:
        return None
    normal = [(c / square).mid() for c in difference]
    middle = [((a + b) / 2).mid() for a, b in zip(first, last, strict=True)]
    central = build(middle[-1])
    residual, rows = Chain(segments, central).linearised(middle[:-1])
    inverse = approximate_inverse(arb_mat([*rows, normal]))
    if inverse is None:
        return None
    shares = arb(0.5, 0.5 + OVERLAP)
    chord = [m + (shares - 0.5) * c for m, c in zip(middle, difference, strict=True)]
    centre = column([*residual, arb(0)])
    off = numbers(inverse * centre)
    radii = [
        _WIDE * o.abs_upper() + _LEAST * (1 + m.abs_upper())
        for o, m in zip(off, middle, strict=True)
    ]
    for _ in range(_TRIES):
        box = [around(c, r) for c, r in zip(chord, radii, strict=True)]
        model = build(box[-1])
        lasting = _durations(segments, model, middle, difference, shares - 0.5, radii)
        whole = Chain(segments, model, Wide(lasting, central, box[-1] - middle[-1]))
        _, wide = whole.linearised(box[:-1])
        jacobian = arb_mat([*wide, normal])
        drift = numbers(arb_mat(wide) * column(difference))
        moved = column(
            [r + d * (shares - 0.5) for r, d in zip(residual, drift, strict=True)] + [arb(0)]
        )
        size = len(middle)
        identity = arb_mat([[int(i == j) for j in range(size)] for i in range(size)])
        gap = identity - inverse * jacobian
        image = numbers(gap * column([arb(0, r) for r in radii]) - inverse * moved)
        if all(k.abs_upper() < r for k, r in zip(image, radii, strict=True)):
            found = [c + k for c, k in zip(chord, image, strict=True)]
            monotone = _is_monotone(inverse, jacobian, gap, difference)
            return Box(first, last, normal, found, radii, monotone, _has_no_flip(whole, found))
        if not all(k.is_finite() for k in image):
            return None
        radii = [max(2 * k.abs_upper(), r, key=float) for k, r in zip(image, radii, strict=True)]
    return None


def _durations(
    segments: Segments,
    model: BallModel,
    middle: Vector,
    difference: Vector,
    shares: arb,
    radii: Vector,
) -> Vector:
    """Return the durations of segments in a box: along the chord the joints move together."""
    m, found = segments.states + 1, []
    for i in range(segments.count):
        at, after = i * m, (i + 1) * m
        if i + 1 < segments.count:
            rest, change = middle[after] - middle[at], difference[after] - difference[at]
            spread = radii[at] + radii[after]
        elif segments.turn != 0.0:  # by the closure, t_N = t_0 + turn T
            rest = middle[0] + arb(segments.turn) * model.period - middle[at]
            change = difference[0] - difference[at]
            spread = radii[0] + radii[at] if i else arb(0)
        else:
            rest, change, spread = -middle[at], -difference[at], radii[at]
        found.append(around(rest + shares * change, spread))
    return found


def are_linked(segments: Segments, build: Builder, before: Box, after: Box) -> bool:
    """Tell whether the curve of a box goes on as that of the next one: both hold one and the same orbit."""
    end = before.last
    difference = [(b - a).mid() for a, b in zip(before.first, end, strict=True)]

    def equations(x: Vector) -> tuple[Vector, arb_mat]:
        residual, rows = Chain(segments, build(x[-1])).linearised(x[:-1])
        off = sum((c * (a - b) for c, a, b in zip(difference, x, end, strict=True)), arb(0))
        return [*residual, off], arb_mat([*rows, difference])

    found = krawczyk(equations, end, [_LEAST * 16 * (1 + c.abs_upper()) for c in end])
    if found.verdict is not Verdict.PROVED:
        return False
    return before.holds(found.zero) and after.holds(found.zero)


def _is_monotone(inverse: arb_mat, jacobian: arb_mat, gap: arb_mat, difference: Vector) -> bool:
    """Tell whether the parameter is monotone along a box, from an enclosure of the direction T of the curve.

    ``T - d = e' + (I - C G_X) (T - d)`` with ``e' = -C (G_X d - (0, 1))`` bounds all entries of T - d
    together, and put in once more the last one.
    """
    contraction = row_norm(gap)
    if not contraction < 1:
        return False
    wanted = column([*[arb(0)] * (len(difference) - 1), arb(1)])
    error = numbers(inverse * (jacobian * column(difference) - wanted))
    worst = max((c.abs_upper() for c in error), key=float) / (1 - contraction)
    last = sum((gap[gap.nrows() - 1, j].abs_upper() for j in range(gap.ncols())), arb(0))
    return bool(abs(difference[-1]) > error[-1].abs_upper() + last * worst)


def _has_no_flip(chain: Chain, box: Vector) -> bool:
    _, rows = chain.linearised(box[:-1], -1)
    jacobian = arb_mat([row[: chain.size] for row in rows])
    inverse = approximate_inverse(jacobian)
    if inverse is None:
        return False
    identity = arb_mat([[int(i == j) for j in range(chain.size)] for i in range(chain.size)])
    return bool(row_norm(identity - inverse * jacobian) < 1)
