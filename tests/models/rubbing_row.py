"""Random masses in a row, some of which rub on the ground."""

from __future__ import annotations

import numpy as np

import contfric as cf


def ten_contacts(seed: int) -> cf.Model:
    """Return twenty masses on springs of their own and between neighbours, ten of which rub."""
    draw = np.random.default_rng(seed)
    beside = np.diag(draw.uniform(0.6, 1.4, 19) * 0.5, 1)
    beside = beside + beside.T
    stiffness = np.diag(draw.uniform(0.8, 1.2, 20) + beside.sum(axis=1)) - beside
    mass = np.diag(draw.uniform(0.8, 1.2, 20))
    rubs = {}
    for i in np.sort(draw.choice(np.arange(1, 21), 10, replace=False)).tolist():
        kinetic = f"{draw.uniform(0.5, 1.5):.4f}*S"
        rubs[f"b{i}"] = {"kind": "friction", "velocity": f"v{i}", "kinetic": kinetic}
    return cf.Mechanism(
        mass,
        0.02 * stiffness,
        stiffness,
        contacts=rubs,
        force={"q1": "cos(Omega*t)"},
        parameters={"Omega": 1.0, "S": 0.03},
        period="2*pi/Omega",
    )
