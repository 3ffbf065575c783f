"""First hits and stationary points of observables that are not affine, along solutions in closed form.

The motion is long against the changes of the observable: sin(k x) of a state that drifts. Reference: the
closed form sampled densely, each change of sign refined by Brent's method.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from typed import typed

MODEL = """
name: drifting
states: [x, v]
parameters: {{a: {a}, b: {b}, c: {c}, k: {k}}}
autonomous: true
surfaces: {{met: {{observable: "{observable}", level: {level}}}}}
modes:
  one: {{in: {{met: +}}, field: {{x: v + c, v: -a*v - b*x}}}}
  two: {{in: {{met: -}}, field: {{x: v + c, v: -a*v - b*x}}}}
"""
OBSERVABLES = ("sin(k*x)", "cos(k*x) + 0.2*v", "x*v", "exp(-x**2) - v", "sqrt(1 + k*x**2) - 2")


@pytest.mark.parametrize("seed", range(5))
def test_first_hits_are_those_of_dense_samples(tmp_path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0.05, 1.0), rng.uniform(0.0, 0.5)
    c, k = rng.uniform(0.5, 3.0), rng.uniform(1.0, 4.0)
    observable, level = OBSERVABLES[seed % len(OBSERVABLES)], rng.uniform(-0.3, 0.3)
    model = typed(tmp_path, MODEL.format(a=a, b=b, c=c, k=k, observable=observable, level=level))
    assert model.closed_form
    view = model.view(model.vector({}))
    whole = np.array([[0.0, 1.0, c], [-b, -a, 0.0], [0.0, 0.0, 0.0]])

    scope = {name: getattr(np, name) for name in ("sin", "cos", "exp", "sqrt")} | {"k": k}
    formula = compile(observable, "observable", "eval")

    def height(time: float, y: np.ndarray) -> float:
        x, v = (expm(whole * time) @ [*y, 1.0])[:2]
        return float(eval(formula, scope | {"x": x, "v": v})) - level

    times, decided = np.arange(0.0, 12.0, 0.02), 0
    motions = np.array([expm(whole * time) for time in times])
    for y in rng.uniform(-2.0, 2.0, (6, 2)):
        x, v = (motions @ [*y, 1.0])[:, :2].T
        heights = eval(formula, scope | {"x": x, "v": v}) - level
        if np.min(np.abs(heights[1:-1]) + np.abs(np.diff(heights[1:]))) < 1e-4:
            continue  # a near graze, which samples do not decide
        crossed = np.flatnonzero(heights[1:] * heights[:-1] < 0.0)
        found = view.first("one", "met", level, 0.0, y, float(times[-1]), on=False)
        decided += 1
        if not len(crossed):
            assert found is None
            continue
        first = brentq(height, times[crossed[0]], times[crossed[0] + 1], args=(y,), xtol=1e-14)
        assert found is not None
        assert found[0] == pytest.approx(first, abs=1e-9)
        slopes = np.diff(heights[: crossed[-1]])
        turns = int(np.sum(slopes[1:] * slopes[:-1] < 0.0))
        until = float(times[crossed[-1]]) - 0.02
        assert len(view.stationary("one", "met", 0.0, y, until)[0]) == pytest.approx(turns, abs=1)
    assert decided >= 3
