"""Orbits without joints where nothing happens.

A simulation stops at every section (a surface between two parts of one mode). An orbit that meets other
surfaces has its joints there, and passes sections inside of its segments. An orbit that meets none is found
and fixed by sections: by one crossing each way, that at which the surface is crossed fastest. Whether it
crosses them more often is a label. (Without excitation it keeps as many as it has large loops.)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contfric.base.arrays import FloatArray
from contfric.bvp.system import Itinerary, build_system
from contfric.models.definition import Model
from contfric.orbit.canonical.section_crossings import (
    SectionCrossings,
    every_crossing,
    fastest_crossings,
)
from contfric.orbit.clock import clocked
from contfric.orbit.orbit import Orbit

#: States that repeat themselves to this (relative to 1 + their size) are the same.
_SAME = 1e-8
#: A crossing this near to a wall (relative to the largest height of the orbit) is where it is touched, and an
#: impact this slow (relative to its largest rate) grazes: events are located to 1e-13, some to half of that.
AT_WALL = 1e-6
#: Where along an orbit sizes are taken: no two symmetric, not all at a touch.
_SHARES = (0.03, 0.19, 0.31, 0.43, 0.57, 0.66, 0.78, 0.91)


def has_sections(model: Model, itinerary: Itinerary) -> bool:
    """Tell whether an itinerary has joints on sections and on other surfaces."""
    return bool(model.sections) and any(pair in model.sections for pair in itinerary)


def is_smooth(model: Model, itinerary: Itinerary) -> bool:
    """Tell whether a cycle meets nothing but sections."""
    return bool(model.sections) and all(pair in model.sections for pair in itinerary)


def named_by_ends(itinerary: Itinerary, model: Model) -> Itinerary:
    """Return an itinerary with the names of parts of modes only where a segment ends on a section."""
    if not model.joined:
        return itinerary
    return tuple(
        pair if pair in model.sections else (model.whole_mode(pair[0]), pair[1])
        for pair in itinerary
    )


def without_sections(
    model: Model,
    itinerary: Itinerary,
    joints: FloatArray,
    end: float,
    vector: FloatArray,
    periods: int,
) -> tuple[Itinerary, FloatArray, float]:
    """Return a whole cycle without its joints on sections: itinerary, joints and the time at which it ends.

    Parameters
    ----------
    itinerary, joints : all segments of a cycle and the time and state where each begins, behind no reset
    end : time at which the cycle ends
    vector : parameters, which tell how fast a section is crossed
    periods : of the excitation; without one, how many crossings each way are kept
    """
    if not model.joined:
        return itinerary, joints, end
    kept = _others(model, itinerary)
    if not kept:
        kept = fastest_crossings(model, itinerary, joints, end, vector, periods)
    first = kept[-1] + 1 - len(itinerary)  # the first segment may begin in the cycle before
    starts = [first, *(i + 1 for i in kept[:-1])]
    found = joints[[i % len(itinerary) for i in starts]].copy()
    period = end - joints[0, 0]
    if first < 0:
        found[0, 0] -= period
    pairs = tuple(
        model.section_pair(*itinerary[i])
        if itinerary[i] in model.sections
        else (model.whole_mode(itinerary[i][0]), itinerary[i][1])
        for i in kept
    )
    return pairs, found, float(found[0, 0]) + period


def _others(model: Model, itinerary: Itinerary) -> list[int]:
    """Return the numbers of the segments that end on no section."""
    return [i for i, pair in enumerate(itinerary) if pair not in model.sections]


def joints_left(model: Model, itinerary: Itinerary) -> list[int]:
    """Return the numbers of the joints that a whole cycle keeps without those on sections, in order."""
    kept = _others(model, itinerary)
    return [(kept[-1] + 1) % len(itinerary), *(i + 1 for i in kept[:-1])]


def at_wall(whole: Orbit, mode: str, joint: FloatArray) -> bool:
    """Tell whether a state is at a surface with a reset."""
    walls = (s.name for s in whole.model.surfaces if whole.model.reset_at(mode, s.name) is not None)
    return any(lies_on(whole, wall, joint) for wall in walls)


def lies_on(whole: Orbit, surface: str, joint: FloatArray) -> bool:
    """Tell whether a state is on a surface, measured by how far from it the orbit comes."""
    height = abs(whole.flow.height(surface, float(joint[0]), joint[1:]))
    return height < AT_WALL * max(abs(whole.flow.height(surface, t, y)) for t, y in _along(whole))


def _along(whole: Orbit) -> Iterator[tuple[float, FloatArray]]:
    """Yield some times and states of an orbit: its sizes."""
    for share in _SHARES:
        time = float(whole.cycle[0, 0]) + share * whole.period
        yield time, whole.state(time)


def only_touches(whole: Orbit) -> bool:
    """Tell whether all joints of a solution are touches of walls: impacts of no speed, or on a section."""
    model, flow = whole.model, whole.flow
    for (mode, exit_), end in zip(whole.itinerary, whole.ends, strict=True):
        if (mode, exit_) in model.sections:
            touches = at_wall(whole, mode, end)
        elif touches := model.reset_at(mode, exit_) is not None:
            observable = model.surface_by_name[exit_].observable
            fastest = max(abs(flow.rate(mode, observable, t, y)) for t, y in _along(whole))
            rate = abs(flow.rate(mode, observable, float(end[0]), end[1:]))
            touches = rate < AT_WALL * fastest
        if not touches:
            return False
    return True


def canonical(orbit: Orbit) -> Orbit:
    """Return the same orbit without joints on sections that it can do without; most often as it is.

    Orbits of earlier versions have them. A smooth orbit with one joint has another where it crosses back.
    """
    model, itinerary = orbit.model, orbit.system.itinerary
    if not has_sections(model, itinerary) or orbit.system.domains:
        return orbit
    if is_smooth(model, itinerary):
        lone = len(itinerary) == 1 and not orbit.system.half and not model.autonomous
        return (_with_pairs(orbit, 1) if lone else None) or orbit
    if orbit.system.half:
        return canonical(orbit.as_whole())
    start = float(orbit.joints[0, 0])
    found, joints, end = without_sections(
        model, itinerary, orbit.joints, start + orbit.period, orbit.vector, orbit.periods
    )
    if found == itinerary:
        return orbit
    system = build_system(model, found, orbit.periods)
    return replace(orbit, system=system, joints=clocked(model, joints, end))


def moved(orbit: Orbit) -> Orbit | None:
    """Return a smooth orbit with the joints where it crosses its section fastest; None if it has too few.

    For an orbit of which a joint is about to vanish, where the orbit only touches the section.
    """
    model, whole = orbit.model, orbit.as_whole()
    if not is_smooth(model, whole.itinerary):
        return None
    pairs = len(whole.itinerary) // 2
    other = _with_pairs(whole, pairs) if len(whole.itinerary) == 2 * pairs else None
    if other is None or not orbit.system.half:
        return other
    n, found = len(orbit.system.itinerary), other.joints
    return replace(orbit, joints=clocked(model, found[:n], float(found[n, 0])))


def in_halves(orbit: Orbit) -> Orbit:
    """Return a smooth orbit of an even number of periods with joints in both halves, if it has them."""
    pairs, odd = divmod(len(orbit.system.itinerary), 2)
    smooth = is_smooth(orbit.model, orbit.system.itinerary) and not orbit.system.half
    if not smooth or orbit.model.autonomous or odd or pairs % 2 == 0 or orbit.periods % 2:
        return orbit
    return _with_pairs(orbit, 2 * pairs) or orbit


def _with_pairs(whole: Orbit, pairs: int) -> Orbit | None:
    """Return a smooth orbit with some number of joints each way, in the rotation that it has."""
    model, period = whole.model, whole.period
    itinerary, joints = every_crossing(whole)
    crossings = SectionCrossings(
        model, itinerary, joints, float(joints[0, 0]) + period, whole.vector
    )
    kept = crossings.chosen(pairs) if len(crossings.down) >= pairs else []
    if len(kept) != 2 * pairs:
        return None
    starts = [(i + 1) % len(itinerary) for i in kept]
    ends = [model.section_pair(*itinerary[i]) for i in kept]
    own = (*ends[1:], ends[0])  # the segment that begins at a joint ends at the next
    turn = own.index(whole.itinerary[0])
    found = joints[starts][np.arange(turn, turn + len(own)) % len(own)].copy()
    for k in range(1, len(found)):
        while found[k, 0] <= found[k - 1, 0]:
            found[k, 0] += period
    found = clocked(model, found, float(found[0, 0]) + period)
    system = build_system(model, own[turn:] + own[:turn], whole.periods)
    return replace(whole, system=system, joints=found)


def shortened(whole: Orbit, turns: int) -> Orbit | None:
    """Return the part that a smooth orbit repeats, as an orbit; None if it does not run through one."""
    model = whole.model
    if model.autonomous or not is_smooth(model, whole.itinerary):
        return None
    step = whole.period / turns
    for joint in whole.cycle:
        gap = np.abs(whole.state(float(joint[0]) + step) - joint[1:])
        if np.max(gap) > _SAME * (1.0 + np.max(np.abs(whole.joints))):
            return None
    itinerary, joints = every_crossing(whole)
    n, rest = divmod(len(itinerary), turns)
    if rest:
        return None
    periods, end = whole.periods // turns, float(joints[n, 0])
    found, starts, _ = without_sections(
        model, itinerary[:n], joints[:n], end, whole.vector, periods
    )
    return replace(whole, system=build_system(model, found, periods), joints=starts)
