"""Branches that leave a branch point or a doubling and end at once, nearer than they can be solved.

Without damping the multiplier of an orbit is 1 at many an event at which a slide has no length, and with
little damping it passes 1 next to it, at a distance in proportion to the damping. There a branch point (a
doubling) lies just before the event, and the branch that leaves it ends where the slide of one half has no
length: asymmetric orbits and bridges go on from there, and nothing else leads to them.

The equations tell the parameter of the branch at a distance a from the vertex to rounding over a: what sets
it is the odd part of the equations, which is in proportion to a. The vertex itself is known to rounding (it
is located on the simpler orbit). The branch leaves it along the null vector as a parabola, whose bend is
known from an orbit at a distance of 1e-3: what that misses is of order ``1e-3 a^2``, and of the parameter,
which is even in a, ``1e-6 a^2``. Nearer than the fourth root of rounding that is less than what a solved
orbit is off by.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contfric.atlas.collect import Event
from contfric.atlas.exploration import Exploration
from contfric.atlas.leaving.crossings import whole_branch
from contfric.atlas.leaving.trace_away import first_end, settings_for, where
from contfric.atlas.matching import same_event, same_kind, same_location
from contfric.base.arrays import FloatArray
from contfric.base.interrupts import whole
from contfric.continuation.assembly import assemble
from contfric.continuation.branch import Branch
from contfric.continuation.half_branch import Side, first_point
from contfric.continuation.located_event import bifurcation_at
from contfric.continuation.points import Point, Settings, displaced
from contfric.continuation.singular_points.switching import LEAVE, null_vector, settings_value
from contfric.continuation.singular_points.vertices import (
    symmetric_part,
    symmetrised,
    undoubled,
    undoubled_part,
)
from contfric.events.bifurcation import TERMINAL, Bifurcation, Decision, End, EndReason, Kind
from contfric.events.doubling_point import solved_at_vertex
from contfric.events.incident.candidates import Candidate
from contfric.events.sliding_kinds import kind_of_margin
from contfric.orbit.orbit import Orbit

#: Where the bend of a branch is told from, and at which share of that it must be the same: up to this share
#: of itself.
_BEND, _NEARER, _MISSED = LEAVE, 0.25, 0.2
#: Data that an orbit keeps (where contacts rest that never slip) and that differ by more are different ones.
_KEPT = 1e-11


def nearest(orbit: Orbit) -> float:
    """Return how far from a vertex a parabola is nearer to the branch than what is solved."""
    return float(orbit.model.rounding**0.25)


@dataclass(frozen=True, eq=False)
class _Parabola:
    """A branch near the vertex that it leaves: ``joints + a phi + a^2 bend``, ``value + a^2 rise``."""

    orbit: Orbit
    phi: FloatArray
    bend: FloatArray
    rise: float
    nearby: Point
    settings: Settings

    def at(self, distance: float) -> Orbit:
        """Return the orbit at a distance from the vertex."""
        active = self.orbit.model.index_of(self.settings.parameter)
        joints = distance * (self.phi + distance * self.bend)
        return displaced(self.orbit, active, joints, distance**2 * self.rise)

    def point(self, distance: float) -> Point:
        """Return the same as a point; multipliers are those next to it."""
        here = self.at(distance)
        return replace(
            self.nearby,
            joints=here.joints,
            w=np.array([settings_value(here, self.settings)]),
            tangent=self.phi,
            direction=np.array([2.0 * distance * self.rise]),
            arc=distance,
            labels=here.labels,
        )

    def first_end(self) -> tuple[int, float] | None:
        """Return the margin that vanishes first, and where; None if none does so near."""
        brentq = whole("scipy.optimize").brentq

        farthest = nearest(self.orbit)
        here, there = self.orbit.margins, self.at(farthest).margins

        def margin(distance: float, k: int) -> float:
            return float(self.at(distance).margins[k])

        ends = {
            k: float(brentq(margin, 0.0, farthest, (k,), xtol=1e-18, rtol=1e-12))
            for k in np.flatnonzero((here > 0.0) & (there < 0.0)).tolist()
        }
        return min(ends.items(), key=lambda pair: pair[1]) if ends else None


def _parabola(orbit: Orbit, phi: FloatArray, settings: Settings) -> _Parabola | None:
    """Return the branch along a null vector as a parabola; None if it is no parabola that near."""
    value = settings_value(orbit, settings)
    found = []
    for distance in (_BEND, _NEARER * _BEND):
        moved = replace(orbit, joints=orbit.joints + distance * phi)
        point = first_point(moved, settings, phi, 0.0)
        if point is None:
            return None
        bend = (point.joints - moved.joints) / distance**2
        found.append((bend, (point.value - value) / distance**2, point))
    (bend, rise, nearby), (nearer, other, _) = found
    misses = np.abs(bend - nearer).max(), abs(rise - other) / settings.width
    size = np.abs(bend).max() + abs(rise) / settings.width
    if max(misses) > _MISSED * size:
        return None
    return _Parabola(orbit, phi, bend, rise, nearby, settings)


def is_short(branch: Branch) -> bool:
    """Tell whether a branch is one that ends nearer to its vertex than its orbits can be solved for."""
    from_vertex = any(end.reason in (EndReason.BP, EndReason.PD) for end in branch.ends)
    return from_vertex and bool(branch.arc[-1] <= nearest(branch[0]))


def leave_short(state: Exploration, orbit: Orbit, event: Event, end: EndReason, text: str) -> bool:
    """Take the branch that leaves a vertex for what follows it, if it is short; False if not."""
    short = short_branch(orbit, settings_for(orbit, state.settings), event, end)
    if short is None:
        return False
    if (known := _known(state, short)) is not None:
        state.judge(event, text, Decision.KNOWN, known)
    else:
        state.accept(event, text, short)
    return True


def follow_short(state: Exploration, candidate: Candidate, event: Event) -> bool | None:
    """Take a short branch that ends at an event for what follows it.

    None if no branch is found, else whether it is another one than the branch that arrives.
    """
    assert candidate.orbit is not None
    short = short_branch_to(candidate.orbit, state.settings, event)
    if short is None:
        return None
    if (known := _known(state, short)) is not None:
        state.judge(event, candidate.reason, Decision.KNOWN, known)
        return event.branches[:1] != [known]
    state.accept(event, candidate.reason, short, short.ends[1:])
    event.take_better(short.ends[1])
    return True


def _known(state: Exploration, branch: Branch) -> int | None:
    """Return the short branch of the same two events that is known already, or None."""
    parameter, width = state.settings.parameter, state.settings.width
    events = [end.bifurcation for end in branch.ends]
    for index, other in enumerate(state.branches):
        if is_short(other) and all(
            any(
                a is not None and b is not None and same_event(a, b, parameter, width)
                for b in (end.bifurcation for end in other.ends)
            )
            for a in events
        ):
            return index
    return None


def begins_at_short(state: Exploration, event: Event) -> None:
    """Let a bridge begin where a short branch ends, if it was taken to begin at the event just after that.

    What is held there is negative between both, by the square of their distance: less than is seen as
    violated. So it is found from either of them, and belongs to the one that comes first.
    """
    if len(event.branches) != 1 or not is_short(state.branches[event.branches[0]]):
        return
    b, near = event.bifurcation, nearest(event.bifurcation.orbit)
    active = b.orbit.model.index_of(state.settings.parameter)
    value = float(b.orbit.vector[active])
    size = b.orbit.model.size_of(active, value)
    for index, branch in enumerate(state.branches):
        system = branch.system
        if not system.holds or system.half or system.periods != b.orbit.as_whole().periods:
            continue  # simpler bridges go through between both
        for k, end in enumerate(branch.ends):
            other = end.bifurcation
            if other is None or not same_kind(other, b):
                continue
            gap = abs(other.params[branch.parameter] - value)
            if gap < near * size and other.outline.apart(b.outline) < near:
                state.end_at(index, k, event)
                text = "the bridge that begins just after it"
                state.judge(event, text, Decision.KNOWN, index)
                return


def short_branch(
    orbit: Orbit, settings: Settings, event: Event, reason: EndReason, phi: FloatArray | None = None
) -> Branch | None:
    """Return the branch that leaves a vertex, if it ends before it can be solved for; else None.

    Parameters
    ----------
    orbit : that of the event, over a whole turn or two
    phi : its null vector, one way
    """
    phi = null_vector(orbit) if phi is None else phi
    if phi is None:
        return None
    tip = replace(orbit, joints=orbit.joints + nearest(orbit) * phi)
    if not np.any((orbit.margins > 0.0) & (tip.margins < 0.0)):
        return None  # as most branches do it goes farther
    curve = _parabola(orbit, phi, settings)
    found = None if curve is None else curve.first_end()
    if curve is None or found is None:
        return None
    test, distance = found
    points = [curve.point(a) for a in (0.0, 0.5 * distance, distance)]
    active = orbit.model.index_of(settings.parameter)
    here = points[-1].orbit(orbit, active)
    kind = kind_of_margin(orbit.system, orbit.system.tests[test], here)
    if kind not in TERMINAL:
        return None
    known = event.bifurcation.accuracy + (_BEND * distance) ** 2 / settings.width
    last = bifurcation_at(
        kind, here, points[0], None, points[-1], settings, (orbit.system.tests[test],)
    )
    last = replace(last, bound=known)
    side = Side.starting(points[0], orbit.system, End(EndReason[kind.name]), settings.stability)
    side.end_at(0, points[1], side.end)
    end = End(EndReason[kind.name], where(last, settings.parameter), last)
    side.end_at(1, points[2], end)
    return assemble(orbit, settings, side, first_end(reason, event, side, settings))


def short_branch_to(orbit: Orbit, settings: Settings, event: Event) -> Branch | None:
    """Return the branch of an orbit at an event that comes from a vertex just before it; None if none does.

    Where the event is known roughly the symmetric orbit of the vertex is taken for that at the event.
    """
    active, near = orbit.model.index_of(settings.parameter), 2.0 * nearest(orbit)
    if orbit.system.holds or event.bifurcation.orbit.system.half:
        return None
    if orbit.system.half:
        vertex, reason = solved_at_vertex(orbit, active), EndReason.BP
    elif (part := symmetrised(orbit, near)) is not None:
        if not _keeps(orbit, part):
            return None
        vertex, reason = symmetric_part(orbit, active), EndReason.BP
    elif undoubled(orbit, near) is not None:
        vertex, reason = undoubled_part(orbit, active), EndReason.PD
    else:
        return None
    start = None if vertex is None else _as_event(vertex, settings, Kind[reason.name])
    if vertex is None or start is None:
        return None
    whole = vertex.as_whole() if reason is EndReason.BP else vertex.doubled()
    phi = null_vector(whole)
    if phi is None:
        return None
    branches = (short_branch(whole, settings, start, reason, way) for way in (phi, -phi))
    return next((b for b in branches if b is not None and _meets(b, event, settings)), None)


def _keeps(orbit: Orbit, part: Orbit) -> bool:
    """Tell whether the symmetric part of an orbit keeps what the orbit does: then its branch may leave there.

    Contacts that never slip rest at any place, and a branch is followed with that given: only where they rest
    at the centre is a symmetric orbit on it.
    """
    data = orbit.system.layout.conserved
    moved = orbit.joints[0, 1:] - part.joints[0, 1:]
    size = 1.0 + float(np.max(np.abs(orbit.joints)))
    return not len(data) or bool(np.max(np.abs(data @ moved)) < _KEPT * size)


def _as_event(vertex: Orbit, settings: Settings, kind: Kind) -> Event | None:
    """Return a vertex as an event of its own branch; None if it is not told from what is next to it."""
    there = Bifurcation(kind, vertex.params, vertex, (), 0.0, None, None)
    branch = whole_branch(vertex, settings)
    for b in () if branch is None else branch.bifurcations:
        if b.kind is kind and same_location(b, there, settings.parameter, settings.width):
            return Event(replace(b, stable_before=None), [], [])
    return None


def _meets(branch: Branch, event: Event, settings: Settings) -> bool:
    last = branch.ends[1].bifurcation
    assert last is not None
    return same_event(last, event.bifurcation, settings.parameter, settings.width)
