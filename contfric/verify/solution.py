"""The solution of a certificate file: its box, its motion, and Krawczyk's operator (see the package)."""

from __future__ import annotations

import re
from typing import Any

from flint import arb, arb_mat, ctx

#: Direction and exit: (1 or -1, 0) of a slide, (0, 1 or -1) of a stick that ends at +-S0.
SEGMENTS = {"slide+ v": (1, 0), "slide- v": (-1, 0), "stick F+": (0, 1), "stick F-": (0, -1)}
_NUMBER = r"\d{1,99}([.]\d{1,99})?(e[+-]?\d{1,4})?"


class Refused(Exception):
    """A statement is false, or the file states nothing that can be checked: no precision helps."""


class Undecided(Exception):
    """The balls are too wide for a decision: more bits may help."""


def number(value: Any) -> arb:
    """Return a number of a file."""
    if type(value) not in (int, float) or not arb(value).is_finite():
        raise Refused(f"{str(value)[:40]!r} is no number")
    return arb(value)


def ball(value: Any) -> arb:
    """Return the ball of a text such as ``1.25 +/- 1e-30``."""
    if not isinstance(value, str) or not re.fullmatch(f"(-?{_NUMBER} )?[+]/- {_NUMBER}", value):
        raise Refused("a ball is no text such as '1.25 +/- 1e-30'")
    return arb(value)


def decided(condition: bool, opposite: bool, what: str) -> None:
    """Go on if a condition holds for all numbers of its balls; refuse if its opposite does."""
    if not condition:
        raise Refused(f"false: {what}") if opposite else Undecided(what)


