"""Proofs of random orbits, of all models that move in closed form, and the parts that they are made of."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from flint import arb, arb_mat, ctx

import contfric as cf
from contfric.certify import limit
from contfric.certify.equations.multipliers import stability, turn_multipliers
from contfric.certify.equations.zeros import in_span
from contfric.certify.inequalities.sign import Path, positive, touched
from contfric.certify.orbit import certify_orbit, with_inequalities
from contfric.certify.verdict import Verdict
from contfric.errors import ContfricError
from contfric.orbit.orbit import Orbit

#: Models that are declared by affine equations, and those that are not.
CLOSED = (
    *("buck", "coulomb-yaml", "dead-band", "impact", "integrate-and-fire", "jenkins", "relay"),
    *("relay-sliding", "rocking-block", "thermostat"),
)
OTHERS = {"stribeck": "not linear in v", "lugre": "integrated", "rimless-wheel": "not linear"}


def random_orbit(rng: np.random.Generator) -> Orbit | None:
    limit = rng.uniform(0.02, 0.9)
    params = {
        "Omega": rng.choice([rng.uniform(0.1, 2.0), 1.0, 1 / 3], p=[0.8, 0.1, 0.1]),
        "S": limit * rng.choice([1.0, rng.uniform(0.3, 1.0)]),
        "S0": limit,
        "h": rng.choice([0.0, rng.uniform(-0.5, 0.5)]),
        "zeta": rng.choice([0.0, rng.uniform(0.0, 0.3), 1.0, rng.uniform(1.0, 5.0)]),
    }
    try:
        return cf.find_orbit("coulomb", params, state=rng.normal(size=2), longest=2000)
    except ContfricError:
        return None


@pytest.mark.parametrize("seed", range(3))
def test_random_orbits_are_proved(seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = [orbit for _ in range(12) if (orbit := random_orbit(rng)) is not None]
    assert len(found) > 6
    for orbit in found:
        certificate = orbit.certify()
        assert certificate.proved, (orbit, certificate.why)
        assert certificate.width < 1e-30
        centres = [complex(disc.mid()) for disc in certificate.multipliers]
        for mu in orbit.turn_multipliers:  # the engine's own lie at the discs
            assert min(abs(c - mu) for c in centres) < 1e-7 * (1.0 + abs(mu))


@functools.cache
def diagram() -> cf.Diagram:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    return cf.explore(orbit, "Omega", (0.4, 0.6))


def test_orbits_of_branches_are_proved_stable_or_not_with_holds_or_without() -> None:
    seen = set()
    for branch in diagram().branches:
        for k in range(2, len(branch) - 2, 9):
            certificate = branch[k].certify()
            assert certificate.proved or "nearly singular" in certificate.why, certificate
            seen.add((bool(branch.system.holds), branch[k].stable, certificate.proved))
    assert {(False, True, True), (False, False, True), (True, False, True)} <= seen


def test_an_orbit_beyond_an_event_is_refuted_with_the_place() -> None:
    ends = [branch for branch in diagram().branches if branch.name == "2s"]
    certificate = ends[0][0].certify()  # at the CS: its stick has no time
    assert certificate.admissible.verdict is Verdict.REFUTED
    assert "stick" in certificate.why


@pytest.mark.parametrize("name", CLOSED)
def test_declared_models_are_proved(name: str) -> None:
    certificate = cf.find_orbit(name, longest=3000).certify()
    assert certificate.proved, certificate.why


def test_the_declared_coulomb_has_the_same_proof() -> None:
    params = {"Omega": 0.5, "S": 0.32, "S0": 0.4, "h": 0.1, "zeta": 0.05}
    own, declared = (cf.find_orbit(name, params).certify() for name in ("coulomb", "coulomb-yaml"))
    assert own.proved
    assert declared.proved
    matching = [abs(a) for a in declared.multipliers]
    assert all(any(abs(abs(mu)).overlaps(size) for size in matching) for mu in own.multipliers)


@pytest.mark.parametrize("name", OTHERS)
def test_other_models_are_named(name: str) -> None:
    orbit = cf.find_orbit(name)
    with pytest.raises(cf.ParameterError, match=f"model '{name}': no proof is offered.*"):
        certify_orbit(orbit)


def test_a_continuum_is_undecided() -> None:
    orbit = cf.find_orbit(
        "coulomb", {"Omega": 0.5, "S": 0.1614435056325586, "S0": 0.1614435056325586}
    )
    found = orbit.certify()
    assert not found.proved
    assert Verdict.UNDECIDED in {found.exists.verdict, found.unique.verdict, found.stable.verdict}


@pytest.mark.parametrize("seed", range(4))
def test_orbits_with_contacts_that_never_slip_are_proved_among_those_that_keep_the_same(
    seed: int,
) -> None:
    """Multipliers are those of the engine, which has taken the trivial ones out in another way."""
    rng = np.random.default_rng(seed)
    limits, stuck = (("0.05", "5.0"), ("5.0", "5.0"))[seed % 2], 1 + seed % 2
    contacts = {
        name: {
            "kind": "jenkins",
            "displacement": f"q{k + 1}",
            "stiffness": f"{rng.uniform(0.5, 2)!r}",
            "limit": limit,
        }
        for k, (name, limit) in enumerate(zip("ab", limits, strict=True))
    }
    model = cf.Mechanism(
        np.diag(rng.uniform(0.7, 1.3, 2)),
        0.2 * np.eye(2),
        np.array([[2.0, -1.0], [-1.0, 2.0]]),
        contacts=contacts,
        force={"q1": "F*cos(W*t)"},
        parameters={"W": 0.8, "F": 0.3},
        period="2*pi/W",
        name=f"never-slips-{seed}",
    )
    orbit = cf.find_orbit(model)
    found = orbit.certify()
    assert found.proved, found.why
    assert found.kept == stuck
    assert len(found.multipliers) == len(orbit.joints[0]) - 1 - stuck
    power = 2 if found.orbit.system.half else 1
    own = sorted(orbit.multipliers, key=abs)[stuck:]
    for mu in found.multipliers:
        there = complex(mu.real, mu.imag) ** power
        assert min(abs(there - other) for other in own) < 1e-7
    joints = orbit.joints.copy()
    joints[0, 2] += 1e-3
    assert not replace(orbit, joints=joints).certify().proved


@pytest.mark.parametrize("seed", range(3))
def test_structures_whose_contacts_share_loads_are_proved(seed: int) -> None:
    """Their modes are made when a solution first visits them, and so are the limits of shared loads."""
    rng = np.random.default_rng(seed)
    limits = {"low": ("v1", *rng.uniform((0.1, 0.35), (0.3, 0.6)))}
    limits["high"] = ("v2 - v1", *rng.uniform((0.05, 0.2), (0.2, 0.3)))
    contacts = {
        name: {"kind": "friction", "velocity": velocity, "kinetic": str(s), "static": str(s0)}
        for name, (velocity, s, s0) in limits.items()
    }
    model = cf.Mechanism(
        np.diag(rng.uniform(0.7, 1.5, 2)),
        rng.uniform(0.3, 0.6) * np.eye(2),
        np.array([[2.0, -1.0], [-1.0, 2.0]]),
        contacts=contacts,
        force={"q1": "cos(W*t)", "q2": "0.3*sin(W*t) + 0.1"},
        parameters={"W": float(rng.uniform(0.4, 1.2))},
        period="2*pi/W",
        name=f"shared-{seed}",
    )
    assert model.composed
    orbit = cf.find_orbit(model)
    assert len(set(orbit.system.layout.modes)) > 1
    assert orbit.certify().proved, orbit.certify().why
    joints = orbit.joints.copy()
    joints[0, 1] += 1e-3
    assert not replace(orbit, joints=joints).certify().proved


# ---------------------------------------------------------------------------------- signs


def oscillation(level: str, *, start: float = 0.0, duration: float = 6.5) -> tuple[Path, arb_mat]:
    """Return ``cos t - level`` along a harmonic motion: w = (1, cos, sin)."""
    field = arb_mat([[0, 0, 0], [0, 0, -1], [0, 1, 0]])
    sine, cosine = arb(start).sin_cos()
    row = arb_mat([[-arb(level), 1, 0]])
    return Path(field, arb_mat([[1], [cosine], [sine]]), arb(duration)), row


@pytest.mark.parametrize("gap", ["1e-3", "1e-12", "1e-25"])
def test_a_graze_is_told_from_a_miss(gap: str) -> None:
    """``cos t + 1 + gap`` nearly touches zero at pi, or just does not."""
    with ctx.workprec(256):
        path, row = oscillation(f"-1.{'0' * (int(gap[3:]) - 1)}1")
        assert positive(path, row, 0, False).proved
        path, row = oscillation(f"-0.{'9' * int(gap[3:])}")
        assert positive(path, row, 0, False).verdict is Verdict.REFUTED


@pytest.mark.parametrize(("duration", "wanted"), [(1e-9, True), (3.0, True), (3.2, False)])
def test_what_is_not_negative_at_the_start_is_positive_where_it_rises(
    duration: float, wanted: bool
) -> None:
    """``sin t`` from about 0 on: that it is not below 0 there must be known."""
    with ctx.workprec(128):
        path, row = oscillation("0", start=-math.pi / 2, duration=duration)
        about = Path(path.field, path.start + arb_mat([[0], [arb(0, 1e-6)], [0]]), path.duration)
        assert not positive(about, row, 0, 0).proved
        assert positive(about, row, 0, 0, rises=True).proved is wanted
        assert not positive(about, -row, 0, 0, rises=True).proved


def test_an_exact_touch_is_undecided_unless_it_is_known() -> None:
    with ctx.workprec(256):
        path, row = oscillation("-1")
        assert positive(path, row, 0, False).verdict is Verdict.UNDECIDED
        assert touched(path, row, 0, arb.pi()).proved
        assert touched(path, -row, 0, arb.pi()).verdict is not Verdict.PROVED


@pytest.mark.parametrize(("first", "duration", "wanted"), [(1, 3.0, True), (1, 3.2, False)])
def test_zeros_at_the_start_are_read_off_the_derivatives(
    first: int, duration: float, wanted: bool
) -> None:
    """``sin t`` is positive up to pi, though it vanishes at its start."""
    field = arb_mat([[0, 0, 0], [0, 0, -1], [0, 1, 0]])
    path = Path(field, arb_mat([[1], [1], [0]]), arb(duration))
    row = arb_mat([[0, 0, 1]])
    with ctx.workprec(128):
        assert positive(path, row, first, False).proved is wanted
        assert not positive(path, row, 0, False).proved  # the start alone decides nothing


def test_random_sums_of_harmonics_against_a_grid() -> None:
    rng = np.random.default_rng(3)
    decided = 0
    for _ in range(60):
        w = rng.uniform(0.3, 3.0, size=2)
        a = rng.normal(size=5)
        field = arb_mat(5, 5)
        for k in range(2):
            field[1 + 2 * k, 2 + 2 * k], field[2 + 2 * k, 1 + 2 * k] = -w[k], w[k]
        start = arb_mat([[1], [1], [0], [1], [0]])
        duration = float(rng.uniform(0.1, 12.0))
        t = np.linspace(0.0, duration, 4001)
        values = a[0] + sum(
            a[1 + 2 * k] * np.cos(w[k] * t) + a[2 + 2 * k] * np.sin(w[k] * t) for k in range(2)
        )
        found = positive(
            Path(field, start, arb(duration)), arb_mat([list(map(float, a))]), 0, False
        )
        if abs(values.min()) > 1e-3:
            assert found.proved is bool(values.min() > 0.0)
            decided += 1
    assert decided > 50


def test_fast_modes_are_halved_for_their_frequency_not_for_its_square() -> None:
    """Displacements and velocities, x'' = -w^2 x: with equal weights |M| d is w^2 d, too many pieces."""
    rng = np.random.default_rng(4)
    for w in rng.uniform(100.0, 400.0, size=6).tolist():
        field = arb_mat([[0, 1, 0], [-w * w, 0, 0], [0, 0, 0]])
        path = Path(field, arb_mat([[1], [0], [1]]), arb(2.0))
        assert path.norm < 1.5 * w
        for offset in (1.01, 0.99):  # cos(w t) + offset
            assert positive(path, arb_mat([[1, 0, offset]]), 0, False).proved is (offset > 1)


def test_states_at_pieces_are_those_of_the_exponential_and_hardly_wider() -> None:
    """Products of flows over halves of a segment, against one exponential each; also of balls."""
    rng = np.random.default_rng(5)
    for width in (0.0, 1e-6):
        field = arb_mat([[arb(float(x), width) for x in row] for row in rng.normal(size=(4, 4))])
        start = arb_mat([[float(x)] for x in rng.normal(size=4)])
        path = Path(field, start, arb(1.5))
        for level, index in ((0, 0), (3, 0), (3, 5), (3, 6), (6, 63), (9, 300)):
            time = path.duration * arb(2 * index + 1) / 2 ** (level + 1)
            direct = ((field * time).exp() * start).entries()
            for ours, other in zip(path.middle(level, index).entries(), direct, strict=True):
                assert ours.overlaps(other)
                assert ours.rad() < 4 * other.rad() + 1e-10


def test_printed_orbits_of_a_branch_are_proved_as_they_are_alone() -> None:
    """That they obey the law is read off the boxes that hold them, or looked at; never only said."""
    branch = cf.continue_orbit(cf.find_orbit("coulomb", {"Omega": 0.5}), "Omega", (0.495, 0.505))
    found = branch.certify()
    assert found.points_proved == len(branch)
    for orbit, point in zip(branch, found.points, strict=True):
        alone = orbit.certify()
        assert (point.exists, point.unique, point.stable) == (
            alone.exists,
            alone.unique,
            alone.stable,
        )
        assert point.admissible == alone.admissible
        assert all(a.overlaps(b) for a, b in zip(point.enclosure, alone.enclosure, strict=True))


def test_inequalities_that_were_not_looked_at_are_not_proved() -> None:
    """Where no box holds an orbit, they are looked at after its branch."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5})
    found = certify_orbit(orbit, inside=False)
    assert not found.proved and found.admissible.verdict is Verdict.UNDECIDED
    assert with_inequalities(found).admissible.proved


