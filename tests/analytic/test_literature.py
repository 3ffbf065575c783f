"""Models of the literature: their diagrams by equations that share nothing with the library.

Piecewise linear solutions are in closed form (mpmath), the others are integrated by scipy; each
bifurcation is a root of its own condition.
"""

from __future__ import annotations

import dataclasses
from functools import cache
from math import cos, pi
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from by_scipy import integrated, slip, slower_than_the_belt
from scipy.optimize import brentq, fsolve, root

import contfric as cf
from contfric.study import read_study

#: Integrated models from end to end: minutes of processor time, run by `make test-all`.
pytestmark = pytest.mark.slow


@cache
def diagram(name: str) -> cf.Diagram:
    """Return the diagram of a bundled study."""
    study = dataclasses.replace(read_study(name), drawings=())
    found = cf.run_study(study, Path(mkdtemp()) / "out").diagram
    assert found is not None
    return found


def value(name: str, kind: str, near: float) -> float:
    """Return the parameter of the event of a kind nearest to a value."""
    found = diagram(name)
    values = [e.params[found.parameter] for e in found.bifurcations if e.kind.value == kind]
    return min(values, key=lambda v: abs(v - near))


class DeadBand:
    """Half turns of the cycle: in the band from edge to edge, and beyond it."""

    delta = mp.mpf("0.1")

    @classmethod
    def moved(cls, alpha: Any, x: Any, v: Any, force: Any, d: Any) -> tuple[Any, Any]:
        """Return (x, v) after d: ``x'' = 2 alpha delta v - alpha^2 x - force``."""
        g, centre = alpha * cls.delta, -force / alpha**2
        w = alpha * mp.sqrt(1 - cls.delta**2)
        c, s, grown = mp.cos(w * d), mp.sin(w * d) / w, mp.exp(g * d)
        u = x - centre
        return centre + grown * ((c - g * s) * u + s * v), grown * (
            (c + g * s) * v - alpha**2 * s * u
        )

    @classmethod
    def across(cls, alpha: Any, x: Any) -> Any:
        """Return where v = -1 is met in the band from (x, 1), mirrored."""
        d = cls.first(lambda d: cls.moved(alpha, x, 1, 0, d)[1] + 1, alpha)
        return -cls.moved(alpha, x, 1, 0, d)[0]

    @classmethod
    def beyond(cls, alpha: Any, x: Any) -> Any:
        """Return where v = 1 is met again in fast motion from (x, 1)."""
        d = cls.first(lambda d: (cls.moved(alpha, x, 1, 1, d)[1] - 1) / d, alpha)
        return cls.moved(alpha, x, 1, 1, d)[0]

    @staticmethod
    def first(f: Any, alpha: Any) -> Any:
        """Return the first root, from steps of a fortieth of a turn."""
        step = 2 * mp.pi / alpha / 40
        k = next(k for k in range(1, 80) if f(k * step) * f((k + 1) * step) <= 0)
        return mp.findroot(f, (k * step, (k + 1) * step), solver="anderson")


def test_dead_band_in_closed_form() -> None:
    mp.mp.dps = 30
    leaves = lambda a: 2 * DeadBand.delta / a  # noqa: E731 - where rest on the edge is left
    ss = mp.findroot(
        lambda a: DeadBand.across(a, leaves(a)) - (2 * a * DeadBand.delta - 1) / a**2, (1.1, 1.15)
    )
    assert value("dead-band", "SS", 1.1) == pytest.approx(float(ss), abs=1e-11)
    cs = mp.findroot(
        lambda a: DeadBand.beyond(a, DeadBand.across(a, leaves(a))) - leaves(a), (2.1, 2.2)
    )
    assert value("dead-band", "CS", 2.2) == pytest.approx(float(cs), abs=1e-11)
    fold = value("dead-band", "SN", 3.17)
    turn = lambda a, x: DeadBand.beyond(a, DeadBand.across(a, x))  # noqa: E731
    at = next(b for b in diagram("dead-band").bifurcations if b.kind.value == "SN").orbit
    start = max(s[1] for s, (_, e) in zip(at.ends, at.itinerary, strict=True) if e == "v+")
    a, _ = mp.findroot(
        lambda a, x: [turn(a, x) - x, mp.diff(lambda u: turn(a, u), x) - 1], (fold, start)
    )
    assert fold == pytest.approx(float(a), abs=1e-10)


