"""Proofs against closed forms, brute force in 60 digits, and differences."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from flint import arb, arb_mat, ctx
from mpmath import mp, mpf

import contfric as cf
from contfric.certify.enclosures.krawczyk import Equations, enclosed, krawczyk
from contfric.certify.equations.chain import Chain, block_exponential, segments_of
from contfric.certify.equations.extended import (
    EventCondition,
    at_joint,
    touched_within,
    with_multiplier,
    with_pair,
)
from contfric.certify.events import _resonates
from contfric.certify.orbit import certify_orbit
from contfric.certify.tubes.circle import no_pair
from contfric.certify.tubes.splitting import along
from contfric.certify.verdict import Verdict
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector
from contfric.orbit.orbit import Orbit
from tests.certificate_oracle import Truth, ball

SCENE = {"Omega": 0.5, "S": 0.32, "S0": 0.4}


def exact(x: arb) -> tuple[mpf, mpf]:
    """Return centre and radius of a ball."""
    text = x.str(50, more=True).strip("[]")
    return ball(text if "+/-" in text else f"{text} +/- 0")


@pytest.mark.parametrize(("omega", "s"), [(0.8, 0.2), (0.6, 0.05), (1.3, 0.1), (0.35, 0.01)])
def test_den_hartog(omega: float, s: float) -> None:
    """His symmetric orbit without sticks: x_max, and the determinant of the map of half a period."""
    orbit = cf.solve_orbit("coulomb", "0s", {"Omega": omega, "S": s, "S0": s})
    certificate = orbit.certify()
    assert certificate.exists.proved
    assert certificate.unique.proved
    assert certificate.admissible.proved
    with mp.workdps(60):
        w, friction = mpf(omega), mpf(s)
        u = mp.tan(mp.pi / (2 * w)) / w
        x_max = mp.sqrt(1 / (1 - w**2) ** 2 - friction**2 * u**2)
        det = (w**2 * x_max - friction) / (w**2 * x_max + friction)
        centre, radius = exact(certificate.enclosure[1])
        assert abs(abs(centre) - x_max) <= radius + mpf(10) ** -45
        assert radius < mpf(10) ** -30
        with ctx.workprec(200):
            product = (certificate.multipliers[0] * certificate.multipliers[1]).real
        centre, radius = exact(product)
        assert abs(centre - det) <= radius + mpf(10) ** -45


@pytest.mark.parametrize(
    "params",
    [
        SCENE,
        {"Omega": 1.0, "S": 0.5, "S0": 0.6, "zeta": 0.1},  # resonance
        {"Omega": 1 / 3, "S": 0.2, "S0": 0.3, "h": 0.1, "zeta": 0.02},  # and of the third harmonic
        {"Omega": 0.7, "S": 0.3, "S0": 0.4, "zeta": 1.0},  # critical damping
        {"Omega": 0.7, "S": 0.3, "S0": 0.3, "zeta": 2.5},
    ],
)
def test_enclosures_hold_the_orbit_of_60_digits(params: dict[str, float]) -> None:
    orbit = cf.find_orbit("coulomb", params)
    certificate = orbit.certify()
    assert certificate.proved
    data = {
        "params": orbit.params,
        "periods": orbit.periods,
        "half": orbit.system.half,
        "segments": orbit.system.itinerary,
    }
    with mp.workdps(60):
        truth = Truth(data)
        z = truth.newton([mpf(c) for joint in orbit.joints for c in joint[:2]])
        for i in range(len(orbit.joints)):
            for value, x in zip(z[2 * i : 2 * i + 2], certificate.enclosure[3 * i :], strict=False):
                centre, radius = exact(x)
                assert abs(value - centre) <= radius + mpf(10) ** -40
        for mu in truth.multipliers(z):
            assert any(
                abs(mu - mp.mpc(exact(disc.real)[0], exact(disc.imag)[0])) < mpf(10) ** -15
                for disc in certificate.multipliers
            )


# --------------------------------------------------------------------------------- events


@cache
def diagram(parameter: str, low: float, high: float) -> tuple[Bifurcation, ...]:
    return cf.explore(cf.find_orbit("coulomb", SCENE), parameter, (low, high)).bifurcations


def truth_at(event: Bifurcation, parameter: str, shift: str = "0") -> Truth:
    """Return the scene of an event in 60 digits, at its proved parameter."""
    orbit = event.orbit.as_half() if event.kind is Kind.BP else event.orbit.as_whole()
    truth = Truth(
        {
            "params": event.params,
            "periods": orbit.periods,
            "half": orbit.system.half,
            "segments": orbit.system.itinerary,
        }
    )
    value = event.certify(parameter).value
    assert value is not None
    name = {"Omega": "omega", "S": "s", "S0": "s0"}[parameter]
    setattr(truth, name, exact(value)[0] + mpf(shift))
    truth.turn = orbit.periods * mp.pi * (1 if orbit.system.half else 2) / truth.omega
    return truth


def start_of(orbit: Orbit) -> list[mpf]:
    return [mpf(c) for joint in orbit.joints for c in joint[:2]]


def test_every_event_of_a_diagram_is_proved() -> None:
    kinds = set()
    for scene in (("Omega", 0.4, 0.6), ("S", 0.06, 0.39)):
        for event in diagram(*scene):
            if event.orbit.system.holds and not event.tests:
                continue
            certificate = event.certify(scene[0])
            if event.orbit.system.holds and not certificate.proved:
                continue
            assert certificate.proved, certificate
            assert certificate.radius < 1e-30
            assert certificate.error < 1e-13
            kinds.add(event.kind)
    assert {Kind.SN, Kind.BP, Kind.PD, Kind.CS, Kind.SS, Kind.T} <= kinds


@pytest.mark.parametrize(
    ("name", "free", "span", "params", "expected"),
    [
        ("2a-14seg", "S", (0.005, 0.0665), {"S": 0.06}, {"held", "exit", "joint"}),
        ("", "h", (-0.3, 0.3), {"S": 0.3}, {"interior", "lasting"}),
    ],
)
def test_events_at_which_holds_end_are_proved(
    name: str, free: str, span: tuple[float, float], params: dict[str, float], expected: set[str]
) -> None:
    """Released on a limit, left without acceleration, split, without length, or pinned elsewhere."""
    params = {"Omega": 0.5, "S0": 0.4, **params}
    orbit = cf.solve_orbit("coulomb", name, params) if name else cf.find_orbit("coulomb", params)
    margins = set()
    for event in cf.explore(orbit, free, span).bifurcations:
        certificate = event.certify(free)
        if not certificate.proved:  # at h = -1/27 the load stands still at its stop
            assert "the load moves outward" in certificate.why, certificate
            continue
        assert certificate.radius < 1e-30
        assert certificate.error < 1e-13
        ends = {hold.segment for hold in event.orbit.system.holds}
        ends |= {hold.segment - 1 for hold in event.orbit.system.holds if hold.after_rest}
        margins |= {test.margin.value for test in event.tests if test.segment in ends}
    assert margins >= expected, margins


@pytest.mark.parametrize(
    ("scene", "kind"), [(("Omega", 0.4, 0.6), Kind.BP), (("S", 0.06, 0.39), Kind.PD)]
)
def test_a_multiplier_is_minus_one_in_60_digits(scene: Any, kind: Kind) -> None:
    event = next(e for e in diagram(*scene) if e.kind is kind)
    with mp.workdps(60):
        truth = truth_at(event, scene[0])
        orbit = event.orbit.as_half() if kind is Kind.BP else event.orbit.as_whole()
        mu = truth.multipliers(truth.newton(start_of(orbit)))
        # differences of 1e-25 know a multiplier to 1e-22
        assert min(abs(m + 1) for m in mu) < mpf(10) ** -20


def test_a_stop_is_on_the_limit_in_60_digits() -> None:
    event = next(
        e for e in diagram("Omega", 0.4, 0.6) if e.kind is Kind.SS and not e.orbit.system.holds
    )
    with mp.workdps(60):
        truth = truth_at(event, "Omega")
        z = truth.newton(start_of(event.orbit.as_whole()))
        loads = [abs(x - truth.force(t)) for t, x in zip(z[::2], z[1::2], strict=True)]
        assert min(abs(u - truth.s0) for u in loads[1:]) < mpf(10) ** -30


@pytest.mark.slow
def test_beside_a_fold_the_multiplier_leaves_one_like_a_square_root() -> None:
    event = next(e for e in diagram("Omega", 0.4, 0.6) if e.kind is Kind.SN)
    start, gaps = start_of(event.orbit.as_whole()), []
    with mp.workdps(60):
        for shift in ("1e-12", "1e-16"):
            truth = truth_at(event, "Omega", f"-{shift}")
            mu = truth.multipliers(truth.newton(start, steps=40))
            gaps.append(min(abs(m - 1) for m in mu))
        # were the fold only 1e-17 elsewhere, the ratio would be off by half of 1e-17 / 1e-16
        assert abs(gaps[0] / gaps[1] - 100) < 1e-3


# ---------------------------------------------------------------------------- derivatives


def worst_difference(equations: Equations, x: Vector) -> float:
    """Return the largest difference of a Jacobian to that by differences."""
    step = arb(2) ** -60
    _, jacobian = equations(x)
    worst = 0.0
    for k in range(len(x)):
        beside = [[c + (sign * step if j == k else 0) for j, c in enumerate(x)] for sign in (1, -1)]
        (above, _), (below, _) = (equations(y) for y in beside)
        for r, (a, b) in enumerate(zip(above, below, strict=True)):
            worst = max(worst, abs(float((a - b) / (2 * step) - jacobian[r, k])))
    return worst


def builder(orbit: Orbit, free: str) -> Callable[[arb], BallModel]:
    return lambda value: ball_model(orbit.model, orbit.params, free, value)


@pytest.mark.parametrize("free", ["Omega", "S", "S0", "h", "zeta"])
@pytest.mark.parametrize("model", ["coulomb", "coulomb-yaml"])
def test_derivatives_of_extended_systems(model: str, free: str) -> None:
    orbit = cf.find_orbit(model, {**SCENE, "h": 0.1, "zeta": 0.07})
    segments, build = segments_of(orbit.system), builder(orbit, free)
    rng = np.random.default_rng(1)
    with ctx.workprec(200):
        z = [arb(float(c)) for c in orbit.joints.ravel()]
        value = arb(orbit.params[free])
        phi = [arb(float(c)) for c in rng.normal(size=len(z))]
        last = segments.count - 1
        cases = [
            (at_joint(segments, build, EventCondition(0, "F+")), [*z, value]),
            (at_joint(segments, build, EventCondition(last, "F+", rate=True)), [*z, value]),
            (
                touched_within(segments, build, EventCondition(0, "F+", within=True)),
                [*z, arb(0.7), value],
            ),
            *(
                (with_multiplier(segments, build, sigma, phi), [*z, *phi, value])
                for sigma in (1, -1)
            ),
            (with_pair(segments, build, phi), [*z, *phi, *phi[::-1], arb(0.3), arb(0.8), value]),
        ]
        for equations, x in cases:
            assert worst_difference(equations, x) < 1e-28


def test_derivatives_behind_a_reset() -> None:
    orbit = cf.find_orbit("impact")
    segments = segments_of(orbit.system)
    with ctx.workprec(200):
        z = [arb(float(c)) for c in orbit.joints.ravel()]
        for free in orbit.params:
            build, value = builder(orbit, free), arb(orbit.params[free])
            phi = [arb(float(c)) for c in np.random.default_rng(2).normal(size=len(z))]
            for equations, x in (
                (at_joint(segments, build, EventCondition(0, segments.exits[0])), [*z, value]),
                (with_multiplier(segments, build, -1, phi), [*z, *phi, value]),
                (
                    with_pair(segments, build, phi),
                    [*z, *phi, *phi[::-1], arb(0.3), arb(0.8), value],
                ),
            ):
                assert worst_difference(equations, x) < 1e-28


@pytest.mark.parametrize("model", ["coulomb", "impact"])
def test_higher_derivatives_in_a_direction(model: str) -> None:
    """Residuals at ``u + e v``, closed to the other turn, are polynomials of e up to e^4."""
    orbit = cf.find_orbit(model, SCENE if model == "coulomb" else None)
    segments = segments_of(orbit.system)
    with ctx.workprec(300):
        chain = Chain(segments, ball_model(orbit.model, orbit.params))
        z = [arb(float(c)) for c in orbit.joints.ravel()]
        v = [arb(float(c)) for c in np.random.default_rng(3).normal(size=len(z))]
        m, step = chain.m, arb(2) ** -40

        def residual(e: arb) -> Vector:
            """The chain that does not close: its last joint is that of u - e v."""
            first = [c + e * d for c, d in zip(z, v, strict=True)]
            other = [c - e * d for c, d in zip(z[:m], v[:m], strict=True)]
            joints = [first[i * m : (i + 1) * m] for i in range(segments.count)]
            joints.append(chain.joints([*other, *first[m:]])[-1])
            found: Vector = []
            for i in range(segments.count):
                end = chain.move(i, joints).end
                found += [end[k, 0] - joints[i + 1][1 + k] for k in range(chain.n)]
                at, row, _ = chain.condition(i)
                state = chain.model.extended(joints[at][0], joints[at][1:])
                found.append(sum((row[0, k] * c for k, c in enumerate(state)), arb(0)))
            return found

        values = {k: residual(k * step) for k in (-2, -1, 0, 1, 2)}
        second = [
            (a - 2 * b + c) / step**2
            for a, b, c in zip(values[1], values[0], values[-1], strict=True)
        ]
        third = [
            (a - 2 * b + 2 * c - d) / (2 * step**3)
            for a, b, c, d in zip(values[2], values[1], values[-1], values[-2], strict=True)
        ]
        for order, wanted in ((2, second), (3, third)):
            for one, other in zip(along(chain, z, v, order), wanted, strict=True):
                assert abs(float(one - other)) < 1e-18 * (1 + abs(float(one)))


# --------------------------------------------------------------------------------- tori


def test_a_torus_is_where_impacts_lose_what_negative_damping_gives() -> None:
    """The determinant of the return map is e^2 exp(-2 pi c / w): 1 at c = w log(e) / pi."""
    orbit = cf.find_orbit("impact", {"w": 2.6, "c": 0.05, "e": 0.9, "d": 0.0})
    branch = cf.continue_orbit(orbit, "c", (-0.3, 0.1))
    (event,) = branch.bifurcations
    proof = event.certify()
    assert event.kind is Kind.NS and proof.proved and proof.value is not None
    assert proof.radius < 1e-35
    with ctx.workprec(200):
        assert proof.value.overlaps(arb(2.6) * arb(0.9).log() / arb.pi())
    tube = branch.certify()
    assert tube.complete and tube.events == (event.label,)
    near = [piece for piece in tube.pieces if piece.tori]
    assert near and all(abs(p.values[0] - event.params["c"]) < 1e-4 for p in near)


def test_a_strong_resonance_is_not_proved_to_be_a_torus() -> None:
    assert _resonates(arb(0, 1e-10), arb(1)) and _resonates(arb(-0.5), arb(3).sqrt() / 2)
    assert _resonates(arb(1), arb(0, 1e-9)) and not _resonates(arb(0.6), arb(0.8))


@pytest.mark.parametrize("size", [2, 3, 5])
def test_pairs_on_the_circle(size: int) -> None:
    """Real matrices with a pair of a known modulus, the others real and apart from products of 1."""
    rng = np.random.default_rng(size)
    for modulus, angle in ((1.0, 1.1), (0.99, 1.1), (1.02, 2.0), (1.0, 0.01)):
        block = np.diag([0.3, 0.5, 0.7, 1.5, 0.2][:size])
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        block[:2, :2] = modulus * turn
        basis = rng.normal(size=(size, size))
        with ctx.workprec(80):
            change = arb_mat([[arb(float(x)) for x in row] for row in basis])
            matrix = (
                change * arb_mat([[arb(float(x)) for x in row] for row in block]) * change.inv()
            )
            wide = matrix + arb_mat(size, size, [arb(0, 1e-12)] * size**2)
        assert no_pair(wide) is (modulus != 1.0)


# ------------------------------------------------------------------------------ Krawczyk


def root_of_two(x: Vector) -> tuple[Vector, arb_mat]:
    return [x[0] * x[0] - 2], arb_mat([[2 * x[0]]])


def test_krawczyk_finds_refutes_and_leaves_open() -> None:
    with ctx.workprec(128):
        assert krawczyk(root_of_two, [arb(1.5)], [arb(0.2)]).verdict is Verdict.PROVED
        assert krawczyk(root_of_two, [arb(1.9)], [arb(0.2)]).verdict is Verdict.REFUTED
        assert krawczyk(root_of_two, [arb(0.1)], [arb(4)]).verdict is Verdict.UNDECIDED
        narrow = enclosed(root_of_two, [arb(1.4)], arb(2) ** -100).zero[0]
        assert narrow.contains(arb(2).sqrt())
        assert float(narrow.rad()) < 1e-29


def test_a_double_zero_is_not_proved() -> None:
    def square(x: Vector) -> tuple[Vector, arb_mat]:
        return [x[0] * x[0]], arb_mat([[2 * x[0]]])

    assert enclosed(square, [arb(0.1)], arb(2) ** -100).verdict is Verdict.UNDECIDED


def test_wrong_joints_are_refuted() -> None:
    orbit = cf.find_orbit("coulomb", SCENE)
    joints = orbit.joints.copy()
    joints[1, 1] += 1e-6
    moved = Orbit(orbit.system, joints, orbit.vector, 0.0)
    found = certify_orbit(moved)
    assert found.exists.verdict is Verdict.REFUTED
    assert not found.proved


@pytest.mark.parametrize("count", [2, 3])
def test_flows_by_the_parameter_from_rows_of_states_only(count: int) -> None:
    """They are those of the whole block matrix, also where other rows depend on the parameter."""
    rng, size, states = np.random.default_rng(count), 5, 2
    field, *others = rng.normal(size=(count, size, size))
    field[states:, :states] = 0
    for rows in (states, size):
        terms = [arb_mat(field.tolist())]
        terms += [arb_mat((m * (np.arange(size) < rows)[:, None]).tolist()) for m in others]
        found = block_exponential(terms, arb(1.3), states)
        whole = block_exponential(terms, arb(1.3), size)
        for one, other in zip(found, whole, strict=True):
            for a, b in zip(one.entries(), other.entries(), strict=True):
                assert abs(a - b) < 1e-9
