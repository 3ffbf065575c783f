"""Tubes about branches: what they prove, where they stop, and that they do not prove what is not so."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from flint import arb, ctx

import contfric as cf
from contfric.certify.branch import certify_branch
from contfric.certify.chain import segments_of
from contfric.certify.phases import in_phases
from contfric.certify.tube import Box, box_between, solved
from contfric.models.balls.build import ball_model
from contfric.models.balls.model import BallModel
from contfric.models.balls.numbers import Vector
from contfric.orbit.solve import polish

SCENE = {"Omega": 0.55, "S": 0.32, "S0": 0.4}


@functools.cache
def den_hartog() -> cf.Branch:
    """The branch without sticks, from its end at CS."""
    return cf.continue_orbit(cf.find_orbit("coulomb", SCENE), "Omega", (0.5, 0.6))


def test_a_branch_is_one_curve_up_to_its_ends() -> None:
    branch = den_hartog()
    certificate = branch.certify()
    assert certificate.proved, certificate.why
    assert certificate.covered > 0.9999
    assert certificate.regular > 0.9999
    # what is left is beside the CS at which the branch ends, with the margin that vanishes
    assert all("F-" in gap or "F+" in gap for gap in certificate.gaps)
    end = min(branch.values)
    for piece in certificate.pieces:
        assert piece.proved or abs(piece.values[0] - end) < 1e-6
        assert piece.start < piece.stop


def test_a_fold_is_covered_and_not_taken_for_monotone() -> None:
    orbit = cf.solve_orbit("coulomb", "1a", {"Omega": 0.5417, "S": 0.32, "S0": 0.4})
    branch = cf.continue_orbit(orbit, "Omega", (0.5416, 0.545))
    fold = next(b for b in branch.bifurcations if b.kind == "SN").params["Omega"]
    at = int(np.argmax(branch.values))
    near = slice(at - 2, at + 3)
    cut = replace(
        branch,
        values=branch.values[near],
        joints=branch.joints[near],
        arc=branch.arc[near],
        labels=branch.labels[near],
    )
    certificate = certify_branch(cut)
    assert certificate.proved
    assert certificate.covered == 1.0
    turned = [p for p in certificate.pieces if not p.monotone and p.proved]
    assert turned
    assert all(abs(p.values[0] - fold) < 1e-5 for p in turned)
    assert certificate.regular < certificate.covered


@functools.cache
def ends() -> tuple[cf.Branch, Vector, Vector]:
    branch = den_hartog()
    with ctx.workprec(80):
        k = len(branch) // 2
        points = []
        for value in (float(branch.values[k]), float(branch.values[k]) + 1e-4):
            vector = branch.vector.copy()
            vector[0] = value
            orbit = polish(replace(branch[k], vector=vector))
            joints = orbit.joints.copy()
            joints[:, 0] *= value
            points.append([*(arb(float(c)) for c in joints.ravel()), arb(value)])
    return branch, points[0], points[1]


def build(value: arb) -> BallModel:
    orbit = den_hartog()[0]
    return in_phases(ball_model(orbit.model, orbit.params, "Omega", value))


def a_box(first: Vector, last: Vector) -> Box | None:
    with ctx.workprec(80):
        segments = segments_of(den_hartog().system)
        plane = [b - a for a, b in zip(first, last, strict=True)]
        exact = [solved(segments, build, point, plane) for point in (first, last)]
        assert exact[0] is not None
        assert exact[1] is not None
        return box_between(segments, build, exact[0], exact[1])


def test_orbits_between_lie_in_the_box() -> None:
    branch, first, last = ends()
    box = a_box(first, last)
    assert box is not None
    assert box.monotone
    for share in np.linspace(0.0, 1.0, 7):
        value = float(first[-1]) + share * 1e-4
        vector = branch.vector.copy()
        vector[0] = value
        orbit = polish(replace(branch[len(branch) // 2], vector=vector))
        joints = orbit.joints.copy()
        joints[:, 0] *= value
        for ball, x in zip(box.all, [*joints.ravel(), value], strict=True):
            assert (ball + arb(0, 1e-12)).contains(arb(float(x)))


def test_what_lies_elsewhere_is_not_in_a_box() -> None:
    _, first, last = ends()
    with ctx.workprec(80):
        holding = a_box(first, last)
        assert holding is not None
        middle = [(a + b) / 2 for a, b in zip(first, last, strict=True)]
        assert holding.holds(middle)
        assert not holding.holds([c + 1e-3 for c in middle])
        assert not holding.holds([2 * b - a for a, b in zip(first, last, strict=True)])


def test_a_branch_beyond_its_end_is_not_proved() -> None:
    """The equations are solved below the CS, where the stops should have stuck."""
    branch = den_hartog()
    values = np.linspace(0.5345, 0.5350, 6)
    orbit, joints = branch[int(np.argmin(branch.values))], []
    for value in values[::-1]:
        vector = branch.vector.copy()
        vector[0] = value
        orbit = polish(replace(orbit, vector=vector))
        assert orbit.converged
        joints.append(orbit.joints)
    beyond = replace(
        branch,
        values=values[::-1],
        joints=np.array(joints),
        arc=np.linspace(0.0, 1.0, 6),
        labels=branch.labels[:6],
    )
    certificate = certify_branch(beyond)
    assert certificate.covered == 0.0
    assert not certificate.proved
    assert all(piece.exists for piece in certificate.pieces)  # the curve is there
    assert all("joint at F" in gap for gap in certificate.gaps)


@pytest.mark.slow
def test_a_bridge_and_an_asymmetric_branch() -> None:
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4})
    diagram = cf.explore(orbit, "Omega", (0.4, 0.6))
    bridge = next(b for b in diagram.branches if b.system.holds)
    assert bridge.certify().covered > 0.999
    stable = next(b for b in diagram.branches if b.name == "1a")
    assert stable.certify().covered > 0.999
