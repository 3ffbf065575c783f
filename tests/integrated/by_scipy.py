"""Motion of `popp` and of `belt` by an integrator of scipy, which shares nothing with contfric."""

from __future__ import annotations

from math import cos
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp


def integrated(f: Any, y0: Any, span: tuple[float, float], until: Any = None) -> np.ndarray:
    """Return the state at the end of a span, or at the first event."""
    if until is not None:
        until.terminal = True
    done = solve_ivp(f, span, y0, method="DOP853", rtol=2.5e-14, atol=1e-15, events=until)
    return done.y_events[0][0] if until is not None else done.y[:, -1]


def slower_than_the_belt(
    start: Any, omega: float, span: tuple[float, float], force: float = 0.1
) -> np.ndarray:
    """Return the state of `popp` at the end of a span, and its tangent map row by row."""

    def f(t: float, y: np.ndarray) -> list[float]:
        z = 1.0 - y[1]
        rate, slope = 1.5 - 1.5 * z + 0.45 * z**3, 1.5 - 1.35 * z * z
        tangent = y[2:].reshape(2, 2)
        grown = np.array([tangent[1], slope * tangent[1] - tangent[0]])
        return [y[1], rate - y[0] + force * cos(omega * t), *grown.ravel()]

    return integrated(f, [*start, 1, 0, 0, 1], span)


def slip(vb: float, delta: float, x: float, side: float) -> float:
    """Return x of `belt` where the belt's speed is met again; side is that of x' - vb."""

    def f(_: float, y: np.ndarray) -> list[float]:
        return [y[1], -y[0] - side / (1 + delta * side * (y[1] - vb))]

    def met(t: float, y: np.ndarray) -> float:
        return float(y[1] - vb) if t > 1e-3 else side

    return float(integrated(f, [x, vb], (0, 20), met)[0])
