"""Ends of a half-branch at a vertex: where the parameter turns, and another curve of orbits crosses."""

from __future__ import annotations

from enum import Enum, auto

import numpy as np

from contfric.continuation.events import Bifurcation, End, EndReason
from contfric.continuation.folds import overshot_vertex, vertex_at
from contfric.continuation.points import Point, Settings
from contfric.continuation.side import Side
from contfric.continuation.stalls import stalled_at
from contfric.continuation.vertex_between import left_at
from contfric.continuation.vertices import at_vertex, passed_vertex
from contfric.orbit.orbit import Orbit
from contfric.orbit.repetition import shortest
from contfric.orbit.sections import is_smooth

#: Near an event at which Newton fails steps are shortened by this factor, down to this length.
SHORTER, NEAREST = 8.0, 1e-8

#: Why a branch ends at a branch point at which its parameter turns, and no declared symmetry is broken.
CROSSED = "branch point: the parameter turns there, and another branch crosses"


class Overshoot(Enum):
    """What became of a side whose last points may have passed a vertex."""

    NONE = auto()
    BACK = auto()
    ENDED = auto()


def overshoots_vertex(orbit: Orbit, side: Side, settings: Settings, written: int) -> Overshoot:
    """End a side where its last points have passed a vertex that no fold has shown, or take them back.

    Orbits that have become symmetric (undoubled) are those of another branch: no side goes on along them.
    """
    first = side.last - written
    rows = side.rows.joints[: side.last + 1]
    passed = passed_vertex(orbit.system, rows, max(0, first))
    passed = passed or _gone_unseen(orbit, side, settings, max(0, first))
    if passed is None:
        return Overshoot.NONE
    before, after = side.rows.point(passed[0]), side.rows.point(passed[0] + 1)
    if np.isfinite(passed[1]):
        found = overshot_vertex(orbit, before, after, passed[1], settings)
    else:
        found = _gone_over(orbit, before, after, settings)
    if found is not None:
        side.rewind(passed[0] + 1)
        _end_at_vertex(orbit, side, settings, *found)
        return Overshoot.ENDED
    if np.isfinite(passed[1]):
        return Overshoot.NONE
    side.rewind(passed[0])
    side.largest = (after.arc - before.arc) / SHORTER
    if side.largest > NEAREST:
        return Overshoot.BACK
    end_stalled(orbit, side, settings)
    return Overshoot.ENDED


def _gone_unseen(
    orbit: Orbit, side: Side, settings: Settings, first: int
) -> tuple[int, float] | None:
    """Return the step over which smooth orbits of an even number of periods have become simpler ones.

    Their joints are those of one half only, and say nothing of the other: each orbit has to be run through.
    """
    model, system = orbit.model, orbit.system
    if (
        system.half
        or system.periods % 2
        or model.autonomous
        or not is_smooth(model, system.itinerary)
    ):
        return None
    active = model.index_of(settings.parameter)

    def repeats(row: int) -> bool:
        there = side.rows.point(row).orbit(orbit, active)
        return shortest(there) is not there

    low, high = first, side.last
    if not repeats(high) or repeats(low):
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if repeats(middle) else (middle, high)
    return low, float(np.inf)


def _gone_over(
    orbit: Orbit, before: Point, after: Point, settings: Settings
) -> tuple[Bifurcation, Point] | None:
    """Return the vertex at which a step has gone over to the simpler orbits, if it is found."""
    active = orbit.model.index_of(settings.parameter)
    near = left_at(before, after.orbit(orbit, active), settings)
    vertex = None if near is None else vertex_at(orbit, near, settings)
    return None if near is None or vertex is None else (vertex, near)


def _stuck_at_vertex(orbit: Orbit, side: Side, settings: Settings) -> bool:
    """End a side that gets no farther because a vertex is before it; True if that is so."""
    found = vertex_at(orbit, side.tip, settings)
    if found is not None:
        _end_at_vertex(orbit, side, settings, found, side.tip)
    return found is not None


def end_stalled(orbit: Orbit, side: Side, settings: Settings) -> None:
    """End a side that gets no farther; its message says whether a multiplier is at +1 there."""
    if _stuck_at_vertex(orbit, side, settings):
        return
    message, found = stalled_at(orbit, side.tip, settings)
    side.end = End(EndReason.STEP, message)
    if found is not None:
        active = orbit.model.index_of(settings.parameter)
        side.put_tip(at_vertex(side.tip, found.orbit, active))
        side.end = End(EndReason.BP, CROSSED, found)


def _end_at_vertex(
    orbit: Orbit, side: Side, settings: Settings, bifurcation: Bifurcation, point: Point
) -> None:
    side.drop_crowd(point.arc)
    side.put_tip(at_vertex(point, bifurcation.orbit, orbit.model.index_of(settings.parameter)))
    side.end = End(EndReason[bifurcation.kind.name], bifurcation=bifurcation)
