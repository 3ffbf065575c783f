"""One orbit and one fold by shooting, with any integrator that finds the stop of a slide."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import newton, root

from peers.oscillator import Counter, Failure, Integrator, Params, release

#: (t0, x0, t1, x1, t2, x2): the release and both stops.
Joints = tuple[float, ...]

#: Steps of Newton's iteration below which rounding rules: ten times that of times of size 10.
SMALLEST_STEP = 2e-14
#: The hybrid method asks for two equal estimates of convergence, which rounding spoils sooner.
SMALLEST_HYBRID = 1e-12
#: The square of the relative step of forward differences: not below the error of a coarse integration.
DIFFERENCE = 1e-10
#: Newton takes 3 to 6 iterations from the starts used here.
MOST_ITERATIONS = 30


def turn(
    t0: float, params: Params, how: Integrator, counter: Counter
) -> tuple[float, tuple[float, ...]]:
    """Return the next release after the one at t0, and the joints."""
    x0 = math.cos(params[0] * t0) - params[2]
    t1, z1 = how.slide(t0, x0, 1, params, counter)
    t2, z2 = how.slide(t1, float(z1[0]), -1, params, counter)
    x2 = float(z2[0])
    return release(t0 + 2 * math.pi / params[0], x2, params), (t0, x0, t1, float(z1[0]), t2, x2)


@dataclass(frozen=True)
class Turn:
    """One turn from a release: the next release, its derivatives by the first and by Omega, the joints."""

    after: float
    by_release: float
    by_omega: float
    joints: Joints


def turn_and_slopes(
    t0: float, params: Params, how: Integrator, counter: Counter, omega_too: bool = False
) -> Turn:
    """Return a turn with its derivatives.

    The variational equations are integrated along; at a joint the derivative of its time comes from the
    implicit function theorem (the velocity is zero on both sides, the acceleration jumps).
    """
    omega, S, S0 = params
    x0 = math.cos(omega * t0) - S0
    sine = math.sin(omega * t0)
    tangents = [(-omega * sine, -(math.cos(omega * t0) - S - x0))]
    if omega_too:
        tangents.append((-t0 * sine, 0.0))
    t1, z1 = how.slide(t0, x0, 1, params, counter, tangents)
    x1 = float(z1[0])
    force = math.cos(omega * t1) - x1
    # a stop that comes later by dt1 has the next slide begin later by as much
    jump = (force + S) / (force - S)
    tangents = [(z1[k], z1[k + 1] * jump) for k in range(2, len(z1), 2)]
    t2, z2 = how.slide(t1, x1, -1, params, counter, tangents)
    x2 = float(z2[0])
    t3 = release(t0 + 2 * math.pi / omega, x2, params)
    sine = math.sin(omega * t3)
    by_omega = (z2[4] + t3 * sine) / (-omega * sine) if omega_too else math.nan
    return Turn(t3, z2[2] / (-omega * sine), by_omega, (t0, x0, t1, x1, t2, x2))


def orbit_by_secant(t0: float, params: Params, how: Integrator) -> tuple[Joints, str]:
    """Joints of the orbit: secant method on the release time."""
    counter, period = Counter(), 2 * math.pi / params[0]
    tolerance = max(how.rtol, SMALLEST_STEP)
    try:
        t0 = newton(lambda t: turn(t, params, how, counter)[0] - t - period, t0, tol=tolerance)
    except RuntimeError as error:
        raise Failure("the secant method did not converge") from error
    return turn(t0, params, how, counter)[1], f"{counter.calls} {how.unit}"


def orbit_by_newton(t0: float, params: Params, how: Integrator) -> tuple[Joints, str]:
    """Joints of the orbit: Newton on the release time, with variational equations."""
    counter, period = Counter(), 2 * math.pi / params[0]
    for _ in range(MOST_ITERATIONS):
        found = turn_and_slopes(t0, params, how, counter)
        step = (found.after - t0 - period) / (1 - found.by_release)
        t0 += step
        if abs(step) < max(how.rtol, SMALLEST_STEP):
            return found.joints, f"{counter.calls} {how.unit}"
    raise Failure("Newton did not converge")


def fold_by_newton(
    t0: float, omega: float, S: float, S0: float, how: Integrator
) -> tuple[float, str]:
    """Omega of the fold: (release time, Omega) for "returns" and "slope 1", by MINPACK's hybrid method.

    The slope comes from the variational equations, the first Jacobian from forward differences.
    """
    counter = Counter()

    def equations(z: np.ndarray) -> np.ndarray:
        found = turn_and_slopes(z[0], (z[1], S, S0), how, counter)
        return np.array([found.after - z[0] - 2 * math.pi / z[1], found.by_release - 1])

    options = {"eps": max(how.rtol, DIFFERENCE), "xtol": max(how.rtol, SMALLEST_HYBRID)}
    found = root(equations, [t0, omega], method="hybr", options=options)
    if not found.success:
        raise Failure("scipy.optimize.root did not converge")
    return float(found.x[1]), f"{counter.calls} {how.unit}"