def test_dead_band_chain_of_4_6_and_4_segments() -> None:
    branches = diagram("dead-band").branches
    chain = [(2 * len(b.system.itinerary), b[0].signature.stops) for b in branches]
    assert sorted(chain) == [(4, 0), (4, 2), (6, 2)]
    assert all(b.symmetric for b in branches) and not diagram("dead-band").loose_ends


def test_impact_oscillator_in_closed_form() -> None:
    mp.mp.dps = 40
    c, e, period = mp.mpf("0.1"), mp.mpf("0.8"), 2 * mp.pi
    z = c / 2
    w = mp.sqrt(1 - z * z)
    co, si = mp.cos(w * period), mp.sin(w * period) / w
    free = mp.exp(-z * period) * mp.matrix([[co + z * si, si], [-si, co - z * si]])

    def amplitude(u: Any) -> Any:
        """Return A of the orbit that meets the stop with the speed u."""
        gap = mp.matrix([1, u]) - free * mp.matrix([1, -e * u])
        response = mp.lu_solve(mp.eye(2) - free, gap)
        return c * mp.sqrt(response[0] ** 2 + response[1] ** 2)

    fold = mp.findroot(lambda u: mp.diff(amplitude, u), mp.mpf("0.004"))
    assert value("impact", "SN", 0.1) == pytest.approx(float(amplitude(fold)), abs=1e-12)
    assert value("impact", "GS", 0.1) == pytest.approx(0.1, abs=1e-12)
    assert float(amplitude(fold)) == pytest.approx(0.09997075362831327180, abs=1e-16)
    assert float(fold) == pytest.approx(0.0041115306, abs=1e-10)


def test_belt_by_another_integrator() -> None:
    ss = brentq(lambda vb: slip(vb, 3.0, 1.0, -1.0) + 1.0, 0.6, 0.7, xtol=1e-13)
    assert value("belt", "SS", 0.64) == pytest.approx(ss, abs=1e-10)
    cs = brentq(lambda v: slip(v, 3.0, slip(v, 3.0, 1.0, -1.0), 1.0) - 1.0, 4.3, 4.5, xtol=1e-13)
    assert value("belt", "CS", 4.42) == pytest.approx(cs, abs=1e-10)


def test_cycle_of_the_belt() -> None:
    """Its period at 0.2 by the slip of another integrator and a stick at the belt's speed; far ahead."""
    orbit = cf.find_orbit("belt", {"vb": 0.2})
    (stick,) = [k for k, (mode, _) in enumerate(orbit.itinerary) if mode == "stick"]
    lasts = orbit.ends[stick, 0] - orbit.begins[stick, 0]
    assert lasts == pytest.approx((1.0 - slip(0.2, 3.0, 1.0, -1.0)) / 0.2, abs=1e-9)
    assert orbit.period == pytest.approx(12.00103129483, abs=1e-10)
    fast = cf.continue_orbit(cf.find_orbit("belt", {"vb": 10.0}), "vb", (5.0, 60.0))
    assert [end.reason for end in fast.ends] == [cf.EndReason.RANGE] * 2
    assert fast.name == "0a, 8seg" and bool(np.all(fast.stable))


