"""Where Newton's method for an event of multipliers starts: approximate disturbances, in floating point."""

from __future__ import annotations

import numpy as np
from flint import arb

from contfric.certify.chain import Chain, Segments
from contfric.models.balls.build import ball_model
from contfric.models.balls.numbers import Vector
from contfric.models.definition import FloatArray
from contfric.orbit.orbit import Orbit


def null_vector(orbit: Orbit, segments: Segments, sigma: int) -> Vector:
    """Return the unit vector that the linearised chain at the printed orbit maps nearest to zero."""
    return [arb(float(x)) for x in np.linalg.svd(_linearised(orbit, segments, sigma))[2][-1]]


def pair_of(orbit: Orbit, segments: Segments) -> tuple[Vector, Vector]:
    """Return about (a, b, c, s) of a pair of multipliers ``c +- i s`` near the circle, and a functional.

    The disturbance ``a + i b`` is turned so that a and b are orthogonal; the functional is 1 of a, 0 of b.
    """
    plus, minus = (_linearised(orbit, segments, sigma) for sigma in (1, -1))
    mu = orbit.turn_multipliers
    upper = mu[mu.imag > 0]
    near = complex(upper[np.argmin(np.abs(np.abs(upper) - 1.0))]) if len(upper) else 1j
    near /= abs(near)
    vector = np.linalg.svd((plus + minus) / 2 + near * (plus - minus) / 2)[2][-1].conj()
    vector = vector * np.exp(-0.5j * np.angle(np.sum(vector * vector)))
    a, b = vector.real, vector.imag
    length = float(np.linalg.norm(a))
    start = [*(a / length), *(b / length), near.real, near.imag]
    return [arb(float(x)) for x in start], [arb(float(x)) for x in a / length]


def _linearised(orbit: Orbit, segments: Segments, sigma: int) -> FloatArray:
    model = ball_model(orbit.model, orbit.params)
    printed = [arb(float(x)) for x in orbit.joints.ravel()]
    _, rows = Chain(segments, model).linearised(printed, sigma)
    return np.array([[float(x.mid()) for x in row] for row in rows])
