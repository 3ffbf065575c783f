"""Den Hartog's symmetric orbit without sticks (zeta = h = 0), known in closed form.

Between two stops, from ``x = X`` at t = 0 down to ``x = -X`` at ``t = T = pi / Omega``::

    x = S + V cos(Omega t + phi) - S cos t - S tan(T/2) sin t,     V = 1 / (1 - Omega^2)
    V Omega sin(phi) = -S tan(T/2),     X = V cos(phi) = sqrt(V^2 - S^2 U^2),  U = tan(T/2) / Omega

(J. P. Den Hartog, Trans. ASME 53 (1931) 107-115, in our units). The load at a stop is ``Omega^2 X``:
nothing sticks while it exceeds S0. The determinant of the map of half a period, without its trivial
direction, is ``(Omega^2 X - S) / (Omega^2 X + S)``: the ratio of the accelerations at the two sides
of a stop.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp, mpf

import contfric as cf
from contfric.orbit.solve import refine

EPS = np.finfo(float).eps
COULOMB = cf.load_model("coulomb")


class DenHartog:
    """The closed form at 40 digits."""

    def __init__(self, omega: float, S: float) -> None:
        with mp.workdps(40):
            self.omega, self.S = mpf(omega), mpf(S)
            self.V = 1 / (1 - self.omega**2)
            self.tan = mp.tan(mp.pi / (2 * self.omega))
            self.U = self.tan / self.omega
            square = self.V**2 - self.S**2 * self.U**2
            self.x_max = mp.sqrt(square) if square > 0 else None

    @property
    def onset(self) -> float:
        """Friction at which the orbit begins to stick, S0 = S."""
        with mp.workdps(40):
            return float(abs(self.V) / mp.sqrt(self.U**2 + 1 / self.omega**4))

    @property
    def load(self) -> float:
        """Load at the stops."""
        with mp.workdps(40):
            return float(self.omega**2 * self.x_max)

    @property
    def determinant(self) -> float:
        with mp.workdps(40):
            load = self.omega**2 * self.x_max
            return float((load - self.S) / (load + self.S))

    @property
    def sensitivity(self) -> float:
        """How much relative rounding grows: a nearly neutral orbit, or X near the root of its square."""
        with mp.workdps(40):
            neutral = 1 / (1 - mp.sqrt(self.determinant))
            return float(neutral * (1 + self.V**2 / self.x_max**2))

    def moves_on(self) -> bool:
        """Whether it does not stop between its stops; by a grid, the two zeros at its ends divided out."""
        omega, S, V, tan, X = map(float, (self.omega, self.S, self.V, self.tan, self.x_max))
        sin_phi, cos_phi = -S * tan / (V * omega), X / V
        t = np.linspace(0, np.pi / omega, 4001)[1:-1]
        v = -V * omega * (np.sin(omega * t) * cos_phi + np.cos(omega * t) * sin_phi)
        v += S * np.sin(t) - S * tan * np.cos(t)
        return bool(np.max(v / (t * (np.pi / omega - t))) < 0.0)


def params(omega: float, S: float, S0: float | None = None) -> dict[str, float]:
    return {"Omega": omega, "S": S, "S0": S if S0 is None else S0, "h": 0.0, "zeta": 0.0}


def at(orbit: cf.Orbit, **changes: float) -> cf.Orbit:
    """Solve again at other parameters, from the joints of an orbit."""
    vector = COULOMB.vector(orbit.params | changes)
    return refine(replace(orbit, vector=vector), damped=True)


def compare(orbit: cf.Orbit, limit: float = 1e-12) -> None:
    exact = DenHartog(orbit.params["Omega"], orbit.params["S"])
    assert orbit.converged and orbit.system.half
    assert orbit.itinerary == (("slide+", "v"), ("slide-", "v")), orbit
    assert orbit.admissible, orbit.violations()
    x_max = float(exact.x_max)
    assert abs(orbit.x_max - x_max) < limit * x_max, orbit
    assert abs(orbit.x_min + x_max) < limit * x_max, orbit
    determinant = np.prod(orbit.turn_multipliers)
    assert abs(determinant - exact.determinant) < limit * max(abs(exact.determinant), 1e-2), orbit


def draws(count: int, seed: int, low: float = 0.35, high: float = 3.0):
    """Random (Omega, S) between no friction and the onset of sticking; twenty at 1 +- 1e-3 .. 1e-1."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        omega = rng.uniform(low, high)
        if k % 4 == 0:
            omega = 1 + rng.choice([-1, 1]) * 10 ** rng.uniform(-3, -1)
        yield float(omega), float(DenHartog(omega, 0.1).onset * rng.uniform(0.03, 0.97)), rng


