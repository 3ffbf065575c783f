"""Quantities and their derivatives against 40 digits, and against forms that are known.

The reference solves the chain of segments of an orbit anew with mpmath: its own flow (constant coefficients
and a cosine), its own equations, Newton with differences at 40 digits, quadrature by mpmath, and
derivatives by central differences with a step of 1e-12. It shares the itinerary of the orbit and a starting
point with the library, and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.optimize import brentq, minimize_scalar
from typed import typed

import contfric as cf

FIG5 = {"Omega": 0.5, "S": 0.32, "S0": 0.4}
NAMES = ("Omega", "S", "S0", "h", "zeta")
DIGITS, STEP = 40, mpf(10) ** -12
#: Rounding of a quantity, and of a derivative: orbits are solved to 1e-14, and derivatives divide by gaps.
CLOSE, DERIVATIVE = 1e-12, 1e-10


class Chain:
    """One orbit of the dry friction oscillator at 40 digits; joints (t, x, v) of the whole cycle."""

    def __init__(self, orbit: cf.Orbit) -> None:
        whole = orbit.as_whole()
        self.itinerary, self.periods = whole.itinerary, whole.periods
        self.start = [mpf(float(value)) for value in whole.joints.ravel()]

    def slide(self, p: dict[str, Any], s: int, t0: Any, x0: Any, v0: Any) -> Callable[[Any], Any]:
        """Return the state as a function of time along a slide."""
        w, h, z, S = p["Omega"], p["h"], p["zeta"], p["S"]
        wd = mp.sqrt(1 - z**2)

        def forced(t: Any) -> tuple[Any, Any]:
            x, v = -s * S, mpf(0)
            for a, k in ((1, w), (h, 3 * w)):
                bottom = (1 - k**2) ** 2 + (2 * z * k) ** 2
                c, d = a * (1 - k**2) / bottom, a * 2 * z * k / bottom
                x += c * mp.cos(k * t) + d * mp.sin(k * t)
                v += k * (d * mp.cos(k * t) - c * mp.sin(k * t))
            return x, v

        fx, fv = forced(t0)
        a, b = x0 - fx, v0 - fv

        def at(t: Any) -> tuple[Any, Any]:
            d = t - t0
            e, co, si = mp.exp(-z * d), mp.cos(wd * d), mp.sin(wd * d)
            fx, fv = forced(t)
            x = e * (a * co + (b + z * a) / wd * si)
            v = e * (b * co - (a + z * b) / wd * si)
            return x + fx, v + fv

        return at

    def pieces(self, p: dict[str, Any], z: list[Any]) -> list[tuple[str, Any, Any, Any]]:
        """Return (mode, start, end, state) of every segment."""
        count, found = len(self.itinerary), []
        for i, (mode, _) in enumerate(self.itinerary):
            t0, x0, v0 = z[3 * i : 3 * i + 3]
            t1 = z[3 * i + 3] if i + 1 < count else z[0] + 2 * mp.pi * self.periods / p["Omega"]
            if mode == "stick":
                state = lambda t, x=x0: (x, mpf(0))  # noqa: E731
            else:
                state = self.slide(p, 1 if mode.endswith("+") else -1, t0, x0, v0)
            found.append((mode, t0, t1, state))
        return found

    def equations(self, p: dict[str, Any], z: list[Any]) -> list[Any]:
        count, left = len(self.itinerary), []
        for i, (_, _, t1, state) in enumerate(self.pieces(p, z)):
            x, v = state(t1)
            j = 3 * ((i + 1) % count)
            left += [x - z[j + 1], v - z[j + 2]]
            exit_ = self.itinerary[i][1]
            load = x - mp.cos(p["Omega"] * t1) - p["h"] * mp.cos(3 * p["Omega"] * t1)
            left.append({"v": v, "F+": load - p["S0"], "F-": load + p["S0"]}[exit_])
        return left

    def solve(self, p: dict[str, Any]) -> list[Any]:
        """Solve by Newton's method with a Jacobian by differences, until nothing changes."""
        z, size = list(self.start), len(self.start)
        h = mpf(10) ** -20
        for _ in range(12):
            f = mp.matrix(self.equations(p, z))
            jac = mp.matrix(size, size)
            for j in range(size):
                beside = self.equations(p, [*z[:j], z[j] + h, *z[j + 1 :]])
                for i in range(size):
                    jac[i, j] = (beside[i] - f[i]) / h
            step = mp.lu_solve(jac, f)
            z = [a - b for a, b in zip(z, step, strict=True)]
            if max(abs(s) for s in step) < mpf(10) ** -34:
                return z
        raise AssertionError("the reference did not converge")


