"""What a steep friction law does at a release, a stop and a reversal, to leading order.

docs/coulomb-limit.md derives it. Nothing here is taken from the library: formulas, an ordinary
differential equation of scipy's, and the slides of Coulomb's oscillator in closed form. D = S0 - S,
tau = vS / D; a stick is released under a load that grows at the rate a.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.special import lambertw

#: The constant of the release with stiff bristles, A = 1 + RELEASE kappa^(-2/3) + ...
RELEASE = 1.424670
#: Times at which the velocity of a slide is looked at before its first zero is refined.
SAMPLES = 4000


@dataclass(frozen=True)
class Law:
    """A friction law; ``sigma0`` is infinite for Stribeck's."""

    S: float
    S0: float
    vS: float
    sigma0: float = math.inf
    sigma1: float = 0.0

    @property
    def drop(self) -> float:
        """D, by which friction falls."""
        return self.S0 - self.S

    @property
    def tau(self) -> float:
        """Time in which a disturbance at rest under the static limit grows by e."""
        return self.vS / self.drop

    def kappa(self, rate: float) -> float:
        """How stiff the bristles are for a release: (tau / t_c)^3, t_c^3 = S0 / (sigma0 a)."""
        return self.sigma0 * self.vS**3 * rate / (self.S0 * self.drop**3)

    def release(self, rate: float) -> float:
        """Delay of a release: (tau - nu) (log(D^2 / (a vS)) - log A(kappa)) + nu."""
        early = 0.0 if math.isinf(self.sigma0) else interpolated(self.kappa(rate))
        logarithm = math.log(self.drop**2 / (rate * self.vS)) - early
        return (self.tau - self.nu) * logarithm + self.nu

    @property
    def nu(self) -> float:
        """Time by which damping makes friction lead the force of the bristles, sigma1 / sigma0."""
        return self.sigma1 / self.sigma0

    @property
    def rebound(self) -> float:
        """Speed with which bristles throw the mass back at a stop with abs(u) = S0.

        S0 y / sqrt(sigma0) with y + log(1 - m y) / m = -2 m, m = sigma1 / sqrt(sigma0); y = 2 for m = 0.
        """
        if math.isinf(self.sigma0):
            return 0.0
        m = self.sigma1 / math.sqrt(self.sigma0)
        y = 2.0
        if m > 0.0:
            y = (1.0 + float(np.real(lambertw(-math.exp(-1.0 - 2.0 * m * m))))) / m
        return self.S0 * y / math.sqrt(self.sigma0)

    def stop(self, load: float) -> float:
        """Time by which a slide ends earlier that comes to rest under the load u (signed with the motion)."""
        b = load + self.S
        return (self.vS / b + self.nu) * math.log1p(self.drop / b)

    def departure(self, load: float) -> float:
        """Time by which a slide starts later that leaves under abs(u) > S0 at once."""
        b = load - self.S
        delay = (self.vS / b - self.nu) * math.log(b / (b - self.drop))
        bristles = math.log(2.0) / math.sqrt(self.sigma0)
        return delay + bristles - self.rebound / (load - self.S0)

    def pin(self, rate: float) -> float:
        """abs(u) - S0 at the stop that begins a canard under a load that falls at the rate a."""
        return rate * self.tau - self.rebound / self.tau


@cache
def amplification(kappa: float) -> float:
    """A(kappa): W ~ A e^s, where W' = s + P, P' = -kappa W (P - W) and P ~ -s, W ~ -1 / (kappa s) before."""
    unit = max(kappa ** (-1.0 / 3.0), kappa**-0.5)
    start = -60.0 * unit  # creep is slaved to the load there, to 1e-5 of W
    P = -start
    W = 0.5 * (P - math.sqrt(P * P - 4.0 / kappa))

    def large(s: float, y: np.ndarray) -> float:
        return float(y[0]) - 1e8  # P = W to rounding, and W' = W + s

    large.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(
        lambda s, y: [s + y[1], -kappa * y[0] * (y[1] - y[0])],
        (start, 400.0),
        [W, P],
        method="Radau",
        rtol=1e-9,
        atol=1e-11,
        events=large,
    )
    s, W = float(run.t[-1]), float(run.y[0, -1])
    return (W + s + 1.0) * math.exp(-s)


def interpolated(kappa: float) -> float:
    """Log A from the four values next to kappa that are tenths of a decade apart: good to 1e-5."""
    place = 10.0 * math.log10(kappa)
    nodes = [math.floor(place) + k for k in (-1, 0, 1, 2)]
    total = 0.0
    for node in nodes:
        weight = math.prod((place - other) / (node - other) for other in nodes if other != node)
        total += weight * math.log(amplification(10.0 ** (node / 10.0)))
    return total


