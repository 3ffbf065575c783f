"""The rate of an observable along a mode, and its derivatives.

The rate itself is held against the flow (the derivative of the state with respect to the duration, at
duration zero) and the gradient of the observable; its derivatives against central differences in 30
digits of the equations of motion, written down here anew.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contfric.models import load_model

MODEL = load_model("coulomb")
NONE = np.empty(0, dtype=np.int64)
ALL = np.arange(5, dtype=np.int64)
VECTOR = np.array([0.43, 0.17, 0.31, 0.07, 0.05])
finite = st.floats(-3.0, 3.0)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2), st.integers(0, 1), st.floats(0.0, 30.0), finite, finite)
def test_rate_is_the_observable_along_the_flow(mode: int, c: int, t: float, x: float, v: float):
    y = np.array([x, 0.0 if mode == 2 else v])
    state, jac, grad = np.empty(2), np.empty((2, 4)), np.empty(3)
    MODEL.flow.flow(mode, t, y, 0.0, VECTOR, NONE, state, jac)
    MODEL.flow.observe(c, t, y, VECTOR, NONE, grad)
    expected = grad[0] + grad[1:] @ jac[:, 3]
    found = MODEL.flow.rate(mode, c, t, y, VECTOR, NONE, np.empty(0))
    assert found == pytest.approx(expected, rel=1e-14, abs=1e-14)


def exact(mode, c, t, x, v, omega, s, s0, h, zeta):
    """Rate of u = x - f(t) (c = 0) or of v (c = 1), from the equation of motion."""
    f = mpmath.cos(omega * t) + h * mpmath.cos(3 * omega * t)
    f1 = -omega * mpmath.sin(omega * t) - 3 * omega * h * mpmath.sin(3 * omega * t)
    slides = 0 if mode == 2 else 1
    sign = 1 if mode == 0 else -1
    return slides * v - f1 if c == 0 else slides * (f - sign * s - 2 * zeta * v - x)


@pytest.mark.parametrize("mode", [0, 1, 2])
@pytest.mark.parametrize("c", [0, 1])
def test_gradient(mode: int, c: int):
    t, y = 3.7, np.array([0.4, -0.3])
    grad = np.empty(3 + 5)
    MODEL.flow.rate(mode, c, t, y, VECTOR, ALL, grad)
    with mpmath.workdps(30):
        point = [mpmath.mpf(float(a)) for a in (t, *y, *VECTOR)]
        for k in range(8):
            step = mpmath.mpf(10) ** -12
            ahead = [a + step * (i == k) for i, a in enumerate(point)]
            behind = [a - step * (i == k) for i, a in enumerate(point)]
            slope = (exact(mode, c, *ahead) - exact(mode, c, *behind)) / (2 * step)
            assert grad[k] == pytest.approx(float(slope), rel=1e-13, abs=1e-13)
