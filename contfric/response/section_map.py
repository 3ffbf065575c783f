"""The section map at a phase of the excitation, its saddle, and how a start leaves that."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import ParameterError
from contfric.orbit.orbit import Orbit
from contfric.simulation.simulate import run
from contfric.simulation.starts import start_of

#: Step of the differences that make the derivative of f: the cube root of rounding, in sizes of the orbit.
_DIFFERENCE = 6e-6
#: One-sided slopes of f that differ by more than this, relative to their sum: f has a kink or a jump.
_KINK = 0.1
#: Distance, in sizes of the orbit, within which f is nearly linear and starts have come to the saddle.
NEAR = 0.02
#: Stable component, relative to that distance, at which the unstable one decides.
_ARRIVED = 1e-6
#: Share of the unstable component u below which the stable one, s, does not matter: the stable set is
#: u = a s**2 there, far below u. The unstable set is curved too: at a thousandth solutions had left before
#: it was reached, and u vanished far away, where it says nothing.
_SMALL = 0.1
#: Returns that a start may take to the saddle, and at it.
_ARRIVALS, _RETURNS = 40, 400


class SpentError(Exception):
    """The returns that a stretch may take are used up."""


class SectionMap:
    """The section map at a phase, and its saddle with both directions.

    Attributes
    ----------
    returns, most : how often the map was taken, and how often it may be
    """

    def __init__(self, orbit: Orbit, phase: float) -> None:
        self.orbit, self.phase = orbit, phase % 1.0
        self.time = self.phase * orbit.flow.period
        self.periods = orbit.periods
        self.saddle = orbit.state(self.time)
        self.size = float(np.max(np.ptp(orbit.trajectory(100)[1], axis=0)))
        self.returns, self.most = 0, math.inf

    def returned(self, state: FloatArray) -> FloatArray | None:
        """Return f at a state; None where the solution does not come back.

        Raises
        ------
        SpentError
            If it may not be taken more often.
        """
        if self.returns >= self.most:
            raise SpentError
        self.returns += 1
        model, vector = self.orbit.model, self.orbit.vector
        try:
            mode, on = start_of(model, self.time, state, vector, None)
        except ParameterError:
            return None
        ended = run(model, vector, mode, on, self.time, state, float(self.periods), 100_000)
        if ended.end.name == "HELD":
            return np.array(ended.last[2])
        return np.array(ended.last[2]) if ended.end.name == "TIME" else None

    @cached_property
    def _eigen(self) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """Stable vector; functionals of the unstable and the stable component; sign of the growth."""
        step = _DIFFERENCE * self.size
        columns = [self._slope(direction, step) for direction in np.eye(2)]
        values, right = np.linalg.eig(np.array(columns).T)
        values, right = np.real(values), np.real(right)
        stable, left = np.argmin(np.abs(values)), np.linalg.inv(right)
        return right[:, stable], left[1 - stable], left[stable], float(np.sign(values[1 - stable]))

    def _slope(self, direction: FloatArray, step: float) -> FloatArray:
        """Return the derivative of f at the saddle in a direction; that of one side where f jumps.

        An orbit that sticks slides off where it is pushed against a load above kinetic friction.
        """
        sides = [self.returned(self.saddle + s * step * direction) for s in (1.0, -1.0)]
        slopes = [
            s * (found - self.saddle) / step
            for s, found in zip((1.0, -1.0), sides, strict=True)
            if found is not None
        ]
        if not slopes:
            raise ParameterError(f"solutions near {self.orbit!r} do not return at this phase")
        small, large = min(slopes, key=np.linalg.norm), max(slopes, key=np.linalg.norm)
        apart = np.linalg.norm(large - small)
        smooth = apart <= _KINK * (np.linalg.norm(large) + np.linalg.norm(small))
        return np.asarray(0.5 * (small + large) if smooth else small)

    @property
    def stable(self) -> FloatArray:
        """Unit vector along the stable set at the saddle."""
        return self._eigen[0]

    def departure(self, state: FloatArray) -> float | None:
        """Return the unstable component with which a start has come to the saddle; None if it has not.

        Where the unstable multiplier is negative each return turns its sign: counted back to the start, it
        tells the sides of the stable set whatever the number of returns is.
        """
        _, growing, shrinking, turns = self._eigen
        came, last = False, 0.0
        for count in range(_RETURNS):
            apart = state - self.saddle
            unstable, stable = float(growing @ apart), abs(float(shrinking @ apart))
            near = np.hypot(*apart) < NEAR * self.size
            if came and not near:
                return last
            came, last = came or bool(near), unstable * turns**count
            if came and stable < max(_ARRIVED * self.size * NEAR, _SMALL * abs(unstable)):
                return last
            if not came and count >= _ARRIVALS:
                return None
            following = self.returned(state)
            if following is None:
                return None
            state = following
        return None