def test_popp_grazing_and_doubling_by_another_integrator() -> None:
    def after(omega: float, t: float, state: Any, turns: int) -> np.ndarray:
        return slower_than_the_belt(state, omega, (t, t + 2 * pi * turns / omega))

    def grazes(u: Any) -> list[float]:
        """It touches the belt's speed from below, without acceleration; closed after four periods."""
        start = [1.5 + 0.1 * cos(u[1] * u[0]), 1.0]
        return list(after(u[1], u[0], start, 4)[:2] - start)

    for near in (1.66769, 1.70780):
        at = value("popp", "GS", near)
        found = next(b for b in diagram("popp").bifurcations if b.params["omega"] == at)
        times = np.linspace(0.0, found.orbit.period, 4001) + found.orbit.cycle[0, 0]
        top = max(times, key=lambda t: found.orbit.state(t)[1])
        _, omega = fsolve(grazes, [top, at + 1e-6], xtol=1e-13)
        assert at == pytest.approx(omega, abs=1e-9) and abs(at - near) < 1e-5

    def doubles(u: Any) -> list[float]:
        end = after(u[2], 0.0, u[:2], 2)
        return [*(end[:2] - u[:2]), np.linalg.det(end[2:].reshape(2, 2) + np.eye(2))]

    found = next(b for b in diagram("popp").bifurcations if b.kind.value == "PD")
    start = found.orbit.state(2 * 2 * pi / found.params["omega"])
    omega = fsolve(doubles, [*start, found.params["omega"] + 1e-6], xtol=1e-13)[2]
    assert found.params["omega"] == pytest.approx(omega, abs=1e-9)


def test_popp_grazing_of_period_one() -> None:
    orbit = cf.find_orbit("popp", {"omega": 0.9})
    events = cf.continue_orbit(orbit, "omega", (0.8, 1.0)).bifurcations
    (found,) = [e for e in events if e.kind.value == "GS"]
    omega, times = found.params["omega"], np.linspace(0.0, found.orbit.period, 4001)
    times += found.orbit.cycle[0, 0]
    top = max(times, key=lambda t: found.orbit.state(t)[1])

    def grazes(u: Any) -> np.ndarray:
        start = np.array([1.5 + 0.1 * cos(u[1] * u[0]), 1.0])
        span = (u[0], u[0] + 2 * pi / u[1])
        end = slower_than_the_belt(start, u[1], span)
        return end[:2] - start

    assert omega == pytest.approx(fsolve(grazes, [top, omega + 1e-6], xtol=1e-13)[1], abs=1e-9)
    assert omega == pytest.approx(0.85146070765, abs=1e-9) and orbit.periods == 1


def test_popp_of_period_one_folds_and_becomes_a_torus() -> None:
    """At the fold a multiplier of the orbit with a stick is 1; at the torus a pair lies on the circle."""
    orbit = cf.find_orbit("popp", {"omega": 0.9})
    found = cf.explore(orbit, "omega", (0.8, 1.1))
    (fold,) = found.of_kind("SN")
    assert fold.params["omega"] == pytest.approx(0.85421176, abs=5e-9) and fold.orbit.periods == 1
    assert np.min(np.abs(fold.orbit.multipliers - 1.0)) < 1e-5
    (torus,) = found.of_kind("NS")
    omega, start = torus.params["omega"], torus.orbit.state(0.0)
    period = 2 * pi / omega
    end = slower_than_the_belt(start, omega, (0.0, period))
    assert end[:2] == pytest.approx(start, abs=1e-9)
    pair = np.linalg.eigvals(end[2:].reshape(2, 2))
    assert np.abs(pair) == pytest.approx([1.0, 1.0], abs=1e-8) and abs(pair[0].imag) > 0.1
    assert omega == pytest.approx(1.0431131590, abs=1e-9)


def test_popp_has_each_orbit_once() -> None:
    """Three events lead to the orbit of period 2 with a stick; twice around is no orbit of its own.

    Where it grazes, orbits of two and of four turns stick in one of them, too."""
    found = [b for b in diagram("popp").branches if b.name.startswith(("1a", "2a"))]
    assert sorted((b.name, b[0].periods) for b in found) == [
        ("1a, 17seg", 8),
        ("1a, 5seg", 2),
        ("1a, 9seg", 4),
    ]
    assert not diagram("popp").loose_ends


