"""Second derivatives of the flow in a direction, against the equation of motion in 40 digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from contfric.models import load_model

MODEL = load_model("coulomb")
ALL = np.arange(5, dtype=np.int64)


def slide(sign, t0, x0, v0, d, omega, s, h, zeta):
    """State after a slide, by its particular solution and characteristic roots, in 40 digits."""
    root = mpmath.sqrt(mpmath.mpc(zeta * zeta - 1))
    a, b = -zeta + root, -zeta - root

    def particular(t):
        value, rate = -sign * s, mpmath.mpf(0)
        for k, size in ((1, 1), (3, h)):
            w = k * omega
            wave = size * mpmath.expj(w * t) / (1 - w * w + 2j * zeta * w)
            value, rate = value + wave.real, rate + (1j * w * wave).real
        return value, rate

    xp, vp = particular(t0)
    x, v = x0 - xp, v0 - vp
    one, other = (v - b * x) / (a - b), (a * x - v) / (a - b)
    xe, ve = particular(t0 + d)
    ea, eb = mpmath.exp(a * d), mpmath.exp(b * d)
    return (xe + (one * ea + other * eb).real, ve + (a * one * ea + b * other * eb).real)


def expected(sign, start, along, params):
    """Derivative in a direction of the derivatives with respect to (t0, x0, v0, d) and parameters."""
    with mpmath.workdps(60):
        step = mpmath.mpf(10) ** -15
        at = [mpmath.mpf(value) for value in (*start, *params)]
        move = [mpmath.mpf(value) for value in (*along, 0, 0, 0, 0)]

        def state(shift, k, h):
            q = [value + shift * m for value, m in zip(at, move, strict=True)]
            q[k] += h
            return slide(sign, *q)

        out = np.empty((2, 8))
        for k in range(8):
            corners = [
                state(i * step, k, j * step) for i, j in ((1, 1), (1, -1), (-1, 1), (-1, -1))
            ]
            for row in range(2):
                value = corners[0][row] - corners[1][row] - corners[2][row] + corners[3][row]
                out[row, k] = float(value / (4 * step * step))
        return out


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.999, 1.7])
@pytest.mark.parametrize("omega", [0.31, 0.9999, 1.3])
def test_slide(sign: int, zeta: float, omega: float) -> None:
    start, along = (2.3, 0.7, 0.4, 3.1), (0.3, -0.8, 0.5, 0.9)
    s, h = 0.21, 0.07
    p = np.array([omega, s, 0.4, h, zeta])
    jac, workspace = np.empty((2, 9)), np.empty(10)
    state = np.array(start[1:3])
    mode = 0 if sign > 0 else 1
    known = MODEL.flow.second(
        mode, -1, start[0], state, start[3], p, ALL, np.array(along), jac, workspace
    )
    assert known == 1
    exact = expected(sign, start, along, (omega, s, h, zeta))
    found = jac[:, [0, 1, 2, 3, 4, 5, 7, 8]]  # S0 does nothing to a slide
    # the largest entries are 100; next to critical damping the roots are 0.04 apart
    np.testing.assert_allclose(found, exact, rtol=2e-11, atol=2e-11)
    assert not np.any(jac[:, 6])


def test_resonance_is_an_ordinary_point() -> None:
    along, state, workspace = np.array([0.3, -0.8, 0.5, 0.9]), np.array([0.7, 0.4]), np.empty(10)
    found = []
    for omega in (1.0 - 1e-7, 1.0, 1.0 + 1e-7):
        jac = np.empty((2, 9))
        p = np.array([omega, 0.2, 0.4, 0.1, 0.0])
        MODEL.flow.second(0, -1, 2.3, state, 5.0, p, ALL, along, jac, workspace)
        found.append(jac)
    np.testing.assert_allclose(found[1], 0.5 * (found[0] + found[2]), rtol=1e-11, atol=1e-11)


def test_observable() -> None:
    along, state = np.array([0.3, -0.8, 0.5, 0.0]), np.array([0.7, 0.4])
    p, step, t = np.array([0.8, 0.2, 0.4, 0.1, 0.05]), 1e-4, 1.7
    for c in (0, 1):
        jac, grads = np.empty((2, 9)), []
        MODEL.flow.second(0, c, t, state, 0.0, p, ALL, along, jac, np.empty(10))
        for h in (step, -step):
            grad = np.empty(8)
            MODEL.flow.observe(c, t + h * along[0], state + h * along[1:3], p, ALL, grad)
            grads.append(grad)
        np.testing.assert_allclose(jac[0, :8], (grads[0] - grads[1]) / (2 * step), atol=1e-7)
