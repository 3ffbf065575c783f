"""How far errors of a chain's equations move an event's parameter or a duration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.base.interrupts import held_back
from contfric.bvp.linear import linearised, null_space, stacked
from contfric.continuation.points import Point
from contfric.orbit.orbit import Orbit

#: Units of rounding in one equation of a segment: its phases, its duration and its state have some each.
UNITS = 4.0
#: Unknowns of the largest system that is solved as a full matrix; a longer one is solved as a sparse one.
_FULL = 200


def moved_by_errors(orbit: Orbit, active: int, row: FloatArray, left: float) -> float | None:
    """Return how far the errors of all equations move the parameter.

    ``row`` is the gradient of the condition, and ``left`` its error.
    """
    wanted = np.zeros(orbit.joints.size + 1)
    wanted[-1] = 1.0  # the parameter is the last unknown
    found = _moved(orbit, active, row, wanted)
    if found is None:
        return None
    moved, by_condition = found
    own = np.finfo(float).eps * abs(float(orbit.vector[active]))
    return moved + by_condition * left + own


def duration_error(orbit: Orbit, active: int, segment: int) -> float | None:
    """Return how far the same errors move the duration of a segment, on the curve of orbits through one.

    None where that curve has no unique direction: the equations leave the duration free then.
    """
    vectors, shares = null_space(orbit.system, orbit.joints, orbit.vector, active)
    if len(vectors) != 1:
        return None
    count, m = orbit.joints.shape
    wanted = np.zeros(count * m + 1)
    wanted[segment * m] -= 1.0
    wanted[(segment + 1) % count * m] += 1.0
    found = _moved(orbit, active, np.append(vectors[0].ravel(), shares[0]), wanted)
    return None if found is None else found[0]


def _moved(
    orbit: Orbit, active: int, row: FloatArray, wanted: FloatArray
) -> tuple[float, float] | None:
    """Return how far the errors of all equations move a sum of unknowns, and a unit of the condition's.

    ``wanted`` has the shares of the unknowns in that sum, joints and parameter.
    """
    a, b, c, close, residual = linearised(orbit.system, orbit.joints, orbit.vector, (active,))
    b[-1] = b[-1] @ close
    weights = _weights(a, b, c[:, :, 0], row, wanted)
    if weights is None or not np.isfinite(weights).all():
        return None
    errors = np.abs(residual) + _rounding(orbit)
    return float(np.abs(weights[:-1]) @ errors), abs(float(weights[-1]))


def _rounding(orbit: Orbit) -> FloatArray:
    """Return the rounding of every equation of a chain, shape (N m,)."""
    size = np.abs(orbit.joints).max(axis=1)
    size = 1.0 + np.maximum(size, np.append(size[1:], size[0]))
    unit = UNITS * np.finfo(float).eps + orbit.model.rounding
    return np.repeat(unit * size, orbit.joints.shape[1])


def _weights(
    a: FloatArray, b: FloatArray, c: FloatArray, row: FloatArray, wanted: FloatArray
) -> FloatArray | None:
    """Return a sum of rows of the inverse of the Jacobian of a chain with one parameter and one condition."""
    count, m = c.shape
    size = count * m
    try:
        if size <= _FULL:
            full = np.zeros((size + 1, size + 1))
            full[:size, :size] = stacked(a, b, np.eye(m))  # the last block is closed already
            full[:size, size], full[size] = c.ravel(), row
            return np.asarray(np.linalg.solve(full.T, wanted), dtype=np.float64)
        return _sparse_weights(a, b, c, row, wanted)
    except (np.linalg.LinAlgError, RuntimeError, ValueError):
        return None


def _sparse_weights(
    a: FloatArray, b: FloatArray, c: FloatArray, row: FloatArray, wanted: FloatArray
) -> FloatArray:
    """Do the same for a long chain."""
    with held_back():
        from scipy.sparse import csc_matrix
        from scipy.sparse.linalg import splu

    count, m = c.shape
    size = count * m
    locations: NDArray[np.int64] = np.arange(size).reshape(count, m)
    across = np.repeat(locations[:, :, None], m, axis=2).ravel()
    own = np.repeat(locations[:, None, :], m, axis=1)
    rows = np.concatenate([across, across, locations.ravel(), np.full(size + 1, size)])
    following = np.roll(own, -1, axis=0).ravel()
    columns = np.concatenate([own.ravel(), following, np.full(size, size), np.arange(size + 1)])
    values = np.concatenate([a.ravel(), b.ravel(), c.ravel(), row])
    matrix = csc_matrix((values, (rows, columns)), shape=(size + 1, size + 1))
    return np.asarray(splu(matrix).solve(wanted, trans="T"), dtype=np.float64)


def fold_error(
    orbit: Orbit, active: int, sides: tuple[Point, Point | None], point: Point
) -> float | None:
    """Return the error of the parameter at a fold, where it is stationary along the branch."""
    before, after = sides
    if after is None or after.arc == before.arc or orbit.joints.shape != point.tangent.shape:
        return None
    error = moved_by_errors(orbit, active, np.append(point.tangent.ravel(), point.slope), 0.0)
    bend = (after.slope - before.slope) / (after.arc - before.arc)
    if error is None or bend == 0.0:
        return None
    return error + 0.5 * point.slope**2 / abs(bend)
