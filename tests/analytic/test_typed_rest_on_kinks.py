"""Solutions that begin where an absolute value has its kink, as a mass at rest does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typed import typed

import contfric as cf

#: Friction that grows with the speed: abs(v)**n has no slope at v = 0 if n < 1, but v*abs(v)**n has.
DRAG = """
name: drag
states: [x, v]
parameters: {w: 1.1, c: 0.7, n: 0.5, k: 0.3}
period: 2*pi/w
kinks: [v]
observables: {phase: sin(w*t)}
surfaces: {phase: {observable: phase, level: 0}}
field: {x: v, v: "cos(w*t) - x - c*v*abs(v)**n - k*abs(v)"}
modes: {first: {in: {phase: +}}, second: {in: {phase: -}}}
"""


@pytest.mark.parametrize("n", [0.3, 0.8, 1.0, 1.7])
def test_a_solution_from_rest_is_that_from_next_to_it(tmp_path: Path, n: float) -> None:
    draw = np.random.default_rng(round(10 * n))
    model = cf.load_model(typed(tmp_path, DRAG))
    for _ in range(8):
        p = {"w": 1.1, "c": draw.uniform(0.2, 1.5), "n": n, "k": draw.uniform(0.1, 0.6)}
        t, x, lasts = draw.uniform(0.0, 6.0), draw.uniform(-2.0, 2.0), draw.uniform(0.05, 0.6)
        view = model.view(model.vector(p))

        def field(t: float, y: np.ndarray, p: dict[str, float] = p) -> list[float]:
            drag = p["c"] * y[1] * abs(y[1]) ** p["n"] + p["k"] * abs(y[1])
            return [y[1], np.cos(1.1 * t) - y[0] - drag]

        known = solve_ivp(field, (t, t + lasts), (x, 0.0), rtol=1e-11, atol=1e-13).y[:, -1]
        np.testing.assert_allclose(
            view.state("first", t, np.array([x, 0.0]), lasts), known, atol=1e-8
        )
        slopes = [view.jacobian("first", t, np.array([x, v]), lasts)[:, :3] for v in (0.0, 1e-13)]
        np.testing.assert_allclose(*slopes, atol=1e-4)
