"""Random parameters and starts for simulations: ordinary ones, and every kind of extreme one.

A case is drawn from ``(seed, index)`` alone, so that it can be drawn again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from flint import arb
from motion import SLIDE_DOWN, SLIDE_UP, STICK, Start
from reference import Law, working_precision

#: Decades between "one unit in the last place" and "plainly different".
BESIDE = (-15.0, -3.0)
#: Distances from a surface at the start, in decades.
NEAR_SURFACE = (-14.0, -12.0)
#: Units in the last place tried around ``f + S0`` for a start whose load equals S0 in doubles.
ULPS_TRIED = 8


@dataclass(frozen=True)
class Case:
    """Parameters and start of one simulation; ``domain`` where the state alone does not decide."""

    index: int
    params: dict[str, float]
    start: Start
    domain: str | None = None

    def __str__(self) -> str:
        p = ", ".join(f"{k}={v!r}" for k, v in self.params.items())
        s = self.start
        domain = f", domain={self.domain!r}" if self.domain else ""
        return f"dict({p}), state=[{s.x!r}, {s.v!r}], time={s.time!r}{domain}"


def power(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a number whose logarithm to base 10 is uniform."""
    return float(10.0 ** rng.uniform(low, high))


def sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def draw_omega(rng: np.random.Generator) -> float:
    kind = rng.random()
    if kind < 0.65:
        return power(rng, math.log10(0.02), math.log10(5.0))
    if kind < 0.75:
        return 1.0
    if kind < 0.80:
        return 1 / 3
    centre = 1.0 if kind < 0.92 else 1 / 3
    return centre + sign(rng) * power(rng, *BESIDE)


def draw_zeta(rng: np.random.Generator) -> float:
    kind = rng.random()
    if kind < 0.35:
        return 0.0
    if kind < 0.60:
        return power(rng, -12.0, -3.0)
    if kind < 0.72:
        return power(rng, -3.0, -0.1)
    if kind < 0.77:
        return 1.0
    if kind < 0.85:
        return 1.0 + sign(rng) * power(rng, *BESIDE)
    if kind < 0.93:
        return 1.0 + power(rng, -3.0, 0.6)
    return -power(rng, -12.0, -3.0)


def draw_friction(rng: np.random.Generator) -> tuple[float, float]:
    """Return (S, S0)."""
    kind = rng.random()
    if kind < 0.6:
        static = float(rng.uniform(0.0, 1.0))
    elif kind < 0.8:
        static = power(rng, -12.0, 0.0)
    else:
        static = float(rng.uniform(0.8, 1.5))  # 1 + |h| holds a mass that is at x = 0 for ever
    kind = rng.random()
    if kind < 0.45:
        return float(rng.uniform(0.0, static)), static
    if kind < 0.60:
        return static, static
    if kind < 0.75:
        return min(static * (1.0 - power(rng, -15.0, -2.0)), static), static
    if kind < 0.95:
        return min(power(rng, -12.0, -1.0), static), static
    return 0.0, static


def draw_time(rng: np.random.Generator, omega: float) -> float:
    kind, period = rng.random(), 2 * math.pi / omega
    if kind < 0.5:
        return 0.0
    if kind < 0.9:
        return float(rng.uniform(0.0, 3.0)) * period
    return power(rng, 0.0, 9.0) * period


def draw(seed: int, index: int) -> Case:
    """Return a case."""
    rng = np.random.default_rng([seed, index])
    S, S0 = draw_friction(rng)
    h = 0.0 if rng.random() < 0.4 else float(rng.uniform(-0.3, 0.3))
    p = {"Omega": draw_omega(rng), "S": S, "S0": S0, "h": h, "zeta": draw_zeta(rng)}
    law = Law(p["Omega"], S, S0, h, p["zeta"])
    time, x = draw_time(rng, p["Omega"]), sign(rng) * power(rng, -1.5, 0.5)
    kind = rng.random()
    if kind < 0.30:
        return Case(index, p, moving(time, x, sign(rng) * power(rng, -1.5, 0.5)))
    if kind < 0.40:
        return Case(index, p, moving(time, x, sign(rng) * power(rng, *NEAR_SURFACE)))
    if kind < 0.70:
        return Case(index, p, at_rest(law, time, x))
    side = int(sign(rng))
    edge = float(law.force(law.phase(arb(time)))[0]) + side * S0
    if kind < 0.85:
        return Case(index, p, at_rest(law, time, edge + sign(rng) * power(rng, *NEAR_SURFACE)))
    return on_surface(law, index, p, time, side)


def moving(time: float, x: float, v: float) -> Start:
    return Start(time, x, v, SLIDE_UP if v > 0 else SLIDE_DOWN)


def load(law: Law, time: float, x: float) -> arb:
    """Return ``x - f(t)`` in the working precision."""
    with working_precision(law.bits):
        return arb(x) - law.force(law.phase(arb(time)))[0]


def at_rest(law: Law, time: float, x: float) -> Start:
    """Return a start from rest: it sticks, or leaves to the side that the load pulls to."""
    u = load(law, time, x)
    if abs(u) < law.S0:
        return Start(time, x, 0.0, STICK)
    return Start(time, x, 0.0, SLIDE_DOWN if u > 0 else SLIDE_UP)


def on_surface(law: Law, index: int, p: dict[str, float], time: float, side: int) -> Case:
    """Return a start from rest with ``u = +-S0`` in doubles: held if the load falls, else released."""
    x = _x_on_surface(p, time, side)
    if x is None:
        time, x = 0.0, 1.0 + p["h"] + side * p["S0"]
    _, f1, f2, _ = law.force(law.phase(arb(time)))
    grows = -side * (float(f1) if time != 0.0 else float(f2)) > 0
    if not grows:
        return Case(index, p, Start(time, x, 0.0, STICK, side), STICK)
    mode, domain = (SLIDE_DOWN, "x+v-") if side > 0 else (SLIDE_UP, "x-v+")
    return Case(index, p, Start(time, x, 0.0, mode, side), domain)


def _x_on_surface(p: dict[str, float], time: float, side: int) -> float | None:
    """Return a double with ``x - f = +-S0`` exactly, in double arithmetic."""
    w = p["Omega"]
    f = math.cos(w * time) + (p["h"] * math.cos(3 * w * time) if p["h"] else 0.0)
    x = f + side * p["S0"]
    for k in range(-ULPS_TRIED, ULPS_TRIED + 1):
        other = x + k * math.ulp(x)
        if other - f == side * p["S0"]:
            return other
    return None