def slides(pieces: list[Any]) -> list[Any]:
    return [piece for piece in pieces if piece[0] != "stick"]


def quad(pieces: list[Any], g: Callable[..., Any]) -> Any:
    return sum(mp.quad(lambda t, s=s: g(t, *s(t)), [a, (a + b) / 2, b]) for _, a, b, s in pieces)


def energy(p: dict[str, Any], pieces: list[Any]) -> Any:
    return quad(pieces, lambda t, x, v: p["S"] * abs(v) + 2 * p["zeta"] * v**2)


def mean_square(p: dict[str, Any], pieces: list[Any]) -> Any:
    period = pieces[-1][2] - pieces[0][1]
    return mp.sqrt(quad(pieces, lambda t, x, v: x**2) / period)


def third_harmonic(p: dict[str, Any], pieces: list[Any]) -> Any:
    period, w = pieces[-1][2] - pieces[0][1], 3 * p["Omega"]
    c = quad(pieces, lambda t, x, v: x * mp.cos(w * t))
    s = quad(pieces, lambda t, x, v: x * mp.sin(w * t))
    return 2 / period * mp.sqrt(c**2 + s**2)


def third_phase(p: dict[str, Any], pieces: list[Any]) -> Any:
    w = 3 * p["Omega"]
    c = quad(pieces, lambda t, x, v: x * mp.cos(w * t))
    s = quad(pieces, lambda t, x, v: x * mp.sin(w * t))
    return mp.atan2(-s, c)


def resting(p: dict[str, Any], pieces: list[Any]) -> Any:
    return sum(b - a for m, a, b, _ in pieces if m == "stick") / (pieces[-1][2] - pieces[0][1])


def largest(p: dict[str, Any], pieces: list[Any]) -> Any:
    return max(state(end)[0] for _, _, end, state in pieces)


def fastest(p: dict[str, Any], pieces: list[Any]) -> Any:
    """The largest speed: where the acceleration, -u - s S - 2 zeta v, is zero."""
    best = mpf(0)
    for mode, a, b, state in slides(pieces):
        s = 1 if mode.endswith("+") else -1

        def push(t: Any, s: int = s, state: Any = state) -> Any:
            x, v = state(t)
            f = mp.cos(p["Omega"] * t) + p["h"] * mp.cos(3 * p["Omega"] * t)
            return f - x - s * p["S"] - 2 * p["zeta"] * v

        grid = [a + (b - a) * mpf(k) / 64 for k in range(65)]
        for left, right in pairwise(grid):
            if push(left) * push(right) < 0:
                root = mp.findroot(push, (left, right), solver="anderson", tol=1e-60)
                best = max(best, abs(state(root)[1]))
    return best


REFERENCES = {
    "x_max": largest,
    "energy": energy,
    "rms(x)": mean_square,
    "amplitude(x, 3)": third_harmonic,
    "phase(x, 3)": third_phase,
    "sticking": resting,
    "max(abs(v))": fastest,
}
ORBITS = {
    "1a": FIG5,
    "2s": {**FIG5, "Omega": 0.5, "S": 0.36, "zeta": 0.03, "h": 0.05},
}