class Scene:
    """The parameters and segments of a file, and the motion that they have."""

    def __init__(self, data: dict[str, Any], balls: dict[str, arb] | None = None) -> None:
        if set(data["params"]) != {"Omega", "S", "S0", "h", "zeta"}:
            raise Refused("the parameters are not Omega, S, S0, h and zeta")
        params = {name: number(value) for name, value in data["params"].items()} | (balls or {})
        self.omega, self.s, self.s0 = (params[name] for name in ("Omega", "S", "S0"))
        self.h, self.zeta = params["h"], params["zeta"]
        if not (self.omega > 0 and self.s >= 0 and self.s0 >= self.s):
            raise Refused("the parameters do not obey Omega > 0 and S0 >= S >= 0")
        periods, self.half = data["periods"], data["half"]
        if type(periods) is not int or periods < 1 or self.half not in (False, periods % 2 == 1):
            raise Refused("it is no orbit of that many periods, or not symmetric in this way")
        self.turn = periods * arb.pi() * (1 if self.half else 2) / self.omega
        names = [" ".join(str(c) for c in row) for row in data["segments"]]
        if not 1 <= len(names) <= 400 or not set(names) <= set(SEGMENTS):
            raise Refused("its segments are not 1 to 400 slides and sticks")
        self.segments, self.count = [SEGMENTS[name] for name in names], len(names)

    def box(self, data: dict[str, Any]) -> tuple[list[arb], list[arb]]:
        """Return printed times and displacements with the half-widths of the box around them."""
        found = [[[number(c) for c in row] for row in data[name]] for name in ("joints", "radius")]
        wide = all(r > 0 for row in found[1] for r in row)
        if not wide or any([len(row) for row in rows] != [3] * self.count for rows in found):
            raise Refused("there is not one joint with its box for each segment")
        for (_, _, v), (_, _, wide) in zip(*found, strict=True):
            decided(abs(v) <= wide, abs(v) > wide, "the printed velocity is 0 within its box")
        printed, radii = ([c for t, x, _ in rows for c in (t, x)] for rows in found)
        return printed, radii

    def force(self, t: arb, order: int = 0) -> arb:
        """Return f(t) or a derivative of it."""
        total = arb(0)
        for w, amplitude in ((self.omega, arb(1)), (3 * self.omega, self.h)):
            sine, cosine = (w * t).sin_cos()
            total += amplitude * w**order * (cosine, -sine, -cosine, sine)[order % 4]
        return total

    def forced(self, t: arb, tau: arb) -> tuple[arb, arb]:
        """Return what f adds to displacement and velocity some time after t, from rest at 0."""
        x, v = arb(0), arb(0)
        for w, amplitude in ((self.omega, arb(1)), (3 * self.omega, self.h)):
            if amplitude.is_zero():
                continue
            (sine, cosine), (later, end) = (w * t).sin_cos(), (w * (t + tau)).sin_cos()
            if self.zeta.is_zero():  # also at resonance
                near, far = ((1 - w) * tau / 2).sinc(), (1 + w) * tau / 2
                p, q = tau * tau / 2 * far.sinc() * near, tau * far.cos() * near
                x += amplitude * (cosine * p - sine * (tau.sin() - q) / (1 + w))
                v += amplitude * (cosine * (q + (w * tau).sin()) / (1 + w) - sine * w * p)
                continue
            near, lost = 1 - w * w, 2 * self.zeta * w
            size, (c, dc, d, dd) = amplitude / (near * near + lost * lost), self.free(tau)
            from_x, from_v = near * cosine + lost * sine, w * (lost * cosine - near * sine)
            x += size * (near * end + lost * later - from_x * c - from_v * d)
            v += size * (w * (lost * end - near * later) - from_x * dc - from_v * dd)
        return x, v

    def free(self, tau: arb) -> tuple[arb, arb, arb, arb]:
        """Return C, C', D and D' after a duration."""
        z, stiff = self.zeta, 1 - self.zeta * self.zeta
        decay = (-z * tau).exp()
        if stiff.is_zero():
            c, d = 1 + z * tau, tau
            return decay * c, -decay * tau, decay * d, decay * (1 - z * tau)
        decided(stiff > 0 or stiff < 0, False, "how the damping compares with the critical one")
        rate = abs(stiff).sqrt()
        sine, cosine = (rate * tau).sin_cos() if stiff > 0 else (rate * tau).sinh_cosh()
        d = sine / rate
        c, slope = cosine + z * d, cosine - z * d
        return decay * c, -decay * d, decay * d, decay * slope

    def slide(self, direction: int, t: arb, x: arb, tau: arb) -> tuple[arb, arb]:
        """Return displacement and velocity of a slide that starts with velocity 0."""
        c, dc, _, _ = self.free(tau)
        (forced, speed), offset = self.forced(t, tau), -direction * self.s
        return offset + (x - offset) * c + forced, (x - offset) * dc + speed

    def acceleration(self, direction: int, t: arb, x: arb, v: arb) -> arb:
        """Return the acceleration in a slide."""
        return self.force(t) - x - 2 * self.zeta * v - direction * self.s

    def observed(self, z: list[arb], i: int, surface: str, tau: arb) -> tuple[arb, arb, arb]:
        """Return the observable of a surface with two derivatives, some time after the start of a segment."""
        (t, x), direction = self.joint(z, i), self.segments[i][0]
        y, v, a = x, arb(0), arb(0)
        if direction:
            y, v = self.slide(direction, t, x, tau)
            a = self.acceleration(direction, t + tau, y, v)
        if surface == "v":
            return v, a, self.force(t + tau, 1) - v - 2 * self.zeta * a
        load = y - self.force(t + tau) - (self.s0 if surface == "F+" else -self.s0)
        return load, v - self.force(t + tau, 1), a - self.force(t + tau, 2)

    def joint(self, z: list[arb], i: int) -> tuple[arb, arb]:
        """Return joint i, the last one by periodicity or symmetry."""
        if i < self.count:
            return z[2 * i], z[2 * i + 1]
        return z[0] + self.turn, -z[1] if self.half else z[1]

    def equations(self, z: list[arb]) -> tuple[list[arb], arb_mat]:
        """Return what vanishes for a solution, and its Jacobian, two rows a segment."""
        size, zero, one = 2 * self.count, arb(0), arb(1)
        values: list[arb] = []
        rows = [[zero] * size for _ in range(size)]
        for i, (direction, side) in enumerate(self.segments):
            (t, x), (end, y), k = self.joint(z, i), self.joint(z, i + 1), 2 * i
            if direction:
                reached, v = self.slide(direction, t, x, end - t)
                first = self.acceleration(direction, t, x, zero)
                last = self.acceleration(direction, end, reached, v)
                c, dc, d, dd = self.free(end - t)
                values += [reached - y, v]
                own, after = ((-first * d, c), (-first * dd, dc)), ((v, -one), (last, zero))
            else:
                values += [y - x, y - self.force(end) - side * self.s0]
                own, after = ((zero, -one), (zero, zero)), ((zero, one), (-self.force(end, 1), one))
            closing = -1 if i + 1 == self.count and self.half else 1
            for row, (by_t, by_x), (by_end, by_y) in zip((k, k + 1), own, after, strict=True):
                rows[row][k] += by_t
                rows[row][k + 1] += by_x
                rows[row][(k + 2) % size] += by_end
                rows[row][(k + 3) % size] += closing * by_y
        return values, arb_mat(rows)

    def solution(self, printed: list[arb], radii: list[arb], unique: bool) -> list[arb]:
        """Return a narrow enclosure of a solution in the box; check that it is the only one there."""
        zero, _ = self.enclosed(printed, None, "a solution near the printed joints")
        for off, r in ((abs(z - p), r) for z, p, r in zip(zero, printed, radii, strict=True)):
            decided(off < r, off > r, "the solution lies in the box around the printed joints")
        if unique:
            self.enclosed(printed, radii, "there is one solution only in the box")
        return zero

    def enclosed(
        self, centre: list[arb], widths: list[arb] | None, what: str, left: Any = (-1, -1)
    ) -> tuple[list[arb], list[arb]]:
        """Return the only zero in a box, and the half-widths of the box; without widths, of some box."""
        tries, widths = (1, widths) if widths else (12, [arb(2) ** (-ctx.prec // 2)] * len(centre))
        for _ in range(tries):
            widths = [w * (n != left[1]) for n, w in enumerate(widths)]
            box = [c + arb(0, w) for c, w in zip(centre, widths, strict=True)]
            zero = self.image(box, left)
            if all(n == left[1] or x.contains_interior(zero[n]) for n, x in enumerate(box)):
                for _ in range(6):
                    zero = self.image(zero, left)  # what a box holds lies in its image
                return zero, widths
            off = [2 * abs(z - c).upper() for z, c in zip(zero, centre, strict=True)]
            widths = [max(pair, key=float) for pair in zip(widths, off, strict=True)]
        raise Undecided(what)

    def image(self, box: list[arb], left: Any = (-1, -1)) -> list[arb]:
        """Return Krawczyk's image of a box: it holds each zero there (one equation, one unknown left out)."""
        rows, columns = ([n for n in range(2 * self.count) if n != out] for out in left)
        centre = [arb(c.mid()) if n in columns else c for n, c in enumerate(box)]
        values, jacobian = self.equations(centre)
        wide = self.equations(box)[1]
        near, wide = (arb_mat([[m[a, b] for b in columns] for a in rows]) for m in (jacobian, wide))
        identity = arb_mat([[int(a == b) for b in columns] for a in columns])
        inverse = near.mid().solve(identity, algorithm="approx").mid()
        spread = arb_mat([[box[n] - centre[n]] for n in columns])
        moved = (identity - inverse * wide) * spread - inverse * arb_mat(
            [[values[n]] for n in rows]
        )
        found = dict(zip(columns, moved.entries(), strict=True))
        return [c + found[n] if n in found else c for n, c in enumerate(centre)]

    def check_enclosure(self, data: dict[str, Any], zero: list[arb]) -> None:
        """See that the stated balls contain the solution."""
        stated = data["enclosure"]
        if len(stated) != self.count or any(len(row) != 3 for row in stated):
            raise Refused("there is not one ball for each joint")
        for i, row in enumerate(stated):
            for wide, value in zip(map(ball, row), (*self.joint(zero, i), arb(0)), strict=True):
                decided(wide.contains(value), not wide.overlaps(value), "balls hold the joints")
