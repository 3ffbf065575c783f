"""Motion of the dry friction oscillator in fifty digits, event by event: a reference.

``x'' + 2 zeta x' + x = f(t) - s S``, ``f = cos(Omega t) + h cos(3 Omega t)``, by undetermined
coefficients: a forced part ``alpha cos w t + beta sin w t`` for each harmonic, with
``alpha + i beta = 1 / (1 - w^2 - 2 i zeta w)``, and the free motion that makes up the difference to the
state at the start, with ``exp(-zeta d)`` times sines, hyperbolic sines or (``|zeta| = 1``) powers. Next to
resonance both parts are large and cancel: the working precision grows by the bits that this costs. At
resonance itself (zeta = 0, Omega = 1) the forced part is ``d/2 sin t``. (3 Omega = 1 has no solution in
doubles.)

Times, states and parameters start as the exact values of their doubles. A state at an event is rounded
to the working precision, so that a trajectory carries errors of 1e-60 that grow with its tangent maps;
what is compared with it has been spoilt by 1e-16 that grows as much.

No zero is missed or invented: :mod:`first_root`. The zero itself comes from Halley's iteration, and is
proved by the least slope of the bracket: it lies within ``|v| / slope`` of the place given.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from first_root import SHORTER, Bracket, Series, Undecided, Windows, search, search_exactly
from flint import arb, ctx

#: Bits of 50 digits, and bits to spare: a phase after 1e10 periods loses 36, a slide that lasts 1e-15
#: loses 50 where its end is divided by its duration, and the rest is for events that are badly conditioned.
DIGITS_50, SPARE = 167, 120
#: A zero is proved to this many bits more than fifty digits.
PROVED = 20
#: The least distance of a double from a resonance (3 Omega = 1) or from critical damping.
NEAREST = 2.0**-54
#: Iterations of Halley for one zero; each triples the digits, and bisection guards it.
ITERATIONS = 200

Number = float | arb
Phase = tuple[arb, arb, arb, arb]


@contextmanager
def working_precision(bits: int) -> Iterator[None]:
    """Compute with this many bits."""
    before = ctx.prec
    ctx.prec = bits
    try:
        yield
    finally:
        ctx.prec = before


class Law:
    """The parameters as exact numbers, and what depends on them alone."""

    def __init__(
        self, omega: Number, S: Number, S0: Number, h: Number, zeta: Number, bits: int = 0
    ) -> None:
        self.omega, self.S, self.S0, self.h, self.zeta = map(arb, (omega, S, S0, h, zeta))
        self.bits = bits or DIGITS_50 + SPARE + self._lost_bits(float(omega), float(zeta))
        with working_precision(self.bits):
            self.resonant = bool(self.zeta == 0 and self.omega == 1)
            self.waves = [self._response(k * self.omega) for k in (1, 3)]
            self.rate = abs(self.zeta * self.zeta - 1).sqrt()
            self.period = 2 * arb.pi() / self.omega
            self.slide_windows = Windows(self.omega, self.h, self.zeta)
            self.stick_windows = Windows(self.omega, self.h, None)
            self.short_slide_windows = Windows(self.omega, self.h, self.zeta, SHORTER)
            self.short_stick_windows = Windows(self.omega, self.h, None, SHORTER)

    @staticmethod
    def _lost_bits(omega: float, zeta: float) -> int:
        lost = 0.0
        for w in (omega, 3 * omega):
            size = math.hypot(1 - w * w, 2 * zeta * w)
            lost += max(0.0, -math.log2(max(size, NEAREST)))
        near = max(abs(zeta * zeta - 1), NEAREST)
        return math.ceil(2 * lost + max(0.0, -math.log2(near)))

    def _response(self, w: arb) -> tuple[arb, arb, arb]:
        if self.resonant and w == 1:
            return w, arb(0), arb(0)
        away, damping = 1 - w * w, 2 * self.zeta * w
        size = away * away + damping * damping
        return w, away / size, damping / size

    def phase(self, t: arb) -> Phase:
        """Return cos, sin of the phase of the excitation, and of three times it."""
        s, c = (self.omega * t).sin_cos()
        return c, s, c * (4 * c * c - 3), s * (3 - 4 * s * s)

    def force(self, phase: Phase) -> tuple[arb, arb, arb, arb]:
        """Return f and three time derivatives."""
        c, s, c3, s3 = phase
        w, h = self.omega, self.h
        w2 = w * w
        return c + h * c3, -w * (s + 3 * h * s3), -w2 * (c + 9 * h * c3), w * w2 * (s + 27 * h * s3)

    def forced(self, phase: Phase, d: arb) -> tuple[arb, arb]:
        """Return (x, v) of the forced part, a duration d after the start of the segment."""
        c, s, c3, s3 = phase
        (w1, a1, b1), (w3, a3, b3) = self.waves
        x = a1 * c + b1 * s
        v = w1 * (b1 * c - a1 * s)
        if self.h != 0:
            x += self.h * (a3 * c3 + b3 * s3)
            v += self.h * w3 * (b3 * c3 - a3 * s3)
        if self.resonant:
            x += d * s / 2
            v += (s + d * c) / 2
        return x, v

    def free(self, d: arb) -> tuple[arb, arb]:
        """Return the free solution (x, v) from x = 0, v = 1."""
        zeta, rate = self.zeta, self.rate
        if zeta == 0:
            return d.sin_cos()
        decay = (-zeta * d).exp()
        if abs(zeta) == 1:
            return decay * d, decay * (1 - zeta * d)
        s, c = (rate * d).sin_cos() if abs(zeta) < 1 else (rate * d).sinh_cosh()
        s = s / rate
        return decay * s, decay * (c - zeta * s)


@dataclass(frozen=True)
class State:
    """State along a slide; ``rates`` are acceleration and its derivative."""

    x: arb
    v: arb
    rates: tuple[arb, arb]
    phase: Phase
    kernel: tuple[arb, arb]


class Slide:
    """A slide in direction s from (t0, x0, v0); ``a0`` if the acceleration there is known exactly."""

    def __init__(self, law: Law, s: int, t0: arb, x0: arb, v0: arb, a0: arb | None = None) -> None:
        self.law, self.s, self.t0, self.x0, self.v0 = law, s, t0, x0, v0
        self.friction = s * law.S
        self.start_phase = law.phase(t0)
        x, v = law.forced(self.start_phase, arb(0))
        self.a, self.b = x0 + self.friction - x, v0 - v
        f = law.force(self.start_phase)[0]
        self.a0 = f - 2 * law.zeta * v0 - x0 - self.friction if a0 is None else a0
        self.windows = law.slide_windows, law.short_slide_windows

    def state(self, d: arb) -> State:
        """Return the state after a duration."""
        law = self.law
        phase = law.phase(self.t0 + d)
        x, v = law.forced(phase, d)
        g, g1 = law.free(d)
        x += self.a * (g1 + 2 * law.zeta * g) + self.b * g - self.friction
        v += self.b * g1 - self.a * g
        f, f1, _, _ = law.force(phase)
        a = f - 2 * law.zeta * v - x - self.friction
        return State(x, v, (a, f1 - 2 * law.zeta * a - v), phase, (g, g1))

    def numbers(self, d: arb) -> tuple[list[arb], arb]:
        """Return what a window's series takes, and the level."""
        if d == 0:
            return [self.v0, self.a0, *self.start_phase], arb(0)
        at = self.state(d)
        return [at.v, at.rates[0], *at.phase], arb(0)

    def halley(self, d: arb) -> tuple[arb, arb, arb]:
        """Return v and two derivatives."""
        at = self.state(d)
        return at.v, *at.rates


