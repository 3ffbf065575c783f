"""A slide by ``scipy.integrate.solve_ivp``: DOP853 with a terminal event at the stop."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from peers.oscillator import Counter, Failure, Params, Tangent, checked, until


def _stop(sign: int):  # type: ignore[no-untyped-def]
    def velocity(t: float, z: np.ndarray) -> float:
        return z[1]

    velocity.terminal = True  # type: ignore[attr-defined]
    velocity.direction = -sign  # type: ignore[attr-defined]
    return velocity


_STOPS = {sign: _stop(sign) for sign in (1, -1)}


def _rate(omega: float, force: float, tangents: int) -> Callable[..., tuple[float, ...]]:
    """Return the right-hand side; one function for each number of tangents, as it would be typed."""

    def plain(t, z):
        return (z[1], math.cos(omega * t) - force - z[0])

    def with_release(t, z):
        return (z[1], math.cos(omega * t) - force - z[0], z[3], -z[2])

    def with_both(t, z):
        acceleration = math.cos(omega * t) - force - z[0]
        return (z[1], acceleration, z[3], -z[2], z[5], -t * math.sin(omega * t) - z[4])

    return (plain, with_release, with_both)[tangents]


@dataclass(frozen=True)
class Dop853:
    """Relative (and absolute) tolerance, and whether stops are refined.

    scipy takes time and state of an event from the interpolant of a step. If they are to be refined, the
    last step is repeated to the event, and the rest of the velocity is removed by Newton.
    """

    rtol: float
    refined: bool = False
    unit: str = "evaluations"

    def slide(
        self,
        t: float,
        x: float,
        sign: int,
        params: Params,
        counter: Counter,
        tangents: Sequence[Tangent] = (),
    ) -> tuple[float, np.ndarray]:
        """See :class:`peers.oscillator.Integrator`."""
        rate = _rate(params[0], sign * params[1], len(tangents))
        start = [x, 0.0, *(v for tangent in tangents for v in tangent)]
        options = {"method": "DOP853", "rtol": self.rtol, "atol": self.rtol}
        found = solve_ivp(rate, (t, until(t, params)), start, events=_STOPS[sign], **options)
        counter.calls += found.nfev
        if not found.success or found.t_events[0].size == 0:
            raise Failure("a slide without a stop")
        end, z = checked(t, float(found.t_events[0][0])), found.y_events[0][0]
        if not self.refined:
            return end, z
        before = float(found.t[-2])
        last = solve_ivp(rate, (before, end), found.y[:, -2], first_step=end - before, **options)
        counter.calls += last.nfev + 1
        z = last.y[:, -1]
        slope = np.array(rate(end, z))
        step = -z[1] / slope[1]
        return end + step, z + step * slope
