"""One orbit by ``scipy.integrate.solve_bvp``: both slides at once on [0, 1], all Jacobians analytic."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp

from peers.oscillator import Failure, Params
from peers.shooting import Joints

#: Relative tolerance of the integration that the first guess is taken from: rough, as by eye.
ROUGH = 1e-3
#: More nodes than any solution here takes; the default is 1000.
MOST_NODES = 20_000


def rough_path(joints: Joints, params: Params, mesh: np.ndarray) -> np.ndarray:
    """Both slides on the mesh, by one rough integration from the release for the durations given."""
    omega, S, _ = params
    t0, x, t1, _, t2, _ = joints
    pieces = []
    for sign, begin, length in ((1, t0, t1 - t0), (-1, t1, t2 - t1)):
        path = solve_ivp(
            lambda t, z, sign=sign: (z[1], math.cos(omega * t) - sign * S - z[0]),
            (begin, begin + length),
            (x, 0.0),
            t_eval=begin + length * mesh,
            rtol=ROUGH,
        )
        pieces.append(path.y)
        x = path.y[0, -1]
    return np.vstack(pieces)


class Collocation:
    """Unknown parameters are the release, the two durations, and whatever a subclass adds."""

    def __init__(self, params: Params) -> None:
        self.params = params

    def omega_of(self, p: np.ndarray) -> float:
        """Omega, which a subclass has among its unknowns."""
        return self.params[0]

    def accelerations(self, s, y, p):
        """Accelerations of both slides, and their derivatives by time, on the mesh."""
        omega, S = self.omega_of(p), self.params[1]
        t = p[0] + p[1] * s, p[0] + p[1] + p[2] * s
        return (
            np.cos(omega * t[0]) - S - y[0],
            np.cos(omega * t[1]) + S - y[2],
            -omega * np.sin(omega * t[0]),
            -omega * np.sin(omega * t[1]),
        )

    def rate(self, s, y, p):
        """Right-hand side."""
        up, down, _, _ = self.accelerations(s, y, p)
        return np.array([p[1] * y[1], p[1] * up, p[2] * y[3], p[2] * down])

    def rate_derivatives(self, s, y, p):
        """Its derivatives by the state and by the parameters."""
        up, down, dup, ddown = self.accelerations(s, y, p)
        by_state = np.zeros((4, 4, s.size))
        by_state[0, 1], by_state[1, 0] = p[1], -p[1]
        by_state[2, 3], by_state[3, 2] = p[2], -p[2]
        by_param = np.zeros((4, len(p), s.size))
        by_param[0, 1], by_param[2, 2] = y[1], y[3]
        by_param[1, 0], by_param[1, 1] = p[1] * dup, up + p[1] * dup * s
        by_param[3, 0] = by_param[3, 1] = p[2] * ddown
        by_param[3, 2] = down + p[2] * ddown * s
        return by_state, by_param

    def boundary(self, a, b, p):
        """Released at the lower limit, at rest at both stops, back where it was released."""
        lower = a[0] - math.cos(self.omega_of(p) * p[0]) + self.params[2]
        return np.array([lower, a[1], b[1], a[2] - b[0], a[3], b[3], b[2] - a[0]])

    def boundary_derivatives(self, a, b, p):
        """Its derivatives by both ends and by the parameters."""
        omega = self.omega_of(p)
        da, db, dp = np.zeros((7, 4)), np.zeros((7, 4)), np.zeros((7, len(p)))
        da[0, 0] = da[1, 1] = da[3, 2] = da[4, 3] = 1
        db[2, 1] = db[5, 3] = db[6, 2] = 1
        db[3, 0] = da[6, 0] = -1
        dp[0, 0] = omega * math.sin(omega * p[0])
        return da, db, dp

    def solve(self, mesh: np.ndarray, guess: np.ndarray, start: np.ndarray, tol: float):
        """Return what ``solve_bvp`` returns, or fail."""
        found = solve_bvp(
            self.rate,
            self.boundary,
            mesh,
            guess,
            p=start,
            fun_jac=self.rate_derivatives,
            bc_jac=self.boundary_derivatives,
            tol=tol,
            max_nodes=MOST_NODES,
        )
        if not found.success:
            raise Failure(f"solve_bvp: {found.message}")
        return found


def joints_of(found) -> Joints:
    """Release and both stops of a solution."""
    (t0, up, down), y = found.p[:3], found.y
    joints = (t0, y[0, 0], t0 + up, y[0, -1], t0 + up + down, y[2, -1])
    return tuple(map(float, joints))


class OrbitByCollocation:
    """The task with its first guess, which is not timed."""

    def __init__(self, joints: Joints, params: Params, nodes: int) -> None:
        t0, _, t1, _, t2, _ = joints
        self.equations = Collocation(params)
        self.start = np.array([t0, t1 - t0, t2 - t1])
        self.mesh = np.linspace(0, 1, nodes)
        self.guess = rough_path(joints, params, self.mesh)

    def solve(self, tol: float) -> tuple[Joints, str]:
        """Joints of the orbit."""
        found = self.equations.solve(self.mesh, self.guess, self.start, tol)
        return joints_of(found), f"{found.x.size} nodes, mesh refined {found.niter - 1} times"
