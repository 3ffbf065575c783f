"""Directions of two curves of orbits at the orbit at which they cross.

The equations with the parameter have a plane of null vectors there. With w their left null vector, the one
equation that is left over begins with ``w F_zz(d, d)``, a quadratic form on the plane (Lyapunov and Schmidt).
Where it is regular the curves through the orbit are its two lines, or none.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.linear import equations_at, null_space
from contfric.orbit.orbit import Orbit

#: Null vectors where two curves may cross, and the directions between them that are tried: the corrector
#: reaches a curve from 30 degrees off it.
_PLANE, _ANGLES = 2, 12
#: Step of a second difference: it misses the derivative by the square of it, and by rounding over its square.
_DIFFERENCE = 1e-4
#: A quadratic form below the first number is such rounding; a discriminant below the second share of its
#: square is that of a double line.
_BENT, _CLEAR = 1e-6, 1e-3


def ways_in_plane(orbit: Orbit, active: int) -> Iterator[tuple[FloatArray, float]]:
    """Yield directions in the plane of two null vectors, with the share of the parameter where it is known.

    None where the curve has a unique direction. Where the form is not regular those at regular angles are
    yielded, in the joints alone.
    """
    vectors, slopes = null_space(orbit.system, orbit.joints, orbit.vector, active)
    if len(vectors) != _PLANE:
        return
    lines = _lines(orbit, active, vectors, slopes)
    regular = np.arange(_ANGLES) * (2.0 * np.pi / _ANGLES)
    for angle in regular if lines is None else lines:
        away = np.cos(angle) * vectors[0] + np.sin(angle) * vectors[1]
        share = 0.0 if lines is None else np.cos(angle) * slopes[0] + np.sin(angle) * slopes[1]
        size = np.abs(away).max()
        yield away / size, float(share / size)


def _lines(orbit: Orbit, active: int, vectors: FloatArray, slopes: FloatArray) -> FloatArray | None:
    """Return the angles in the plane of two null vectors at which curves leave; None if that is not clear."""
    _, *columns = equations_at(orbit.system, orbit.joints, orbit.vector, (active,))
    full = np.hstack(columns)
    left = np.linalg.svd(full)[0][:, -1]
    form = [
        _bent(orbit, active, left, c * vectors[0] + s * vectors[1], c * slopes[0] + s * slopes[1])
        for c, s in ((1.0, 0.0), (0.0, 1.0), (np.sqrt(0.5), np.sqrt(0.5)))
    ]
    one, other, mixed = form[0], form[1], form[2] - 0.5 * (form[0] + form[1])
    size = max(abs(one), abs(other), abs(mixed))
    inside = mixed * mixed - one * other
    if not np.isfinite(form).all() or size < _BENT or abs(inside) < _CLEAR * size * size:
        return None
    if inside < 0.0:
        return np.empty(0)
    middle, half = np.arctan2(mixed, 0.5 * (one - other)), np.hypot(mixed, 0.5 * (one - other))
    # one c^2 + 2 mixed c s + other s^2 = (one + other) / 2 + half cos(2 angle - middle)
    turn = float(np.arccos(np.clip(-0.5 * (one + other) / half, -1.0, 1.0)))
    rays = [0.5 * (middle + turn), 0.5 * (middle - turn)]
    return np.array([*rays, *(ray + np.pi for ray in rays)])


def _bent(orbit: Orbit, active: int, left: FloatArray, along: FloatArray, slope: float) -> float:
    """Return the second derivative of a combination of the equations in a direction, by differences."""
    total = 0.0
    for step in (-_DIFFERENCE, 0.0, _DIFFERENCE):
        vector = orbit.vector.copy()
        vector[active] += step * slope
        residual = equations_at(orbit.system, orbit.joints + step * along, vector)[0]
        total += float(left @ residual) * (-2.0 if step == 0.0 else 1.0)
    return total / _DIFFERENCE**2
