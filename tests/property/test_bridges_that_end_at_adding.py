"""Bridges up to AS: a hold or the stick before it has no length, and the load is of second order in that."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from flint import ctx

import contfric as cf
from contfric.bvp.system import build_system
from contfric.certify.branch import certify_branch
from contfric.certify.tubes.tracing import Tracer
from contfric.certify.tubes.tube import solved
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import refine

LEFT, RIGHT = ("slide-", "v"), ("slide+", "v")
HELD, LOW, HIGH = ("stick", "hold@touch"), ("stick", "F-"), ("stick", "F+")
#: S, its range, itinerary, half or whole, times and places at the joints, and kinds of the ends.
BRIDGES = {
    "symmetric, no hold": (0.1985, (0.19, 0.2), (LEFT, LOW, HELD), True, 2),
    "symmetric, touched": (0.458, (0.4575, 0.6), (LEFT, LOW, HELD), True, 2),
    "whole, symmetric there": (0.465432, (0.1, 0.466), (LEFT, LOW, RIGHT, HIGH, HELD), False, 4),
    "no stick": (0.265517, (0.1, 0.267), (LEFT, LOW, HELD, RIGHT), False, 1),
}
STARTS = {
    3: ((14.4208988, 19.98336, 20.3251627), (1.424, -1.424, -1.424), 0.298062),
    5: (
        (15.3079076, 20.035795, 22.2721823, 26.8246039, 27.100217),
        (1.424, -1.40584595, -1.40584595, 1.424, 1.424),
        0.465432,
    ),
    4: (
        (26.6944391, 33.870036, 33.8752712, 35.03285),
        (1.49000655, -1.424, -1.424, -1.424),
        0.265517,
    ),
}


@functools.cache
def start(case: str) -> Orbit:
    _, _, itinerary, half, _ = BRIDGES[case]
    times, places, value = STARTS[len(itinerary)]
    some = cf.solve_orbit("coulomb", "2s", {"Omega": 0.4637, "S": 0.3, "S0": 0.4})
    vector = some.vector.copy()
    for name, x in {"h": -0.19, "zeta": 0.054, "S0": 0.614, "S": value}.items():
        vector[some.model.index_of(name)] = x
    joints = np.column_stack([times, places, np.zeros(len(times))])
    system = build_system(some.model, itinerary, 1, half)
    orbit = refine(replace(some, system=system, joints=joints, vector=vector))
    assert orbit.converged
    return orbit


@functools.cache
def bridge(case: str) -> cf.Branch:
    value, span, *_ = BRIDGES[case]
    orbit = start(case)
    if abs(orbit.params["S"] - value) > 1e-4:
        orbit = next(
            one
            for one in cf.continue_orbit(orbit, "S", (0.1, 0.6))
            if span[0] < one.params["S"] < span[1]
        )
    return cf.continue_orbit(orbit, "S", span)


@pytest.mark.parametrize("case", BRIDGES)
def test_a_bridge_is_proved_up_to_its_event(case: str) -> None:
    branch = bridge(case)
    found = certify_branch(branch)
    assert found.complete, (found.gaps, found.open)
    ends = [(piece, name) for piece in found.pieces for name in piece.ends]
    assert ends and all(piece.events for piece, _ in ends)
    assert any(label.startswith("AS") for label in found.events)
    assert BRIDGES[case][-1] in {name.segment for _, name in ends}


@pytest.mark.parametrize("case", BRIDGES)
def test_nothing_is_proved_beyond_its_event(case: str) -> None:
    """Its equations have solutions there, with a load above its limit or a duration below zero."""
    branch = bridge(case)
    first = branch.ends[0].reason.name == "AS"
    end, inner = (0, 3) if first else (-1, -4)
    with ctx.workprec(80):
        tracer, value = Tracer(branch, [], np.inf), float(branch.values[end])
        near, far = tracer.point(branch[end]), tracer.point(branch[inner])
        plane = [b - a for a, b in zip(far, near, strict=True)]
        for share in (0.0, 0.05, 0.5):
            guess = [(b + share * c).mid() for b, c in zip(near, plane, strict=True)]
            point = solved(tracer.segments, tracer.build, tracer.plain, guess, plane)
            if point is None:  # so far there are none
                assert share == 0.5
                continue
            joints = np.array([float(x) for x in point[:-1]]).reshape(branch.joints[end].shape)
            joints[:, 0] /= branch[end].params["Omega"]
            arrays = {"joints": branch.joints.copy(), "values": branch.values.copy()}
            arrays["joints"][end], arrays["values"][end] = joints, float(point[-1])
            changed = Tracer(replace(branch, **arrays), [], np.inf)
            k = 0 if first else len(branch) - 4
            pieces = changed._step(k, k + 3)
            ending = [piece for piece in pieces if piece.ends]
            assert all(piece.proved for piece in ending) and (share or ending)
            inside = np.sign(branch.values[inner] - value)
            whole = [piece for piece in pieces if piece.proved and not piece.ends]
            assert all(inside * (x - value) > 0 for piece in whole for x in piece.values)
            assert len(ending) + len(whole) < len(pieces) or len(ending) == 1
