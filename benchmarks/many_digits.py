"""The 40-digit reference: slides in closed form, and Newton with differences exact for the purpose.

It shares nothing with the library, and nothing with the peers, but rough starts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import numpy as np
from mpmath import mp, mpf
from scipy.optimize import brentq

DIGITS = 40
#: Working digits of Newton, whose differences of 10^-DIFFERENCE are then exact to twice that.
WORKING, DIFFERENCE = 120, 30
#: From a start of three digits Newton moves less than this to the fold that is meant.
NEAR = mpf("0.01")
#: Newton takes 6 to 10 iterations from three digits to forty.
MOST_ITERATIONS = 60
#: Places where the velocity is looked at, over two periods: slides last at least 1, or 300 of these.
GRID = 4001
#: Newton from a root in double precision: 15, 30, 60, 120 digits, and one to spare.
POLISH = 5
#: A distance is iterated until it changes by less: 3 digits more than double precision has.
SETTLED = mpf(10) ** -20
#: Step of the differences for an approximate Jacobian in double precision: good to 10 digits.
ROUGH = 1e-6


class Reference:
    """Orbit 1a, its fold, its branch, and a simulation."""

    def __init__(self, S: float, S0: float) -> None:
        self.S, self.S0 = mpf(S), mpf(S0)

    def after(self, sign: int, omega: Any, t0: Any, x0: Any, t: Any, lib: Any = mp) -> tuple:
        """Return position and velocity at t of a slide that starts at rest at (t0, x0)."""
        S = self.S if lib is mp else float(self.S)
        gain = 1 / (1 - omega**2)
        a = x0 + sign * S - gain * lib.cos(omega * t0)
        b = gain * omega * lib.sin(omega * t0)
        c, d = lib.cos(t - t0), lib.sin(t - t0)
        x = -sign * S + gain * lib.cos(omega * t) + a * c + b * d
        return x, -gain * omega * lib.sin(omega * t) - a * d + b * c

    def walk(self, times: Sequence, omega: Any, lib: ModuleType | Any = mp) -> tuple[list, list]:
        """Return (velocities at both stops, failure to close) and the positions of the joints."""
        t0, t1, t2 = times
        x0 = lib.cos(omega * t0) - (self.S0 if lib is mp else float(self.S0))
        x1, v1 = self.after(1, omega, t0, x0, t1, lib)
        x2, v2 = self.after(-1, omega, t1, x1, t2, lib)
        return [v1, v2, x2 - x0], [x0, x1, x2]

    def orbit(self, omega: Any, times: Sequence) -> list:
        """Return [t0, x0, t1, x1, t2, x2] from a start."""
        with mp.workdps(WORKING):
            omega = mpf(omega)
            t = newton(lambda t: self.walk(t, omega)[0], times)
            x = self.walk(t, omega)[1]
            return [t[0], x[0], t[1], x[1], t[2], x[2]]

    def fold(self, omega: Any, times: Sequence) -> Any:
        """Return Omega where the Jacobian of the orbit is singular, from a start of three digits."""
        with mp.workdps(WORKING):

            def equations(z: list) -> list:
                value = self.walk(z[:3], z[3])[0]
                return [*value, mp.det(jacobian(lambda t: self.walk(t, z[3])[0], z[:3]))]

            found = newton(equations, [*times, omega])
            moves = [abs(a - mpf(b)) for a, b in zip(found, [*times, omega], strict=True)]
            if max(moves) > NEAR:
                raise AssertionError("the reference left its start")
            return found[3]

    def distance(self, omega: float, joints: Sequence[float]) -> float:
        """Return how far a point is from the curve of orbits: the largest one over Omega and joints.

        The point of the curve is the one in the plane through the given point that is normal to the
        curve, in the space of the times and Omega. The Jacobian in double precision serves all iterations:
        residuals have all digits, so that only the number of iterations depends on it.
        """
        given = [joints[0], joints[2], joints[4], omega]
        matrix = self._rough_jacobian(given)
        inverse = np.linalg.inv(np.vstack([matrix, np.linalg.svd(matrix)[2][-1]])).tolist()
        with mp.workdps(DIGITS):
            exact = [mpf(v) for v in given]
            for _ in range(MOST_ITERATIONS):
                values, x = self.walk(exact[:3], exact[3])
                # the last row keeps the iteration in the plane, where it begins
                step = [sum(r * v for r, v in zip(row, values, strict=False)) for row in inverse]
                if max(map(abs, step)) < SETTLED:
                    pairs = zip([*exact, *x], [*given, *joints[1::2]], strict=True)
                    return float(max(abs(a - mpf(float(b))) for a, b in pairs))
                exact = [a - b for a, b in zip(exact, step, strict=True)]
        return math.inf

    def _rough_jacobian(self, z: Sequence[float]) -> np.ndarray:
        columns = []
        for k in range(4):
            pair = []
            for side in (ROUGH, -ROUGH):
                moved = [float(v) for v in z]
                moved[k] += side
                pair.append(np.array(self.walk(moved[:3], moved[3], math)[0]))
            columns.append((pair[0] - pair[1]) / (2 * ROUGH))
        return np.array(columns).T

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

    def _release(self, omega: Any, t: Any, x: Any) -> Any:
        found = []
        for level in (x - self.S0, x + self.S0):
            if abs(level) <= 1:
                for phase in (mp.acos(level), 2 * mp.pi - mp.acos(level)):
                    laps = mp.ceil((omega * t - phase) / (2 * mp.pi))
                    found.append((phase + 2 * mp.pi * laps) / omega)
        return min(found)

    def _stop(self, sign: int, omega: Any, t0: Any, x0: Any) -> tuple:
        """First zero of the velocity: a fine grid in double precision, then Newton."""
        w, S, start, place = map(float, (omega, self.S, mp.fmod(t0, 2 * mp.pi / omega), x0))
        gain = 1 / (1 - w**2)
        a = place + sign * S - gain * math.cos(w * start)
        b = gain * w * math.sin(w * start)

        def v(tau: Any) -> Any:
            return -gain * w * np.sin(w * (start + tau)) - a * np.sin(tau) + b * np.cos(tau)

        grid = np.linspace(0, 4 * math.pi / w, GRID)[1:]
        after = int(np.argmax(sign * v(grid) < 0))
        t = t0 + mpf(brentq(v, grid[after - 1], grid[after]))
        for _ in range(POLISH):
            x, rate = self.after(sign, omega, t0, x0, t)
            t -= rate / (mp.cos(omega * t) - sign * self.S - x)
        return t, self.after(sign, omega, t0, x0, t)[0]


def jacobian(equations: Callable[[list], list], z: Sequence) -> Any:
    """Return the Jacobian by central differences."""
    e = mpf(10) ** -DIFFERENCE
    matrix = mp.zeros(len(z))
    for k in range(len(z)):
        up, down = list(z), list(z)
        up[k] += e
        down[k] -= e
        for i, (a, b) in enumerate(zip(equations(up), equations(down), strict=True)):
            matrix[i, k] = (a - b) / (2 * e)
    return matrix


def newton(equations: Callable[[list], list], start: Sequence) -> list:
    """Solve a square system to DIGITS digits."""
    z = [mpf(v) for v in start]
    for _ in range(MOST_ITERATIONS):
        step = mp.lu_solve(jacobian(equations, z), mp.matrix(equations(z)))
        z = [a - b for a, b in zip(z, step, strict=True)]
        if mp.norm(step, mp.inf) < mpf(10) ** -DIGITS:
            return z
    raise AssertionError("the reference did not converge")


def farthest(found: Sequence, exact: Sequence) -> float:
    """Return the largest distance of pairs, taken in many digits."""
    with mp.workdps(DIGITS):
        return float(max(abs(mpf(a) - b) for a, b in zip(found, exact, strict=True)))