def test_amplitude_and_determinant() -> None:
    """30 orbits from the signature alone, and three more of other friction from each of them."""
    compared = 0
    for omega, S, rng in draws(30, seed=3):
        assert DenHartog(omega, S).moves_on()
        orbit = cf.solve_orbit("coulomb", "0s", params(omega, S))
        compare(orbit)
        compared += 1
        onset = DenHartog(omega, S).onset
        for share in rng.uniform(0.03, 0.97, 3):
            other = float(onset * share)
            load = DenHartog(omega, other).load
            if DenHartog(omega, other).moves_on():
                # S0 anywhere from S to the load at which it would stick does not change the orbit
                S0 = other + float(rng.choice([0.0, 0.9])) * (load - other)
                compare(at(orbit, S=other, S0=S0))
                compared += 1
    assert compared >= 100


@pytest.mark.parametrize("distance", [1e-3, -1e-3, 1e-4, -1e-4, 1e-5, -1e-5])
def test_very_near_resonance(distance: float) -> None:
    """At Omega = 1 friction below pi/4 does not bound the solution: X grows like 1 / |Omega - 1| and the
    half map nears the identity. Rounding grows with it, and no more than that."""
    exact = DenHartog(1 + distance, 0.4)
    assert float(exact.x_max) > 0.4 / abs(distance)
    orbit = cf.solve_orbit("coulomb", "0s", params(1 + distance, 0.4))
    compare(orbit, limit=20 * EPS * exact.sensitivity)


@pytest.mark.parametrize(
    "omega, S", [(0.357257025, 0.0832116755), (0.3508, 0.058), (0.3938, 0.1342)]
)
def test_where_it_would_stop_on_the_way_there_is_none(omega: float, S: float) -> None:
    assert DenHartog(omega, S).onset > S and not DenHartog(omega, S).moves_on()
    with pytest.raises(cf.ConvergenceError, match="interior margin at v"):
        cf.solve_orbit("coulomb", "0s", params(omega, S))


@pytest.mark.parametrize("omega", [0.45, 0.55, 0.8, 0.97, 1.03, 1.4, 2.0, 3.0])
def test_onset_of_sticking(omega: float) -> None:
    """With S0 = S the load at the stop falls to S: the zero of the margin there, by bisection."""
    exact = DenHartog(omega, 0.1)
    onset = exact.onset
    # near resonance X falls from S / Omega^2 to zero over a small share of the onset: stay within it
    share = min(0.05, 0.2 / float(exact.U * omega**2) ** 2)
    low, high = (1 - share) * onset, (1 + share) * onset
    orbit = cf.solve_orbit("coulomb", "0s", params(omega, low))
    (stop,) = (
        k
        for k, test in enumerate(orbit.system.tests)
        if (test.margin.value, test.segment, test.surface) == ("joint", 0, "F+")
    )
    assert orbit.system.itinerary == (("slide+", "v"),)

    def margin(S: float) -> float:
        nonlocal orbit
        orbit = at(orbit, S=S, S0=S)
        assert orbit.converged
        return float(orbit.margins[stop])

    assert margin(low) > 0.0 > margin(high)
    while high - low > 2 * EPS * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if margin(middle) > 0.0 else (low, middle)
    assert low == pytest.approx(onset, rel=1e-12)


@pytest.mark.parametrize(
    "omega, kind", [(0.45, "SS"), (0.55, "CS"), (0.7, "CS"), (1.05, "CS"), (2.2, "CS")]
)
def test_continued_in_the_static_limit_it_ends_where_the_load_is(omega: float, kind: str) -> None:
    S = 0.5 * DenHartog(omega, 0.0).onset
    exact = DenHartog(omega, S)
    # the load at the stop x = X grows at the rate -f'(t) = Omega sin(phi), of the sign of -tan(T/2)/V
    assert (exact.tan * exact.V < 0) == (kind == "CS")
    orbit = cf.solve_orbit("coulomb", "0s", params(omega, S))
    branch = cf.continue_orbit(orbit, "S0", (S, 3 * exact.load))
    assert {end.reason.name for end in branch.ends} == {"LIMIT", kind}
    (event,) = (b for b in branch.bifurcations if b.kind != "T")
    assert event.kind == kind
    assert event.params["S0"] == pytest.approx(exact.load, rel=1e-12)
    assert event.group == 2, "it happens at both stops at once"
    # S0 means nothing to an orbit that does not stick
    assert np.max(np.abs(branch.x_max / float(exact.x_max) - 1)) < 1e-12


def test_continued_in_omega_through_resonance_of_the_response() -> None:
    """V changes its sign at Omega = 1; with S above pi/4 there is no orbit there, below it is infinite.
    On both sides every point of a branch is Den Hartog's."""
    for start, bounds in ((1.5, (1.02, 3.0)), (0.7, (0.55, 0.98))):
        orbit = cf.solve_orbit("coulomb", "0s", params(start, 0.2))
        branch = cf.continue_orbit(orbit, "Omega", bounds)
        exact = [DenHartog(omega, 0.2) for omega in branch.values]
        x_max = np.array([float(e.x_max) for e in exact])
        determinant = np.array([e.determinant for e in exact])
        assert len(branch) > 30
        assert np.max(np.abs(branch.x_max / x_max - 1)) < 1e-12
        found = np.prod(branch.turn_multipliers, axis=1)
        assert np.max(np.abs(found - determinant)) < 1e-12
