"""Quantities with code of their own: the share of the period at rest, speeds of impacts, multipliers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from contfric.errors import ParameterError
from contfric.models.definition import FloatArray
from contfric.quantities.duals import Dual, divide
from contfric.quantities.functionals import Measuring

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit


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
    """Return the largest speed at which a surface is met that sends the motion back: a wall.

    The speed is the rate of the surface's observable before its reset.
    """
    orbit, resets = measuring.motion.orbit, measuring.motion.orbit.model.reset_by_surface
    candidates: list[tuple[float, Callable[[], FloatArray]]] = []
    for i, (_, exit_) in enumerate(orbit.word):
        if exit_ in resets and resets[exit_].stays and not resets[exit_].wraps:
            rate, grad = _rate_at_end(orbit, i)
            candidates.append(
                (abs(rate), partial(_speed_slopes, measuring, i, np.sign(rate) * grad))
            )
    if not candidates:
        return measuring.number(0.0, np.zeros(measuring.motion.count))
    return measuring.largest("the speed of impact", candidates)


def _rate_at_end(orbit: Orbit, i: int) -> tuple[float, FloatArray]:
    """Return the rate of the exit's observable at the end of a segment, and its gradient on (t, y, p)."""
    model, (mode, exit_), joint = orbit.model, orbit.word[i], orbit.ends[i]
    m, c = model.mode_index[mode], model.observable_index[model.surface_by_name[exit_].observable]
    every = np.arange(len(orbit.vector))
    grad = np.empty(len(joint) + len(every))
    state = np.ascontiguousarray(joint[1:])
    return float(model.flow.rate(m, c, float(joint[0]), state, orbit.vector, every, grad)), grad


def _speed_slopes(measuring: Measuring, i: int, grad: FloatArray) -> FloatArray:
    """Return how a speed moves at the end of a segment, by its gradient on (t, y, p)."""
    time, states = measuring.motion.segments[i].at(np.ones(1))
    moved = np.vstack([time.slopes, *(s.slopes for s in states)])[:, :-1]
    return np.asarray(grad[: len(moved)] @ moved + grad[len(moved) :] @ measuring.motion.d_vector)


def multiplier(measuring: Measuring) -> Dual:
    """Return the largest modulus of a Floquet multiplier.

    Raises
    ------
    ParameterError
        If its derivatives are wanted: they need second derivatives of the flow, which only curves in two
        parameters have.
    """
    if measuring.motion.count:
        raise ParameterError(
            "the derivatives of 'multiplier' are not available: they are those of the Jacobian itself"
        )
    mu = np.abs(measuring.motion.orbit.multipliers)
    return measuring.number(float(np.max(mu, initial=0.0)), np.empty(0))
