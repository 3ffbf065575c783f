"""The closed form of the independent checker against Taylor's series in 60 digits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

flint = pytest.importorskip("flint")
from flint import arb, arb_series, ctx  # noqa: E402
from mpmath import mp, mpf  # noqa: E402

from contfric.verify.motion import Scene  # noqa: E402
from tests.certificate_oracle import DIGITS, SMALL, Truth  # noqa: E402

SLIDE = [["slide+", "v"], ["stick", "F+"]]
#: Of scenes: about critical damping and resonance (of the third harmonic, too), and far off.
DAMPINGS = (0.0, 1e-12, -0.05, 0.3, 0.75, 0.9, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.1, 1.2, 4.0)
FREQUENCIES = (1.0, 1.0 + 1e-12, 1.2, 1 / 3, 0.25, 0.5, 1.7)


def _scene(rng: np.random.Generator) -> tuple[dict[str, float], float, float, float]:
    params = {"Omega": float(rng.choice(FREQUENCIES)), "S": 0.3, "S0": 0.4}
    params |= {"h": float(rng.choice([0.0, 0.3])), "zeta": float(rng.choice(DAMPINGS))}
    return params, *(float(c) for c in (rng.uniform(0, 6), rng.normal(), rng.uniform(0.01, 8)))


def _truth(params: dict[str, Any], phase: float, x: float, tau: float) -> list[mpf]:
    with mp.workdps(DIGITS):
        truth = Truth({"params": params, "half": False, "periods": 1, "segments": SLIDE})
        found = truth.slide(1, mpf(phase) / truth.omega, mpf(x), mpf(tau))
        return [found[0], found[1]]


def _in_balls(params: dict[str, Any], name: str, value: Any, at: list[float]) -> list[Any]:
    data = {"periods": 1, "half": False, "params": params, "parameter": name, "segments": SLIDE}
    cap, ctx.cap = ctx.cap, 3
    try:
        with ctx.workprec(212):
            phase, x, tau = (arb(c) for c in at)
            return list(Scene(data, value).state([phase, x, phase, x], 0, tau)[:2])
    finally:
        ctx.cap = cap


def _holds(ball: arb, truth: mpf) -> bool:
    with mp.workdps(DIGITS), ctx.workprec(240):
        return bool(ball.overlaps(arb(mp.nstr(truth, 55)) + arb(0, 1e-50)))


@pytest.mark.parametrize("seed", range(60))
def test_a_slide_is_that_of_its_equation(seed: int) -> None:
    params, *at = _scene(np.random.default_rng([7, seed]))
    for ball, truth in zip(_in_balls(params, "S", arb(0.3), at), _truth(params, *at), strict=True):
        assert ball.rad() < 1e-40
        assert _holds(ball, truth)


@pytest.mark.parametrize("seed", range(40))
def test_a_slide_of_many_dampings_is_held_with_its_derivative(seed: int) -> None:
    """A ball of dampings may hold the critical one; the series in it has the derivative by the damping."""
    rng = np.random.default_rng([8, seed])
    params, *at = _scene(rng)
    zeta = params["zeta"]
    wide = _in_balls(params, "zeta", arb_series([arb(zeta, 1e-6), 1]), at)
    inner = mpf(zeta) + mpf(float(rng.uniform(-1e-6, 1e-6)))
    with mp.workdps(DIGITS):
        values = [_truth({**params, "zeta": inner + k * SMALL}, *at) for k in (-1, 0, 1)]
        slopes = [(b - a) / (2 * SMALL) for a, b in zip(values[0], values[2], strict=True)]
    for series, truth, slope in zip(wide, values[1], slopes, strict=True):
        assert series[0].rad() < 1e-2
        assert _holds(series[0], truth)
        assert series[1].is_finite()
        assert series[1].overlaps(arb(mp.nstr(slope, 18)) + arb(0, 1e-12 * (1 + abs(float(slope)))))