# ---------------------------------------------------------------------------- small parts


def test_a_nilpotent_map_has_discs_about_zero() -> None:
    with ctx.workprec(128):
        matrix = arb_mat([[arb(0, 1e-30), 1], [arb(0, 1e-30), arb(0, 1e-30)]])
        discs = turn_multipliers(matrix, 3)
        assert len(discs) == 3
        assert stability(discs).proved


@pytest.mark.parametrize(
    ("size", "verdict"), [("0.999", "proved"), ("1", "undecided"), ("1.001", "refuted")]
)
def test_stability_is_decided_by_discs(size: str, verdict: str) -> None:
    with ctx.workprec(128):
        discs = turn_multipliers(arb_mat([[arb(size) + arb(0, 1e-20)]]), 2)
    assert stability(discs).verdict == verdict


@pytest.mark.parametrize("seed", range(5))
def test_in_span_of_a_surface_and_its_rate(seed: int) -> None:
    """Whatever is off by multiples of x and x', in whichever order they are known."""
    a, b, c = (arb(float(x)) for x in np.random.default_rng(seed).normal(size=3))
    surface, rate = [arb(1), arb(0), arb(0), arb(0)], [a, arb(1), arb(0), b]
    for rows in ([surface, rate], [rate, surface]):
        assert in_span([c, arb(-2), arb(0), -2 * b], rows)
        assert not in_span([c, arb(-2), arb(0), -2 * b + arb(2) ** -40], rows)


