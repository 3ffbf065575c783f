"""Two masses of which one sticks all along, next to the gap of the other: what several tests begin from."""

from __future__ import annotations

import numpy as np

import contfric as cf


def stuck_next_to_a_gap(draw: np.random.Generator, gap: float) -> cf.Model:
    """Return a chain driven at its second mass, which meets a spring; the friction of the first is large."""
    friction = {"kind": "friction", "velocity": "v1", "kinetic": 0.6, "static": 0.6}
    stiffness = float(draw.uniform(0.5, 4.0))
    return cf.Mechanism(
        np.eye(2),
        [[0.2, -0.1], [-0.1, 0.2]],
        [[2.0, -1.0], [-1.0, 2.0]],
        contacts={
            "c1": friction,
            "stop": {"kind": "spring", "gap": f"{gap} - q2", "stiffness": stiffness},
        },
        force={"q2": "0.15*cos(w*t)"},
        parameters={"w": float(draw.uniform(0.4, 0.8))},
        period="2*pi/w",
    )
