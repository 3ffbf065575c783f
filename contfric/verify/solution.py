"""The motion of a certificate file: parameters, segments, flow; in balls or power series."""

from __future__ import annotations

import re
from typing import Any

from flint import acb, arb, arb_series

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

    def __init__(self, data: dict[str, Any], moved: dict[str, Any] | None = None) -> None:
        if set(data["params"]) != set(PARAMETERS):
            raise Refused("the parameters are not Omega, S, S0, h and zeta")
        p = {name: number(value) for name, value in data["params"].items()} | (moved or {})
        series = {name for name, value in p.items() if isinstance(value, arb_series)}
        omega, s, s0, h, zeta = (p[n][0] if n in series else p[n] for n in PARAMETERS)
        good, bad = omega > 0 and s >= 0 and s0 >= s, omega <= 0 or s < 0 or s0 < s
        decided(good, bad, "Omega > 0 and S0 >= S >= 0")
        self.undamped = "zeta" not in series and zeta.is_zero()
        if series:
            p = {name: c if name in series else arb_series([c]) for name, c in p.items()}
        self.omega, self.s, self.s0, self.h, self.zeta = (p[name] for name in PARAMETERS)
        single = "h" not in series and h.is_zero()
        self.waves = [(self.omega, 0 * self.omega + 1), (3 * self.omega, self.h)][: 2 - single]
        periods, self.half = data["periods"], data["half"]
        if type(periods) is not int or periods < 1 or self.half not in (False, periods % 2 == 1):
            raise Refused("it is no orbit of that many periods, or not symmetric in this way")
        self.turn = periods * arb.pi() * (1 if self.half else 2) / self.omega
        names = [" ".join(str(c) for c in row) for row in data["segments"]]
        if not 1 <= len(names) <= 400 or not set(names) <= set(SEGMENTS):
            raise Refused("its segments are not 1 to 400 slides and sticks")
        self.segments, self.count = [SEGMENTS[name] for name in names], len(names)

    def force(self, t: Any, order: int = 0) -> Any:
        """Return f(t) or one of two derivatives of it."""
        phases = [(a * w**order, w * t) for w, a in self.waves]
        found = [a * (phase.sin() if order == 1 else phase.cos()) for a, phase in phases]
        return sum(found[1:], found[0]) * (-1 if order else 1)

    def forced(self, t: Any, tau: Any) -> tuple[Any, Any]:
        """Return what f adds to displacement and velocity some time after t, from rest at 0."""
        x = v = 0 * tau
        c, dc, d, dd = self.free(tau)
        for w, amplitude in self.waves:
            (sine, cosine), (later, last) = ((w * s).sin_cos() for s in (t, t + tau))
            if self.undamped:  # also at resonance
                near, far = (1 - w) * tau / 2, (1 + w) * tau / 2
                near = near.sinc() if isinstance(near, arb) else near.sin() / near
                p, q = tau * near * far.sin() / (1 + w), tau * far.cos() * near
                x += amplitude * (cosine * p - sine * (d - q) / (1 + w))
                v += amplitude * (cosine * (q + (w * tau).sin()) / (1 + w) - sine * w * p)
                continue
            real, imag = 1 - w * w, -2 * self.zeta * w  # of the steady state
            size = amplitude / (real * real + imag * imag)
            begin, speed = real * cosine - imag * sine, -w * (real * sine + imag * cosine)
            x += size * (real * last - imag * later - begin * c - speed * d)
            v -= size * (w * (real * later + imag * last) + begin * dc + speed * dd)
        return x, v

    def free(self, tau: Any) -> tuple[Any, Any, Any, Any]:
        """Return C, C', D and D' after a duration."""
        if self.undamped:
            d, c = tau.sin_cos()
            return c, -d, d, c
        square, decay = 1 - self.zeta * self.zeta, (-self.zeta * tau).exp()
        if isinstance(tau, arb):  # real beyond critical damping, too
            angle = acb(square).sqrt() * tau
            near, d = angle.cos().real, tau * angle.sinc().real
        else:
            near, d = (square.sqrt() * tau).cos(), (square.sqrt() * tau).sin() / square.sqrt()
        c, slope = near + self.zeta * d, near - self.zeta * d
        return decay * c, -decay * d, decay * d, decay * slope

    def slide(self, direction: int, t: Any, x: Any, tau: Any) -> tuple[Any, Any, Any]:
        """Return displacement, velocity and acceleration in a slide that starts with velocity 0."""
        c, dc, _, _ = self.free(tau)
        (forced, speed), offset = self.forced(t, tau), -direction * self.s
        y, v = offset + (x - offset) * c + forced, (x - offset) * dc + speed
        return y, v, self.force(t + tau) - y - 2 * self.zeta * v + offset

    def observed(self, z: list[Any], i: int, surface: str, tau: Any) -> tuple[Any, Any, Any]:
        """Return the observable of a surface with two derivatives, some time after the start of a segment."""
        (t, x), direction = self.joint(z, i), self.segments[i][0]
        y, v, a = self.slide(direction, t, x, tau) if direction else (x, 0 * x, 0 * x)
        first = v - self.force(t + tau, 1)
        if surface == "v":
            return v, a, -first - 2 * self.zeta * a
        load = y - self.force(t + tau) - (self.s0 if surface == "F+" else -self.s0)
        return load, first, a - self.force(t + tau, 2)

    def joint(self, z: list[Any], i: int) -> tuple[Any, Any]:
        """Return joint i, the last one by periodicity or symmetry."""
        if i < self.count:
            return z[2 * i], z[2 * i + 1]
        return z[0] + self.turn, -z[1] if self.half else z[1]

    def segment(self, z: list[Any], i: int) -> tuple[list[Any], Any, Any]:
        """Return what vanishes for a segment, with its derivatives by (t, x) at its start and at its end."""
        (t, x), (end, y), (direction, side) = (
            *(self.joint(z, k) for k in (i, i + 1)),
            self.segments[i],
        )
        zero, one = 0 * t, 0 * t + 1
        if not direction:
            values, slope = [y - x, y - self.force(end) - side * self.s0], -self.force(end, 1)
            return values, ((zero, -one), (zero, zero)), ((zero, one), (slope, one))
        reached, v, last = self.slide(direction, t, x, end - t)
        first = self.force(t) - x - direction * self.s
        c, dc, d, dd = self.free(end - t)
        return [reached - y, v], ((-first * d, c), (-first * dd, dc)), ((v, -one), (last, zero))

    def equations(self, z: list[Any]) -> tuple[list[Any], list[list[Any]]]:
        """Return what vanishes for a solution, and its Jacobian, two rows a segment."""
        size, values = 2 * self.count, list[Any]()
        rows = [[0 * z[0]] * size for _ in range(size)]
        for i in range(self.count):
            found, own, after = self.segment(z, i)
            values += found
            closing = -1 if i + 1 == self.count and self.half else 1
            for row, start, end in zip(rows[2 * i :], own, after, strict=False):
                for k in (0, 1):
                    row[2 * i + k] += start[k]
                    row[(2 * i + 2 + k) % size] += end[k] * closing**k
        return values, rows
