"""Proofs for structures: contacts that never slip, two contacts that change at once, symmetry by formulas."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import mpmath
import numpy as np
import pytest
from flint import arb, arb_mat

import contfric as cf
from contfric.certify.equations.chain import segments_of
from contfric.certify.equations.closing import is_symmetry
from contfric.certify.inequalities import sign
from contfric.certify.verdict import Verdict
from contfric.models.balls.build import ball_model


@pytest.mark.parametrize("seed", range(10))
def test_a_violation_is_one_of_all_solutions_only_while_all_of_them_last(seed: int) -> None:
    """``q = a - tau`` is negative after a: of solutions that may have ended before nothing is refuted."""
    rng = np.random.default_rng(seed)
    a = rng.uniform(0.5, 2)
    field, start, row = arb_mat([[0, -1], [0, 0]]), arb_mat([[a], [1]]), arb_mat([[1, 0]])
    later, earlier = a * (1 + rng.uniform(0.01, 1)), a * rng.uniform(0.1, 0.9)

    def verdict(longest: float, shortest: float) -> Verdict:
        return sign.positive(
            sign.Path(field, start, arb(longest), arb(shortest)), row, 0, 0
        ).verdict

    assert verdict(later, earlier) is Verdict.UNDECIDED
    assert verdict(2 * later, later) is Verdict.REFUTED
    assert verdict(earlier, earlier / 2) is Verdict.PROVED


def test_an_autonomous_branch_with_few_points_is_proved_between_them() -> None:
    """Boxes between far points hold segments of very different durations, which say nothing by themselves."""
    friction = {"kind": "friction", "velocity": "v1 - V", "kinetic": "0.6", "static": "1.0"}
    belt = cf.Mechanism(
        np.eye(1),
        0.02 * np.eye(1),
        np.eye(1),
        contacts={"belt": friction},
        parameters={"V": 0.3},
        name="belt-of-few-points",
    )
    branch = cf.continue_orbit(cf.find_orbit(belt), "V", (0.2, 0.5))
    proof = branch.certify()
    assert proof.proved and proof.covered > 0.9999, proof.gaps


# --------------------------------------------------------------- contacts that never slip


@functools.cache
def stuck(seed: int) -> tuple[cf.Branch, dict[str, float]]:
    """A mass on a spring and a Jenkins element whose slider rests somewhere, up to where it slips."""
    rng = np.random.default_rng(seed)
    p = {
        "k": rng.uniform(0.7, 1.3),
        "kd": rng.uniform(0.5, 1.5),
        "c": rng.uniform(0.05, 0.2),
        "F": 0.3,
        "P": rng.uniform(0.3, 0.5),
    }
    pad = {"kind": "jenkins", "displacement": "q1", "stiffness": "kd", "limit": "P"}
    model = cf.Mechanism(
        np.eye(1),
        [["c"]],
        [["k"]],
        contacts={"pad": pad},
        force={"q1": "F*cos(W*t)"},
        parameters={"W": 0.5, **p},
        period="2*pi/W",
        name=f"stuck-{seed}",
    )
    orbit = cf.find_orbit(model, at={"pad": float(rng.uniform(-0.1, 0.1))})
    return cf.continue_orbit(orbit, "W", (0.45, 3.0)), p


@pytest.mark.parametrize("seed", range(3))
def test_where_a_slider_begins_to_slip_is_proved_and_is_where_the_linear_response_says(
    seed: int,
) -> None:
    branch, p = stuck(seed)
    (event,) = branch.bifurcations
    proof = event.certify()
    assert proof.proved, proof.why
    (kept,) = proof.kept
    with mpmath.workdps(50):
        k, kd, c, f, limit = (mpmath.mpf(p[name]) for name in ("k", "kd", "c", "F", "P"))
        rest = mpmath.mpf(float(kept.value.mid()))

        def slack(w: mpmath.mpf) -> mpmath.mpf:
            amplitude = f / mpmath.sqrt((k + kd - w**2) ** 2 + (c * w) ** 2)
            return amplitude + k * abs(rest) / (k + kd) - limit / kd

        exact = mpmath.findroot(slack, mpmath.mpf(event.params["W"]))
        assert abs(exact - mpmath.mpf(proof.value.mid().str(45, radius=False))) < 1e-38


def test_the_branch_of_a_contact_that_never_slips_is_proved_up_to_its_event() -> None:
    branch, _ = stuck(0)
    near = float(branch.values[-1])
    low = near - 0.006 if branch.ends[1].reason.name != "RANGE" else near
    piece = cf.continue_orbit(branch[len(branch) - 3], "W", (low, 3.0))
    proof = piece.certify()
    assert proof.proved, proof.gaps
    assert proof.points_proved >= len(piece) - 1
    assert proof.events


@pytest.mark.parametrize("seed", range(3))
def test_a_friction_contact_that_never_slips_keeps_its_position(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = cf.Mechanism(
        np.diag(rng.uniform(0.7, 1.3, 3)),
        0.15 * np.eye(3),
        [["2.1", "-1", "0"], ["-1", "2", "-1"], ["0", "-1", "2"]],
        contacts={
            "firm": {"kind": "friction", "velocity": "v1", "kinetic": "4", "static": "5"},
            "loose": {"kind": "friction", "velocity": "v3", "kinetic": "0.1", "static": "0.12"},
        },
        force={"q2": "F*cos(W*t)"},
        parameters={"W": float(rng.uniform(0.6, 1.2)), "F": 1.0},
        period="2*pi/W",
        name=f"firm-{seed}",
    )
    orbit = cf.find_orbit(model, at={"firm": float(rng.uniform(-0.3, 0.3))})
    found = orbit.certify()
    assert found.proved, found.why
    assert found.kept == 2  # the position, and a velocity of exactly 0
    joints = orbit.joints.copy()
    joints[:, 1] += 1e-6  # at another position the other joints are others
    assert not replace(orbit, joints=joints).certify().proved


# --------------------------------------------------------------- two contacts


def two_contacts(seed: int) -> cf.Mechanism:
    """Two masses with friction and a second contact; coefficients are no binary numbers."""
    rng = np.random.default_rng(seed)
    second = (
        {"kind": "friction", "velocity": "v1", "kinetic": "R"},
        {"kind": "spring", "gap": "g - q1", "stiffness": "3"},
        {"kind": "jenkins", "displacement": "q1", "stiffness": "1.1", "limit": "R"},
    )[seed % 3]
    brake = {"kind": "friction", "velocity": "v2", "kinetic": "S", "static": "1.25*S"}
    return cf.Mechanism(
        np.diag([1.0, float(np.round(rng.uniform(0.8, 2), 2))]),
        [["2*0.07", "-0.07"], ["-0.07", "2*0.07"]],
        [["2.1", "-1.1"], ["-1.1", "2.1"]],
        contacts={"brake": brake, "second": second},
        force={"q1": "F*cos(w*t)"},
        parameters={"w": 0.7, "F": 1.0, "S": 0.2, "R": 0.15, "g": 0.4},
        period="2*pi/w",
        name=f"two-contacts-{seed}",
    )


@pytest.mark.parametrize("seed", [0, 2, 3, 5])
def test_a_symmetry_is_known_by_the_formulas(seed: int) -> None:
    orbit = cf.find_orbit(two_contacts(seed), longest=500).as_half()
    assert orbit.system.half
    found = orbit.certify()
    assert found.orbit.system.half
    assert found.proved, found.why
    model = ball_model(orbit.model, orbit.params)
    segments = segments_of(orbit.system)
    assert is_symmetry(orbit, segments, model)
    assert model.mirrored is not None
    symmetry = orbit.model.symmetry
    assert symmetry is not None
    modes = tuple((mode, mode) for mode in segments.modes)
    assert not model.mirrored(
        segments.closure, modes, ()
    )  # each its own image: friction turns over


@pytest.mark.parametrize("seed", [2, 3])
def test_two_contacts_that_change_at_once_are_where_their_times_meet(seed: int) -> None:
    """The duration between them, by the engine's orbits on the branch, vanishes at the proved parameter."""
    orbit = cf.find_orbit(two_contacts(seed), longest=500)
    diagram = cf.explore(
        orbit, "w", (0.6, 0.8), max_step=2e-4
    )  # five points tell where the time vanishes
    found = 0
    for branch in diagram.branches:
        for event in branch.bifurcations:
            proof = event.certify("w")
            condition = None if proof.location is None else proof.location.condition
            if condition is None or not condition.before:
                continue
            assert proof.proved, proof.why
            assert proof.value is not None
            near = sorted(branch, key=lambda orbit: abs(orbit.params["w"] - event.params["w"]))[1:6]
            lasts = [float((orbit.ends - orbit.begins)[condition.segment, 0]) for orbit in near]
            values = [orbit.params["w"] for orbit in near]
            where = np.polyval(np.polyfit(lasts, values, 4), 0.0)
            assert abs(where - float(proof.value.mid())) < 1e-4 * max(map(abs, np.diff(values)))
            found += 1
    assert found


