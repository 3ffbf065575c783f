"""Stops and extrema: where the displacement is stationary, at joints or inside of segments."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contfric.base.arrays import FloatArray
from contfric.bvp.system import Itinerary
from contfric.models.definition import Model
from contfric.orbit.measured.samples import stationary_within

if TYPE_CHECKING:
    from contfric.orbit.orbit import Orbit

#: Most stops of one segment that are looked for: a segment with more would be no segment.
_MOST = 1000
#: A stop this near to a joint (in time, and in the distance to its surface) is at the joint: events at which
#: that is so are located to about 1e-10.
_AT_JOINT = 1e-8


def stopping_segments(model: Model, itinerary: Itinerary) -> list[int]:
    """Return the segments that end at a stop or at an impact, where the displacement may turn."""
    return [
        i
        for i, joint in enumerate(itinerary)
        if joint[1] == model.stop_surface or model.reset_at(*joint) is not None
    ]


def stops_of(orbit: Orbit) -> FloatArray:
    """Return the displacements at the stops and impacts in the order of the orbit, shape (stops,)."""
    model = orbit.model
    if not model.stop_surface:
        return stationary_points(orbit)
    if not model.stops_at_joints:
        return displacements(orbit, model.stop_surface)
    return orbit.ends[stopping_segments(model, orbit.itinerary), 1]


def displacements(orbit: Orbit, surface: str) -> FloatArray:
    """Return the displacement wherever an orbit crosses a surface or kink, in order, shape (crossings,).

    Inside its segments and at its joints, impacts among them; by the first roots of the flow. For models
    whose solution is not cut at its stops.
    """
    model, flow = orbit.model, orbit.flow
    observable, level = surface, 0.0
    if surface in model.surface_by_name:
        observable, level = model.surface_by_name[surface].observable, flow.level(surface)
    found: list[tuple[float, float]] = []
    for i, (mode, exit_) in enumerate(orbit.itinerary):
        if model.mode_by_name[mode].sliding and exit_ in model.surface_by_name:
            lies = {d.signs.get(surface) for d in model.domains_of(mode)}
            if lies == {0}:
                continue  # it rests there
        start, end = float(orbit.begins[i, 0]), float(orbit.ends[i, 0])
        state, on = orbit.begins[i, 1:], False
        for _ in range(_MOST):
            hit = flow.first(mode, observable, level, start, state, end - start, on=on)
            if hit is None:
                break
            start, state, on = start + hit[0], hit[1], True
            found.append((start, float(state[0])))
        state = orbit.ends[i, 1:]
        apart = flow.observe(observable, end, state) - level
        if model.reset_at(mode, exit_) is not None or abs(apart) < _AT_JOINT:
            found.append((end, float(state[0])))
    return _apart(found, orbit.period)


def _apart(found: list[tuple[float, float]], period: float) -> FloatArray:
    """Return the displacements of (time, displacement) pairs, those that are one but once.

    A stop at a joint, within rounding of it, is met by either of its segments, by both or by none.
    """
    every = sorted(found)
    near = [
        (every[k - 1][0] - (period if k == 0 else 0.0)) > time - _AT_JOINT and len(every) > 1
        for k, (time, _) in enumerate(every)
    ]
    return np.array([x for (_, x), known in zip(every, near, strict=True) if not known])


def stationary_points(orbit: Orbit) -> FloatArray:
    """Return the displacement at its local extrema and at impacts, in order, shape (extrema,).

    For models that name no surface on which it is stationary.
    """
    model = orbit.model
    x: list[float] = []
    struck: list[bool] = []
    for i, (mode, exit_) in enumerate(orbit.itinerary):
        values = np.empty(0)
        if model.displacement and orbit.durations[i] > 0.0:
            _, values = stationary_within(orbit, i, model.displacement)
        x += [*values.tolist(), float(orbit.ends[i, 1])]
        struck += [False] * len(values) + [model.reset_at(mode, exit_) is not None]
    size = 1.0 + float(np.max(np.abs(x)))
    return _extrema(np.array(x), np.array(struck), _AT_JOINT * size)


def _extrema(x: FloatArray, struck: NDArray[np.bool_], known: float) -> FloatArray:
    """Return the local extrema of a cyclic sequence, and the values at impacts.

    Neighbours that differ by less than they are known to are one: where a mass rests, or slides along a
    surface, the differences of its displacement have no sign.
    """
    first = np.flatnonzero(np.abs(x - np.roll(x, 1)) > known)
    if not len(first):
        return x[struck]
    x, struck = np.roll(x, -first[0]), np.roll(struck, -first[0])
    first -= first[0]
    levels, met = x[first], np.logical_or.reduceat(struck, first)
    before, after = np.roll(levels, 1) - levels, np.roll(levels, -1) - levels
    return np.asarray(levels[(before * after > 0.0) | met])


def reach_of(orbit: Orbit) -> tuple[float, float]:
    """Return the least and the largest displacement of an orbit, over joints and stationary points."""
    model, whole = orbit.model, orbit.as_whole()
    x = [orbit.cycle[:, 1]]
    if model.displacement:
        from contfric.orbit.measured.extent import extent

        c, out = model.observable_index[model.displacement], np.empty(2)
        system, joints = whole.system, np.ascontiguousarray(whole.joints)
        if not extent(system.functions(), system.layout, c, joints, orbit.vector, out):
            out[:] = np.nan
        x.append(out)
    elif not model.stops_at_joints:  # a definition by hand that says no more
        x.append(orbit.stops)
    every = np.concatenate(x)
    return float(np.min(every)), float(np.max(every))


def reaches_at_joints(model: Model) -> bool:
    """Tell whether the extrema of the displacement are among the joints of orbits."""
    return not model.displacement and model.stops_at_joints
