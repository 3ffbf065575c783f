"""Events of structures at which the return map jumps: bridges where other masses, or a belt, go on moving."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import contfric as cf
from contfric.bvp.linear import equations_at
from contfric.events.incident.candidates import candidates

PARAMETERS = {"w": 0.667, "F": 0.5, "k": 1.0, "c": 0.05, "vd": 0.6, "S": 0.25, "S0": 0.35, "d": 0.9}


@cache
def brake() -> cf.Model:
    """Return a pad on a belt, and a mass that drives it."""
    return cf.Mechanism(
        np.diag([1.0, 2.0]),
        0.05 * np.array([[1.0, -1.0], [-1.0, 2.0]]),
        np.array([[1.0, -1.0], [-1.0, 2.4]]),
        contacts={
            "pad": {"kind": "friction", "velocity": "v1 - vd", "kinetic": "S", "static": "S0"}
        },
        force={"q2": "F*cos(w*t)"},
        parameters={name: PARAMETERS[name] for name in ("w", "F", "vd", "S", "S0")},
        period="2*pi/w",
    )


@pytest.mark.parametrize("seed", range(3))
def test_what_comes_in_moves_along_the_solution(seed: int) -> None:
    """Joints of a slide that comes in within a hold miss the equations to second order only."""
    draw, tried = np.random.default_rng(seed), 0
    params = {name: PARAMETERS[name] * draw.uniform(0.9, 1.1) for name in ("F", "vd", "S", "S0")}
    orbit = cf.find_orbit(brake(), {"w": 0.68, **params})
    for event in cf.explore(orbit, "w", (0.62, 0.72), max_branches=6).bifurcations:
        if event.kind not in ("AS", "GS", "SS"):
            continue
        for found in candidates(event):
            if found.orbit is None or found.away is None:
                continue
            missed = [
                np.max(np.abs(_equations(found.orbit, size * found.away) - _equations(found.orbit)))
                for size in (2e-3, 1e-3)
            ]
            assert missed[1] < 0.3 * missed[0] + 1e-12
            tried += 1
    assert tried > 0


def test_a_pad_on_a_belt_has_no_loose_ends() -> None:
    """Its slide over one period meets nothing: it is found from the bridge, and the bridge from it."""
    events = []
    for start in (0.68, 0.95):
        diagram = cf.explore(cf.find_orbit(brake(), {"w": start}), "w", (0.6, 1.0))
        assert not diagram.loose_ends
        events.append(sorted((b.kind.name, b.params["w"]) for b in diagram.bifurcations))
        assert len(diagram.branches) == 11
    assert [kind for kind, _ in events[0]] == [kind for kind, _ in events[1]]
    np.testing.assert_allclose(*([w for _, w in found] for found in events), atol=1e-9)


@pytest.mark.slow
def test_rest_where_a_gap_stands_still_is_held() -> None:
    """A mass touches rest that a gap ends at: the rate of the gap is zero, and bounds nothing."""
    model = cf.Mechanism(
        np.diag([1.2, 1.0, 0.9]),
        0.05 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]]),
        np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]]),
        contacts={
            "low": {"kind": "friction", "velocity": "v1", "kinetic": "S", "static": "S0"},
            "high": {"kind": "friction", "velocity": "v3", "kinetic": "S", "static": "S0"},
            "stop": {"kind": "spring", "gap": "d - q3", "stiffness": "4*k"},
        },
        force=dict.fromkeys(("q1", "q2", "q3"), "F*cos(w*t)"),
        parameters={**PARAMETERS, "w": 0.44, "F": 0.3, "S": 0.12, "S0": 0.16},
        period="2*pi/w",
    )
    diagram = cf.explore(cf.find_orbit(model), "w", (0.43, 0.446))
    assert not diagram.loose_ends and any(b.bridge for b in diagram.branches)


def _equations(orbit: cf.Orbit, moved: Any = 0.0) -> np.ndarray:
    return equations_at(orbit.system, orbit.joints + moved, orbit.vector)[0]
