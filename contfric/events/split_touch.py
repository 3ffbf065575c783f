"""Points at which the touch that a hold is pinned to splits into two of equal height.

A stick ends where its load u touches the limit, and a hold goes on. The touch is a maximum, ``u' = 0``. Under
an even excitation it may lie where u is even in time: with e the distance of the parameter from the location
where its curvature vanishes, and t the time from there,

    u' = e t - c t^3:

one maximum at t = 0 on one side, two of equal height at ``t^2 = e / c`` (and a minimum between them) on the
other. The height of the maximum has a derivative on both sides, and so has the motion: only the time of the
pin moves with the root. As the earliest touch is what a stick ends at, the pin moves to the earlier maximum.

Along the orbits that are pinned to it, e comes to zero where its slope does. The equations go on there to the
later maximum, with the same values of e: they turn, and the motion does not. It is the end of the branch.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import EventFunction, Margin, System
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.events.local.zero_acceleration import joint_within
from contfric.orbit.orbit import Orbit

#: Share of the times of pins that all other joints move by where nothing but these moves. At a fold they all
#: move alike; near the location where a touch splits they move by less than the distance from it.
_ALONE = 1e-4
#: Share of the period over which the curvature of a load is measured; and how near to each other two maxima
#: count as one, in these: where a margin is violated by rounding.
_APART, _NEAR = 1e-3, 0.3
#: Heights of maxima that agree to this (relative to 1 + the height) are equal: far above their rounding.
_EQUAL = 1e-11


def touch_holds(system: System) -> list[int]:
    """Return the segments that are holds pinned to a touch of the limit."""
    return [h.segment for h in system.holds if h.pin is None and h.after_rest]


def as_split(found: Bifurcation, tangent: FloatArray) -> Bifurcation | None:
    """Return what a fold is along which only the times of touches move: an AS; None if it is a fold.

    Parameters
    ----------
    tangent : direction of the curve of orbits at the fold, shape (segments, 1 + n)
    """
    system = found.orbit.system
    touches = touch_holds(system)
    if not touches:
        return None
    moved = np.abs(tangent).max(axis=1)
    pins = [k for k in touches if moved[k] > _ALONE * moved.max()]
    rest = np.delete(moved, pins)
    if not pins or np.max(rest, initial=0.0) > _ALONE * moved[pins].max():
        return None
    tests = tuple(EventFunction(Margin.INTERIOR, k, system.itinerary[k - 1][1]) for k in pins)
    known = tuple(test for test in tests if test in system.tests)
    return replace(found, kind=Kind.AS, tests=known) if known else None


def splits(orbit: Orbit) -> bool:
    """Tell whether a touch that a hold is pinned to splits: two maxima would be as near as one.

    With the rates of the load at +-s and +-2s around it, ``u' = e t - c t^3`` has the two coefficients.
    """
    for k in touch_holds(orbit.system):
        mode, surface = orbit.itinerary[k - 1]
        observable = orbit.model.surface_by_name[surface].observable
        step, time = _APART * orbit.period, float(orbit.cycle[k, 0])
        one, two = (_mean_curvature(orbit, k - 1, mode, observable, time, n * step) for n in (1, 2))
        if abs(4.0 * one - two) / 3.0 < _NEAR**2 * abs(two - one) / 3.0:
            return True
    return False


def _mean_curvature(
    orbit: Orbit, i: int, mode: str, observable: str, time: float, step: float
) -> float:
    """Return the central difference of the rate of an observable along a rest."""
    behind, ahead = (joint_within(orbit, i, time + s * step) for s in (-1.0, 1.0))
    rates = [orbit.flow.rate(mode, observable, float(z[0]), z[1:]) for z in (behind, ahead)]
    return (rates[1] - rates[0]) / (2.0 * step)


def pinned_first(orbit: Orbit, vector: FloatArray) -> Orbit:
    """Return a guess at other parameters: a hold is pinned to the first of the highest maxima of its rest."""
    joints, flow = orbit.joints.copy(), replace(orbit, vector=vector).flow
    for k in touch_holds(orbit.system):
        mode, surface = orbit.itinerary[k - 1]
        start, end = orbit.begins[k - 1], float(orbit.ends[k, 0])
        begin = float(start[0])
        observable = orbit.model.surface_by_name[surface].observable
        times, values = flow.stationary(mode, observable, begin, start[1:], end - begin)
        heights = np.abs(values)
        if len(times) and joints.shape[0] > k:
            highest = heights.max()
            first = float(times[np.argmax(heights >= highest - _EQUAL * (1.0 + highest))])
            joints[k, 0] = begin + first
            joints[k, 1:] = flow.state(mode, begin, start[1:], first)
    return Orbit(orbit.system, joints, vector, np.inf)
