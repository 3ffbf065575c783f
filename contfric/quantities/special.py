"""Quantities with code of their own: the share of the period at rest, speeds of impacts, multipliers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from contfric.errors import ParameterError
from contfric.models.definition import FloatArray
from contfric.quantities.duals import Dual, divide
from contfric.quantities.functionals import Measuring

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit
    from contfric.quantities.motion import Directions, IndexArray

#: Displacement of an orbit for the derivatives of multipliers, relative to its size: its fourth power, and
#: rounding divided by it, are both about 1e-12.
_STEP = 1e-3
#: Shares of it tried where two steps differ by more than this, as they do near multipliers that meet.
_SHARES, _AGREE = (1.0, 0.1, 0.01), 1e-6
#: Derivatives of two steps that differ by more than this are those of no smooth function.
_UNSURE = 1e-2


def sticking(measuring: Measuring) -> Dual:
    """Return the share of the period in modes of sliding, where motion stays on a surface."""
    model, lasts, slopes = measuring.motion.orbit.model, 0.0, np.zeros(measuring.motion.count)
    for segment in measuring.motion.segments:
        if model.mode_by_name[segment.mode].sliding:
            lasts, slopes = lasts + segment.lasts, slopes + segment.d_lasts
    found = divide(measuring.number(lasts, slopes), measuring.period())
    assert isinstance(found, Dual)
    return found


def impact_velocity(measuring: Measuring) -> Dual:
    """Return the largest speed at which a surface is met that sends the solution back: a wall.

    The speed is the rate of the surface's observable before its reset.
    """
    orbit = measuring.motion.orbit
    met: list[tuple[int, float, FloatArray]] = []
    for i, joint in enumerate(orbit.itinerary):
        reset = orbit.model.reset_at(*joint)
        if reset is not None and reset.stays and not reset.wraps:
            rate, grad = _rate_at_end(orbit, i)
            met.append((i, abs(rate), np.sign(rate) * grad))
    if not met:
        return measuring.number(0.0, np.zeros(measuring.motion.count))

    def slopes(rows: IndexArray) -> FloatArray:
        return np.array([_speed_slopes(measuring, met[k][0], met[k][2]) for k in rows])

    return measuring.largest("the speed of impact", np.array([m[1] for m in met]), slopes)


def _rate_at_end(orbit: Orbit, i: int) -> tuple[float, FloatArray]:
    """Return the rate of the exit's observable at the end of a segment, and its gradient on (t, y, p)."""
    model, (mode, exit_), joint = orbit.model, orbit.itinerary[i], orbit.ends[i]
    m, c = model.mode_index[mode], model.observable_index[model.surface_by_name[exit_].observable]
    every = np.arange(len(orbit.vector))
    grad = np.empty(len(joint) + len(every))
    state = np.ascontiguousarray(joint[1:])
    return float(model.flow.rate(m, c, float(joint[0]), state, orbit.vector, every, grad)), grad


def _speed_slopes(measuring: Measuring, i: int, grad: FloatArray) -> FloatArray:
    """Return how a speed moves at the end of a segment, by its gradient on (t, y, p)."""
    time, states = measuring.motion.last_of(i).at(np.ones(1))
    moved = np.vstack([time.slopes, *(s.slopes for s in states)])[:, :-1]
    return np.asarray(grad[: len(moved)] @ moved + grad[len(moved) :] @ measuring.motion.d_vector)


def multiplier(measuring: Measuring) -> Dual:
    """Return the largest modulus of a Floquet multiplier.

    Its derivatives are differences: the Jacobian of the equations is exact wherever joints and parameters are
    displaced, on an orbit or near one, so that nothing is solved for. With Richardson's extrapolation.
    """
    motion = measuring.motion
    value = _largest_modulus(motion.orbit)
    if motion.directions is None:
        return measuring.number(value, np.empty(0))
    if not np.isfinite(value):
        raise ParameterError("the multipliers of an orbit with a hold are infinite: no derivatives")
    pairs = [_difference(motion.orbit, motion.directions, k) for k in range(motion.count)]
    slopes = np.array([slope for slope, _ in pairs])
    apart = np.array([error for _, error in pairs])
    if np.any(apart > _UNSURE * (1.0 + np.abs(slopes))):
        measuring.kinks.append("two multipliers of one modulus part here, or meet")
    return measuring.number(value, slopes)


def _largest_modulus(orbit: Orbit) -> float:
    return float(np.max(np.abs(orbit.multipliers), initial=0.0))


def _difference(orbit: Orbit, directions: Directions, k: int) -> tuple[float, float]:
    """Return the derivative of the largest modulus in one direction, and by how much two steps differ."""
    joints, vector = directions.joints[:, :, k], directions.vector[:, k]
    size = max(float(np.max(np.abs(joints))), float(np.max(np.abs(vector))))
    if size == 0.0:
        return 0.0, 0.0
    step = _STEP * (1.0 + float(np.max(np.abs(orbit.joints[:, 1:])))) / size

    def at(by: float) -> float:
        moved = replace(orbit, joints=orbit.joints + by * joints, vector=orbit.vector + by * vector)
        return _largest_modulus(moved)

    best = 0.0, np.inf
    for share in _SHARES:
        h = share * step
        wide = (at(h) - at(-h)) / (2.0 * h)
        narrow = (at(0.5 * h) - at(-0.5 * h)) / h
        if abs(narrow - wide) < best[1]:
            best = (4.0 * narrow - wide) / 3.0, abs(narrow - wide)
        if best[1] <= _AGREE * (1.0 + abs(best[0])):
            break
    return best