class Rest:
    """A stick from t0 at x0, up to u = side * S0: the force takes the level ``x0 - side * S0``."""

    def __init__(self, law: Law, side: int, t0: arb, x0: arb) -> None:
        self.law, self.side, self.t0, self.x0 = law, side, t0, x0
        self.level = x0 - side * law.S0
        self.s = side  # the force is above the level of F+, below that of F-
        self.windows = law.stick_windows, law.short_stick_windows

    def numbers(self, d: arb) -> tuple[list[arb], arb]:
        """Return what a window's series takes, and the level."""
        return list(self.law.phase(self.t0 + d)), self.level

    def halley(self, d: arb) -> tuple[arb, arb, arb]:
        """Return f - level and two derivatives."""
        f, f1, f2, _ = self.law.force(self.law.phase(self.t0 + d))
        return f - self.level, f1, f2


class Segment(Protocol):
    """A function along a segment: positive before its zero, times ``s``."""

    s: int
    windows: tuple[Windows, Windows]

    def numbers(self, d: arb) -> tuple[list[arb], arb]:
        """Return what a window's series takes, and the level."""

    def halley(self, d: arb) -> tuple[arb, arb, arb]:
        """Return the function (less its level) and two derivatives."""


def first_zero(
    segment: Segment, order: int, longest: float, start: arb | None = None
) -> arb | None:
    """Return the first zero of a segment after its start; None if there is none within ``longest``.

    ``order`` is that of the zero at the start itself, which does not count; ``start`` is another start.

    Raises
    ------
    Undecided
        If the working precision does not tell whether there is a zero.
    """
    wide, short = segment.windows
    d, exact, until = arb(0) if start is None else start, False, 0.0
    while float(d) < longest:
        windows = short if exact else wide
        z, level = segment.numbers(d)
        if order:
            level = arb(0)  # the series divided by s has lost its constant, and the level with it
        found = _look(windows.form(order), z, level, segment.s, exact)
        if isinstance(found, Bracket):
            return refine(segment, d, windows.length, found, order)
        if isinstance(found, float):
            # certain up to there; then short windows in balls, until the doubtful place is passed
            if found > 0.0:
                d, order = (d + arb(found * windows.length)).mid(), 0
            exact, until = True, float(d) + 2.0 * short.length
            continue
        d, order = (d + arb(windows.length)).mid(), 0
        exact = exact and float(d) < until
    return None


def _look(form: Series, z: list[arb], level: arb, sign: int, exact: bool) -> Bracket | float | None:
    if exact:
        return search_exactly(form, z, level, sign)
    return search(form, np.array([float(c) for c in z]), float(level), float(sign))


def refine(segment: Segment, start: arb, length: float, bracket: Bracket, order: int) -> arb:
    """Return the zero in a bracket of a window, proved by the least slope there.

    The bracket is of the function divided by ``s^order``.
    """
    low, high = (start + arb(length) * arb(e) for e in (bracket.low, bracket.high))
    d = (low + high) / 2
    small = arb(2) ** -(DIGITS_50 + PROVED)
    for _ in range(ITERATIONS):
        d = d.mid()
        q, q1, q2 = segment.halley(d)
        divided = abs(q) * (length / (d - start)) ** order if order else abs(q)
        step = 2 * q * q1 / (2 * q1 * q1 - q * q2)
        if divided * length / bracket.slope < small:
            return (d - step).mid()
        if segment.s * q.mid() > 0:
            low = d
        else:
            high = d
        d -= step
        if not (d > low and d < high):
            d = (low + high) / 2
    raise Undecided
