"""What crosses a symmetric bridge where it turns.

A hold has an effect on the orbit that is stationary in its length. There each of two symmetric holds may be
shorter or longer, so that the bridge with one of either passes the same motion, and turns there as well.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving_event import (
    first_end,
    plane_of,
    settings_for,
)
from contfric.continuation.assembly import assemble
from contfric.continuation.events import (
    EndReason,
    Verdict,
)
from contfric.continuation.points import Point
from contfric.continuation.side import first_point
from contfric.continuation.switching import (
    NEARER,
    settings_value,
)
from contfric.continuation.trace import follow_orbit, trace_side
from contfric.continuation.vertices import symmetrised
from contfric.models.definition import FloatArray
from contfric.orbit.linear import null_space
from contfric.orbit.orbit import Orbit

#: An orbit this much (of its distance from a symmetric one) off its own symmetry image is asymmetric.
_ODD = 0.1


def follow_fold(state: Exploration, event: Event) -> None:
    """Try the families that cross a symmetric bridge where it turns.

    A hold has an effect that is stationary in its length: there each of two symmetric holds may be shorter
    or longer, so that the bridge with one of either passes the same motion, and turns there as well.
    """
    orbit = event.bifurcation.orbit
    half = orbit if orbit.system.half else symmetrised(orbit)
    if half is None:
        return
    _try_crossing(
        state, event, half.as_whole(), "the asymmetric branch with one hold of either length"
    )
    if not any(state.branches[i].system.half for i in event.branches):
        _try_crossing(state, event, half, "the symmetric branch through the fold")


def _try_crossing(state: Exploration, event: Event, orbit: Orbit, reason: str) -> None:
    settings = settings_for(orbit, state.settings)
    active = orbit.model.index_of(settings.parameter)
    for distance in NEARER:
        for direction in _ways_through(orbit, active):
            moved = replace(orbit, joints=orbit.joints + distance * direction)
            point = first_point(moved, settings, direction, 0.0)
            if point is None:
                continue
            there = point.orbit(orbit.system, orbit.vector, active)
            off = there.mirror_distance > _ODD * distance
            if not there.admissible or off is orbit.system.half:
                continue
            if (known := state.known(there)) is not None:
                state.judge(event, reason, Verdict.KNOWN, known)
                return
            _add_crossing(state, event, orbit, point, reason)
            return


def _ways_through(orbit: Orbit, active: int) -> list[FloatArray]:
    """Return directions to look for a family in: where it is the only one of its equations, along it."""
    found = list(plane_of(orbit, active))
    if found or not orbit.system.half:
        return found
    vectors, _ = null_space(orbit.system, orbit.joints, orbit.vector, active)
    return [vector / np.max(np.abs(vector)) for vector in vectors]


def _add_crossing(
    state: Exploration, event: Event, orbit: Orbit, point: Point, reason: str
) -> None:
    """Trace a family that crosses a fold: both ways, or to one side of it where the other is its image."""
    settings = settings_for(orbit, state.settings)
    active = orbit.model.index_of(settings.parameter)
    if orbit.system.half:
        there = point.orbit(orbit.system, orbit.vector, active)
        branch = follow_orbit(there, settings)
    else:
        if float(np.sum((point.joints - orbit.joints) * point.tangent)) < 0.0:
            point = point.reversed()
        origin = replace(
            point, joints=orbit.joints, w=np.array([settings_value(orbit, settings)]), arc=0.0
        )
        point.arc = float(np.linalg.norm(point.joints - orbit.joints)) / len(orbit.joints) ** 0.5
        side = trace_side(orbit, point, settings, progress=state.progress)
        first = first_end(EndReason.BP, event, side, settings)
        branch = assemble(orbit, settings, side, first, origin)
    state.accept(event, reason, branch)
