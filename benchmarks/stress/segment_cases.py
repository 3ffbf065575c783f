"""Random segments: durations over 17 decades, starts up to 1e9 periods away, and constructed grazings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb
from numpy.typing import NDArray
from reference import Law, Slide, working_precision
from sequence_cases import draw_friction, draw_omega, draw_time, draw_zeta, power, sign

SLIDES, STICK = (0, 1), 2
LOAD, SPEED = 0, 1
#: Depth of a grazing, in decades: from plainly seen to the resolution of doubles.
DEPTHS = (-15.0, -6.0)


@dataclass(frozen=True)
class Case:
    """A segment: mode, parameters, start, duration; observable, level and ``on`` of a search for roots."""

    index: int
    mode: int
    params: dict[str, float]
    t0: float
    x0: float
    v0: float
    d: float
    c: int = SPEED
    level: float = 0.0
    on: bool = False
    kind: str = ""

    def vector(self) -> NDArray[np.float64]:
        """Return the parameters in contfric's order."""
        return np.array([self.params[k] for k in ("Omega", "S", "S0", "h", "zeta")])


def draw_params(rng: np.random.Generator) -> dict[str, float]:
    S, S0 = draw_friction(rng)
    h = 0.0 if rng.random() < 0.4 else float(rng.uniform(-0.3, 0.3))
    return {"Omega": draw_omega(rng), "S": S, "S0": S0, "h": h, "zeta": draw_zeta(rng)}


def place(rng: np.random.Generator) -> float:
    return sign(rng) * power(rng, -1.5, 0.5)


def draw_flow(seed: int, index: int) -> Case:
    """Return a segment for the flow and its derivatives."""
    rng = np.random.default_rng([seed, index, 1])
    p = draw_params(rng)
    duration = power(rng, -14.0, 3.0) if rng.random() < 0.5 else power(rng, -2.0, 1.5)
    t0 = draw_time(rng, p["Omega"])
    return Case(index, int(rng.integers(2)), p, t0, place(rng), place(rng), duration)


def draw_root(seed: int, index: int) -> Case:
    """Return a segment for a first root of the load or of the velocity."""
    rng = np.random.default_rng([seed, index, 2])
    p = draw_params(rng)
    t0, mode = draw_time(rng, p["Omega"]), int(rng.integers(3))
    longest = min(60.0, 3 * math.pi / p["Omega"] + 7.0)
    d = float(rng.uniform(0.05, 1.0)) * longest
    if mode == STICK:
        return Case(index, mode, p, t0, place(rng), 0.0, d, LOAD, float(sign(rng)) * p["S0"])
    v0 = (1 - 2 * mode) * abs(place(rng))
    if rng.random() < 0.5:
        return Case(index, mode, p, t0, place(rng), v0, d, LOAD, float(sign(rng)) * p["S0"])
    return Case(index, mode, p, t0, place(rng), v0, d)


def draw_graze(seed: int, index: int) -> Case | None:
    """Return a slide that touches a surface, but for a depth to either side; None if it starts beyond.

    The slide is constructed backwards from there in fifty digits, and its start rounded to doubles:
    velocity zero with no acceleration (double root), the load at a surface with no rate (tangency),
    or velocity zero where the force is stationary besides (triple root).
    """
    rng = np.random.default_rng([seed, index, 3])
    p = draw_params(rng)
    law = Law(*(p[k] for k in ("Omega", "S", "S0", "h", "zeta")))
    mode = int(rng.integers(2))
    kind = ("double", "tangent", "triple")[int(rng.choice(3, p=[0.45, 0.45, 0.1]))]
    period = 2 * math.pi / p["Omega"]
    t = float(rng.uniform(0.0, 1.0)) * period if kind != "triple" else 0.0
    before, after = float(rng.uniform(0.05, 2.0)), float(rng.uniform(0.05, 1.0))
    depth = sign(rng) * power(rng, *DEPTHS)
    with working_precision(law.bits):
        start, level = _backwards(law, mode, kind, arb(t), depth, rng, before, p)
        t0, x0, v0 = start
    if (1 - 2 * mode) * v0 <= 0.0 or max(abs(x0), abs(v0)) > 100.0:
        return None
    c = LOAD if kind == "tangent" else SPEED
    return Case(index, mode, p, t0, x0, v0, before + after, c, level, False, kind)


def _backwards(
    law: Law,
    mode: int,
    kind: str,
    t: arb,
    depth: float,
    rng: np.random.Generator,
    before: float,
    p: dict[str, float],
) -> tuple[tuple[float, float, float], float]:
    s = 1 - 2 * mode
    f, f1, _, _ = law.force(law.phase(t))
    level = 0.0
    if kind == "tangent":
        level = sign(rng) * p["S0"]
        x: Any = f + arb(level) + depth
        v: Any = f1
    else:
        v = arb(depth)
        x = f - s * law.S - 2 * law.zeta * v
    t0 = float(t) - before
    at = Slide(law, s, t, x, v).state(arb(t0) - t)
    return (t0, float(at.x), float(at.v)), level
