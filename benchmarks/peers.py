"""What one would write with scipy for the same questions, and a 40-digit reference.

The oscillator is ``x'' + x = cos(Omega t) - S sgn(x')``, held at rest while ``|x - cos(Omega t)| <= S0``.
The orbit is 1a: released at the lower limit at t0, up to the stop at t1, down to the stop at t2, held
until t0 + T. Every peer types this order of segments by hand, takes the stick in closed form, and has
analytic derivatives where its solver accepts them. Nothing of contfric is used here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from mpmath import mp, mpf
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import brentq, newton, root

DIGITS = 40
#: Working digits of the reference: its Newton takes differences of 10^-DIFFERENCE.
WORKING, DIFFERENCE = 120, 30


class Failure(Exception):
    """A method gave no result; the text says why."""


@dataclass
class Counter:
    """Evaluations of a right-hand side."""

    calls: int = 0


# ------------------------------------------------------------------------------ scipy, shooting


@dataclass(frozen=True)
class Shooting:
    """How a slide is integrated: relative (and absolute) tolerance, and whether its stop is refined."""

    rtol: float
    refined: bool = False


def _stop(sign: int):  # type: ignore[no-untyped-def]
    def velocity(t: float, z: np.ndarray) -> float:
        return z[1]

    velocity.terminal = True  # type: ignore[attr-defined]
    velocity.direction = -sign  # type: ignore[attr-defined]
    return velocity


_STOPS = {sign: _stop(sign) for sign in (1, -1)}


def slide(
    t: float,
    x: float,
    sign: int,
    params: tuple[float, float, float],
    how: Shooting,
    counter: Counter,
    tangent: tuple[float, float] | None = None,
) -> tuple[float, np.ndarray]:
    """Return time and state at the stop that ends a slide; DOP853 with a terminal event.

    scipy takes time and state of an event from the interpolant of a step. If they are to be refined, the
    last step is repeated to the event, and the rest of the velocity is removed by Newton.

    With ``tangent``, the derivatives of position and velocity with respect to a parameter are carried along.
    """
    omega, S, _ = params
    if tangent is None:

        def rate(t, z):
            return (z[1], math.cos(omega * t) - sign * S - z[0])

        start = (x, 0.0)
    else:

        def rate(t, z):
            return (z[1], math.cos(omega * t) - sign * S - z[0], z[3], -z[2])

        start = (x, 0.0, *tangent)
    options = {"method": "DOP853", "rtol": how.rtol, "atol": how.rtol}
    until = t + 4 * math.pi / omega
    found = solve_ivp(rate, (t, until), start, events=_STOPS[sign], **options)
    counter.calls += found.nfev
    if not found.success or found.t_events[0].size == 0:
        raise Failure("a slide without a stop")
    end, z = float(found.t_events[0][0]), found.y_events[0][0]
    if end <= t + 1e-9:
        raise Failure("the event was not seen: the slide ends where it starts")
    if how.refined:
        before = float(found.t[-2])
        last = solve_ivp(rate, (before, end), found.y[:, -2], first_step=end - before, **options)
        counter.calls += last.nfev + 1
        z = last.y[:, -1]
        slope = np.array(rate(end, z))
        step = -z[1] / slope[1]
        end, z = end + step, z + step * slope
    return end, z


def release(t: float, x: float, params: tuple[float, float, float]) -> float:
    """Return the first time after t at which the load of a mass held at x falls to -S0."""
    omega, _, S0 = params
    if abs(x + S0) > 1:
        raise Failure("a stick without a release")
    phase = 2 * math.pi - math.acos(x + S0)
    return (phase + 2 * math.pi * math.ceil((omega * t - phase) / (2 * math.pi))) / omega


def turn(
    t0: float, params: tuple[float, float, float], how: Shooting, counter: Counter
) -> tuple[float, tuple[float, ...]]:
    """Return the next release after the one at t0, and (t0, x0, t1, x1, t2, x2)."""
    omega, _, S0 = params
    x0 = math.cos(omega * t0) - S0
    t1, z1 = slide(t0, x0, 1, params, how, counter)
    t2, z2 = slide(t1, z1[0], -1, params, how, counter)
    return release(t2, z2[0], params), (t0, x0, t1, float(z1[0]), t2, float(z2[0]))


def turn_and_slope(
    t0: float, params: tuple[float, float, float], how: Shooting, counter: Counter
) -> tuple[float, float, tuple[float, ...]]:
    """Return as :func:`turn`, with the derivative of the next release by that at t0.

    The variational equations are integrated along; at a joint the derivative of its time comes from the
    implicit function theorem (the velocity is zero on both sides, the acceleration jumps).
    """
    omega, S, S0 = params
    x0 = math.cos(omega * t0) - S0
    start = (-omega * math.sin(omega * t0), -(math.cos(omega * t0) - S - x0))
    t1, z1 = slide(t0, x0, 1, params, how, counter, start)
    force = math.cos(omega * t1) - z1[0]
    dt1 = -z1[3] / (force - S)
    t2, z2 = slide(t1, z1[0], -1, params, how, counter, (z1[2], -(force + S) * dt1))
    t3 = release(t2, z2[0], params)
    slope = z2[2] / (-omega * math.sin(omega * t3))
    return t3, slope, (t0, x0, t1, float(z1[0]), t2, float(z2[0]))


def orbit_by_secant(
    t0: float, params: tuple[float, float, float], how: Shooting
) -> tuple[tuple[float, ...], str]:
    """Joints of the orbit: secant method on the release time."""
    counter, period = Counter(), 2 * math.pi / params[0]
    try:
        t0 = newton(lambda t: turn(t, params, how, counter)[0] - t - period, t0, tol=how.rtol)
    except RuntimeError as error:
        raise Failure("the secant method did not converge") from error
    return turn(t0, params, how, counter)[1], f"{counter.calls} evaluations"


def orbit_by_newton(
    t0: float, params: tuple[float, float, float], how: Shooting
) -> tuple[tuple[float, ...], str]:
    """Joints of the orbit: Newton on the release time, with variational equations."""
    counter, period = Counter(), 2 * math.pi / params[0]
    for _ in range(30):
        after, slope, joints = turn_and_slope(t0, params, how, counter)
        step = (after - t0 - period) / (1 - slope)
        t0 += step
        if abs(step) < how.rtol:
            return joints, f"{counter.calls} evaluations"
    raise Failure("Newton did not converge")


def fold_by_newton(
    t0: float, omega: float, S: float, S0: float, how: Shooting
) -> tuple[float, str]:
    """Omega of the fold: (release time, Omega) for "returns" and "slope 1", by MINPACK's hybrid method.

    The slope comes from the variational equations, the first Jacobian from forward differences.
    """
    counter = Counter()

    def equations(z):
        after, slope, _ = turn_and_slope(z[0], (z[1], S, S0), how, counter)
        return np.array([after - z[0] - 2 * math.pi / z[1], slope - 1])

    options = {"eps": max(how.rtol, 1e-10), "xtol": how.rtol}
    found = root(equations, [t0, omega], method="hybr", options=options)
    if not found.success:
        raise Failure("scipy.optimize.root did not converge")
    return float(found.x[1]), f"{counter.calls} evaluations"


# ---------------------------------------------------------------------- closed form, interpreted


def slide_in_closed_form(
    t0: float, x0: float, sign: int, params: tuple[float, float, float]
) -> tuple[float, float]:
    """Return time and position of the stop that ends a slide: steps of 0.2, then brentq."""
    omega, S, _ = params
    gain = 1 / (1 - omega**2)
    a = x0 + sign * S - gain * math.cos(omega * t0)
    b = gain * omega * math.sin(omega * t0)

    def velocity(tau: float) -> float:
        forced = -gain * omega * math.sin(omega * (t0 + tau))
        return forced - a * math.sin(tau) + b * math.cos(tau)

    tau = 0.2
    while sign * velocity(tau) > 0:
        tau += 0.2
    tau = brentq(velocity, tau - 0.2, tau, xtol=1e-15) if tau > 0.3 else math.nan
    forced = -sign * S + gain * math.cos(omega * (t0 + tau))
    return t0 + tau, forced + a * math.cos(tau) + b * math.sin(tau)


def orbit_in_closed_form(
    t0: float, params: tuple[float, float, float]
) -> tuple[tuple[float, ...], str]:
    """Joints of the orbit: secant method on the release time, slides in closed form, no compiler."""
    omega, _, S0 = params
    turns = 0

    def joints_from(t: float) -> tuple[float, ...]:
        nonlocal turns
        turns += 1
        x0 = math.cos(omega * t) - S0
        t1, x1 = slide_in_closed_form(t, x0, 1, params)
        t2, x2 = slide_in_closed_form(t1, x1, -1, params)
        return t, x0, t1, x1, t2, x2

    def slip(t: float) -> float:
        joints = joints_from(t)
        return release(*joints[4:], params) - t - 2 * math.pi / omega

    try:
        t0 = newton(slip, t0, tol=1e-13)
    except RuntimeError as error:
        raise Failure("the secant method did not converge") from error
    return joints_from(t0), f"{turns} turns"


# --------------------------------------------------------------------------- scipy, collocation


class Collocation:
    """Both slides at once on [0, 1]; unknown parameters are the release and the two durations."""

    def __init__(self, joints: tuple[float, ...], params: tuple[float, float, float], nodes: int):
        self.params = params
        t0, _, t1, _, t2, _ = joints
        self.start = np.array([t0, t1 - t0, t2 - t1])
        self.mesh = np.linspace(0, 1, nodes)
        # the first guess is one rough integration from the start, as a user would have it
        pieces = []
        x = joints[1]
        for sign, begin, length in ((1, t0, t1 - t0), (-1, t1, t2 - t1)):
            path = solve_ivp(
                lambda t, z, sign=sign: (
                    z[1],
                    math.cos(params[0] * t) - sign * params[1] - z[0],
                ),
                (begin, begin + length),
                (x, 0.0),
                t_eval=begin + length * self.mesh,
                rtol=1e-3,
            )
            pieces.append(path.y)
            x = path.y[0, -1]
        self.guess = np.vstack(pieces)

    def accelerations(self, s, y, p):
        omega, S, _ = self.params
        t = p[0] + p[1] * s, p[0] + p[1] + p[2] * s
        return (
            np.cos(omega * t[0]) - S - y[0],
            np.cos(omega * t[1]) + S - y[2],
            -omega * np.sin(omega * t[0]),
            -omega * np.sin(omega * t[1]),
        )

    def rate(self, s, y, p):
        up, down, _, _ = self.accelerations(s, y, p)
        return np.array([p[1] * y[1], p[1] * up, p[2] * y[3], p[2] * down])

    def rate_derivatives(self, s, y, p):
        up, down, dup, ddown = self.accelerations(s, y, p)
        by_state = np.zeros((4, 4, s.size))
        by_state[0, 1], by_state[1, 0] = p[1], -p[1]
        by_state[2, 3], by_state[3, 2] = p[2], -p[2]
        by_param = np.zeros((4, 3, s.size))
        by_param[0, 1], by_param[2, 2] = y[1], y[3]
        by_param[1, 0], by_param[1, 1] = p[1] * dup, up + p[1] * dup * s
        by_param[3, 0] = by_param[3, 1] = p[2] * ddown
        by_param[3, 2] = down + p[2] * ddown * s
        return by_state, by_param

    def boundary(self, a, b, p):
        omega, _, S0 = self.params
        lower = a[0] - math.cos(omega * p[0]) + S0
        return np.array([lower, a[1], b[1], a[2] - b[0], a[3], b[3], b[2] - a[0]])

    def boundary_derivatives(self, a, b, p):
        omega = self.params[0]
        da, db, dp = np.zeros((7, 4)), np.zeros((7, 4)), np.zeros((7, 3))
        da[0, 0] = da[1, 1] = da[3, 2] = da[4, 3] = 1
        db[2, 1] = db[5, 3] = db[6, 2] = 1
        db[3, 0] = da[6, 0] = -1
        dp[0, 0] = omega * math.sin(omega * p[0])
        return da, db, dp

    def solve(self, tol: float) -> tuple[tuple[float, ...], str]:
        found = solve_bvp(
            self.rate,
            self.boundary,
            self.mesh,
            self.guess,
            p=self.start,
            fun_jac=self.rate_derivatives,
            bc_jac=self.boundary_derivatives,
            tol=tol,
            max_nodes=20_000,
        )
        if not found.success:
            raise Failure(f"solve_bvp: {found.message}")
        t0, up, down = found.p
        y = found.y
        joints = (t0, y[0, 0], t0 + up, y[0, -1], t0 + up + down, y[2, -1])
        return tuple(
            map(float, joints)
        ), f"{found.x.size} nodes, mesh refined {found.niter - 1} times"


# ---------------------------------------------------------------------------- scipy, simulation


def simulate(
    x: float, periods: int, params: tuple[float, float, float], how: Shooting
) -> tuple[list[tuple[int, float]], str]:
    """Events (completed periods, phase) from rest at (0, x); which slide follows a stop is decided there."""
    omega, _, S0 = params
    period, counter = 2 * math.pi / omega, Counter()
    t, cycle, events, held = 0.0, 0, [], False
    while True:
        load = x - math.cos(omega * t)
        held = not held and abs(load) <= S0  # a stick is never followed by another
        if held:
            t = first_release(t, x, params)
        else:
            t, z = slide(t, x, -1 if load > 0 else 1, params, how, counter)
            x = float(z[0])
        extra = math.floor(t / period)
        cycle, t = cycle + extra, t - extra * period
        if cycle >= periods:
            return events, f"{counter.calls} evaluations"
        events.append((cycle, t))


def first_release(t: float, x: float, params: tuple[float, float, float]) -> float:
    """Return the first time after t at which the load of a mass held at x reaches S0 or -S0."""
    omega, _, S0 = params
    found = []
    for level in (x - S0, x + S0):
        if abs(level) > 1:
            continue
        for phase in (math.acos(level), 2 * math.pi - math.acos(level)):
            laps = math.ceil((omega * t - phase) / (2 * math.pi))
            found.append((phase + 2 * math.pi * laps) / omega)
    if not found:
        raise Failure("held for ever")
    return min(found)


# ------------------------------------------------------------------------------------ reference


class Reference:
    """Closed form of a slide in mpmath, and Newton with differences that are exact for the purpose."""

    def __init__(self, S: float, S0: float):
        self.S, self.S0 = mpf(S), mpf(S0)

    def after(self, sign, omega, t0, x0, t):
        """Return position and velocity at t of a slide that starts at rest at (t0, x0)."""
        gain = 1 / (1 - omega**2)
        a = x0 + sign * self.S - gain * mp.cos(omega * t0)
        b = gain * omega * mp.sin(omega * t0)
        c, d = mp.cos(t - t0), mp.sin(t - t0)
        x = -sign * self.S + gain * mp.cos(omega * t) + a * c + b * d
        return x, -gain * omega * mp.sin(omega * t) - a * d + b * c

    def walk(self, times, omega):
        """Return (velocities at both stops, failure to close) and the positions of the joints."""
        t0, t1, t2 = times
        x0 = mp.cos(omega * t0) - self.S0
        x1, v1 = self.after(1, omega, t0, x0, t1)
        x2, v2 = self.after(-1, omega, t1, x1, t2)
        return [v1, v2, x2 - x0], [x0, x1, x2]

    def orbit(self, omega: float, times) -> list:
        """Return [t0, x0, t1, x1, t2, x2] from a start."""
        with mp.workdps(WORKING):
            omega = mpf(omega)
            t = _newton(lambda t: self.walk(t, omega)[0], times)
            x = self.walk(t, omega)[1]
            return [t[0], x[0], t[1], x[1], t[2], x[2]]

    def fold(self, omega: float, times):
        """Return Omega where the Jacobian of the orbit is singular, from a start of three digits."""
        with mp.workdps(WORKING):

            def equations(z):
                value = self.walk(z[:3], z[3])[0]
                return [*value, mp.det(_jacobian(lambda t: self.walk(t, z[3])[0], z[:3]))]

            found = _newton(equations, [*times, omega])
            moves = [abs(a - mpf(b)) for a, b in zip(found, [*times, omega], strict=True)]
            if max(moves) > mpf("0.01"):
                raise AssertionError("the reference left its start")
            return found[3]

    def simulate(self, x: float, periods: int, omega: float) -> list:
        """Return the absolute times of the events from rest at (0, x)."""
        with mp.workdps(2 * DIGITS):
            omega, x, t = mpf(omega), mpf(x), mpf(0)
            end, events, held = 2 * mp.pi / omega * periods, [], False
            while True:
                load = x - mp.cos(omega * t)
                if not held and abs(load) <= self.S0:
                    held, t = True, self._release(omega, t, x)
                else:
                    held, sign = False, -1 if load > 0 else 1
                    t, x = self._stop(sign, omega, t, x)
                if t >= end:
                    return events
                events.append(t)

    def _release(self, omega, t, x):
        found = []
        for level in (x - self.S0, x + self.S0):
            if abs(level) <= 1:
                for phase in (mp.acos(level), 2 * mp.pi - mp.acos(level)):
                    laps = mp.ceil((omega * t - phase) / (2 * mp.pi))
                    found.append((phase + 2 * mp.pi * laps) / omega)
        return min(found)

    def _stop(self, sign, omega, t0, x0):
        """First zero of the velocity: a fine grid in double precision, then Newton."""
        w, S, start, place = map(float, (omega, self.S, t0, x0))
        gain = 1 / (1 - w**2)
        a = place + sign * S - gain * math.cos(w * start)
        b = gain * w * math.sin(w * start)

        def v(tau):
            return -gain * w * np.sin(w * (start + tau)) - a * np.sin(tau) + b * np.cos(tau)

        grid = np.linspace(0, 4 * math.pi / w, 4001)[1:]
        after = int(np.argmax(sign * v(grid) < 0))
        t = t0 + mpf(brentq(v, grid[after - 1], grid[after]))
        for _ in range(5):
            x, rate = self.after(sign, omega, t0, x0, t)
            t -= rate / (mp.cos(omega * t) - sign * self.S - x)
        return t, self.after(sign, omega, t0, x0, t)[0]


def _jacobian(equations, z):
    e = mpf(10) ** -DIFFERENCE
    jacobian = mp.zeros(len(z))
    for k in range(len(z)):
        up, down = list(z), list(z)
        up[k] += e
        down[k] -= e
        for i, (a, b) in enumerate(zip(equations(up), equations(down), strict=True)):
            jacobian[i, k] = (a - b) / (2 * e)
    return jacobian


def _newton(equations, start):
    z = [mpf(v) for v in start]
    for _ in range(60):
        step = mp.lu_solve(_jacobian(equations, z), mp.matrix(equations(z)))
        z = [a - b for a, b in zip(z, step, strict=True)]
        if mp.norm(step, mp.inf) < mpf(10) ** -DIGITS:
            return z
    raise AssertionError("the reference did not converge")
