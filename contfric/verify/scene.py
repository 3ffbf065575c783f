"""What a certificate file is about: parameters, segments and their motion, in balls or power series."""

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


def positive(value: arb, what: str) -> None:
    """Go on if all numbers of a ball are above 0; refuse if none is."""
    if not value > 0:
        raise Refused(f"false: {what}") if value <= 0 else Undecided(what)


def phases(rows: Any, scene: Scene) -> list[arb]:
    """Return unknowns from the time and displacement at which each segment begins."""
    if len(rows) != scene.count:
        raise Refused("there is not one joint for each segment")
    return [c for t, x, *_ in rows for c in (t * scene.omega, x)]


def part(value: Any, k: int) -> arb:
    """Return a coefficient of a power series; a ball is a constant."""
    return value[k] if isinstance(value, arb_series) else arb(0 if k else value)


def sinc(x: Any) -> Any:
    """Return sin(x) / x, also at 0: there by the derivatives of 0F1(3/2, -x^2 / 4)."""
    if isinstance(x, arb) or not x[0].contains(0):
        return x.sinc() if isinstance(x, arb) else x.sin() / x
    q = -x * x / 4
    terms = (q[0].hypgeom_0f1(1.5 + k) * (q - q[0]) ** k / (1, 1.5, 7.5)[k] for k in range(3))
    return sum(terms, 0 * x)


