"""A box about a piece of a curve of orbits, proved to hold one orbit for each s, |s| <= 1/2.

Its middle is a line c(s) between two knots; one number of it is kept, the others may differ by y, |y| <= r.
With C near the inverse of the Jacobian J by them the map ``y - C F(c + y)`` contracts |y| <= r into itself
if ``|1 - C J| r + |C F(c)| < r``.
"""

from __future__ import annotations

from typing import Any, Self

from flint import arb, arb_mat, arb_series, ctx

from contfric.verify.scene import Scene, Undecided, part

HALF = arb(0.51)  # of a box, which overlaps the next one
INSIDE = arb(0, HALF)


class Box:
    """The orbits between two knots; or, without a second one, an orbit next to a point."""

    def __init__(self, data: Any, kept: int, a: list[arb], b: list[arb] | None = None) -> None:
        self.data, self.kept, self.steps, n = data, kept, 0 if b else 3, len(a) - 1
        self.middle = ((column(a) + column(b or a)) * 0.5).mid()
        self.along = (column(b or a) - column(a)).mid()
        self.radii = 0 * self.middle
        self.rest = arb_mat([[j + (j >= kept) == i for j in range(n)] for i in range(n + 1)])

    def proved(self, radii: list[arb] | None = None) -> Self:
        """See that each s has one orbit, within some half-widths if they are given."""
        for left in range(0 if radii else self.steps, -1, -1):
            f, jacobian = self.equations(arb(0))
            self.inverse = (jacobian * self.rest).mid().inv().mid()
            if left:  # a step of Newton's method
                self.middle = (self.middle - self.rest * (self.inverse * f)).mid()
        parts = [f, self.rates(arb(0), 1), self.rates(INSIDE, 2)][: 1 if self.steps else 3]
        off = sum((HALF**k * size(self.inverse * v) for k, v in enumerate(parts)), 0 * f)
        others = self.rest.transpose()
        least = arb(2) ** -(7 * ctx.prec // 10) * column([1] * len(f.entries()))
        found = size(others * column(radii) if radii else 2 * off + least)
        for _ in range(1 if radii else 4):
            self.radii = self.rest * found
            gap = size(others * self.rest - self.inverse * self.equations(INSIDE)[1] * self.rest)
            reached = gap * found + off
            if below(reached, found):
                self.gap = others * self.rest - gap
                return self
            found = size(1.5 * reached + least)
        raise Undecided("one orbit in a box")

    def curve(self, s: arb) -> arb_mat:
        """Return what the box holds at s."""
        return self.middle + s * self.along + spread(self.radii)

    def orbits(self, s: Any) -> tuple[Scene, list[arb]]:
        """Return scene and unknowns for all s in a ball."""
        *z, value = self.curve(arb(s)).entries()
        return Scene(self.data, value), z

    def equations(self, s: arb) -> tuple[arb_mat, arb_mat]:
        """Return F, and its Jacobian by all numbers."""
        *z, value = self.curve(s).entries()
        moved = value if self.kept == len(z) else arb_series([value, 1])
        values, rows = Scene(self.data, moved).equations(z)
        full = ([*row, part(v, 1)] for row, v in zip(rows, values, strict=True))
        jacobian = arb_mat([[part(v, 0) for v in row[:-1]] + row[-1:] for row in full])
        return column(part(v, 0) for v in values), jacobian

    def rates(self, s: arb, order: int) -> arb_mat:
        """Return a coefficient of F along the line."""
        values, _ = Scene.equations(*self.moving(s, self.along))
        return column(part(v, order) for v in values)

    def moving(self, s: arb, slope: arb_mat) -> tuple[Scene, list[Any]]:
        """Return scene and unknowns as power series in a direction."""
        pairs = zip(self.curve(s).entries(), slope.entries(), strict=True)
        *z, value = (arb_series([v, d]) for v, d in pairs)
        return Scene(self.data, value), z


def column(values: Any) -> arb_mat:
    """Return a matrix of one column."""
    return arb_mat([[v] for v in values])


def size(matrix: arb_mat) -> arb_mat:
    """Return upper bounds of the entries."""
    bounds = [abs(v).upper() for v in matrix.entries()]
    return arb_mat(matrix.nrows(), matrix.ncols(), bounds)


def spread(radii: arb_mat) -> arb_mat:
    """Return balls about 0."""
    return column(arb(0, r.upper()) for r in radii.entries())


def below(first: arb_mat, last: arb_mat) -> bool:
    """Tell whether all entries are."""
    return all(v < w for v, w in zip(first.entries(), last.entries(), strict=True))
