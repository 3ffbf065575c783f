"""Classifies a change of sign of the slope: fold, vertex, crossing of curves, split touch, or nothing."""

from __future__ import annotations

import numpy as np

from contfric.base.attributes import altered
from contfric.continuation.half_branch import point_before
from contfric.continuation.located_event import ROUGH, bifurcation_at, event_in
from contfric.continuation.points import Point, Settings
from contfric.continuation.singular_points.crossing import crossing_between
from contfric.continuation.singular_points.vertices import (
    parabola_vertex,
    simpler_fold,
    symmetric_part,
    undoubled_part,
)
from contfric.continuation.step import Step
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.events.doubling_point import opens_through
from contfric.events.split_touch import as_split
from contfric.orbit.orbit import Orbit

#: A parameter that changes this slowly along a branch, in units of arclength, is constant: the orbits are
#: a continuum at one value, and the sign of the slope is rounding.
_VERTICAL = 1e-3
#: A parameter is solved for to this (relative to 1).
_ROUNDING = 1e-13
#: A multiplier of a continuum is 1 to the root of rounding and a little.
_MARGINAL = 1e-5
#: A fold has a multiplier 1, located to far better than this.
NEAR_ONE = 0.1
#: What it may change by over a step, relative to the range, where it is constant: the root of rounding.
_CONSTANT = 1e-7
#: A located fold has a slope of rounding; this share of those around it is left at a jump only.
_LEFT = 0.1
#: Distance (arclength) up to which a branch is a parabola at a fold: a usual step.
_PARABOLA = 1e-2
#: A step shorter than this (arclength) is not taken back: there is nothing to be found in between.
SHORTEST_OVERSHOOT = 1e-7
#: An event with the point of the branch at which it is.
Located = tuple[Bifurcation, Point]


def fold_between(step: Step, share: float) -> list[Located]:
    """Return what a change of sign of the slope is for which no point was found.

    At the vertex of a pitchfork or of a period doubling the arclength system itself is singular, and Newton
    may be lost around it: it is looked for from between the two points.
    """
    vertex = _fold(step, parabola_vertex(step.before, step.after, share))
    # a fold of simpler orbits is located on these
    if (
        vertex[0].kind is not Kind.SN
        or vertex[0].orbit.system.segments < step.orbit.system.segments
    ):
        return [vertex]
    found = _vertex_of_crossing(step, share) or _split_between(step, share)
    if found is not None:
        return [found]
    return [] if _is_vertical(step) or _jumps_at_end(step) else [not_located(step, Kind.SN)]


def _split_between(step: Step, share: float) -> Located | None:
    """Return where the touch that a hold is pinned to splits, if that is why the slope changes its sign.

    Around it Newton may be lost: the step is taken back until it is as short as the location is known.
    """
    if not step.orbit.system.holds:
        return None
    before, after = step.before, step.after
    here = step.orbit_at(before)
    found = bifurcation_at(Kind.SN, here, before, after, before, step.settings)
    split = as_split(found, before.tangent + share * (after.tangent - before.tangent))
    if split is None:
        return None
    return altered(split, bound=ROUGH), altered(before, lost=step.length > SHORTEST_OVERSHOOT)


def fold_at(step: Step, point: Point) -> list[Located]:
    """Return what a change of sign of the slope at a point is: a fold, a vertex, or nothing."""
    vertex = _fold(step, point)
    if vertex[0].kind is not Kind.SN:
        return [vertex]
    crossing = _vertex_of_crossing(step, (point.arc - step.before.arc) / step.length)
    if crossing is not None:
        return [crossing]
    split = as_split(vertex[0], point.tangent)
    if split is not None:
        return [(split, point)]
    if _is_jump(step, point) or _is_idle(step, point):
        return []
    if _is_vertical(step):
        # of a bridge nothing but the parameter tells a fold
        settings = step.settings
        known = vertex[0].accuracy * settings.width if settings.stability else 0.0
        size = step.orbit.model.size_of(step.active, point.value)
        known = max(known, _ROUNDING * size)
        sides = step.before, step.after
        if not _turns(point, sides, known):
            sides = _farther(step.orbit, point, sides, settings)
        return [vertex] if _turns(point, sides, known) else []
    return [vertex]


def crossing_in(step: Step, share: float) -> Located | None:
    """Return the branch point in a step, if there is one: another curve of orbits crosses there.

    Along one parameter that takes a symmetry. One that is declared is dealt with by the orbits that have
    it; the search is for models whose author did not declare it.
    """
    if step.orbit.model.symmetry is not None:
        return None
    found = crossing_between(step, share)
    if found is None:
        return None
    crossing, point = found
    if np.all(np.abs(crossing.orbit.multipliers - 1.0) > NEAR_ONE):
        return None  # where an impact grazes multipliers are infinite, and singular is no crossing
    return event_in(step, Kind.BP, crossing.orbit, point), point


def _vertex_of_crossing(step: Step, share: float) -> Located | None:
    """Return the branch point at which the parameter turns, if that is what a fold is."""
    found = crossing_in(step, share)
    return found if found is not None and found[1].slope == 0.0 else None