class Scene:
    """The parameters and segments of a file, and their motion; joints are (phase of the excitation, x)."""

    def __init__(self, data: dict[str, Any], value: Any = None) -> None:
        if set(data["params"]) != set(PARAMETERS):
            raise Refused("the parameters are not Omega, S, S0, h and zeta")
        p = {name: number(given) for name, given in data["params"].items()}
        moved, self.given = {} if value is None else {data["parameter"]: value}, value
        self.undamped, single = ((n not in moved) and p[n].is_zero() for n in ("zeta", "h"))
        p |= {name: part(v, 0) for name, v in moved.items()}
        if not (p["Omega"] > 0 and p["S"] >= 0 and p["S0"] >= p["S"]):
            raise Undecided("Omega > 0, S0 >= S >= 0")
        if isinstance(value, arb_series):
            p = {name: arb_series([v]) for name, v in p.items()} | moved
        self.omega, self.s, self.s0, h, self.zeta = (p[name] for name in PARAMETERS)
        self.waves = [(1, 0 * h + 1), (3, h)][: 2 - single]
        periods, self.half = data["periods"], data["half"]
        if type(periods) is not int or periods < 1 or self.half not in (False, periods % 2 == 1):
            raise Refused("it is no orbit of that many periods, or not symmetric in this way")
        self.turn, self.closing = periods * arb.pi() * (1 if self.half else 2), 1 - 2 * self.half
        names = [" ".join(str(c) for c in row) for row in data["segments"]]
        if not 1 <= len(names) <= 400 or not set(names) <= set(SEGMENTS):
            raise Refused("its segments are not 1 to 400 slides and sticks")
        self.segments, self.count = [SEGMENTS[name] for name in names], len(names)

    def force(self, phase: Any, order: int = 0) -> Any:
        """Return f or one of two derivatives of it by time."""
        parts = ((k * self.omega, a, (k * phase).sin_cos()) for k, a in self.waves)
        found = [a * w**order * waves[order != 1] for w, a, waves in parts]
        return sum(found[1:], found[0]) * (-1 if order else 1)

    def forced(self, phase: Any, tau: Any) -> tuple[Any, Any]:
        """Return what f adds to displacement and velocity some time after a phase, from rest at 0."""
        x = v = 0 * tau
        c, dc, d, dd = self.free(tau)
        for k, amplitude in self.waves:
            w = k * self.omega
            sine, cosine = (k * phase).sin_cos()
            later, last = (k * phase + w * tau).sin_cos()
            if self.undamped:  # also at resonance
                near, far = (1 - w) * tau / 2, (1 + w) * tau / 2
                near = sinc(near)
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
        return decay * (near + self.zeta * d), -decay * d, decay * d, decay * (near - self.zeta * d)

    def state(self, z: list[Any], i: int, tau: Any) -> tuple[Any, Any, Any]:
        """Return displacement, velocity and acceleration some time after the start of a segment."""
        (phase, x), (direction, _) = self.joint(z, i), self.segments[i]
        if not direction:
            return x, 0 * x, 0 * x
        (c, dc, *_), (forced, speed) = self.free(tau), self.forced(phase, tau)
        offset = -direction * self.s
        y, v = offset + (x - offset) * c + forced, (x - offset) * dc + speed
        return y, v, self.force(phase + self.omega * tau) - y - 2 * self.zeta * v + offset

    def observed(self, z: list[Any], i: int, surface: str, tau: Any) -> tuple[Any, Any, Any]:
        """Return the observable of a surface with two derivatives, some time after the start of a segment."""
        (y, v, a), phase = self.state(z, i, tau), self.joint(z, i)[0] + self.omega * tau
        first = v - self.force(phase, 1)
        if surface == "v":
            return v, a, -first - 2 * self.zeta * a
        load = y - self.force(phase) - (self.s0 if surface == "F+" else -self.s0)
        return load, first, a - self.force(phase, 2)

    def joint(self, z: list[Any], i: int) -> tuple[Any, Any]:
        """Return joint i, the last one by periodicity or symmetry."""
        if i < self.count:
            return z[2 * i], z[2 * i + 1]
        return z[0] + self.turn, self.closing * z[1]

    def duration(self, z: list[Any], i: int) -> Any:
        """Return how long segment i lasts."""
        return (self.joint(z, i + 1)[0] - self.joint(z, i)[0]) / self.omega

    def segment(self, z: list[Any], i: int) -> tuple[list[Any], Any, Any]:
        """Return what vanishes for a segment, with its derivatives by the joints at its start and its end."""
        (phase, x), (end, y) = self.joint(z, i), self.joint(z, i + 1)
        direction, side = self.segments[i]
        zero, one = 0 * phase, 0 * phase + 1
        if not direction:
            load, slope = y - self.force(end), -self.force(end, 1) / self.omega
            own, after = ((zero, -one), (zero, zero)), ((zero, one), (slope, one))
            return [y - x, load - side * self.s0], own, after
        reached, v, last = self.state(z, i, self.duration(z, i))
        first = (self.force(phase) - x - direction * self.s) / self.omega
        c, dc, d, dd = self.free(self.duration(z, i))
        after = (v / self.omega, -one), (last / self.omega, zero)
        return [reached - y, v], ((-first * d, c), (-first * dd, dc)), after

    def equations(self, z: list[Any]) -> tuple[list[Any], list[list[Any]]]:
        """Return what vanishes for a solution, and its Jacobian, two rows a segment."""
        size, values = 2 * self.count, list[Any]()
        rows = [[0 * z[0]] * size for _ in range(size)]
        for i in range(self.count):
            found, own, after = self.segment(z, i)
            values += found
            closing = self.closing if i + 1 == self.count else 1
            for row, start, end in zip(rows[2 * i :], own, after, strict=False):
                for k in (0, 1):
                    row[2 * i + k] += start[k]
                    row[(2 * i + 2 + k) % size] += end[k] * closing**k
        return values, rows

    def multipliers(self, z: list[Any]) -> tuple[Any, Any]:
        """Return trace and determinant of the derivative of (phase, x) after a turn: v = 0 is the section."""
        one = 0 * z[0] + 1
        total, det = [[one, 0 * one], [0 * one, one]], self.closing * one
        for i in range(self.count):
            _, own, ((a, b), (c, d)) = self.segment(z, i)
            moved = [[row[0] * total[0][k] + row[1] * total[1][k] for k in (0, 1)] for row in own]
            size, back = a * d - b * c, ((-d, b), (c, -a))  # minus the inverse of what is after
            pairs = list(zip(*moved, strict=True))
            total = [[(e * p + f * q) / size for p, q in pairs] for e, f in back]
            det *= (own[0][0] * own[1][1] - own[0][1] * own[1][0]) / size
        slides = all(direction for direction, _ in self.segments)  # rest leaves one multiplier only
        return total[0][0] + self.closing * total[1][1], det if slides else 0 * det
