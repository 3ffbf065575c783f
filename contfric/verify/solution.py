"""The solution of a certificate file: its box, its motion, and Krawczyk's operator (see the package)."""

from __future__ import annotations

import re
from typing import Any

from flint import acb, arb, arb_mat, ctx

#: Direction and exit: (1 or -1, 0) of a slide, (0, 1 or -1) of a stick that ends at +-S0.
SEGMENTS = {"slide+ v": (1, 0), "slide- v": (-1, 0), "stick F+": (0, 1), "stick F-": (0, -1)}
PARAMETERS = ("Omega", "S", "S0", "h", "zeta")
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
        if set(data["params"]) != set(PARAMETERS):
            raise Refused("the parameters are not Omega, S, S0, h and zeta")
        params = {name: number(value) for name, value in data["params"].items()} | (balls or {})
        self.omega, self.s, self.s0, self.h, self.zeta = (params[name] for name in PARAMETERS)
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
        if len(found[0]) != self.count or not all(r > 0 for row in found[1] for r in row):
            raise Refused("there is not one joint with its box for each segment")
        for (_, _, v), (_, _, wide) in zip(*found, strict=True):
            decided(abs(v) <= wide, abs(v) > wide, "the printed velocity is 0 within its box")
        printed, radii = ([c for t, x, _ in rows for c in (t, x)] for rows in found)
        return printed, radii

    def force(self, t: arb, order: int = 0) -> arb:
        """Return f(t) or a derivative of it."""
        waves = ((arb(1), self.omega), (self.h, 3 * self.omega))
        return sum((a * (acb(0, w) ** order * acb(0, w * t).exp()).real for a, w in waves), arb(0))

    def forced(self, t: arb, tau: arb) -> tuple[arb, arb]:
        """Return what f adds to displacement and velocity some time after t, from rest at 0."""
        x, v = arb(0), arb(0)
        for w, amplitude in ((self.omega, arb(1)), (3 * self.omega, self.h)):
            if amplitude.is_zero():
                continue
            if self.zeta.is_zero():  # also at resonance
                sine, cosine = (w * t).sin_cos()
                near, far = ((1 - w) * tau / 2).sinc(), (1 + w) * tau / 2
                p, q = tau * tau / 2 * far.sinc() * near, tau * far.cos() * near
                x += amplitude * (cosine * p - sine * (tau.sin() - q) / (1 + w))
                v += amplitude * (cosine * (q + (w * tau).sin()) / (1 + w) - sine * w * p)
                continue
            response = amplitude / acb(1 - w * w, 2 * self.zeta * w)  # of the steady state
            now, later = (response * acb(0, w * s).exp() for s in (t, t + tau))
            c, dc, d, dd = self.free(tau)
            x += later.real - now.real * c + w * now.imag * d
            v += w * now.imag * dd - w * later.imag - now.real * dc
        return x, v

    def free(self, tau: arb) -> tuple[arb, arb, arb, arb]:
        """Return C, C', D and D' after a duration."""
        angle, decay = acb(1 - self.zeta * self.zeta).sqrt() * tau, (-self.zeta * tau).exp()
        near, d = angle.cos().real, tau * angle.sinc().real  # real beyond critical damping, too
        c, slope = near + self.zeta * d, near - self.zeta * d
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

    def segment(self, z: list[arb], i: int) -> tuple[list[arb], Any, Any]:
        """Return what vanishes for a segment, with its derivatives by (t, x) at its start and at its end."""
        (t, x), (end, y) = self.joint(z, i), self.joint(z, i + 1)
        direction, side = self.segments[i]
        zero, one = arb(0), arb(1)
        if not direction:
            values, slope = [y - x, y - self.force(end) - side * self.s0], -self.force(end, 1)
            return values, ((zero, -one), (zero, zero)), ((zero, one), (slope, one))
        reached, v = self.slide(direction, t, x, end - t)
        first = self.acceleration(direction, t, x, zero)
        last = self.acceleration(direction, end, reached, v)
        c, dc, d, dd = self.free(end - t)
        own = ((-first * d, c), (-first * dd, dc))
        return [reached - y, v], own, ((v, -one), (last, zero))

    def equations(self, z: list[arb]) -> tuple[list[arb], arb_mat]:
        """Return what vanishes for a solution, and its Jacobian, two rows a segment."""
        size, values = 2 * self.count, list[arb]()
        rows = [[arb(0)] * size for _ in range(size)]
        for i in range(self.count):
            found, own, after = self.segment(z, i)
            values += found
            closing = -1 if i + 1 == self.count and self.half else 1
            for row, start, end in zip(rows[2 * i :], own, after, strict=False):
                for k in (0, 1):
                    row[2 * i + k] += start[k]
                    row[(2 * i + 2 + k) % size] += end[k] * closing**k
        return values, arb_mat(rows)

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
        residual = arb_mat([[values[n]] for n in rows])
        moved = (identity - inverse * wide) * spread - inverse * residual
        found = dict(zip(columns, moved.entries(), strict=True))
        return [c + found[n] if n in found else c for n, c in enumerate(centre)]
