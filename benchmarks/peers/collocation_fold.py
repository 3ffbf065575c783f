"""One fold by ``solve_bvp``: the orbit together with its linearisation, which is singular there.

Both are solved at once on [0, 1]. Unknowns are position and velocity of both slides and the change of each
when the release is moved by 1 with Omega held; release, durations, Omega, and the changes of the
durations. At the fold the changed orbit is one again, to first order.
"""

from __future__ import annotations

import math

import numpy as np

from peers.collocation import Collocation, OrbitByCollocation
from peers.oscillator import Params
from peers.shooting import Joints

#: (release, both durations, Omega, changes of both durations) -> (begin, duration, Omega, change of the
#: begin less 1, change of the duration) of each slide: linear, so that derivatives follow by this matrix.
_UP = np.array(
    [
        [1, 0, 0, 0, 0, 0],
        [0, 1, 0, 0, 0, 0],
        [0, 0, 0, 1, 0, 0],
        [0, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, 1, 0],
    ]
)
_DOWN = np.array(
    [
        [1, 1, 0, 0, 0, 0],
        [0, 0, 1, 0, 0, 0],
        [0, 0, 0, 1, 0, 0],
        [0, 0, 0, 0, 1, 0],
        [0, 0, 0, 0, 0, 1],
    ]
)


class _Slide:
    """One slide with its change: rates and derivatives, on the mesh."""

    def __init__(self, s, y, q, friction: float) -> None:
        begin, self.d, omega, change, self.dd = q
        self.s, self.y = s, y
        self.t = begin + self.d * s
        self.change = 1 + change + self.dd * s  # of the time
        phase = omega * self.t
        self.sin, self.cos, self.omega = np.sin(phase), np.cos(phase), omega
        self.a = self.cos - friction - y[0]
        self.jerk = -omega * self.sin

    def rate(self):
        _, v, dx, dv = self.y
        bent = self.jerk * self.change - dx
        return (
            self.d * v,
            self.d * self.a,
            self.dd * v + self.d * dv,
            self.dd * self.a + self.d * bent,
        )

    def by_state(self, out) -> None:
        out[0, 1] = out[2, 3] = self.d
        out[1, 0] = out[3, 2] = -self.d
        out[2, 1], out[3, 0] = self.dd, -self.dd

    def by_own(self):
        """Derivatives by (begin, duration, Omega, change of the begin, change of the duration)."""
        s, d, dd, (_, v, dx, dv) = self.s, self.d, self.dd, self.y
        bend = -(self.omega**2) * self.cos * self.change  # of the changed acceleration, by time
        by_omega = -self.t * self.sin
        jerk_by_omega = -self.sin - self.omega * self.t * self.cos
        zero = np.zeros_like(s)
        by_begin = dd * self.jerk + d * bend
        return np.array(
            [
                [zero, v, zero, zero, zero],
                [d * self.jerk, self.a + d * self.jerk * s, d * by_omega, zero, zero],
                [zero, dv, zero, zero, v],
                [
                    by_begin,
                    self.jerk * self.change - dx + by_begin * s,
                    dd * by_omega + d * self.change * jerk_by_omega,
                    d * self.jerk,
                    self.a + d * self.jerk * s,
                ],
            ]
        )


class FoldCollocation(Collocation):
    """States (x, v, dx, dv) of both slides; parameters as in ``_UP``."""

    def _slides(self, s, y, p):
        S = self.params[1]
        return _Slide(s, y[:4], _UP @ p, S), _Slide(s, y[4:], _DOWN @ p, -S)

    def rate(self, s, y, p):
        up, down = self._slides(s, y, p)
        return np.array([*up.rate(), *down.rate()])

    def rate_derivatives(self, s, y, p):
        up, down = self._slides(s, y, p)
        by_state = np.zeros((8, 8, s.size))
        up.by_state(by_state[:4, :4])
        down.by_state(by_state[4:, 4:])
        own = [
            np.einsum("ijm,jk->ikm", up.by_own(), _UP),
            np.einsum("ijm,jk->ikm", down.by_own(), _DOWN),
        ]
        return by_state, np.concatenate(own)

    def boundary(self, a, b, p):
        t0, omega = p[0], p[3]
        places = [a[0] - math.cos(omega * t0) + self.params[2], a[4] - b[0], b[4] - a[0]]
        changes = [a[2] + omega * math.sin(omega * t0), a[6] - b[2], b[6] - a[2]]
        rests = [a[1], a[3], a[5], a[7], b[1], b[3], b[5], b[7]]
        return np.array([*places, *changes, *rests])

    def boundary_derivatives(self, a, b, p):
        t0, omega = p[0], p[3]
        da, db, dp = np.zeros((14, 8)), np.zeros((14, 8)), np.zeros((14, 6))
        for row, first in ((0, 0), (3, 2)):
            da[row, first] = da[row + 1, first + 4] = db[row + 2, first + 4] = 1
            db[row + 1, first] = da[row + 2, first] = -1
        for k, column in enumerate((1, 3, 5, 7)):
            da[6 + k, column] = db[10 + k, column] = 1
        sine, cosine = math.sin(omega * t0), math.cos(omega * t0)
        dp[0, 0], dp[0, 3] = omega * sine, t0 * sine
        dp[3, 0], dp[3, 3] = omega**2 * cosine, sine + omega * t0 * cosine
        return da, db, dp


def fold_between(earlier, later, params: Params, tol: float):
    """Solve for a fold from two neighbouring solutions with (release, durations, Omega) as parameters.

    Their difference for one unit of the release is the first guess of the changes.
    """
    mesh = later.x
    rise = later.p[0] - earlier.p[0]
    change = (later.y - earlier.sol(mesh)) / rise
    y = np.vstack([later.y[:2], change[:2], later.y[2:], change[2:]])
    start = np.concatenate([later.p[:4], (later.p[1:3] - earlier.p[1:3]) / rise])
    return FoldCollocation(params).solve(mesh, y, start, tol)


class FoldByCollocation:
    """The task with its first guess, two rough solutions before the fold, which is not timed."""

    #: Tolerance of the two solutions before the fold: that of a first look.
    ROUGH = 1e-3

    def __init__(self, starts: list[tuple[Joints, float]], S: float, S0: float, nodes: int) -> None:
        self.params = (math.nan, S, S0)
        self.guesses = []
        for joints, omega in starts:
            orbit = OrbitByCollocation(joints, (omega, S, S0), nodes)
            found = orbit.equations.solve(orbit.mesh, orbit.guess, orbit.start, self.ROUGH)
            found.p = np.append(found.p, omega)
            self.guesses.append(found)

    def solve(self, tol: float) -> tuple[float, str]:
        """Omega of the fold."""
        found = fold_between(*self.guesses, self.params, tol)
        remark = f"{found.x.size} nodes, mesh refined {found.niter - 1} times"
        return float(found.p[3]), remark
