"""The solution: x'' + 2 zeta x' + x = f(t) - s S while s = sgn x' is not 0, x' = 0 while |x - f| <= S0.

A slide is ``x = -s S + (x_0 + s S) C + r``, ``C = D' + 2 zeta D``, D = exp[l1, l2] a divided difference of
exp(l tau) at the zeros of P; a wave a cos(w t) adds ``Re a exp(i w t_0) exp[l1, l2, i w]`` to r, the last one
(exp(i w tau) - C - i w D) / P(i w). Its start changes it by ``dx/dx_0 = C``, ``dx/dt_0 = -x''_0 D``.
"""

import re
from typing import Any

from flint import acb, acb_series, arb, arb_series

SEGMENTS = {"slide+ v": (1, 0), "slide- v": (-1, 0), "stick F+": (0, 1), "stick F-": (0, -1)}
PARAMETERS, J, NEAR = ("Omega", "S", "S0", "h", "zeta"), acb(0, 1), 0.4  # to resonance
_NUMBER = r"\d{1,99}([.]\d{1,99})?(e[+-]?\d{1,4})?"


class Refused(Exception):
    """A statement is false, or the file states nothing that can be checked: no precision helps."""


class Undecided(Exception):
    """The balls are too wide for a decision: more bits may help."""


def ball(value: Any) -> arb:
    """Return a number of a file, or a ball inside that of a text such as ``1.25 +/- 1e-30``."""
    if text := re.fullmatch(f"(-?{_NUMBER} )?[+]/- ({_NUMBER})", str(value)):  # no number is one
        middle, radius = arb(text[1] or 0), arb(text[4])  # an arb rounds its radius up
        return arb(middle.mid(), ((radius - middle.rad()) * 0.999999).lower().max(arb(0)))
    if type(value) in (int, float) and arb(value).is_finite():
        return arb(value)
    raise Refused(f"{str(value)[:40]!r} is no number, and no ball such as '1.25 +/- 1e-30'")


def see(so: Any, what: str, sure: bool = True) -> None:
    """Go on if something is so, or all numbers of a ball are above 0; refuse if that surely is not."""
    if not so > 0:
        raise Refused(f"false: {what}") if sure and so <= 0 else Undecided(what)


def part(value: Any, k: int) -> Any:
    """Return a coefficient of a power series; a ball is a constant."""
    return value[k] if isinstance(value, arb_series | acb_series) else value * int(k == 0)


def real(value: Any) -> Any:
    """Return the real part of a ball or a series."""
    return value.real if isinstance(value, acb | arb) else arb_series([c.real for c in value])


def entire(b: float, q: Any) -> Any:
    """Return 0F1(b, q), of a series by its derivatives: cos and sinc of 2 sqrt(-q) at b = 1/2, 3/2."""
    weights = enumerate((1, b, 2 * b * (b + 1)))
    terms = (q[0].hypgeom_0f1(b + k) * (q - q[0]) ** k / c for k, c in weights)
    return q.hypgeom_0f1(b) if isinstance(q, acb | arb) else sum(terms, 0 * q)


