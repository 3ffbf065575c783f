"""The solution of a certificate file: its box, its motion, and Krawczyk's operator (see the package)."""

from __future__ import annotations

import re
from typing import Any

from flint import arb, arb_mat, ctx

#: Most segments: a file that has more is refused, not worked on.
MOST_SEGMENTS = 400
_NUMBER = r"\d{1,99}([.]\d{1,99})?(e[+-]?\d{1,4})?"


class Refused(Exception):
    """A statement is false, or the file states nothing that can be checked: no precision helps."""


class Undecided(Exception):
    """The balls are too wide for a decision: more bits may help."""


def number(value: Any) -> arb:
    """Return a number of a file."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise Refused(f"{str(value)[:40]!r} is no number")
    return _finite(arb(value))


def ball(value: Any) -> arb:
    """Return the ball of a text such as ``1.25 +/- 1e-30``."""
    if not isinstance(value, str) or not re.fullmatch(f"(-?{_NUMBER} )?[+]/- {_NUMBER}", value):
        raise Refused("a ball is no text such as '1.25 +/- 1e-30'")
    return _finite(arb(value))


def _finite(found: arb) -> arb:
    if not found.is_finite():
        raise Refused("a number is not finite")
    return found


def decided(condition: bool, opposite: bool, what: str) -> None:
    """Go on if a condition holds for all numbers of its balls; refuse if its opposite does."""
    if condition:
        return
    raise Refused(f"false: {what}") if opposite else Undecided(what)


class Scene:
    """The parameters and segments of a file, and the motion that they have."""

    def __init__(self, data: dict[str, Any]) -> None:
        params = data["params"]
        if set(params) != {"Omega", "S", "S0", "h", "zeta"}:
            raise Refused("the parameters are not Omega, S, S0, h and zeta")
        self.omega, self.s, self.s0 = (number(params[k]) for k in ("Omega", "S", "S0"))
        self.h, self.zeta = number(params["h"]), number(params["zeta"])
        if not (self.omega > 0 and self.s >= 0 and self.s0 >= self.s):
            raise Refused("the parameters do not obey Omega > 0 and S0 >= S >= 0")
        periods, self.half = data["periods"], data["half"]
        if isinstance(periods, bool) or not isinstance(periods, int) or periods < 1:
            raise Refused("periods is no whole number from 1")
        if not isinstance(self.half, bool) or (self.half and periods % 2 == 0):
            raise Refused("an orbit of an even number of periods is not symmetric in this way")
        self.turn = periods * arb.pi() * (1 if self.half else 2) / self.omega
        self.segments = [self._segment(row) for row in data["segments"]]
        self.count = len(self.segments)
        if not 1 <= self.count <= MOST_SEGMENTS:
            raise Refused(f"it has {self.count} segments")

    def _segment(self, row: Any) -> tuple[int, int]:
        """Return direction and exit: (1 or -1, 0) of a slide, (0, 1 or -1) of a stick that ends at +-S0."""
        kinds = {"slide+ v": (1, 0), "slide- v": (-1, 0), "stick F+": (0, 1), "stick F-": (0, -1)}
        if len(row) != 2 or f"{row[0]} {row[1]}" not in kinds:
            raise Refused(f"a segment {str(row)[:60]} is not checked here")
        return kinds[f"{row[0]} {row[1]}"]

    def box(self, data: dict[str, Any]) -> tuple[list[arb], list[arb]]:
        """Return printed times and displacements with the half-widths of the box around them."""
        printed, radii = [], []
        if len(data["joints"]) != self.count or len(data["radius"]) != self.count:
            raise Refused("there is not one joint for each segment")
        for joint, radius in zip(data["joints"], data["radius"], strict=True):
            t, x, v = (number(c) for c in joint)
            wide = [number(r) for r in radius]
            if len(wide) != 3 or not all(r > 0 for r in wide):
                raise Refused("a box has no width")
            decided(abs(v) <= wide[2], abs(v) > wide[2], "the printed velocity is 0 within its box")
            printed += [t, x]
            radii += wide[:2]
        return printed, radii

    # ---------------------------------------------------------------------- motion

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

    # ---------------------------------------------------------------------- the solution

    def joint(self, z: list[arb], i: int) -> tuple[arb, arb]:
        """Return joint i, the last one by periodicity or symmetry."""
        if i < self.count:
            return z[2 * i], z[2 * i + 1]
        return z[0] + self.turn, -z[1] if self.half else z[1]

    def equations(self, z: list[arb]) -> tuple[list[arb], arb_mat]:
        """Return what vanishes for a solution, and its Jacobian, two rows a segment."""
        size = 2 * self.count
        values: list[arb] = []
        rows = [[arb(0)] * size for _ in range(size)]

        def add(row: int, joint: int, by_t: arb, by_x: arb) -> None:
            mirrored = joint == self.count and self.half
            at = 2 * (joint % self.count)
            rows[row][at] += by_t
            rows[row][at + 1] += -by_x if mirrored else by_x

        for i, (direction, side) in enumerate(self.segments):
            (t, x), (end, y), zero, one = self.joint(z, i), self.joint(z, i + 1), arb(0), arb(1)
            if direction == 0:
                values += [y - x, y - self.force(end) - side * self.s0]
                add(2 * i, i, zero, -one)
                add(2 * i, i + 1, zero, one)
                add(2 * i + 1, i + 1, -self.force(end, 1), one)
                continue
            reached, v = self.slide(direction, t, x, end - t)
            first = self.acceleration(direction, t, x, zero)
            last = self.acceleration(direction, end, reached, v)
            c, dc, d, dd = self.free(end - t)
            values += [reached - y, v]
            add(2 * i, i, -first * d, c)
            add(2 * i, i + 1, v, -one)
            add(2 * i + 1, i, -first * dd, dc)
            add(2 * i + 1, i + 1, last, zero)
        return values, arb_mat(rows)

    def solution(self, printed: list[arb], radii: list[arb], unique: bool) -> list[arb]:
        """Return a narrow enclosure of a solution in the box; check that it is the only one there."""
        centre = list(printed)
        for _ in range(6):
            values, jacobian = self.equations(centre)
            step = jacobian.mid().solve(_column(values).mid(), algorithm="approx").entries()
            if not all(s.is_finite() for s in step):
                raise Undecided("the equations are singular")
            centre = [(c - s).mid() for c, s in zip(centre, step, strict=True)]
        tiny = arb(2) ** (-ctx.prec // 2)  # rounding is its square, and so is what is left of it
        widths = [tiny * (1 + abs(c)).upper() for c in centre]
        zero = self._enclosed(centre, widths, "a solution near the printed joints")
        for found, p, r in zip(zero, printed, radii, strict=True):
            off = abs(found - p)
            decided(off < r, off > r, "the solution lies in the box around the printed joints")
        if unique:
            self._enclosed(printed, radii, "there is one solution only in the box")
        return zero

    def _enclosed(self, centre: list[arb], widths: list[arb], what: str) -> list[arb]:
        """Krawczyk's operator maps the box into itself: exactly one zero is in it."""
        size = len(centre)
        values, jacobian = self.equations(centre)
        identity = arb_mat([[int(i == j) for j in range(size)] for i in range(size)])
        inverse = jacobian.mid().solve(identity, algorithm="approx").mid()
        _, wide = self.equations([c + arb(0, w) for c, w in zip(centre, widths, strict=True)])
        spread = _column([arb(0, w) for w in widths])
        image = ((identity - inverse * wide) * spread - inverse * _column(values)).entries()
        if not all(k.abs_upper() < w for k, w in zip(image, widths, strict=True)):
            raise Undecided(what)
        return [c + k for c, k in zip(centre, image, strict=True)]

    def check_enclosure(self, data: dict[str, Any], zero: list[arb]) -> None:
        """See that the stated balls contain the solution."""
        stated = data["enclosure"]
        if len(stated) != self.count or any(len(row) != 3 for row in stated):
            raise Refused("there is not one ball for each joint")
        for i, row in enumerate(stated):
            for text, value in zip(row, (*self.joint(zero, i), arb(0)), strict=True):
                wide = ball(text)
                decided(wide.contains(value), not wide.overlaps(value), "balls hold the joints")


def _column(values: list[arb]) -> arb_mat:
    return arb_mat(len(values), 1, values)
