"""A branch by shooting: arclength steps on (release time, Omega), folds located on the way."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from peers.oscillator import Counter, Failure, Integrator
from peers.shooting import MOST_ITERATIONS, SMALLEST_STEP, Joints, turn_and_slopes

#: A branch that is longer has lost its way: the one measured here takes some 80 points.
MOST_POINTS = 1000


@dataclass(frozen=True)
class Task:
    """A start, the length of the steps, and Omega at both ends: the lower one, and that after the fold.

    ``first`` is the step in Omega for a method that has no tangent to begin with.
    """

    t0: float
    omega: float
    S: float
    S0: float
    step: float
    first: float
    ends: tuple[float, float]


@dataclass(frozen=True)
class Followed:
    """What a method found: (Omega, joints) of each point, and Omega of the fold."""

    points: list[tuple[float, Joints]]
    fold: float


@dataclass(frozen=True)
class Place:
    """A point of the branch, its unit tangent, and the slope of the return less 1 (zero at a fold)."""

    z: np.ndarray
    tangent: np.ndarray
    slip: float
    joints: Joints


class Shooting:
    """Follows the branch with one integrator."""

    def __init__(self, task: Task, how: Integrator) -> None:
        self.task, self.how, self.counter = task, how, Counter()
        self.fold = math.nan

    def arrive(self, predicted: np.ndarray, normal: np.ndarray) -> Place:
        """Newton to the branch, in the line through a prediction with this normal."""
        z = predicted.copy()
        for _ in range(MOST_ITERATIONS):
            t0, omega = float(z[0]), float(z[1])
            found = turn_and_slopes(
                t0, (omega, self.task.S, self.task.S0), self.how, self.counter, True
            )
            slope = np.array([found.by_release - 1, found.by_omega + 2 * math.pi / omega**2])
            value = [found.after - t0 - 2 * math.pi / omega, normal @ (z - predicted)]
            step = np.linalg.solve(np.array([slope, normal]), value)
            if np.abs(step).max() < max(self.how.rtol, SMALLEST_STEP):
                tangent = np.array([-slope[1], slope[0]]) / np.linalg.norm(slope)
                tangent *= math.copysign(1, tangent @ normal)
                return Place(z, tangent, slope[0], found.joints)
            z = z - step
        raise Failure("Newton did not converge")

    def along(self, place: Place, step: float) -> Place:
        """One step of arclength."""
        return self.arrive(place.z + step * place.tangent, place.tangent)

    def locate_fold(self, place: Place) -> None:
        """Omega of the fold within the step from a place: where the slope of the return is 1.

        Omega is stationary there, so that half of the digits of the step are enough.
        """
        tolerance = math.sqrt(max(self.how.rtol, SMALLEST_STEP))
        step = brentq(lambda h: self.along(place, h).slip, 0, self.task.step, xtol=tolerance)
        self.fold = float(self.along(place, step).z[1])

    def side(self, place: Place, end: float) -> list[Place]:
        """Points from a place, without it, to the end that is reached with Omega decreasing."""
        found = []
        while len(found) < MOST_POINTS:
            following = self.along(place, self.task.step)
            if following.slip * place.slip < 0:
                self.locate_fold(place)
            if following.tangent[1] < 0 and following.z[1] < end:
                ratio = (end - place.z[1]) / (following.z[1] - place.z[1])
                predicted = place.z + ratio * (following.z - place.z)
                found.append(self.arrive(np.array([predicted[0], end]), np.array([0.0, -1.0])))
                return found
            found.append(following)
            place = following
        raise Failure("no end after many points")


def follow(task: Task, how: Integrator) -> tuple[Followed, str]:
    """Return the whole branch, from its lower end over the fold to its other end."""
    walk = Shooting(task, how)
    start = np.array([task.t0, task.omega])
    down = walk.arrive(start, np.array([0.0, -1.0]))
    up = Place(down.z, -down.tangent, down.slip, down.joints)
    places = [*walk.side(down, task.ends[0])[::-1], down, *walk.side(up, task.ends[1])]
    points = [(float(p.z[1]), p.joints) for p in places]
    if math.isnan(walk.fold):
        raise Failure("no fold on the way")
    return Followed(points, walk.fold), f"{len(points)} points, {walk.counter.calls} {how.unit}"
