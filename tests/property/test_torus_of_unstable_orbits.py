"""A torus (NS) is found whatever other multipliers do: larger ones may be off the circle."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typed import typed

import contfric as cf
from contfric.orbit.solve import refine

#: A linear oscillator without any coupling to others, each with a multiplier of its own.
LINEAR = """
name: uncoupled
states: [x, v, y, z]
parameters: {c: 0.4, k: 2.0, g: -0.3, l: -0.5, w: 1.0}
period: 2*pi/w
field: {x: v, v: "-c*v - k*x + cos(w*t)", y: "g*y + cos(w*t)", z: "l*z + sin(w*t)"}
"""


@pytest.mark.parametrize("seed", range(6))
def test_a_torus_next_to_real_multipliers_of_any_size(seed: int, tmp_path: Path) -> None:
    """The pair has the modulus exp(-pi c / w): it is on the circle at c = 0, whatever g and l are."""
    rng = np.random.default_rng(seed)
    model = typed(tmp_path, LINEAR)
    start = cf.find_orbit(model, {"k": rng.uniform(1.5, 3.0), "w": rng.uniform(0.9, 1.1)})
    vector = start.vector.copy()
    vector[model.index_of("g")] = rng.uniform(0.05, 0.6)
    vector[model.index_of("l")] = rng.uniform(-0.6, 0.6)
    orbit = refine(replace(start, vector=vector))
    assert max(abs(orbit.multipliers)) > 1.0
    branch = cf.continue_orbit(orbit, "c", (-0.3, 0.5), max_step=float(rng.uniform(0.01, 0.2)))
    (torus,) = (b for b in branch.bifurcations if b.kind is cf.Kind.NS)
    assert torus.params["c"] == pytest.approx(0.0, abs=1e-12) and torus.accuracy < 1e-10
    assert len(branch.bifurcations) == 1
    rates = np.array([orbit.params[name] for name in ("g", "l")])
    mu = np.exp(2.0 * np.pi / orbit.params["w"] * rates)
    for k in (0, -1):
        real = branch.multipliers[k].real[np.abs(branch.multipliers[k].imag) < 1e-9]
        assert np.sort(real) == pytest.approx(np.sort(mu), rel=1e-9)
