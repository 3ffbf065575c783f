r"""A box about a piece of a curve of orbits, proved to hold one orbit for each number s (see the package).

Between two knots let c(s), |s| <= 1/2, be the straight line, in phases for times; one number of it is kept
(the parameter, near a fold another one). ``F(c + y) = f0 + s f1 + s^2 f2`` and the Jacobian by the others are
power series, their last coefficients balls over all s. With C near the inverse of J0, B = C J1 the map
``y - (1 - s B) C F(c + y)`` takes |y| <= r into itself and contracts: each s has one orbit there. They are
a smooth curve with the direction c' + y', ``J y' = -dF(c + y)/ds``.
"""

from __future__ import annotations

from typing import Any

from flint import arb, arb_mat, arb_series, ctx

from contfric.verify.solution import Scene, Undecided

HALF = arb(0.51)  # of a box, which overlaps the next one
STEEP = 0.02  # a parameter that changes less than this share of another number is not kept
INSIDE = arb(0, HALF)


class Box:
    """The orbits between two knots; or, without a second one, the orbit at a parameter next to a point."""

    def __init__(self, data: Any, a: list[arb], b: list[arb] | None = None, kept: int = -1) -> None:
        self.data, self.name, self.n, self.point = data, data["parameter"], len(a) - 1, b is None
        first, last = (self.phases(x, 1) for x in (a, b or a))
        self.middle = [((p + q) / 2).mid() for p, q in zip(first, last, strict=True)]
        self.along = [(q - p).mid() for p, q in zip(first, last, strict=True)]
        size = [
            float(abs(d)) / (1 + float(abs(m)))
            for d, m in zip(self.along, self.middle, strict=True)
        ]
        steep = size.index(max(size)) if size[-1] < STEEP * max(size) else self.n
        self.kept = steep if kept < 0 else kept
        self.others = [j for j in range(self.n + 1) if j != self.kept]
        self.radii = [arb(0)] * len(a)

    def proved(self, radii: list[arb] | None = None) -> Box:
        """See that each s has one orbit, within some half-widths if they are given; find the direction."""
        rounds = 3 if self.point and radii is None else 0
        for again in range(rounds + 1):
            f, jacobian = self._series(arb(0))
            c = jacobian[0].mid().inv().mid()
            if again < rounds:  # Newton's method
                moved = dict(zip(self.others, (c * f[0]).entries(), strict=True))
                x = [v - moved.get(j, 0) for j, v in enumerate(self.phases(self.middle, -1))]
                self.middle = [v.mid() for v in self.phases(x, 1)]
        off = [
            (c * _column(own.equations(z)[0])).entries()
            for own, z in map(self.orbits, (-0.5, 0, 0.5))
        ]
        widths = [
            2 * max((abs(v).upper() for v in row), key=float) for row in zip(*off, strict=True)
        ]
        one = arb_mat([[int(i == j) for j in range(self.n)] for i in range(self.n)])
        for _ in range(1 if radii else 4):
            least = [
                arb(2) ** -(7 * ctx.prec // 10) * (1 + abs(self.middle[j])) for j in self.others
            ]
            found = radii or [(w + r).upper() for w, r in zip(widths, least, strict=True)]
            self.radii = [*found[: self.kept], arb(0), *found[self.kept :]]
            ((_, f1, _), (j0, j1, _)), ((_, _, f2), (_, _, j2)) = map(
                self._series, (arb(0), INSIDE)
            )
            b = (c * j1).mid()
            gap, moved = _bound(c, b, [j0, j1, j2], one), _bound(c, b, [f[0], f[1], f2])
            reached = (gap * _column(found) + moved).entries()
            if all(v < r for v, r in zip(reached, found, strict=True)):
                if self.point:  # what a box holds lies in its image
                    self.radii = [*reached[: self.kept], arb(0), *reached[self.kept :]]
                turned = (one - gap).solve(_bound(c, b, [f1, 2 * f2, 0 * f2])).entries()
                turned = [*turned[: self.kept], arb(0), *turned[self.kept :]]
                slopes = (v[1] for v in self.curve(INSIDE))
                self.slope = [v + arb(0, w.upper()) for v, w in zip(slopes, turned, strict=True)]
                return self
            widths = [1.5 * v for v in reached]
        raise Undecided("one orbit in a box")

    def phases(self, x: list[Any], way: int) -> list[Any]:
        """Return unknowns with phases for times, or times for phases (-1)."""
        omega = x[-1] if self.name == "Omega" else Scene(self.data).omega
        return [*(v * omega**way if j % 2 == 0 else v for j, v in enumerate(x[:-1])), x[-1]]

    def knot(self) -> list[arb]:
        """Return what is in the middle of it."""
        return [v.mid() for v in self.phases(self.middle, -1)]

    def curve(self, s: Any, wide: bool = True) -> list[Any]:
        """Return c(s) as power series about a ball, with the half-widths of the box."""
        line = [arb_series([m + s * d, d]) for m, d in zip(self.middle, self.along, strict=True)]
        return [
            v + arb(0, r * wide) for v, r in zip(self.phases(line, -1), self.radii, strict=True)
        ]

    def orbits(self, s: Any, slope: list[arb] | None = None) -> tuple[Scene, list[Any]]:
        """Return scene and unknowns for all s in a ball; with a direction, as power series."""
        x = [v[0] for v in self.curve(s)]
        if slope:
            x = [arb_series([v, d]) for v, d in zip(x, slope, strict=True)]
        return Scene(self.data, {self.name: x[-1]}), x[:-1]

    def _series(self, s: arb) -> tuple[list[arb_mat], list[arb_mat]]:
        """Return the coefficients of F(c + y), and of its Jacobian, about a ball of s."""
        *z, value = [v[0] if self.point else v for v in self.curve(s)]
        values, rows = Scene(self.data, {self.name: value}).equations(z)
        if self.kept != self.n:
            rows = [[*r, v] for r, v in zip(rows, self._by_value(s), strict=True)]
        jacobian = [
            arb_mat([[_part(row[j], k) for j in self.others] for row in rows]) for k in range(3)
        ]
        return [_column([_part(v, k) for v in values]) for k in range(3)], jacobian

    def _by_value(self, s: arb) -> list[arb_series]:
        """Return the column of the parameter: its rate along c is half a difference of second derivatives."""
        slope = [v[1] for v in self.curve(INSIDE)]
        size = arb(1) if self.point else max(map(abs, self.along), key=float).mid()
        unit = [arb(0)] * self.n + [size]

        def along(at: arb, way: list[arb]) -> list[Any]:
            scene, z = self.orbits(at, way)
            return scene.equations(z)[0]

        if self.point:
            return [arb_series([v[1]]) for v in along(s, unit)]
        both = along(INSIDE, [v + w for v, w in zip(slope, unit, strict=True)])
        parts = zip(along(s, unit), both, along(INSIDE, slope), along(INSIDE, unit), strict=True)
        return [arb_series([f[1], p[2] - q[2] - r[2]]) / size for f, p, q, r in parts]

    def holds(self, point: Box) -> bool:
        """Tell whether the orbit next to a point is one of the box."""
        zero, k = [v[0] for v in point.curve(0)], self.kept
        s = (self.phases(zero, 1)[k] - self.middle[k]) / self.along[k]
        near = list(zip(zero, self.curve(s, False), self.radii, strict=True))
        return bool(abs(s) < HALF) and all(
            abs(v - c[0]) < r for v, c, r in near[:k] + near[k + 1 :]
        )


def _part(value: Any, k: int) -> arb:
    """Return a coefficient of a power series; a ball is a constant."""
    return value[k] if isinstance(value, arb_series) else arb(0 if k else value)


def _column(values: list[Any]) -> arb_mat:
    return arb_mat([[v] for v in values])


def _bound(c: arb_mat, b: arb_mat, parts: list[arb_mat], less: arb_mat | None = None) -> arb_mat:
    """Return bounds of (1 - s B) C (m_0 + s m_1 + s^2 m_2) - less for all s."""
    p, q, r = (c * m for m in parts)
    rows, columns = p.nrows(), p.ncols()
    terms = [(p if less is None else p - less).entries()]
    terms += [m.entries() for m in (q - b * p, r - b * q, b * r)]
    sizes = ((abs(v) * HALF**k for k, v in enumerate(entry)) for entry in zip(*terms, strict=True))
    return arb_mat(rows, columns, [sum(entry, arb(0)).upper() for entry in sizes])
