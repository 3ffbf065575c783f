"""Times at which a resting solution is about to leave rest, or a segment touches a surface.

Both are locations on one known segment, looked for once an event.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.errors import NotationError
from contfric.events.local.jumps import left_to, nothing_jumps
from contfric.models.mode_domains import inside_sign
from contfric.orbit.measured.samples import state_within, stationary_within
from contfric.orbit.orbit import Orbit
from contfric.signature.holds import is_hold

#: Pieces of a rest between two stationary points of its observables: where the acceleration that it
#: would be left with depends on them monotonically, one would be enough, as in every model of a load.
_PIECES = 8
#: An acceleration this small (relative to 1) at the start of a rest is zero: the rest begins at a touch.
_ZERO = 1e-9
#: Heights of touches that agree to this (relative to 1 + the level) are equal: far above their rounding.
_EQUAL = 1e-11
#: A touch this share of the period after another one is another one; how far before a touch, as a share of
#: it, stationary points are looked for at other parameters; and how far away those are.
_LATER, _BACK, _ASIDE = 1e-4, 0.02, 1e-3
#: Halvings of a bracket: to the resolution of time.
_HALVINGS = 60


def first_zero_acceleration(orbit: Orbit, i: int, start: float, departs: str) -> FloatArray | None:
    """Return the first joint of a rest after a time at which the departing mode has no acceleration.

    Parameters
    ----------
    i : int
        Segment of the whole orbit at which the rest takes place.
    departs : str
        Mode in which it would be left.

    Returns
    -------
    ndarray, shape (1 + n,), or None
        None if it can be left all the time until the segment ends.
    """
    rate = _departure_rate(orbit, i, departs)
    end = float(orbit.ends[i, 0])
    locations = [t for t in _stationary(orbit, i) if start < t < end]
    grid = sorted(
        {
            float(time)
            for a, b in pairwise([start, *locations, end])
            for time in np.linspace(a, b, _PIECES + 1)
        }
    )
    for a, b in pairwise(grid):
        if rate(b) < (0.0 if b < end else -_ZERO) and (rate(a) > 0.0 or a > start):
            return joint_within(orbit, i, _crossing(rate, a, b))
    return None


def _crossing(rate: Callable[[float], float], a: float, b: float) -> float:
    """Return the last time before a rate becomes negative, by halving."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (a + b)
        if rate(middle) > 0.0:
            a = middle
        else:
            b = middle
    return 0.5 * (a + b)


def _departure_rate(orbit: Orbit, i: int, departs: str) -> Callable[[float], float]:
    """Return the acceleration with which a rest would be left, as a function of time."""
    rest, flow = orbit.itinerary[i][0], orbit.flow
    sign, observable = left_to(orbit, rest, departs)
    begin, start = float(orbit.begins[i, 0]), orbit.begins[i, 1:]

    def rate(time: float) -> float:
        return sign * flow.rate(
            departs, observable, time, flow.state(rest, begin, start, time - begin)
        )

    return rate


def joint_within(orbit: Orbit, i: int, time: float) -> FloatArray:
    """Return the joint (t, y) of a segment of the whole orbit at a time inside it."""
    return np.array([time, *state_within(orbit, i, time - float(orbit.begins[i, 0]))])


def stationary_values(orbit: Orbit, i: int, observable: str) -> list[tuple[float, float]]:
    """Return times and values of the stationary points of an observable along a segment."""
    begin, found = float(orbit.begins[i, 0]), stationary_within(orbit, i, observable)
    return [(begin + float(t), float(v)) for t, v in zip(*found, strict=True)]


def _stationary(orbit: Orbit, i: int) -> list[float]:
    """Return the stationary times of all observables along a segment."""
    return sorted(
        t for c in orbit.model.observables for t, _ in stationary_values(orbit, i, c.name)
    )


