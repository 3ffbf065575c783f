"""Branches that come to a resonance of a block with dry friction: without damping, and with very little."""

import math

import numpy as np
from typed import typed

import contfric as cf

BLOCK = """
name: block
states: [x, v]
parameters: {Omega: 0.8, S: 0.3, zeta: 0.0, k: 1.0}
period: 2*pi/Omega
surfaces: {stop: {observable: v, sliding: filippov}}
field: {x: v, v: cos(Omega*t) - k*x - 2*zeta*v - S*sign(v)}
symmetry: x -> -x, v -> -v, t -> t + T/2
"""


def test_only_what_has_no_bound_is_called_unbounded(tmp_path) -> None:
    """The amplitude at the peak is (1 - 4 S/pi)/(2 zeta omega): its branch goes over it, or stalls there."""
    model, draw, unbounded = typed(tmp_path, BLOCK), np.random.default_rng(3), 0
    for damping in 2 * (0.0, 1e-8, 1e-6, 3e-6, 1e-4):
        where = {"k": 10 ** draw.uniform(-0.5, 0.7), "S": draw.uniform(0.05, 0.7)}
        omega = math.sqrt(where["k"])
        orbit = cf.find_orbit(model, where | {"zeta": damping, "Omega": 0.7 * omega})
        diagram = cf.explore(orbit, "Omega", (0.6 * omega, 1.3 * omega))
        reasons = {end.reason for branch in diagram.branches for end in branch.ends}
        largest = max(point.x_max for branch in diagram.branches for point in branch)
        peak = math.inf if not damping else (1 - 4 * where["S"] / math.pi) / (2 * damping * omega)
        assert largest < 1.001 * peak, where
        if cf.EndReason.UNBOUNDED in reasons:
            unbounded += 1
            assert largest < 0.5 * peak, where  # so far from it nothing tells of the peak
        elif largest < 0.999 * peak:
            assert cf.EndReason.STEP in reasons, where
    assert unbounded == 4
