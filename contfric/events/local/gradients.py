"""Exact gradients of what vanishes at an event, on the joints and on the parameter."""

from __future__ import annotations

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import EventFunction, Margin
from contfric.errors import NotationError
from contfric.events.local.holdable import vanishes_with
from contfric.events.local.jumps import left_to
from contfric.events.local.zero_acceleration import touch_of
from contfric.orbit.orbit import Orbit

#: A hold this short is one that vanishes: what its margins say is its length.
_SHORT = 1e-3


def closing(orbit: Orbit, active: int) -> FloatArray:
    """Return how the end of a turn moves with the parameter, shape (m,): the period does."""
    model, out = orbit.model, np.zeros(orbit.joints.shape[1])
    if not model.autonomous:
        grad = np.empty(1)
        model.flow.period(orbit.vector, np.array([active], dtype=np.int64), grad)
        out[0] = orbit.system.layout.turn * grad[0]
    return out


def gradient_of(
    orbit: Orbit, location: EventFunction, count: int, active: int
) -> tuple[FloatArray, float] | None:
    """Return the gradient of one margin on the joints and on the parameter; None if nothing is stationary.

    It is that along orbits. Off them the margin may differ: a mode moves a state onto its surfaces first.
    """
    if location.margin is Margin.HELD:
        return _held_gradient(orbit, location.segment, count, active)
    i, m = location.segment, orbit.joints.shape[1]
    gradient, slope = np.zeros((count + 1, m)), 0.0
    held = next((hold for hold in orbit.system.holds if hold.segment == i), None)
    short = orbit.durations[i] < _SHORT and vanishes_with(orbit, location)
    if location.margin is Margin.LASTING or short:
        gradient[i + 1, 0], gradient[i, 0] = 1.0, -1.0
        return gradient, slope
    sign = _sign(orbit, location)
    if location.margin is Margin.JOINT:
        gradient[i + 1], slope = surface_gradient(orbit, location.surface, orbit.ends[i], active)
    elif location.margin is Margin.EXIT:
        ends = held is not None and held.until is None
        mode = held.departs if held is not None and ends else orbit.itinerary[i][0]
        gradient[i + 1], slope = _rate_gradient(
            orbit, mode, location.surface, orbit.ends[i], active
        )
    elif location.margin is Margin.ENTRY:
        there, slope = surface_gradient(orbit, location.surface, orbit.begins[i], active)
        gradient[i], slope = before_reset(orbit, i, there, slope, active)
    else:
        try:
            touch = touch_of(orbit, i, location.surface)
        except NotationError:
            return None
        if (
            touch[0] == orbit.begins[i, 0]
        ):  # the load of a hold that starts on its limit: whether it falls
            mode = orbit.itinerary[i][0]
            gradient[i], slope = before_reset(
                orbit, i, *_rate_gradient(orbit, mode, location.surface, touch, active), active
            )
            return sign * gradient, sign * slope
        there, slope = surface_gradient(orbit, location.surface, touch, active)
        gradient[i], moves = carried(orbit, i, touch, there, active)
        slope += moves
    return sign * gradient, sign * slope


def _held_gradient(
    orbit: Orbit, i: int, count: int, active: int
) -> tuple[FloatArray, float] | None:
    """Return the gradient of the least acceleration with which a hold could be left inside, if it has one.

    The time at which it is least is stationary: it does not move the value.
    """
    try:
        touch = touch_of(orbit, i, None)
    except NotationError:
        return None
    hold = next(hold for hold in orbit.system.holds if hold.segment == i)
    sign, observable = left_to(orbit, orbit.itinerary[i][0], hold.departs)
    m, gradient = len(touch), np.zeros((count + 1, len(touch)))
    grad = orbit.flow.rate_gradient(hold.departs, observable, float(touch[0]), touch[1:], active)
    gradient[i], moves = carried(orbit, i, touch, grad[:m], active)
    return sign * gradient, sign * (float(grad[m]) + moves)


def _sign(orbit: Orbit, location: EventFunction) -> float:
    """Return the sign with which a margin counts what it watches."""
    layout, i = orbit.system.layout, location.segment
    if location.margin is Margin.EXIT:
        return float(layout.exit_signs[i])
    k = orbit.model.surface_index[location.surface]
    rows = layout.interior
    if location.margin is not Margin.INTERIOR:
        rows = layout.joint[layout.joint[:, 3] == int(location.margin is Margin.ENTRY)]
    return float(next((row[2] for row in rows if row[0] == i and row[1] == k), 0.0))


def surface_gradient(
    orbit: Orbit, surface: str, joint: FloatArray, active: int
) -> tuple[FloatArray, float]:
    """Return the gradient of an observable less the level of a surface on (t, y), and on the parameter."""
    model, m = orbit.model, len(joint)
    observable = model.surface_by_name[surface].observable
    grad = orbit.flow.gradient(observable, float(joint[0]), joint[1:], active)
    return grad[:m], float(grad[m] - orbit.flow.level_slope(surface, active))


def _rate_gradient(
    orbit: Orbit, mode: str, surface: str, joint: FloatArray, active: int
) -> tuple[FloatArray, float]:
    """Return the gradient of the rate of a surface's observable along a mode."""
    m, observable = len(joint), orbit.model.surface_by_name[surface].observable
    grad = orbit.flow.rate_gradient(mode, observable, float(joint[0]), joint[1:], active)
    return grad[:m], float(grad[m])


def carried(
    orbit: Orbit, i: int, touch: FloatArray, there: FloatArray, active: int
) -> tuple[FloatArray, float]:
    """Return a gradient at a touch inside of a segment as one on the joint in which the segment begins.

    The time of the touch is stationary: it does not move the value.
    """
    m, n, start = len(touch), len(touch) - 1, orbit.begins[i]
    time = float(start[0])
    mode, lasts = orbit.itinerary[i][0], float(touch[0]) - time
    jac = orbit.flow.jacobian(mode, time, start[1:], lasts, active)
    gradient = np.empty(m)
    gradient[0] = there[1:] @ (jac[:, 0] - jac[:, 1 + n])
    gradient[1:] = there[1:] @ jac[:, 1 : 1 + n]
    return before_reset(orbit, i, gradient, float(there[1:] @ jac[:, 2 + n]), active)


def before_reset(
    orbit: Orbit, i: int, gradient: FloatArray, slope: float, active: int
) -> tuple[FloatArray, float]:
    """Return a gradient on the state in which a segment begins as one on its joint: before a reset."""
    k = orbit.system.layout.resets[i % orbit.system.segments]
    if k < 0:
        return gradient, slope
    surface, joint = orbit.model.surfaces[k].name, orbit.cycle[i]
    jac = orbit.flow.reset_jacobian(surface, float(joint[0]), joint[1:], active)
    moved = gradient[1:] @ jac
    before = np.concatenate([[gradient[0] + moved[0]], moved[1:-1]])
    return before, slope + float(moved[-1])