@pytest.fixture(scope="module", params=ORBITS)
def solved(request: pytest.FixtureRequest) -> tuple[cf.Orbit, Chain]:
    orbit = cf.solve_orbit("coulomb", request.param, ORBITS[request.param])
    return orbit, Chain(orbit)


def moved(orbit: cf.Orbit, name: str, by: Any) -> dict[str, Any]:
    p = {n: mpf(value) for n, value in orbit.params.items()}
    return {**p, name: p[name] + by}


@pytest.mark.slow
def test_quantities_and_gradients_in_40_digits(solved: tuple[cf.Orbit, Chain]) -> None:
    orbit, chain = solved
    with mp.workdps(DIGITS):
        here = moved(orbit, "S", 0)
        middle = chain.pieces(here, chain.solve(here))
        chain.start = chain.solve(here)
        for name, reference in REFERENCES.items():
            assert orbit.quantity(name) == pytest.approx(float(reference(here, middle)), abs=CLOSE)
        gradients = {name: orbit.gradient(name) for name in REFERENCES}
        for parameter in NAMES:
            ends = []
            for by in (STEP, -STEP):
                p = moved(orbit, parameter, by)
                ends.append((p, chain.pieces(p, chain.solve(p))))
            for name, reference in REFERENCES.items():
                slope = float((reference(*ends[0]) - reference(*ends[1])) / (2 * STEP))
                got = gradients[name][parameter]
                assert got == pytest.approx(slope, rel=DERIVATIVE, abs=DERIVATIVE), (
                    name,
                    parameter,
                )
                assert gradients[name].notes == ()


@pytest.mark.parametrize("zeta", [0.01, 0.3])
def test_an_oscillator_without_friction_is_a_formula(zeta: float) -> None:
    """Motion is A cos(Omega t - phi), and S = 0 leaves damping only: energy 2 pi zeta Omega A^2."""
    w = 0.7
    orbit = cf.find_orbit("coulomb", {"Omega": w, "S": 0.0, "S0": 0.0, "zeta": zeta})
    size = np.hypot(1 - w**2, 2 * zeta * w)
    expected = {
        "amplitude(x, 1)": 1 / size,
        "phase(x, 1)": -np.arctan2(2 * zeta * w, 1 - w**2),
        "rms(v)": w / size / np.sqrt(2),
        "mean(x)": 0.0,
        "energy": 2 * np.pi * zeta * w / size**2,
        "power": zeta * w**2 / size**2,
        "max(x) - min(x)": 2 / size,
        "max(v)": w / size,
        "sticking": 0.0,
    }
    for name, value in expected.items():
        assert orbit.quantity(name) == pytest.approx(value, abs=1e-13), name


def test_the_gradient_of_the_resonance_peak_is_that_of_its_formula() -> None:
    zeta, w = 0.2, 0.7
    orbit = cf.find_orbit("coulomb", {"Omega": w, "S": 0.0, "S0": 0.0, "zeta": zeta})
    size = np.hypot(1 - w**2, 2 * zeta * w)
    gradient = orbit.gradient("amplitude(x, 1)")
    assert gradient["zeta"] == pytest.approx(-4 * zeta * w**2 / size**3, rel=1e-11)
    by_frequency = -(-2 * w * (1 - w**2) + 4 * zeta**2 * w) / size**3
    assert gradient["Omega"] == pytest.approx(by_frequency, rel=1e-11)


