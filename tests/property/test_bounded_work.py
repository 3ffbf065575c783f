"""Kernels return in bounded work, whatever Newton's method makes of a start: iterates may be anything.

Where several conditions vanish together the system is singular, and a correction may leave a frequency that
is negative, a segment of a million periods, or states beyond all bounds. What is computed there is of no use;
but it must end.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

import contfric as cf
from contfric.atlas.leaving import from_flow
from contfric.atlas.leaving.crossings import whole_branch
from contfric.continuation.half_branch import first_point
from contfric.continuation.points import Settings, settings_of
from contfric.curves.points import solve_point
from contfric.curves.problem import border_of, problem_of
from contfric.curves.ranges import box_of
from contfric.orbit.solve import refine

#: Starts, and processor time that they may take together after compilation (s): each is a few thousand
#: evaluations at worst.
STARTS, MOST = 60, 20.0


@pytest.fixture(scope="module", params=[0.0, 0.3])
def diagram(request: pytest.FixtureRequest) -> cf.Diagram:
    """Return a small diagram, with one harmonic (sticks in closed form) and with two."""
    orbit = cf.find_orbit("coulomb", {"Omega": 0.5, "S": 0.32, "S0": 0.4, "h": request.param})
    return cf.explore(orbit, "Omega", (0.48, 0.55), max_periods=1)


def wild(draw: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Return numbers of any sign and size, some of them none."""
    values = draw.standard_normal(shape) * 10.0 ** draw.uniform(-4.0, 9.0, shape)
    return np.where(draw.uniform(size=shape) < 0.02, np.nan, values)


def test_curves(diagram: cf.Diagram) -> None:
    draw, began, tried = np.random.default_rng(5), np.inf, 0
    box = box_of(diagram.model, ("Omega", "S"), {"Omega": (0.1, 0.7), "S": (0.0, 0.4)})
    for event in diagram.bifurcations:
        if not event.located or event.orbit.system.holds or event.kind.value == "NS":
            continue
        problem = problem_of(event, box)
        orbit = event.orbit if event.orbit.system is problem.system else event.orbit.as_half()
        border = border_of(problem, orbit.joints, orbit.vector)
        for _ in range(STARTS // 4):
            share = 10.0 ** draw.uniform(-6.0, 0.0)
            joints = orbit.joints + share * wild(draw, orbit.joints.shape)
            w = orbit.vector[problem.which] + share * wild(draw, (2,))
            tangent, slope = wild(draw, joints.shape), wild(draw, (2,))
            solve_point(problem, joints, w, tangent, slope, border.copy())
            began = min(began, time.process_time())
            tried += 1
    assert tried >= STARTS // 4
    assert time.process_time() - began < MOST


def test_branches_and_orbits(diagram: cf.Diagram) -> None:
    draw, began = np.random.default_rng(6), np.inf
    for branch in diagram.branches[:4]:
        orbit = branch[len(branch) // 2]
        settings = settings_of(orbit, "Omega", (0.1, 0.9), None, True, 100)
        for _ in range(STARTS // 10):
            share = 10.0 ** draw.uniform(-6.0, 0.0)
            vector = orbit.vector + share * wild(draw, orbit.vector.shape)
            joints = orbit.joints + share * wild(draw, orbit.joints.shape)
            moved = replace(orbit, joints=joints, vector=vector)
            first_point(moved, settings, wild(draw, joints.shape), float(wild(draw, (1,))[0]))
            refine(moved)
            moved.margins.sum()
            began = min(began, time.process_time())
    assert time.process_time() - began < MOST


@pytest.mark.parametrize("model", ["coulomb", "jenkins", "popp"])
def test_a_segment_of_many_turns_is_given_up(model: str) -> None:
    """Each of its evaluations would cost as many turns, and Newton's method does not come back from there."""
    draw, orbit = np.random.default_rng(7), cf.find_orbit(model)
    turn = orbit.period
    for _ in range(20):
        joints = orbit.joints.copy()
        which = int(draw.integers(1, len(joints)))
        joints[which, 0] += float(draw.choice([-1.0, 1.0])) * turn * 10.0 ** draw.uniform(3.0, 9.0)
        for damped in (False, True):
            left = refine(replace(orbit, joints=joints), damped=damped)
            assert not left.converged
            assert np.array_equal(left.joints, joints)
        joints = orbit.joints.copy()
        joints[which, 0] += 1e-3 * turn * draw.standard_normal()
        assert refine(replace(orbit, joints=joints)).converged


@pytest.mark.slow
def test_no_branch_is_traced_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Motions near several events walk the itinerary of one branch: it is traced for one of them."""
    play = {"kind": "spring", "stiffness": "6"}
    model = cf.Mechanism(
        [["1", "0"], ["0", "2"]],
        [["0.1", "0"], ["0", "0.05"]],
        [["0.2", "0"], ["0", "0.4"]],
        contacts={
            "front": {**play, "gap": "0.3 - q1 + q2"},
            "back": {**play, "gap": "0.3 + q1 - q2"},
            "bearing": {"kind": "friction", "velocity": "v2", "kinetic": "0.1", "static": "0.13"},
        },
        force={"q1": "0.1 + 0.6*cos(w*t)"},
        parameters={"w": 0.9},
        period="2*pi/w",
    )
    traced: list[cf.Branch] = []

    def kept(orbit: cf.Orbit, settings: Settings) -> cf.Branch:
        traced.append(whole_branch(orbit, settings))
        return traced[-1]

    monkeypatch.setattr(
        from_flow, "_NEXT_TO_IT", np.inf
    )  # else each is traced next to its event only
    monkeypatch.setattr(from_flow, "whole_branch", kept)
    cf.explore(cf.find_orbit(model), "w", (0.7, 1.1), max_branches=45)
    spans = [(b.name, round(b.values.min(), 6), round(b.values.max(), 6)) for b in traced]
    assert len(set(spans)) == len(spans) > 5