#: Of the model with impacts and friction: closed forms of what one turn does.
FF, B, E = 0.7961, 0.8471, 0.9


def speed_squared(x: float, b: float) -> float:
    """Return the square of the speed after an impact at x, of a mass at rest."""
    return (1 + E) ** 2 * (1 - (x + b) ** 2)


def test_impact_with_friction_in_closed_form() -> None:
    """One turn leads back to x where ``speed^2 = 8 Ff (Ff/k - x)``, from the energy of both slides."""
    ss = brentq(lambda k: speed_squared(-FF / k, B) - 16 * FF**2 / k, 5.0, 6.0, xtol=1e-15)
    assert value("impact-friction", "SS", 5.6) == pytest.approx(ss, abs=1e-11)
    x = 4 * FF / (1 + E) ** 2 - B
    fold = 8 * FF**2 / (speed_squared(x, B) + 8 * FF * x)
    assert value("impact-friction", "SN", 4.95) == pytest.approx(fold, abs=1e-11)
    assert value("impact-friction", "AS", 5.2) == pytest.approx(FF / (1.0 - B), abs=1e-9)
    assert [ss, fold] == pytest.approx([5.5730340399782, 4.9515355556113], abs=1e-12)
    # beyond it the mass rests for ever, which is said: no branch is missing there
    reasons = {end.reason for branch in diagram("impact-friction").branches for end in branch.ends}
    assert reasons == {cf.EndReason.REST, cf.EndReason.SS, cf.EndReason.RANGE}
    assert not diagram("impact-friction").loose_ends


def test_impact_with_friction_codimension_two_by_runs() -> None:
    """On the curve of SS the multiplier comes to 1 where fold and SS meet: a root in b over runs in k."""
    bs, shares = np.array([0.936, 0.938, 0.94, 0.942, 0.943, 0.944]), (1 + E) ** 2
    ks, multipliers = [], []
    for b in bs:
        half = 4 * FF / shares - b
        fold = 8 * FF**2 / (speed_squared(half, b) + 8 * FF * half)
        k = 1.00002 * fold  # a little above the fold, on its stable side
        x = half - ((half**2) - (8 * FF**2 / k - shares * (1 - b * b)) / shares) ** 0.5
        orbit = cf.find_orbit("impact-friction", {"k": k, "b": b}, state=[x, 0.0], time=-1.5)
        events = cf.continue_orbit(orbit, "k", (0.9 * fold, 1.5 * fold)).bifurcations
        (event,) = [e for e in events if e.kind.value == "SS" and e.orbit.multipliers[0].real < 1]
        ks.append(event.params["k"])
        multipliers.append(event.orbit.multipliers[0].real)
        assert multipliers[-1] == pytest.approx(shares * (b - FF / ks[-1]) / (4 * FF), abs=1e-9)
    past = np.array(multipliers) - 1.0  # no such orbit exists beyond: the root by extrapolation
    b, k = (float(np.polyfit(past, values, len(bs) - 1)[-1]) for values in (bs, np.array(ks)))
    s = 4 * FF / shares
    exact = 16 * FF**2 / (shares * (1 - s * s))
    assert k == pytest.approx(exact, abs=1e-6) and b == pytest.approx(s + FF / exact, abs=1e-8)


def test_impact_with_friction_signature() -> None:
    branch = diagram("impact-friction").branches[0]
    assert str(branch[0].signature).split(" -> ")[:2] == ["stick", "impact@wall"]
    assert [mode for mode, _ in branch[0].itinerary] == ["stick", "slide+", "slide-"]


