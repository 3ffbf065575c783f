"""Ends of a half-branch at a vertex: where the parameter turns, and another curve of orbits crosses.

The last step may lead from asymmetric (doubled) orbits to symmetric (undoubled) ones. Where a vertex has a
sharp tip, orbits become symmetric too fast to be met by shorter steps: near a touch of a kink multipliers
change with the root of the parameter. What vanishes at the vertex is defined on the symmetric orbits on
both sides of it, and changes sign there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import Enum, auto

import numpy as np

from contfric.continuation.half_branch import Side, first_point, point_before
from contfric.continuation.located_event import bifurcation_at
from contfric.continuation.locating.smooth import tangencies
from contfric.continuation.points import Point, Settings, displaced
from contfric.continuation.singular_points.crossing import crossing_near
from contfric.continuation.singular_points.folds import overshot_vertex, vertex_at
from contfric.continuation.singular_points.vertices import (
    at_vertex,
    joints_like,
    passed_vertex,
    symmetrised,
    undoubled,
)
from contfric.continuation.step import Step
from contfric.events.bifurcation import Bifurcation, End, EndReason, Kind
from contfric.events.doubling_point import moved, opening
from contfric.orbit.canonical.repetition import shortest
from contfric.orbit.canonical.sections import is_smooth
from contfric.orbit.orbit import Orbit

#: Near an event at which Newton fails steps are shortened by this factor, down to this length.
SHORTER, NEAREST = 8.0, 1e-8

#: Why a branch ends at a branch point at which its parameter turns, and no declared symmetry is broken.
CROSSED = "branch point: the parameter turns there, and another branch crosses"
#: Halvings of a step to the resolution of the parameter.
_HALVINGS = 40
#: What vanishes at a vertex is rounding below this.
_NOTHING = 1e-12
#: A step fails as near to a branch point as the last step was long, 1e-10, or as predictors are good, 1e-4:
#: what is farther from the last point (scaled product) is another one.
_NEAR = 1e-2
#: A multiplier this near to 1 is one of the singular orbit next to the last point: it is as far from 1 as
#: the point is from there.
_AT_ONE = 1e-2


#: Multiplier from which on a segment's end tells nothing of its start to rounding, and Newton's method fails.
_LOST = 1e12
#: Distance (arclength) from a vertex at which its branch is asked what is just before it: states are known
#: there to the root of rounding.
_NEXT_TO = 1e-5


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
        found = overshot_vertex(Step(orbit, before, after, after, settings), passed[1])
    else:
        found = _gone_over(orbit, before, after, settings)
    if found is not None:
        side.bifurcations += _touches_before(orbit, before, found[1], settings)
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


def _touches_before(
    orbit: Orbit, before: Point, vertex: Point, settings: Settings
) -> list[Bifurcation]:
    """Return the sections that are touched between a point and the vertex that a step from it has passed.

    Beyond the vertex the mirror image of the branch has the labels of the other half.
    """
    here = vertex.orbit(orbit, orbit.model.index_of(settings.parameter))
    near = point_before(here, vertex, _NEXT_TO, settings)
    if near is None or near.arc <= before.arc:
        return []
    touches = tangencies(Step(orbit, before, near, near, settings))
    return [event for event, _ in sorted(touches, key=lambda located: located[1].arc)]


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


def left_at(before: Point, after: Orbit, settings: Settings) -> Point | None:
    """Return the vertex at which a step went over from asymmetric orbits to symmetric ones, if it did.

    The simpler orbits between its ends are found at fixed parameters from the far one; where they turn on the
    way (a fold may lie near the vertex), along the chord between both ends.
    """
    active = after.model.index_of(settings.parameter)
    found = _at_values(before, after, active) or _along_chord(before, after, settings, active)
    if found is None:
        return None
    there = joints_like(found, before.joints)
    value = float(found.vector[active])
    gap = there - before.joints
    far = np.sum(gap * gap) / len(gap) + (value - before.value) ** 2 * settings.scale
    return replace(before, joints=there, w=np.array([value]), arc=before.arc + float(np.sqrt(far)))


def _simpler(orbit: Orbit) -> Orbit | None:
    return symmetrised(orbit) or undoubled(orbit)


def _at_values(before: Point, after: Orbit, active: int) -> Orbit | None:
    """Return the vertex between the parameters of two orbits; None if no orbit between is found."""
    part = _simpler(after)
    if part is None:
        return None
    low, high = before.value, float(after.vector[active])

    def between(share: float, near: Orbit | None) -> Orbit | None:
        return moved(near or part, active, low + share * (high - low))

    return _vanishing(between)


def _along_chord(before: Point, after: Orbit, settings: Settings, active: int) -> Orbit | None:
    """Return the vertex between two orbits, the orbits between being normal to their chord."""
    low = _simpler(before.orbit(after, active))
    high = _simpler(after)
    if low is None or high is None or low.joints.shape != high.joints.shape:
        return None
    chord = high.joints - low.joints
    rise = float(high.vector[active] - low.vector[active])
    length = np.sqrt(np.sum(chord * chord) / len(chord) + rise * rise * settings.scale)
    if not length > 0.0:
        return None
    plain = replace(settings, stability=False)

    def between(share: float, _: Orbit | None) -> Orbit | None:
        guess = displaced(low, active, share * chord, share * rise)
        point = first_point(guess, plain, chord / length, rise / length)
        return None if point is None else point.orbit(low, active)

    return _vanishing(between)


def _vanishing(orbit_at: Callable[[float, Orbit | None], Orbit | None]) -> Orbit | None:
    """Return the orbit at which a disturbance opens, between the shares 0 and 1 of a step; None if none does.

    By the method of false position and by halving in turn: what vanishes may change with a root.

    Parameters
    ----------
    orbit_at : the orbit at a share of the step, from one that is known nearby
    """
    low, high = 0.0, 1.0
    start, best = orbit_at(low, None), orbit_at(high, None)
    below, above = _opens(start), _opens(best)
    if not below * above < 0.0:
        return None
    for k in range(2 * _HALVINGS):
        share = below / (below - above) if k % 2 == 0 else 0.5
        share = low + share * (high - low)
        middle = orbit_at(share, best)
        here = _opens(middle)
        if np.isnan(here):
            return None
        if abs(here) < _NOTHING:
            return middle
        if below * here > 0.0:
            low, below = share, here
        else:
            high, above, best = share, here, middle
        if high - low < 0.5**_HALVINGS:
            break
    return best


def _opens(orbit: Orbit | None) -> float:
    return np.nan if orbit is None else opening(orbit)


def stalled_at(orbit: Orbit, tip: Point, settings: Settings) -> tuple[str, Bifurcation | None]:
    """Return why a branch stalls at a point, and the branch point at which its parameter turns, if it is one.

    Parameters
    ----------
    orbit : an orbit of the branch
    tip : the last point
    """
    active = orbit.model.index_of(settings.parameter)
    here = tip.orbit(orbit, active)
    crossing = crossing_near(here, settings, _NEAR)
    if crossing is None:
        return _multipliers(here), None
    found = crossing.orbit
    where = f"{settings.parameter} = {found.params[settings.parameter]:.12g}"
    message = f"{EndReason.STEP.value}; a multiplier is at +1: a branch point is at {where}"
    turns = crossing.nearest(tip.tangent, tip.slope, settings.scale).turns
    if not turns:
        return message, None
    return message, bifurcation_at(Kind.BP, found, tip, None, tip, settings)


def _multipliers(here: Orbit) -> str:
    """Return whether a multiplier is at +1, in words."""
    stalled = EndReason.STEP.value
    if here.system.holds:  # a bridge has none
        return stalled
    mu = here.turn_multipliers
    if not np.isfinite(mu).all():
        return f"{stalled}; a multiplier is infinite: an exit is tangential there"
    nearest = complex(mu[np.argmin(np.abs(mu - 1.0))])
    text = f"{nearest.real:.6g}" + (f"{nearest.imag:+.6g}i" if nearest.imag else "")
    if abs(nearest - 1.0) < _AT_ONE:
        return f"{stalled}; a multiplier is at +1 ({text}): a fold or a branch point is near"
    far = float(np.max(np.abs(mu)))
    if far > _LOST:
        return f"{stalled}; disturbances grow {far:.0e} times in a turn: sixteen digits do not follow that"
    return f"{stalled}; no multiplier is at +1 (the nearest is {text})"