def test_in_span_is_exact() -> None:
    one, two = [arb(1), arb(2), arb(0)], [arb(0), arb(1), arb(1)]
    assert in_span([arb(2), arb(5), arb(1)], [one, two])
    assert not in_span([arb(2), arb(5), arb(1) + arb(2) ** -40], [one, two])
    assert not in_span([arb(2), arb(5), arb(1, 1e-30)], [one, two])  # a ball is not its centre


@pytest.mark.parametrize("name", ["1a", "2s"])
def test_an_orbit_ends_at_the_time_limit(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever it comes: the clock is not read again, what is shown by then stands, and the rest is said."""
    orbit = cf.solve_orbit("coulomb", name, {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    reads: list[int] = []

    def clock() -> float:
        reads.append(1)
        return float(len(reads))

    monkeypatch.setattr(limit, "time", SimpleNamespace(time=clock))
    whole = certify_orbit(orbit, until=1e9)
    assert whole.proved and not whole.ended
    needed, existing = len(reads), 0
    for last in range(needed):
        reads.clear()
        found = certify_orbit(orbit, until=last)
        assert found.ended and not found.proved and limit.LATE in found.why
        assert len(reads) == last + 1
        existing += found.exists.proved
        for part in ("exists", "unique", "admissible", "stable"):
            ours = getattr(found, part)
            assert ours.why == limit.LATE or ours == getattr(whole, part) or not found.exists.proved
    assert 0 < existing < needed
    reads.clear()
    assert certify_orbit(orbit, until=needed).proved


def test_a_limit_in_seconds_ends_the_proof_of_an_orbit() -> None:
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    found = orbit.certify(time_limit=1e-9)
    assert (
        found.ended and "time limit" in repr(found) and found.why.startswith("existence undecided")
    )
    assert orbit.certify(time_limit=1e9).proved
    for wrong in (0, -1.0, float("nan")):
        with pytest.raises(cf.ParameterError, match="time_limit"):
            orbit.certify(time_limit=wrong)