def _half_turns(A: float, y: Any, count: int) -> np.ndarray:
    """Return state and tangent map after half periods of the bang-bang force, each mirrored."""

    def f(_: float, y: np.ndarray) -> list[float]:
        tangent = y[2:].reshape(2, 2)
        grown = np.array([tangent[1], -0.2 * tangent[1] - (1 + 3 * y[0] ** 2) * tangent[0]])
        return [y[1], A - 0.2 * y[1] - y[0] - y[0] ** 3, *grown.ravel()]

    there = np.array([*y, 1, 0, 0, 1])
    for _ in range(count):
        there = -integrated(f, there, (0.0, pi))
    return there


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind, near, halves",
    [
        *[("SN", near, 1) for near in (4.357, 9.408, 20.944, 48.633)],
        *[("BP", near, 1) for near in (2.880, 5.691, 20.887, 40.178, 43.544, 46.706, 69.852)],
        *[("SN", near, 2) for near in (21.868, 24.742)],
        *[("PD", near, 2) for near in (26.660, 41.691, 73.128)],
        ("PD", 27.518, 4),
    ],
)
def test_bang_bang_by_another_integrator(kind: str, near: float, halves: int) -> None:
    """An orbit folds where the map of its turn has the multiplier 1; it breaks or doubles at -1."""
    at = value("bang-bang", kind, near)
    events = diagram("bang-bang").bifurcations
    orbit = next(e.orbit for e in events if e.kind.value == kind and e.params["A"] == at)
    assert halves == (1 if orbit.symmetric else 2 * orbit.periods) and abs(at - near) < 6e-4
    critical = 1.0 if kind == "SN" else -1.0

    def singular(u: Any) -> list[float]:
        end = _half_turns(u[2], u[:2], halves)
        tangent = end[2:].reshape(2, 2)
        return [*(end[:2] - u[:2]), np.linalg.det(tangent - critical * np.eye(2))]

    # as far as rounding of the integrator lets it: how far that is, the residual says
    found = root(singular, [*orbit.state(0.0), at * (1 + 1e-7)], options={"xtol": 1e-13})
    assert np.max(np.abs(found.fun)) < 1e-10
    assert at == pytest.approx(found.x[2], abs=2e-9)


def test_bang_bang_is_found_from_one_start() -> None:
    """Four pairs of asymmetric branches and both cascades hang together with the orbit at A = 1."""
    found = diagram("bang-bang")
    assert found.connected and not found.loose_ends and found.complete
    own = [b for b in found.branches if not b.mirrored]
    assert sorted(b.system.periods for b in own) == [1, 1, 1, 1, 1, 2, 2, 4, 4, 8, 8]
    upper = next(b for b in own if 40.0 < b.values.min() < 41.0)
    assert bool(np.all(upper.stable[1:-1])) and upper.values.max() < 46.8
    first = [b.params["A"] for b in found.of_kind("PD")][:4]
    gaps = np.diff(first)
    assert gaps[:-1] / gaps[1:] == pytest.approx([3.92, 4.31], abs=5e-3)


def test_events_that_branches_share_are_listed_once() -> None:
    """The grazing of the orbit of period 2 is met by four branches, one of which stops there."""
    for name in ("popp", "impact-friction", "impact", "belt", "dead-band", "bang-bang"):
        found = diagram(name)
        events = [b for b in found.bifurcations if b.kind is not cf.Kind.T]
        values = np.array([b.params[found.parameter] for b in events])
        assert np.all(np.diff(values) > 1e-7), name
    (node,) = [
        n for n in diagram("popp").nodes if abs(n.bifurcation.params["omega"] - 1.66769) < 1e-5
    ]
    names = {diagram("popp").branches[i].name for i in node.branches}
    assert node.bifurcation.kind is cf.Kind.GS and names == {
        "0a, 4seg",
        "1a, 5seg",
        "1a, 9seg",
        "1a, 17seg",
    }
    for branch in diagram("popp").branches:
        for end in branch.ends:
            assert end.bifurcation is None or end.reason.name == end.bifurcation.kind.value
