"""What errors a simulation in doubles may have: its own rounding, carried along by the tangent maps.

A double computation rounds at each segment, and the solution amplifies what was rounded. Both are known:
let ``J_k`` be the tangent map of segment k in (t, x) (:mod:`motion`), and ``N_k`` the diagonal of the
squares of what the segment's own arithmetic costs (:class:`Rounding`). Then

    C_k = J_k C_{k-1} J_k^T + N_k

is the covariance of the errors if the roundings are independent, and ``sigma = sqrt(diag C)`` the bound
that errors are measured against. (Some roundings are not independent: the period of the excitation is
rounded once and subtracted at each turn. That adds up to the square root of the number of events.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from motion import STICK, Event
from reference import Law
from sequence_cases import Case, load

EPS = 2.0**-52


@dataclass
class Spread:
    """Covariance of the errors of (t, x)."""

    tt: float
    tx: float
    xx: float

    def through(self, event: Event, noise: tuple[float, float]) -> Spread:
        """Return the covariance after a segment, from its tangent map and its own rounding."""
        (a, b), (c, d) = event.map
        return Spread(
            a * a * self.tt + 2 * a * b * self.tx + b * b * self.xx + noise[0] ** 2,
            a * c * self.tt + (a * d + b * c) * self.tx + b * d * self.xx,
            c * c * self.tt + 2 * c * d * self.tx + d * d * self.xx + noise[1] ** 2,
        )

    def along(self, t: float, x: float) -> float:
        """Return sigma of the combination ``t dt + x dx``."""
        return math.sqrt(max(0.0, t * t * self.tt + 2 * t * x * self.tx + x * x * self.xx))

    @property
    def sigmas(self) -> tuple[float, float]:
        return math.sqrt(self.tt), math.sqrt(self.xx)


class Rounding:
    """What one segment costs a double computation, for one set of parameters."""

    def __init__(self, p: dict[str, float]) -> None:
        self.p = p
        self.period = 2 * math.pi / p["Omega"]
        self.fastest = p["Omega"] * (3 if p["h"] else 1)
        sizes = [math.hypot(1 - w * w, 2 * p["zeta"] * w) for w in (p["Omega"], 3 * p["Omega"])][
            : 2 if p["h"] else 1
        ]
        self.response = 1.0 + max(1.0 / max(size, EPS) for size in sizes)

    def state(self, size: float, d: float) -> float:
        """Return the error of a state after a duration d from one of this size.

        Half a unit in the last place of each phase (up to 2 pi, and w d), of d, and of the result; times
        the amplitudes: of the free solution, and of the response, which at resonance grows like d.
        """
        p = self.p
        response = (1 + abs(p["h"])) * min(1 + d, self.response)
        growth = math.exp(max(0.0, -p["zeta"]) * d)
        phases = 1 + d * (1 + self.fastest) + 2 * math.pi * self.fastest / p["Omega"]
        return EPS * (size + p["S"] + response) * growth * phases

    def event(self, event: Event) -> tuple[float, float]:
        """Return the errors (of t, of x) that a segment adds."""
        d = event.duration
        clock = EPS * (self.period * (1 + d / self.period) + 4 * d)  # 4: a root's last step in ulps
        if event.mode == STICK:
            u = self.load(event.size)
            return clock + u / max(abs(event.slope), 1e-300), 0.0
        v = self.state(event.size, d)
        return clock + v / max(abs(event.slope), 1e-300), v

    def load(self, x: float) -> float:
        """Return the error of a load u."""
        return EPS * (abs(x) + self.p["S0"] + 1 + abs(self.p["h"]))

    def start(self, case: Case, law: Law) -> Spread:
        """Return the errors of a start: its time is split into periods and phase; x is exact.

        On a surface, the reference starts at another x, by what the double is next to the surface.
        """
        s = case.start
        clock = EPS * (abs(s.time) + self.period)
        moved = 0.0
        if s.side:
            moved = abs(float(load(law, s.time, s.x) - s.side * law.S0)) + self.load(s.x)
        return Spread(clock**2, 0.0, moved**2)