def touch_of(orbit: Orbit, i: int, surface: str | None) -> FloatArray:
    """Return the joint at which a segment comes nearest to a surface inside; of equal ones the first.

    Without a surface: at which a hold is nearest to not being left any more.

    Raises
    ------
    NotationError
        If no observable of the surface is stationary inside: the touch has moved out through a joint.
    """
    model = orbit.model
    if surface is None:
        own = i % orbit.system.segments
        departs = next(hold.departs for hold in orbit.system.holds if hold.segment == own)
        rate = _departure_rate(orbit, i, departs)
        still = _stationary(orbit, i)
        if not still:
            raise NotationError(
                f"hold {i + 1} could be left anywhere inside: nothing is stationary"
            )
        time = min(still, key=rate)
        return joint_within(orbit, i, time)
    level = orbit.flow.level(surface)
    sign = inside_sign(model, orbit.itinerary[i][0], surface)
    observable = model.surface_by_name[surface].observable
    found = stationary_values(orbit, i, observable)
    start = orbit.begins[i]
    rises = orbit.flow.rate(orbit.itinerary[i][0], observable, float(start[0]), start[1:])
    gap = orbit.flow.observe(observable, float(start[0]), start[1:]) - level
    # after a reset that has just touched, the solution is at its start again: no touch of its own
    rests = model.reset_at(orbit.itinerary[i][0], surface) is None
    rests = rests and not (found and _slides_off(orbit, i, surface))  # as every orbit there does
    if rests and abs(rises) < _ZERO and abs(gap) < _EQUAL * (1.0 + abs(level)):
        return np.array(start)  # it begins with the touch
    if not found:
        raise NotationError(f"segment {i + 1} touches {surface} nowhere inside")
    least = min(sign * (value - level) for _, value in found)
    near = _EQUAL * (1.0 + abs(level))
    return joint_within(orbit, i, next(t for t, v in found if sign * (v - level) <= least + near))


def only_comes_back(orbit: Orbit, i: int, surface: str) -> bool:
    """Tell whether a segment leaves a surface and comes back to it, and does not come near it between.

    A slide that is about to vanish has small velocities all along: each of its stationary points is farther
    from the surface than what is before and after it, and touches nothing, whatever counts as small.
    """
    observable = orbit.model.surface_by_name[surface].observable
    level, sign = (
        orbit.flow.level(surface),
        inside_sign(orbit.model, orbit.itinerary[i][0], surface),
    )
    inside = [value for _, value in stationary_values(orbit, i, observable)]
    begin, end = (
        orbit.flow.observe(observable, float(joint[0]), joint[1:])
        for joint in (orbit.begins[i], orbit.ends[i])
    )
    heights = [sign * (value - level) for value in (begin, *inside, end)]
    nearby = zip(heights[:-2], heights[2:], strict=True)
    return bool(inside) and all(
        height > max(pair) for height, pair in zip(heights[1:-1], nearby, strict=True)
    )


def _slides_off(orbit: Orbit, i: int, surface: str) -> bool:
    """Tell whether a segment leaves a surface on which the one before it moves, and where nothing jumps.

    Sliding ends where the field on one side no longer points to the surface: motion leaves by a tangent.
    """
    before, exit_ = orbit.itinerary[i - 1]
    return (
        not is_hold(exit_)
        and exit_ != surface
        and orbit.model.lies_on(before, surface)
        and nothing_jumps(orbit)
    )


def touches_again(orbit: Orbit, i: int, surface: str, start: float) -> bool:
    """Tell whether a rest whose load touches a surface at its start does so at the same height later.

    Not by chance, but for all parameters: under an even excitation a load at rest has maxima of equal height
    by twos, and it has the same ones in every period. Heights are compared at neighbouring parameters, too.
    """
    observable, mode = orbit.model.surface_by_name[surface].observable, orbit.itinerary[i][0]
    back, lasts = _BACK * orbit.period, float(orbit.ends[i, 0]) - start
    joint = joint_within(orbit, i, start)

    def heights(vector: FloatArray) -> list[tuple[float, float]]:
        flow = replace(orbit, vector=vector).flow
        state = flow.state(mode, start, joint[1:], -back)
        times, values = flow.stationary(mode, observable, start - back, state, lasts + back)
        return [(start - back + float(t), float(v)) for t, v in zip(times, values, strict=True)]

    found = heights(orbit.vector)
    first = orbit.flow.observe(observable, start, joint[1:])
    near = _EQUAL * (1.0 + abs(first))
    later = [t for t, v in found if t - start > _LATER * orbit.period and abs(v - first) < near]
    if not later:
        return False
    for k in range(len(orbit.vector)):
        vector = orbit.vector.copy()
        vector[k] += _ASIDE * (1.0 + abs(vector[k]))
        nearby = heights(vector)
        if len(nearby) < 2:
            continue
        times = np.array([t for t, _ in nearby])
        first, other = (nearby[int(np.argmin(np.abs(times - t)))][1] for t in (start, later[0]))
        if abs(first - other) > near:
            return False
    return True