@dataclass(frozen=True)
class Slide:
    """A slide of Coulomb's oscillator (zeta = h = 0) from rest."""

    time: float
    x: float
    way: float
    Omega: float
    S: float

    @property
    def response(self) -> float:
        """Amplitude of the forced motion."""
        return 1.0 / (1.0 - self.Omega**2)

    def state(self, t: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity."""
        V, om, t0 = self.response, self.Omega, self.time
        c = self.x + self.way * self.S - V * math.cos(om * t0)
        s = V * om * math.sin(om * t0)
        d = np.asarray(t) - t0
        x = c * np.cos(d) + s * np.sin(d) + V * np.cos(om * np.asarray(t)) - self.way * self.S
        return x, -c * np.sin(d) + s * np.cos(d) - V * om * np.sin(om * np.asarray(t))

    def end(self) -> tuple[float, float]:
        """Time and place of its stop."""
        times = self.time + np.linspace(1e-3, 4.0 * math.pi, SAMPLES)
        rest = np.flatnonzero(self.way * self.state(times)[1] <= 0.0)[0]
        stop = brentq(lambda t: float(self.state(t)[1]), times[rest - 1], times[rest], xtol=1e-15)
        return stop, float(self.state(stop)[0])


def amplitudes(law: Law, Omega: float, turns: int, delays: bool = True) -> np.ndarray:
    """Both amplitudes of the solution that Coulomb's rules converge to, with the delays of a law."""
    stop, x = 0.0, 1.0  # at rest, without load
    stops: list[float] = []
    for _ in range(turns):
        stop, x = _behind(stop, x, Omega, law, delays).end()
        stops.append(x)
    late = np.array(stops[-6:])
    return np.sort([late.max(), -late.min()])


def _behind(stop: float, x: float, Omega: float, law: Law, delays: bool) -> Slide:
    """The slide after a stop."""
    load = x - math.cos(Omega * stop)
    if abs(load) >= law.S0:
        late = law.departure(abs(load)) - law.stop(abs(load)) if delays else 0.0
        return Slide(stop + late, x, -math.copysign(1.0, load), Omega, law.S)
    times = stop + np.linspace(0.0, 2.0 * math.pi / Omega, SAMPLES)
    loads = x - np.cos(Omega * times)
    k = int(np.flatnonzero(np.abs(loads) > law.S0)[0])
    side = math.copysign(1.0, loads[k])
    free = brentq(
        lambda t: x - math.cos(Omega * t) - side * law.S0, times[k - 1], times[k], xtol=1e-15
    )
    rate = side * Omega * math.sin(Omega * free)
    late = law.release(rate) if delays else 0.0
    return Slide(free + late, x, -side, Omega, law.S)


def held(law: Law, length: float, guess: np.ndarray, delays: bool = True) -> np.ndarray:
    """Omega, x_max and -x_min of the orbit of one stick, one slide to a pinned stop and a hold of a length.

    Under a law with ``delays`` the pin is that of its canard, which creeps while it is held.
    """

    def turn(unknown: np.ndarray) -> tuple[np.ndarray, float]:
        Omega, rest = map(float, unknown)
        phase = -math.acos(rest + law.S0)
        late = law.release(-Omega * math.sin(phase)) if delays else 0.0
        stop, x = Slide(phase / Omega + late, rest, 1.0, Omega, law.S).end()
        early = law.stop(x - math.cos(Omega * stop)) if delays else 0.0
        stop -= early
        beyond = law.pin(-Omega * math.sin(Omega * stop)) if delays else 0.0
        crept = _creep(law, x, Omega, stop, length) if delays else 0.0
        _, back = Slide(stop + length, x - crept, -1.0, Omega, law.S).end()
        return np.array([x - math.cos(Omega * stop) - law.S0 - beyond, back - rest]), x

    solution = fsolve(lambda unknown: turn(unknown)[0], guess, xtol=1e-13)
    return np.array([solution[0], turn(solution)[1], -solution[1]])


def _creep(law: Law, x: float, Omega: float, stop: float, length: float) -> float:
    """Way of a hold, along g(v) = |u|: vS log(D / (|u| - S)) integrated."""
    times = np.linspace(stop, stop + length, 201)
    speed = np.log(law.drop / (x - np.cos(Omega * times) - law.S))
    return law.vS * float(np.trapezoid(speed, times))


def exponent(law: Law, point: np.ndarray, length: float) -> float:
    """Logarithm of the growth along a hold of a bridge: the integral of (abs(u) - S) / vS."""
    Omega, x = float(point[0]), float(point[1])
    stop = -math.acos(min(1.0, x - law.S0)) / Omega
    times = np.linspace(stop, stop + length, 201)
    return float(np.trapezoid(x - np.cos(Omega * times) - law.S, times)) / law.vS
