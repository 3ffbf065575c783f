"""Pieces of a curve of orbits: each in a box, with what the law of friction says over all of it.

Orbits of a box are c + y, c(s) a line, |y| <= r, ``b y = 0`` (b keeps the parameter, or is along c).
With C near the inverse of J, that of F and b, ``y - C F(c + y)`` contracts if ``|1 - C J| r + |C F(c)| < r``.
"""

from __future__ import annotations

from typing import Any, Self

from flint import arb, arb_mat, arb_series, ctx

from contfric.verify.motion import Scene, Undecided, ball, part, see

HALF, INSIDE, STEEP = arb(0.51), arb(0, 0.51), 0.02  # of a box, beyond its ends; of its parameter
MET = {"CS": "1F0", "SS": "1F0", "GS": "1v1", "T": "1F1", "AS": "0F1"}  # slides, meets, in windows


class Link:
    """The orbits between two knots; or, without a second one, an orbit next to a point."""

    def __init__(self, data: Any, a: list[arb], b: Any = None, border: Any = None) -> None:
        self.data, self.newton = data, 0 if b else 3
        self.middle = ((column(a) + column(b or a)) * 0.5).mid()
        self.along, self.radii = (column(b or a) - column(a)).mid(), 0 * self.middle
        *others, moved = size(self.along).entries()
        self.unit = column([0] * len(others) + [1])
        own = (self.along if moved < STEEP * max(others) else self.unit).transpose()
        self.border = own if border is None else border
        self.fixed = self.border == self.unit.transpose()

    def proved(self, radii: list[arb] | None = None) -> Self:
        """See that each s has one orbit, within some half-widths if they are given."""
        for left in range(0 if radii else self.newton, -1, -1):
            f, jacobian = self.equations(arb(0))
            self.inverse = jacobian.mid().inv().mid()
            if not left or max(size(f).entries(), key=float) < arb(2) ** -(9 * ctx.prec // 10):
                break
            self.middle = (self.middle - self.inverse * f).mid()  # a step of Newton's method
        more = () if self.newton else (self.rates(arb(0), 1), self.rates(INSIDE, 2))
        off = sum((HALF**k * size(self.inverse * v) for k, v in enumerate((f, *more))), 0 * f)
        least = column([arb(2) ** -((8 if self.newton else 6) * ctx.prec // 10)] * len(f.entries()))
        self.radii = column(radii) + least if radii else size(2 * off + least)
        for _ in range(1 if radii else 4):
            self.gap = 1 - size(1 - self.inverse * self.equations(INSIDE)[1])
            if all(margin > 0 for margin in (self.gap * self.radii - off).entries()):
                if self.newton and not radii:  # an orbit
                    see(Scene.misses(*self.orbits(0)), "no part of its period is one", False)
                return self
            self.radii = size(1.5 * (self.radii - self.gap * self.radii + off) + least)
        raise Undecided("one orbit in a box")

    def orbits(self, s: Any, slope: arb_mat | None = None) -> tuple[Scene, list[Any]]:
        """Return scene and unknowns for all s in a ball; with a slope as power series."""
        *y, last = (arb(0, r.upper()) for r in self.radii.entries())
        off = column([*y, 0 if self.fixed else last])
        *z, value = (self.middle + arb(s) * self.along + off).entries()
        if slope is not None:
            *z, value = (arb_series([*c]) for c in zip([*z, value], slope.entries(), strict=True))
        return Scene(self.data, value), z

    def moving(self) -> tuple[Scene, list[Any]]:
        """Return scene and unknowns of all orbits, as power series in the direction of their curve."""
        rates = self.rates(arb(0), 1) + 2 * INSIDE * self.rates(INSIDE, 2)
        turned = self.gap.solve(size(self.inverse * rates)).entries()
        return self.orbits(INSIDE, self.along + column(arb(0, r.upper()) for r in turned))

    def equations(self, s: arb) -> tuple[arb_mat, arb_mat]:
        """Return F, and the Jacobian of F and b."""
        scene, z = self.orbits(s, None if self.fixed else self.unit)
        values, rows = scene.equations(z)
        full = [[*(part(c, 0) for c in r), part(v, 1)] for r, v in zip(rows, values, strict=True)]
        return column(part(v, 0) for v in [*values, 0]), arb_mat([*full, self.border.entries()])

    def rates(self, s: arb, order: int) -> arb_mat:
        """Return a coefficient of F along the line."""
        return column(part(v, order) for v in [*Scene.equations(*self.orbits(s, self.along))[0], 0])

    def holds(self, point: Link) -> bool:
        """Tell whether the orbit next to a point is one of the box."""
        scene, z = point.orbits(0)
        off = column([*z, scene.value]) - self.middle
        s = (self.border * off)[0, 0] / (self.border * self.along)[0, 0]
        left = self.radii - size(off - s * self.along)
        return abs(s) < HALF and all(margin > 0 for margin in left.entries())

    def events(self, first: Link, last: Link) -> list[str]:
        """Return which multipliers pass the circle between two orbits, once each: their rates have a sign."""
        found, (scene, z) = list[str](), self.moving()
        trace, det, along = scene.multipliers(z)
        kinds, pair = ("SN", "BP" if scene.half else "PD", "NS"), part(trace * trace - 4 * det, 0)
        here = Scene.multipliers(*self.orbits(0))[2]
        for k, kind in enumerate(kinds):
            rate, other = part(along[k], 1), kind == "NS"
            never = pair > 0 if other else k == 0 and 0 not in part(scene.value, 1)  # or no fold
            if not never and 0 in here[k] + rate * INSIDE:
                low, high = (Scene.multipliers(*box.orbits(0))[2][k] for box in (first, last))
                unclear = 0 in rate or 0 in low * high or (other and not pair < 0)
                see(not unclear, f"whether a {kind} is in a box", False)
                found += [kind] * bool(low * high < 0)
        return found


def column(values: Any) -> arb_mat:
    """Return a matrix of one column."""
    return arb_mat([[v] for v in values])


def size(matrix: arb_mat) -> arb_mat:
    """Return upper bounds of the entries."""
    return arb_mat(matrix.nrows(), matrix.ncols(), [abs(v).upper() for v in matrix.entries()])


def check_admissible(scene: Scene, z: list[arb], met: Any = (), short: bool = False) -> None:
    """See that the law is obeyed, where surfaces may be met; a short stick after such a stop may vanish."""
    met, count = dict(met), scene.count
    stops = [((i, "F+") in met) - ((i, "F-") in met) for i in range(count)]
    levels = [k * abs(slide) for k, (slide, _) in zip(stops, scene.segments, strict=True)]
    for i, (direction, side) in enumerate(scene.segments):
        what, tau = f"segment {i + 1}", scene.duration(z, i)
        after = scene.segments[(i + 1) % count][0] * (scene.closing if i + 1 == count else 1)
        start = levels[i - 1] * (scene.closing if i == 0 else 1)
        vanishes = short and side != 0 and side == start
        see(vanishes or tau, f"{what} lasts")
        leads = after in ((0, -direction) if direction else (-side,))
        see(leads and not after * levels[i] > 0, f"{what} leads on in that direction")
        if direction and after and not levels[i]:  # a stick shows by itself that it may begin
            end, x = scene.joint(z, i + 1)
            see(after * (scene.force(end)[0] - x) - scene.s0, f"{what}: it reverses at its end")
        if direction:  # after rest with S0 = S it starts with acceleration 0
            rest = scene.segments[i - 1][0] == 0 and (scene.s0 - scene.s).is_zero()
            _inside((scene, z), i, "v", direction, 1 + rest, True, met)
        for limit, name in () if direction else ((1, "F+"), (-1, "F-")):
            if vanishes and limit == side:  # the load grows on the way
                see(side * scene.observed(z, i, name, tau.union(arb(0)))[1], f"{what}: transversal")
            else:
                _inside((scene, z), i, name, -limit, limit == start, limit == side, met)


def _inside(orbit: Any, i: int, name: str, sign: int, order: int, ends: bool, met: Any) -> None:
    """See that an observable has a sign inside of a segment, but for zeros at its ends and at a touch."""
    (scene, z), what = orbit, f"segment {i + 1}: {name} is not met inside"
    waiting = [(2, index) for index in range(4)] if name == "v" else [(0, 0)]
    duration, touch = scene.duration(z, i).upper(), met.get((i, name))
    for level, index in waiting:  # which grows
        piece = (duration * index / 2**level).union(duration * (index + 1) / 2**level)
        value, rate, bend, _ = (sign * c for c in scene.observed(z, i, name, piece.mid()))
        off, third = piece - piece.mid(), sign * scene.observed(z, i, name, piece)[3]
        value += (rate + (bend + third * off / 3) * off / 2) * off  # Taylor's
        rate, bend = rate + (bend + third * off / 2) * off, bend + third * off
        see(not value < 0, what)
        starts = level > 0 == index and order > 0 and (rate, bend)[order - 1] > 0
        stops = level > 0 and index == 2**level - 1 and ends and rate < 0
        lowest = touch is not None and piece.overlaps(touch) and bend > 0
        if not (value > 0 or starts or stops or lowest):
            see(level < 90 and len(waiting) <= 20_000, what, False)  # halvings, pieces
            waiting += [(level + 1, 2 * index), (level + 1, 2 * index + 1)]


def met_in(box: Link, a: Link, b: Link, kind: str, spots: list[Any]) -> dict[tuple[int, str], arb]:
    """Return what is met at an event between two orbits, and when: all of it falls, and some passes 0."""
    (scene, z), moving, met, passed = box.orbits(INSIDE), box.moving(), {}, False
    for i, what, *window in spots:
        name = {1: "F+", -1: "F-", "F+": "F+", "F-": "F-", "v": "v"}.get(what, "")
        slides = abs(scene.segments[i][0]) if i in range(scene.count) else ""
        see(f"{slides}{name[:1]}{len(window)}" == MET.get(kind), f"a {kind} is at {[i, what]}")
        times = [ball(text) for text in window]
        first, last = (_met(*point.orbits(0), i, name, times)[0] for point in (a, b))
        _, grows, met[i, name] = _met(scene, z, i, name, times)
        time = times[0] if times else Scene.duration(*moving, i)
        rate = part(Scene.observed(*moving, i, name, time)[0], 1)
        see(-first * rate, f"what vanishes at a {kind} falls")
        passed = passed or first * last < 0
        see(len(window) or what * grows * (1 if kind == "CS" else -1), f"it moves as at a {kind}")
    see(passed, f"what vanishes at a {kind} changes its sign", False)
    return met if kind != "T" else {}  # which the law allows


def _met(scene: Scene, z: Any, i: int, name: str, windows: list[arb]) -> tuple[arb, arb, arb]:
    """Return a load at the end of a slide, or what is stationary once in a window; its rate; and when."""
    time = duration = scene.duration(z, i)
    for window in windows:
        see(window.min(duration - window), "it is touched inside")
        time = window
        for _ in range(4):  # interval Newton's method
            middle, bend = arb(time.mid()), scene.observed(z, i, name, time)[2]
            time = middle - scene.observed(z, i, name, middle)[1] / bend
            see(window.contains_interior(time), "a surface is touched", False)
    return (*scene.observed(z, i, name, time)[:2], time)
