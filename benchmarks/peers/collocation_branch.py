"""A branch by ``solve_bvp``: Omega one more unknown, a step of arclength one more boundary condition."""

from __future__ import annotations

import math

import numpy as np

from peers.arclength import MOST_POINTS, Followed, Task
from peers.collocation import Collocation, joints_of, rough_path
from peers.collocation_fold import fold_between
from peers.oscillator import Failure
from peers.shooting import Joints

#: Where (release, Omega) stand among the parameters (release, both durations, Omega).
_PLANE = [0, 3]


class ArclengthCollocation(Collocation):
    """Parameters are the release, both durations and Omega; the last condition is set before each solve."""

    def omega_of(self, p: np.ndarray) -> float:
        return p[3]

    def at(self, predicted: np.ndarray, normal: np.ndarray) -> ArclengthCollocation:
        """Set the line in the plane of release and Omega in which the solution is sought."""
        self.predicted, self.normal = predicted[_PLANE], normal
        return self

    def rate_derivatives(self, s, y, p):
        by_state, by_param = super().rate_derivatives(s, y, p)
        t = p[0] + p[1] * s, p[0] + p[1] + p[2] * s
        by_param[1, 3] = -p[1] * t[0] * np.sin(p[3] * t[0])
        by_param[3, 3] = -p[2] * t[1] * np.sin(p[3] * t[1])
        return by_state, by_param

    def boundary(self, a, b, p):
        return np.append(super().boundary(a, b, p), self.normal @ (p[_PLANE] - self.predicted))

    def boundary_derivatives(self, a, b, p):
        da, db, dp = super().boundary_derivatives(a, b, p)
        dp[0, 3] = p[0] * math.sin(p[3] * p[0])
        more = np.zeros((1, 4))
        last = more.copy()
        last[0, _PLANE] = self.normal
        return np.vstack([da, more]), np.vstack([db, more]), np.vstack([dp, last])


class BranchByCollocation:
    """The task with its first guess, which is not timed."""

    def __init__(self, task: Task, joints: Joints, nodes: int) -> None:
        self.task = task
        self.params = (task.omega, task.S, task.S0)
        self.equations = ArclengthCollocation(self.params)
        self.mesh = np.linspace(0, 1, nodes)
        self.guess = rough_path(joints, self.params, self.mesh)
        t0, _, t1, _, t2, _ = joints
        self.start = np.array([t0, t1 - t0, t2 - t1, task.omega])

    def follow(self, tol: float) -> tuple[Followed, str]:
        """Return the whole branch, from its lower end over the fold to its other end."""
        at = self.equations.at(self.start, np.array([0.0, 1.0]))
        first = at.solve(self.mesh, self.guess, self.start, tol)
        lower, _ = self._side(first, -1, self.task.ends[0], tol)
        upper, fold = self._side(first, 1, self.task.ends[1], tol)
        if math.isnan(fold):
            raise Failure("no fold on the way")
        found = [*lower[::-1], first, *upper]
        points = [(float(f.p[3]), joints_of(f)) for f in found]
        most = max(f.x.size for f in found)
        return Followed(points, fold), f"{len(points)} points, up to {most} nodes"

    def _side(self, place, sign: int, end: float, tol: float):
        """Points from a place, without it, to an end reached with Omega decreasing; and the fold."""
        before, tangent, found, fold = None, np.array([0.0, float(sign)]), [], math.nan
        while len(found) < MOST_POINTS:
            following = self._along(before, place, tangent, tol)
            chord = (following.p - place.p)[_PLANE]
            if chord[1] * tangent[1] < 0:
                fold = float(fold_between(place, following, self.params, tol).p[3])
            if chord[1] < 0 and following.p[3] < end:
                found.append(self._end(place, following, end, tol))
                return found, fold
            found.append(following)
            before, place, tangent = place, following, chord / np.linalg.norm(chord)
        raise Failure("no end after many points")

    def _along(self, before, place, tangent: np.ndarray, tol: float):
        """One step of arclength along the secant; the first step, without a secant, is one of Omega."""
        step, mesh = self.task.step, place.x
        if before is None:
            predicted = place.p + np.array([0, 0, 0, tangent[1] * self.task.first])
            return self.equations.at(predicted, np.array([0.0, 1.0])).solve(
                mesh, place.y, predicted, tol
            )
        ratio = step / np.linalg.norm((place.p - before.p)[_PLANE])
        predicted = place.p + ratio * (place.p - before.p)
        y = place.y + ratio * (place.y - before.sol(mesh))
        return self.equations.at(predicted, tangent).solve(mesh, y, predicted, tol)

    def _end(self, place, beyond, end: float, tol: float):
        """Return the point with Omega given, between two points."""
        ratio = (end - place.p[3]) / (beyond.p[3] - place.p[3])
        predicted = place.p + ratio * (beyond.p - place.p)
        predicted[3] = end
        y = place.y + ratio * (beyond.sol(place.x) - place.y)
        return self.equations.at(predicted, np.array([0.0, 1.0])).solve(place.x, y, predicted, tol)
