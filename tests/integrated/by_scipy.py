"""Solutions by an integrator of scipy, which shares nothing with contfric; those of `popp` and `belt`."""

from __future__ import annotations

from collections.abc import Callable
from math import cos
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

#: Accuracy where a test does not ask for another one.
_TIGHT: dict[str, Any] = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}


def after(field: Any, start: Any, span: tuple[float, float], **options: Any) -> np.ndarray:
    """Return the state at the end of a span."""
    return np.asarray(solve_ivp(field, span, start, **(_TIGHT | options)).y[:, -1])


def met(
    field: Any,
    start: Any,
    event: Any,
    direction: float = 0.0,
    span: tuple[float, float] = (0.0, 200.0),
    **options: Any,
) -> tuple[float, np.ndarray]:
    """Return time and state where an event is met in a direction (0: in either), at the latest at the end."""
    event.terminal, event.direction = True, direction
    run = solve_ivp(field, span, start, events=event, **(_TIGHT | options))
    return float(run.t[-1]), run.y[:, -1]


def misses(orbit: Any, field_of: Callable[[str], Any]) -> float:
    """Return how far the segments of an orbit, each along the field of its mode, end from its joints."""
    ways = zip(orbit.itinerary, orbit.begins, orbit.ends, strict=True)
    return max(
        float(np.max(np.abs(after(field_of(mode), begin[1:], (begin[0], end[0])) - end[1:])))
        for (mode, _), begin, end in ways
    )


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