# --------------------------------------------------------------- kicks

CLOCK = """
name: kicked
states: [x, v]
parameters: {f: 0.1, J: 1.0, c: 0.05}
autonomous: true
surfaces:
  middle: {observable: x}
  stop: {observable: v, sliding: filippov}
field: {x: v, v: -x - 2*c*v - f*sign(v)}
modes:
  forth: {in: {stop: +}}
  back: {in: {stop: -}}
resets: {middle: {v: v + J, from: [forth]}}
"""


def test_a_kick_that_is_just_reached_is_proved_and_so_is_the_branch_to_it(tmp_path: Path) -> None:
    """Speed and place of the gate vanish together; the branch bends much between its last points."""
    (tmp_path / "kicked.yaml").write_text(CLOCK, encoding="utf-8")
    orbit = cf.find_orbit(cf.load_model(tmp_path / "kicked.yaml"))
    branch = cf.continue_orbit(orbit, "f", (0.05, 0.2))
    grazing = next(event for event in branch.bifurcations if event.kind == "GS")
    proof = grazing.certify()
    assert proof.proved, proof.why
    assert proof.value is not None
    with mpmath.workdps(50):
        c, kick = mpmath.mpf(0.05), mpmath.mpf(1)
        w = mpmath.sqrt(1 - c * c)
        less = mpmath.exp(-c * mpmath.pi / w)  # what is left of an amplitude after half a swing

        def place(f: mpmath.mpf) -> mpmath.mpf:
            """Where the third half swing after a kick ends."""
            t = mpmath.atan2(kick * w, f + c * kick) / w  # v = 0
            first = mpmath.exp(-c * t) * (
                f * mpmath.cos(w * t) + (kick + c * f) / w * mpmath.sin(w * t)
            )
            second = f - (first - 2 * f) * less
            return -f - (second + f) * less

        exact = mpmath.findroot(place, mpmath.mpf(grazing.params["f"]))
        assert abs(exact - mpmath.mpf(proof.value.mid().str(40, radius=False))) < 1e-30
    assert branch.certify().covered > 0.9999
