"""One orbit with the slides in closed form, in plain Python: what no compiler is needed for."""

from __future__ import annotations

import math

from scipy.optimize import brentq, newton

from peers.oscillator import Failure, Params, release
from peers.shooting import SMALLEST_STEP, Joints

#: The velocity is looked at in steps this long; slides of this orbit last longer than 4.
LOOK = 0.2
#: That of the arithmetic, for times of size 10.
ROOT = 1e-15


def slide_in_closed_form(t0: float, x0: float, sign: int, params: Params) -> tuple[float, float]:
    """Return time and position of the stop that ends a slide: steps, then brentq."""
    omega, S, _ = params
    gain = 1 / (1 - omega**2)
    a = x0 + sign * S - gain * math.cos(omega * t0)
    b = gain * omega * math.sin(omega * t0)

    def velocity(tau: float) -> float:
        forced = -gain * omega * math.sin(omega * (t0 + tau))
        return forced - a * math.sin(tau) + b * math.cos(tau)

    tau = LOOK
    while sign * velocity(tau) > 0:
        tau += LOOK
    if tau == LOOK:
        raise Failure("a slide without a beginning")
    tau = brentq(velocity, tau - LOOK, tau, xtol=ROOT)
    forced = -sign * S + gain * math.cos(omega * (t0 + tau))
    return t0 + tau, forced + a * math.cos(tau) + b * math.sin(tau)


def orbit_in_closed_form(t0: float, params: Params) -> tuple[Joints, str]:
    """Joints of the orbit: secant method on the release time."""
    omega, _, S0 = params
    turns = 0

    def joints_from(t: float) -> Joints:
        nonlocal turns
        turns += 1
        x0 = math.cos(omega * t) - S0
        t1, x1 = slide_in_closed_form(t, x0, 1, params)
        t2, x2 = slide_in_closed_form(t1, x1, -1, params)
        return t, x0, t1, x1, t2, x2

    def slip(t: float) -> float:
        expected = t + 2 * math.pi / omega
        return release(expected, joints_from(t)[5], params) - expected

    try:
        t0 = newton(slip, t0, tol=SMALLEST_STEP)
    except RuntimeError as error:
        raise Failure("the secant method did not converge") from error
    return joints_from(t0), f"{turns} turns"