class Scene:
    """The parameters and segments of a file, and their solution; joints are (phase of the excitation, x)."""

    def __init__(self, data: dict[str, Any], value: Any) -> None:
        periods, self.half, self.count = data["periods"], data["half"], len(data["segments"])
        possible = type(periods) is int and self.half in (False, periods % 2 == 1) and periods > 0
        see({*data["params"], data["parameter"]} == set(PARAMETERS) and possible, "it is periodic")
        p = {name: ball(given - 0) for name, given in data["params"].items()}  # and no text
        self.value = p[data["parameter"]] = value
        self.omega, self.s, self.s0, h, self.zeta = (p[name] for name in PARAMETERS)
        limits = (part(self.omega, 0) > 0, part(self.s, 0) >= 0, part(self.s0 - self.s, 0) >= 0)
        see(all(limits), "Omega > 0, S0 >= S >= 0", False)
        self.waves = [(1, arb(1), self.omega), (3, h, 3 * self.omega)][: 1 if h == 0 else 2]
        self.rates = [(k, a, -a * w, -a * w * w, a * w**3) for k, a, w in self.waves]
        self.polynomial = [1 - w * w + 2 * J * self.zeta * w for _, _, w in self.waves]
        self.square = 1 - self.zeta * self.zeta
        self.root = (self.square if part(self.square, 0) > 0 else acb(1) * self.square).sqrt()
        self.turn, self.closing = periods * arb.pi() * (1 if self.half else 2), 1 - 2 * self.half
        self.segments = [SEGMENTS[" ".join(row[:])] for row in data["segments"]]  # direction, exit

    def force(self, phase: Any) -> list[Any]:
        """Return f with three derivatives by time."""
        turns = [(row, (row[0] * phase).sin_cos()) for row in self.rates]
        waves = [(a * c, b * s, d * c, e * s) for (_, a, b, d, e), (s, c) in turns]
        return [sum(others, first) for first, *others in zip(*waves, strict=True)]

    def state(self, z: list[Any], i: int, tau: Any) -> tuple[Any, Any, Any, Any, list[Any]]:
        """Return x with two derivatives after some time in a segment, C, C', D, D' of a slide, and f."""
        (phase, x), (direction, _), root = self.joint(z, i), self.segments[i], self.root
        force = self.force(phase + self.omega * tau)
        if not direction:
            return x, 0 * x, 0 * x, (), force
        decay, q, offset = (-self.zeta * tau).exp(), self.square * tau * tau, -direction * self.s
        if abs(part(self.square, 0)) > NEAR:
            d, rate = decay * real((root * tau).sin() / root), decay * real((root * tau).cos())
        else:
            d, rate = decay * tau * entire(1.5, -q / 4), decay * entire(0.5, -q / 4)
        rate, c = rate - self.zeta * d, rate + self.zeta * d
        y, v = offset + (x - offset) * c, (offset - x) * d
        for (k, amplitude, w), p in zip(self.waves, self.polynomial, strict=True):
            turn, wave = amplitude * (J * k * phase).exp(), (J * w * tau).exp()
            if abs(part(p, 0)) > NEAR:
                both = (wave - c - J * w * d) / p
            else:  # without what cancels
                half = (J * (root - w) - self.zeta) * tau / 2
                near = tau * half.exp() * wave * entire(1.5, half * half / 4)
                both = (near - d) / (J * (w + root) + self.zeta)
            y, v = y + real(turn * both), v + real(turn * (J * w * both + d))
        return y, v, force[0] - y - 2 * self.zeta * v + offset, (c, -d, d, rate), force

    def observed(self, z: list[Any], i: int, name: str, tau: Any) -> tuple[Any, Any, Any, Any]:
        """Return v, or the load less its limit (F+, F-), with three derivatives."""
        y, v, a, slides, (force, first, second, third) = self.state(z, i, tau)
        jerk = first - v - 2 * self.zeta * a if slides else 0
        if name == "v":
            return v, a, jerk, second - a - 2 * self.zeta * jerk
        return y - force - {"F+": 1, "F-": -1}[name] * self.s0, v - first, a - second, jerk - third

    def joint(self, z: list[Any], i: int) -> Any:
        """Return joint i, the last one by periodicity or symmetry."""
        return z[2 * i :][:2] if i < self.count else (z[0] + self.turn, self.closing * z[1])

    def misses(self, z: list[Any], other: Any = None) -> bool:
        """Tell whether no joint is the first one of another orbit, or its own, whole periods of f apart."""
        (t, y, *_), joints = (other or (0, z))[1], [self.joint(z, i) for i in range(self.count)]
        joints += [(phase + self.turn, -x) for phase, x in joints] * self.half
        apart = all(abs(((p - t) / 2).sin()) + abs(x - y) > 0 for p, x in joints[not other :])
        return apart or bool(other and other[0].value != self.value)

    def duration(self, z: list[Any], i: int) -> Any:
        """Return how long segment i lasts."""
        return (self.joint(z, i + 1)[0] - self.joint(z, i)[0]) / self.omega

    def segment(self, z: list[Any], i: int) -> tuple[list[Any], Any, Any]:
        """Return what vanishes for a segment, with its derivatives by the joints at its start and its end."""
        (phase, x), (end, y), tau = self.joint(z, i), self.joint(z, i + 1), self.duration(z, i)
        direction, side = self.segments[i]
        if not direction:
            (f, rate, *_), start = self.force(end), ((0, -1), (0, 0))
            return [y - x, y - f - side * self.s0], start, ((0, 1), (-rate / self.omega, 1))
        reached, v, last, (c, dc, d, dd), _ = self.state(z, i, tau)
        first = (self.force(phase)[0] - x - direction * self.s) / self.omega
        own = (-first * d, c), (-first * dd, dc)
        return [reached - y, v], own, ((v / self.omega, -1), (last / self.omega, 0))

    def equations(self, z: list[Any]) -> tuple[list[Any], list[list[Any]]]:
        """Return what vanishes for a solution, and its Jacobian, two rows a segment."""
        values, rows = list[Any](), list[list[Any]]()
        for i in range(self.count):
            found, own, after = self.segment(z, i)
            closing, k = self.closing if i + 1 == self.count else 1, (2 * i + 2) % (2 * self.count)
            values += found
            for start, (by_phase, by_x) in zip(own, after, strict=True):
                rows.append([0] * (2 * i) + [*start] + [0] * (2 * (self.count - i - 1)))
                rows[-1][k] += by_phase
                rows[-1][k + 1] += by_x * closing
        return values, rows

    def multipliers(self, z: list[Any]) -> tuple[Any, Any, tuple[Any, Any, Any]]:
        """Return trace and determinant of a turn, and what vanishes at a multiplier 1, -1, a pair (Jury)."""
        columns, det = [(arb(1), arb(0)), (arb(0), arb(1))], arb(self.closing)
        for i in range(self.count):
            _, ((p, q), (r, s)), ((a, b), (c, d)) = self.segment(z, i)
            size = a * d - b * c
            moved = [(p * x + q * y, r * x + s * y) for x, y in columns]
            columns = [((b * y - d * x) / size, (c * x - a * y) / size) for x, y in moved]
            det *= (p * s - q * r) / size  # 0 after rest, which leaves one multiplier only
        trace = columns[0][0] + self.closing * columns[1][1]
        return trace, det, (1 - trace + det, 1 + trace + det, 1 - det)