def test_the_time_above_a_level_moves_with_it() -> None:
    """Of A cos a share of arccos(c / A) / pi lies above c; the derivative is that of moving jumps alone."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.7, "S": 0.0, "S0": 0.0, "zeta": 0.1, "h": 0.0})
    a = orbit.quantity("amplitude(x, 1)")
    level = 0.4
    assert orbit.quantity(f"mean(where(x > {level}, 1, 0))") == pytest.approx(
        np.arccos(level / a) / np.pi, abs=1e-12
    )
    gradient = orbit.gradient(f"mean(where(x > {level}, 1, 0))")
    slope = level / (a * np.sqrt(a**2 - level**2)) / np.pi
    for name in ("Omega", "zeta"):
        expected = slope * orbit.gradient("amplitude(x, 1)")[name]
        assert gradient[name] == pytest.approx(expected, rel=1e-9)


def test_the_speed_of_impact_follows_restitution() -> None:
    """At steady impact the wall takes what the force gives: energies balance, speeds in 14 digits."""
    orbit = cf.find_orbit("impact", {"A": 1.0, "w": 1.0, "d": 0.5, "e": 0.8})
    lost = 0.5 * (1 - 0.8**2) * orbit.quantity("impact_velocity") ** 2
    hits = sum(exit_ == "wall" for _, exit_ in orbit.itinerary)
    assert hits == 1
    work = orbit.quantity("integral(A*cos(w*t)*v)")
    assert work == pytest.approx(lost + orbit.quantity("integral(c*v**2)"), rel=1e-12)


def test_an_autonomous_cycle_has_a_period_and_a_gradient() -> None:
    orbit = cf.find_orbit("belt", {"vb": 0.2})
    assert orbit.quantity("period") == orbit.period
    gradient = orbit.gradient("period")
    values = []
    for by in (1e-4, -1e-4, 2e-4, -2e-4):
        beside = cf.find_orbit("belt", {"vb": 0.2 + by})
        values.append(beside.period)
    one, two = (values[0] - values[1]) / 2e-4, (values[2] - values[3]) / 4e-4
    assert gradient["vb"] == pytest.approx((4 * one - two) / 3, rel=1e-8)


# ------------------------------------------------------------------------------------- events


@pytest.mark.slow
def test_the_onset_of_sticking_moves_as_its_formula() -> None:
    """Den Hartog: 0s sticks where Omega^2 X = S0, X^2 = V^2 - S^2 U^2; differentiated at 40 digits."""
    orbit = cf.solve_orbit("coulomb", "0s", {**FIG5, "Omega": 0.56})
    branch = cf.continue_orbit(orbit, "Omega", (0.5, 0.6))
    event = next(b for b in branch.bifurcations if b.kind is cf.Kind.CS)
    gradient = event.gradient()

    def gap(w: Any, S: Any, S0: Any) -> Any:
        u = mp.tan(mp.pi / (2 * w)) / w
        return w**4 * ((1 / (1 - w**2)) ** 2 - S**2 * u**2) - S0**2

    with mp.workdps(DIGITS):
        S, S0 = mpf(event.params["S"]), mpf(event.params["S0"])
        w = mp.findroot(lambda w: gap(w, S, S0), event.params["Omega"])
        by_w = mp.diff(lambda w: gap(w, S, S0), w)
        by_S = -mp.diff(lambda s: gap(w, s, S0), S) / by_w
        by_S0 = -mp.diff(lambda s: gap(w, S, s), S0) / by_w
    assert gradient.value == pytest.approx(float(w), abs=1e-12)
    assert gradient["S"] == pytest.approx(float(by_S), rel=1e-11)
    assert gradient["S0"] == pytest.approx(float(by_S0), rel=1e-11)
    assert gradient.notes == ()  # both stops reach the limit at once, by symmetry
    assert event.gradient("S")["Omega"] == pytest.approx(1.0 / float(by_S), rel=1e-11)


EVENTS = [
    ("1a", ("SN",), (0.5, 0.56)),
    ("1a", ("CS", "SS"), (0.48, 0.52)),  # one stop, on its limit: CS and SS differ in what follows
    ("2s", ("BP",), (0.45, 0.52)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kinds", "bounds"), EVENTS)
@pytest.mark.parametrize("parameter", ["S", "S0", "h", "zeta"])
def test_events_move_as_differences_of_located_ones(
    name: str, kinds: tuple[str, ...], bounds: tuple[float, float], parameter: str
) -> None:
    def located(by: float) -> cf.Bifurcation:
        start = {"Omega": 0.5, "S": 0.32, "S0": 0.4, "h": 0.0, "zeta": 0.002}
        if name == "2s":
            start["Omega"] = 0.47
        start[parameter] += by
        branch = cf.continue_orbit(cf.solve_orbit("coulomb", name, start), "Omega", bounds)
        return next(b for b in branch.bifurcations if b.kind.value in kinds)

    step = 2e-4
    values = [located(k * step).params["Omega"] for k in (1, -1, 2, -2)]
    one, two = (values[0] - values[1]) / (2 * step), (values[2] - values[3]) / (4 * step)
    gradient = located(0.0).gradient()
    assert gradient.notes == ()
    # events are good to 1e-12, differences to that over the step and to its fourth power
    assert gradient[parameter] == pytest.approx((4 * one - two) / 3, rel=2e-7, abs=2e-7)


# --------------------------------------------------------------------- extrema along a branch


@pytest.mark.parametrize("quantity", ["x_max", "amplitude(x, 1)", "rms(x)*sqrt(2)"])
def test_the_resonance_peak_lies_where_its_formula_says(quantity: str) -> None:
    """The response of a linear oscillator is largest at sqrt(1 - 2 zeta^2): 1 / (2 zeta sqrt(1 - zeta^2))."""
    zeta = 0.1
    orbit = cf.find_orbit("coulomb", {"Omega": 0.7, "S": 0.0, "S0": 0.0, "zeta": zeta})
    branch = cf.continue_orbit(orbit, "Omega", (0.5, 1.5))
    (peak,) = branch.extrema(quantity)
    assert peak.largest and not peak.kink
    assert peak.params["Omega"] == pytest.approx(np.sqrt(1 - 2 * zeta**2), abs=1e-13)
    assert peak.value == pytest.approx(1 / (2 * zeta * np.sqrt(1 - zeta**2)), rel=1e-13)
    # the peak moves with the damping as the quantity does at a fixed frequency (envelope theorem)
    slope = -(1 - 2 * zeta**2) / (2 * zeta**2 * (1 - zeta**2) ** 1.5)
    assert peak.orbit.gradient(quantity)["zeta"] == pytest.approx(slope, rel=1e-11)


@pytest.mark.slow
def test_extrema_of_a_branch_with_a_fold_are_those_of_fine_steps() -> None:
    branch = cf.continue_orbit(cf.solve_orbit("coulomb", "1a", FIG5), "Omega", (0.4, 0.6))
    fine = cf.continue_orbit(
        cf.solve_orbit("coulomb", "1a", FIG5), "Omega", (0.4, 0.6), max_step=2e-4
    )
    for name in ("energy", "x_max", "psi", "max(u)"):
        values = fine.quantity(name)
        inner = [
            k
            for k in range(1, len(values) - 1)
            if (values[k] - values[k - 1]) * (values[k + 1] - values[k]) < 0.0
        ]
        found = branch.extrema(name)
        assert len(found) == len(inner), name
        for extremum, k in zip(found, inner, strict=True):
            bend = abs(values[k + 1] - 2.0 * values[k] + values[k - 1])
            assert extremum.largest == (values[k] > values[k - 1])
            assert abs(extremum.value - values[k]) <= bend
            assert branch.arc[0] < extremum.position < branch.arc[-1]
            assert extremum.orbit.admissible


def test_what_is_constant_to_rounding_has_no_extrema() -> None:
    """psi of symmetric orbits is zero, and its slopes are rounding: each of them was a kink."""
    branch = cf.continue_orbit(cf.solve_orbit("coulomb", "2s", FIG5), "Omega", (0.45, 0.55))
    assert np.max(np.abs(branch.quantity("psi"))) < 1e-13
    assert (
        branch.extrema("psi")
        == branch.extrema("mean(x)")
        == branch.extrema("S0 + max(u) + min(u)")
        == ()
    )


def test_a_pair_of_extrema_within_one_step_is_found() -> None:
    """x_max less a line in Omega has a minimum and a maximum where its second derivative changes sign."""
    zeta = 0.1
    orbit = cf.find_orbit("coulomb", {"Omega": 0.7, "S": 0.0, "S0": 0.0, "zeta": zeta})
    branch = cf.continue_orbit(orbit, "Omega", (0.5, 1.5), max_step=0.02)

    def slope(w: float) -> float:
        bottom = (1 - w**2) ** 2 + (2 * zeta * w) ** 2
        return float(-0.5 * (-4 * w * (1 - w**2) + 8 * zeta**2 * w) / bottom**1.5)

    steepest = minimize_scalar(lambda w: -slope(w), bounds=(0.85, 0.97), method="bounded").x
    tangent = slope(steepest) * (1 - 1e-5)  # two places near each other have this slope
    ends = (steepest - 0.03, steepest, steepest + 0.03)
    places = [brentq(lambda w: slope(w) - tangent, *pair, xtol=1e-15) for pair in pairwise(ends)]
    found = [e for e in branch.extrema(f"x_max - {tangent!r}*Omega") if e.params["Omega"] < 0.95]
    inside = (branch.values > places[0]) & (branch.values < places[1])
    assert not np.any(inside), "no point of the branch lies between them: both are in one step"
    assert [e.largest for e in found] == [False, True]
    assert [e.params["Omega"] for e in found] == pytest.approx(places, abs=1e-9)


# ------------------------------------------------------------------- a quantity that is held


@pytest.mark.parametrize(
    ("quantity", "omega", "zeta"),
    [
        ("x_max", 0.7, 0.3),
        ("x_max", 1.1, -0.2),
        ("x_max", 0.52, 0.4),
        ("amplitude(x, 1)", 0.7, 0.3),
    ],
)
def test_orbits_of_one_amplitude_lie_on_their_formula(
    quantity: str, omega: float, zeta: float
) -> None:
    """(1 - w^2)^2 + (2 zeta w)^2 = 1/A^2 is a closed curve around the resonance, through negative damping.

    It is closed whichever way round it is followed, though joints are a period later then or earlier.
    """
    size = 1.25
    orbit = cf.find_orbit("coulomb", {"Omega": omega, "S": 0.0, "S0": 0.0, "zeta": abs(zeta)})
    ranges = {"Omega": (0.2, 1.6), "zeta": (-0.9, 0.9)}
    curve = cf.continue_quantity(
        orbit, quantity, size, ("Omega", "zeta"), ranges, max_step=0.03, max_points=500
    )
    assert [end.reason.name for end in curve.ends] == ["CLOSED", "CLOSED"]
    w, zeta = curve.values.T
    assert np.max(np.abs((1 - w**2) ** 2 + (2 * zeta * w) ** 2 - size**-2)) < 1e-12
    assert np.min(zeta) < -0.3 < 0.3 < np.max(zeta)
    assert np.array_equal(curve.stable, zeta > 0.0)
    assert np.max(np.abs(curve.measured("rms(x)") - size / np.sqrt(2))) < 1e-12


SMOOTH = """
name: smooth
states: [x, v]
parameters: {W: 0.9, zeta: 0.2, a: 0.2}
period: 2*pi/W
field: {x: v, v: cos(W*t) - x - 2*zeta*v}
"""


@pytest.fixture(scope="module")
def smooth(tmp_path_factory: pytest.TempPathFactory) -> cf.Model:
    return typed(tmp_path_factory.mktemp("models"), SMOOTH)


def test_the_resonance_peak_of_a_linear_oscillator_is_a_formula(smooth: cf.Model) -> None:
    """The amplitude 1/|1 - w^2 + 2 i zeta w| is largest at w^2 = 1 - 2 zeta^2."""
    start = cf.find_orbit(smooth, {"W": 0.7, "zeta": 0.2})
    ranges = {"W": (0.5, 1.2), "zeta": (0.05, 0.5)}
    curve = cf.continue_extremum(start, "amplitude(x, 1)", ("W", "zeta"), ranges)
    w, zeta = curve.values.T
    assert [end.reason.name for end in curve.ends] == ["RANGE", "RANGE"] and len(curve) > 20
    assert np.max(np.abs(w**2 - (1 - 2 * zeta**2))) < 1e-11
    peak = 1 / (2 * zeta * np.sqrt(1 - zeta**2))
    assert np.max(np.abs(curve.extrema / peak - 1)) < 1e-12


def test_what_is_stationary_in_two_parameters_is_a_formula(smooth: cf.Model) -> None:
    """The peak plus zeta / a is least where 1/a = (1 - 2 zeta^2) / (2 zeta^2 (1 - zeta^2)^(3/2))."""
    start = cf.find_orbit(smooth, {"W": 0.9, "zeta": 0.25, "a": 0.12})
    ranges = {"W": (0.5, 1.2), "zeta": (0.1, 0.5), "a": (0.05, 0.3)}
    curve = cf.continue_extremum(start, "amplitude(x, 1) + zeta/a", ("W", "zeta", "a"), ranges)
    w, zeta, a = curve.values.T
    assert {end.reason.name for end in curve.ends} == {"RANGE"} and len(curve) > 10
    assert np.max(np.abs(w**2 - (1 - 2 * zeta**2))) < 1e-10
    known = 2 * zeta**2 * (1 - zeta**2) ** 1.5 / (1 - 2 * zeta**2)
    assert np.max(np.abs(a - known)) < 1e-10


def test_extrema_of_a_branch_that_starts_like_a_square_root_are_extrema() -> None:
    """Where a Jenkins element begins to slip the branch leaves with slope zero by arclength."""
    for limit in (1.2, 1.4, 1.6, 1.8):
        branch = cf.continue_orbit(
            cf.find_orbit("jenkins", {"muN": limit, "W": 1.45}), "W", (0.8, 2.2)
        )
        found = branch.extrema("x_max")
        assert len([e for e in found if not e.kink]) == 1
        assert all(abs(e.orbit.gradient("x_max")["W"]) < 1e-9 for e in found if not e.kink)


@pytest.mark.slow
def test_a_curve_of_one_energy_ends_at_events_and_edges() -> None:
    orbit = cf.solve_orbit("coulomb", "1a", FIG5)
    ranges = {"Omega": (0.45, 0.56), "S": (0.2, 0.39)}
    curve = cf.continue_quantity(orbit, "energy", 1.75, ("Omega", "S"), ranges)
    assert [end.reason.name for end in curve.ends] == ["MEETS", "MEETS"]
    assert np.max(np.abs(curve.measured("energy") - 1.75)) < 1e-12
    for end, inside in ((curve[0], curve[3]), (curve[-1], curve[-4])):
        assert abs(np.min(end.margins)) < 1e-11
        # the curve of that event, started from a branch near the end, runs through the end
        branch = cf.continue_orbit(inside, "Omega", ranges["Omega"])
        near = [b for b in branch.bifurcations if b.kind is cf.Kind.CS]
        event = min(near, key=lambda b: abs(b.params["Omega"] - end.params["Omega"]))
        crossed = cf.continue_bifurcation(event, ("Omega", "S"), ranges).values
        order = np.argsort(crossed[:, 1])
        place = np.interp(end.params["S"], crossed[order, 1], crossed[order, 0])
        assert place == pytest.approx(end.params["Omega"], abs=1e-4)
    x_max = cf.continue_quantity(orbit, "x_max", 1.43, ("Omega", "S"), ranges)
    assert [end.reason.name for end in x_max.ends] == ["RANGE", "RANGE"]
    assert x_max.values[[0, -1], 1] == pytest.approx([0.2, 0.2], abs=1e-12)
    assert all(other.admissible for other in x_max)
