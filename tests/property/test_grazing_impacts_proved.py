"""Grazing impacts are proved, against the amplitude of the response that just reaches the wall."""

from __future__ import annotations

import pytest
from mpmath import findroot, mp, mpf
from numpy.random import default_rng
from typed import typed

import contfric as cf

HOPPER = """
name: hopper
states: [x, v]
parameters: {w: 1.5, d: 0.3, r: 0.8, zeta: 0.05}
period: 2*pi/w
surfaces: {wall: {observable: x, level: d}}
modes: {free: {in: {wall: -}, field: {x: v, v: -x - 2*zeta*v + cos(w*t)}}}
resets: {wall: {v: -r*v}}
"""


@pytest.mark.parametrize("seed", range(4))
def test_a_grazing_impact_is_proved_where_the_response_reaches_the_wall(tmp_path, seed) -> None:
    """The orbit of one impact ends where the response without impacts has the amplitude of the wall."""
    rng = default_rng(seed)
    d, r, zeta = rng.uniform(0.25, 0.6), rng.uniform(0.5, 0.9), rng.uniform(0.02, 0.2)
    with mp.workdps(60):
        wall, damping = mpf(float(d)), mpf(float(zeta))
        touches = findroot(
            lambda w: ((1 - w * w) ** 2 + (2 * damping * w) ** 2) * wall**2 - 1,
            mp.sqrt(1 + 1 / wall),
        )
        w = float(touches) + 0.02
        response = 1 / (1 - w * w + 2j * zeta * w)
        state = [response.real, (1j * w * response).real]
        start = cf.find_orbit(
            typed(tmp_path, HOPPER), {"w": w, "d": d, "r": r, "zeta": zeta}, state=state
        )
        diagram = cf.explore(start, "w", (w - 0.05, w), max_branches=6)
        found = [event.certify() for event in diagram.bifurcations if event.kind == "GS"]
        assert found and all(proof.proved for proof in found), [proof.why for proof in found]
        values = [mpf(proof.value.mid().str(50, radius=False)) for proof in found]
        assert min(abs(value - touches) for value in values) < 1e-35


def test_a_segment_that_is_the_whole_orbit_touches_at_both_ends(tmp_path) -> None:
    """Its first rates vanish before the touch and after it."""
    branch = cf.continue_orbit(cf.find_orbit(typed(tmp_path, HOPPER), {"w": 1.5}), "w", (1.4, 2.5))
    (event,) = (end.bifurcation for end in branch.ends if end.bifurcation is not None)
    assert event.kind == "GS" and len(event.orbit.joints) == 1
    assert event.certify().proved
