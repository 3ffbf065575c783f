"""Ends of a side at a vertex: where the parameter turns, and another curve of orbits crosses."""

from __future__ import annotations

import numpy as np

from contfric.continuation.events import Bifurcation, End, EndReason
from contfric.continuation.points import Point, Settings
from contfric.continuation.side import Side
from contfric.continuation.smooth import leapt_vertex, vertex_at
from contfric.continuation.stalls import stalled_at
from contfric.continuation.vertices import at_vertex, left_at, passed_vertex
from contfric.orbit.orbit import Orbit

#: Beside an event at which Newton fails steps are shortened by this factor, down to this length.
SHORTER, NEAREST = 8.0, 1e-8

#: Why a branch ends at a branch point at which its parameter turns, and no declared symmetry is broken.
CROSSED = "branch point: the parameter turns there, and another branch crosses"


def leaps_over_vertex(orbit: Orbit, side: Side, settings: Settings, written: int) -> bool:
    """End a side where its last points have passed a vertex that no fold has shown."""
    first = side.last - written
    passed = passed_vertex(orbit.system, side.rows.joints[first : side.last + 1])
    if passed is None:
        return False
    before = side.rows.point(first + passed[0])
    after = side.rows.point(first + passed[0] + 1)
    if not np.isfinite(passed[1]):
        active = orbit.model.index_of(settings.parameter)
        near = left_at(before, after.orbit(orbit.system, orbit.vector, active), active)
        vertex = None if near is None else vertex_at(orbit, near, settings)
        if near is not None and vertex is not None:
            side.rewind(first + passed[0] + 1)
            _end_at_vertex(orbit, side, settings, vertex, near)
            return True
        if passed[1] < 0.0:
            return False
        side.rewind(first + passed[0])
        side.largest = (after.arc - before.arc) / SHORTER
        return side.largest < NEAREST and _stuck_at_vertex(orbit, side, settings)
    found = leapt_vertex(orbit, before, after, passed[1], settings)
    if found is None:
        return False
    bifurcation, point = found
    side.rewind(first + passed[0] + 1)
    _end_at_vertex(orbit, side, settings, bifurcation, point)
    return True


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
    side.put_tip(at_vertex(point, bifurcation.orbit, orbit.model.index_of(settings.parameter)))
    side.end = End(EndReason[bifurcation.kind.name], bifurcation=bifurcation)