def overshot_vertex(step: Step, share: float) -> Located | None:
    """Return the vertex between two points on its two sides, if it is one."""
    before, after = step.before, step.after
    point = parabola_vertex(before, after, share)
    point.w = before.w + share * (after.w - before.w)
    found = _fold(step, point)
    return None if found[0].kind is Kind.SN else found


def vertex_at(orbit: Orbit, point: Point, settings: Settings) -> Bifurcation | None:
    """Return the vertex that a point is next to, if it is."""
    found, _ = _fold(Step(orbit, point, point, point, settings), point)
    return None if found.kind is Kind.SN else found


def _is_vertical(step: Step) -> bool:
    """Tell whether the parameter is constant over a step: the sign of its slope is rounding.

    At a fold the multiplier passes 1 as fast as the parameter turns; on a continuum it is 1.
    """
    before, after, settings = step.before, step.after, step.settings
    slopes = max(abs(before.slope), abs(after.slope))
    size = step.orbit.model.size_of(step.active, before.value)
    if (
        slopes > _VERTICAL * min(1.0, size)
        or abs(after.value - before.value) > _CONSTANT * settings.width
    ):
        return False
    if not settings.stability:
        return True
    return all(float(np.abs(point.mu - 1.0).min()) < _MARGINAL for point in (before, after))


def _turns(point: Point, sides: tuple[Point, Point], known: float) -> bool:
    """Tell whether a parameter turns at a point that is known to an error, however slowly it does.

    On both sides its values lie on one side of that at the fold, and farther away than errors are.
    """
    gaps = [side.value - point.value for side in sides]
    return gaps[0] * gaps[1] > 0.0 and min(map(abs, gaps)) > known


def _farther(
    orbit: Orbit, point: Point, sides: tuple[Point, Point], settings: Settings
) -> tuple[Point, Point]:
    """Return points as far on both sides of a fold as its step is long, or as a branch is a parabola.

    A step may end so near to a fold that the parameter has changed by rounding only. Of a short branch there
    may be no orbits so far away: then half as far.
    """
    apart = max(_PARABOLA, *(abs(side.arc - point.arc) for side in sides))
    before, after = (_farthest(orbit, point, side, apart, settings) for side in sides)
    return before, after


def _farthest(orbit: Orbit, point: Point, side: Point, apart: float, settings: Settings) -> Point:
    """Return the farthest point found on one side of another one; else the side itself."""
    near = point.arc - side.arc
    while apart > abs(near):
        found = point_before(orbit, point, float(np.copysign(apart, near)), settings)
        if found is not None:
            return found
        apart *= 0.5
    return side


def _is_jump(step: Step, point: Point) -> bool:
    """Tell whether a slope changes its sign without being zero in between: no fold.

    Where two curves cross at the end of a branch trials end on either, and the sign is that of two curves.
    """
    return abs(point.slope) > _LEFT * max(abs(step.before.slope), abs(step.after.slope))


def _jumps_at_end(step: Step) -> bool:
    """Tell whether the parameter changes over a step as if only one of the two slopes were true.

    At an event at which another curve crosses the equations are singular, and the tangent is rounding. At a
    fold the slope changes over the whole step, and its mean is nearer to the middle of those at the ends than
    to either.
    """
    before, after = step.before, step.after
    mean = (after.value - before.value) / step.length
    middle = 0.5 * (before.slope + after.slope)
    return min(abs(mean - before.slope), abs(mean - after.slope)) < abs(mean - middle)


def _is_idle(step: Step, point: Point) -> bool:
    """Tell whether a parameter comes to a stand with no multiplier near 1: no fold.

    Where a slide begins at rest in its equilibrium, or grazes, its duration is arbitrary: a vertical line
    that the branch meets at its end, and on which the sign of the slope is rounding. At a fold the
    parameter turns: its values on both sides lie on one side of that at the fold, and away from it. So
    one that turns is a fold whatever the multipliers are.
    """
    leaves = min(abs(side.value - point.value) for side in (step.before, step.after))
    if leaves > _CONSTANT * step.settings.width:
        return False
    known = step.settings.stability and not step.orbit.system.holds and point.mu.size > 0
    return bool(known and np.all(np.abs(point.mu - 1.0) > NEAR_ONE))


def not_located(step: Step, kind: Kind) -> Located:
    """Return an event that is known to lie after a point, and no better: it is not kept silent.

    Its bound is that of an event at the point, and as much again for the way after it.
    """
    bifurcation = event_in(step, kind, step.orbit_at(step.before), step.before)
    return altered(bifurcation, located=False, bound=2.0 * bifurcation.accuracy), step.before


def _fold(step: Step, point: Point) -> Located:
    """Tell a fold from the vertex of a pitchfork or of a period doubling."""
    active, here = step.active, step.orbit_at(point)
    symmetric = symmetric_part(here, active)
    if symmetric is not None:
        kind, here = Kind.BP, symmetric
    elif (undoubled := undoubled_part(here, active)) is not None:
        kind, here = Kind.PD, undoubled
    else:
        kind, here = Kind.SN, simpler_fold(here, step.settings) or here
    found = event_in(step, kind, here, point)
    if kind is not Kind.SN and not opens_through(here, active):
        found = altered(found, bound=ROUGH)
    return found, point
