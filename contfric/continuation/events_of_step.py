"""Events of the last step of a branch: located, in order, compared with known ones; which end the branch."""

from __future__ import annotations

import numpy as np

from contfric.continuation.accuracy.near_sliding_events import SAME_FOLD, SAME_LOCATION, SAME_VALUE
from contfric.continuation.accuracy.rounding import not_critical
from contfric.continuation.ends.at_events import (
    end_at_limit,
    ends_at,
    is_point,
    never_leaves,
    passes_point,
)
from contfric.continuation.ends.at_range import ends_at_limit, is_at_limit, limit_crossed, limit_end
from contfric.continuation.ends.at_values import stop_between
from contfric.continuation.ends.at_vertices import NEAREST, SHORTER
from contfric.continuation.half_branch import Side
from contfric.continuation.locating.sliding import nearly_reached, sliding_events
from contfric.continuation.locating.smooth import SAME_TANGENCY, smooth_events
from contfric.continuation.moving_joints import (
    LAST_CROSSING,
    is_known_touch,
    is_on_section,
    move_joints,
)
from contfric.continuation.points import EXTRA, Point, Settings
from contfric.continuation.step import Step
from contfric.events.bifurcation import TERMINAL, Bifurcation, End, EndReason, Kind
from contfric.orbit.orbit import Orbit

#: An event within this share of a step of a limit of the parameter belongs to the limit (S = 0).
_AT_LIMIT = 1e-6
#: A margin this negative (nondimensional) is violated; a located limit is good to rounding.
VIOLATED = 1e-9
#: Events from which simpler orbits go on, and how much farther (in their accuracies) they are told from what
#: is next to them.
_OPENS, _TOLD = frozenset({Kind.BP, Kind.PD}), 10.0


def end_of_holds(orbit: Orbit, side: Side, settings: Settings, stuck: bool) -> bool:
    """End a side that is stuck just before several holds end at once; True if that is so."""
    reached = nearly_reached(orbit, side.tip, settings) if stuck else None
    if reached is not None:
        side.end = End(EndReason[reached.kind.name], bifurcation=reached)
    return reached is not None


def resolve(orbit: Orbit, side: Side, settings: Settings) -> bool:
    """Locate what happened over the last step; True if the side ends there."""
    before, after = side.before_tip, side.tip
    limit = limit_crossed(orbit, before, after, settings)
    stop = stop_between(orbit, before, after, settings) if settings.stop_at else None
    if stop is not None and (limit is None or stop.point.arc <= limit[0].arc):
        limit = stop.point, ""
    located = locate_events(orbit, before, after, settings)
    if any(is_on_section(b) and is_point(b.orbit) for b, _ in located):
        side.drop_tip()  # beyond it the same orbits come again, half a cycle later
        side.end = End(EndReason.POINT)
        return True
    fails = violates(after if limit is None else limit[0])
    active = orbit.model.index_of(settings.parameter)
    shrinks = fails and passes_point(before.orbit(orbit, active), after.orbit(orbit, active))
    at_limit = fails and ends_at_limit(located, before, after, settings)
    if at_limit:
        side.drop_tip()
        side.end = limit_end(before.value, settings)
        return True
    if _comes_closer(side, located, at_limit is None or shrinks, after.arc - before.arc):
        return False
    if shrinks:
        side.drop_tip()
        side.end = End(EndReason.POINT)
        return True
    if located and is_on_section(located[0][0]):
        side.drop_tip()
        if move_joints(orbit, side, settings):
            return False
        side.end = End(EndReason.STEP, LAST_CROSSING)
        return True
    side.largest = np.inf  # what asked for shorter steps is behind
    if shrunk := [pair for pair in located if is_point(pair[0].orbit)]:
        # segments of no length fold and double with it, and Newton fails before it
        clear = [pair for pair in located if pair[0].located and not pair[1].lost]
        located = [*(pair for pair in clear if pair not in shrunk), shrunk[-1]]
    for bifurcation, point in located:
        if limit is not None and _is_beyond(point, limit[0], after.arc - before.arc, settings):
            break
        if is_at_limit(point.value, settings):
            end_at_limit(side, located, point, settings)
            return True
        if _is_known(side, bifurcation, before, point, after, settings):
            continue
        if is_point(bifurcation.orbit):
            side.put_tip(point)
            side.end = End(EndReason.POINT)
            return True
        if never_leaves(bifurcation.orbit):  # flights of no height fold by rounding
            side.put_tip(point)
            side.end = End(EndReason.REST)
            return True
        if not point.lost and (note := not_critical(bifurcation, before, after, settings)):
            side.notes.append(note)
        elif ends_at(orbit, side, bifurcation, point, settings):
            if bifurcation.kind in TERMINAL:
                _drop_what_belongs(side, point, settings)
            return True
    if fails:
        _end_where_it_fails(orbit, side, settings)
        return True
    if limit is None:
        return False
    side.put_tip(limit[0])
    side.end = limit_end(after.value, settings)
    if stop is not None and limit[0] is stop.point:
        side.end = stop.end
    return True


def _end_where_it_fails(orbit: Orbit, side: Side, settings: Settings) -> None:
    """End a side before a step over which a condition is violated, and no event says why."""
    side.drop_tip()
    if is_at_limit(side.tip.value, settings):
        side.end = limit_end(side.tip.value, settings)
    elif not end_of_holds(orbit, side, settings, True):
        side.end = End(EndReason.SINGULAR)


def violates(point: Point) -> bool:
    """Tell whether a condition is violated at a point, by more than a located event is off by rounding."""
    return bool((point.tests[:-EXTRA] < -VIOLATED).any())


def _is_beyond(point: Point, limit: Point, step: float, settings: Settings) -> bool:
    """Tell whether an event lies at the limit of the parameter, or after it."""
    within = settings.low <= point.value <= settings.high
    return point.arc > limit.arc - _AT_LIMIT * step or not within


def _is_known(
    side: Side,
    bifurcation: Bifurcation,
    before: Point,
    point: Point,
    after: Point,
    settings: Settings,
) -> bool:
    """Tell whether an event is that at which the side starts, or a touch that is known already."""
    if side.at_event and belongs_to(bifurcation, side.first, settings):
        return True
    if bifurcation.kind is not Kind.T:
        return False
    if side.count == 2 and point.arc - before.arc < SAME_LOCATION:
        side.relabel_first(after.labels)  # where a stop lies on a surface its label is arbitrary
        return True
    return is_known_touch(side, point)


def _comes_closer(
    side: Side, located: list[tuple[Bifurcation, Point]], undecided: bool, step: float
) -> bool:
    """Go back to the point before an event near which Newton fails, and on in shorter steps.

    Where two curves of orbits cross, Newton converges from no farther than the crossing is away: a step
    across may end on the other curve, and what is between its ends belongs to neither. And it may be
    ``undecided`` whether a branch ends at a limit, or at how small an orbit.
    """
    fails = undecided or any(point.lost or point.rough for _, point in located)
    if not fails or step < NEAREST:
        return False
    side.drop_tip()
    side.largest = step / SHORTER
    return True


def locate_events(
    orbit: Orbit, before: Point, after: Point, settings: Settings
) -> list[tuple[Bifurcation, Point]]:
    """Return the bifurcations between two points with their located points, in order.

    A point that is ``lost`` is no event: Newton fails after it before any condition is violated.
    """
    sliding = sliding_events(orbit, before, after, settings)
    if not sliding:
        smooth = smooth_events(Step(orbit, before, after, after, settings))
        return sorted(smooth, key=lambda pair: pair[1].arc)
    end = sliding[0][1]
    if end.arc <= before.arc:  # it is at the first point: nothing comes before it
        return sliding
    smooth = [
        (b, point)
        for b, point in smooth_events(Step(orbit, before, after, end, settings))
        if point.arc < end.arc and not belongs_to(b, end, settings)
    ]
    return sorted([*smooth, *sliding], key=lambda pair: pair[1].arc)


def _drop_what_belongs(side: Side, end: Point, settings: Settings) -> None:
    """Take away what belongs to the sliding event that ends a side, and was met over the step before.

    That step may end at the very event, or a rounding before it: the next one finds it at its first point.
    """
    while side.bifurcations and belongs_to(side.bifurcations[-1], end, settings):
        side.bifurcations.pop()


def belongs_to(event: Bifurcation, end: Point, settings: Settings) -> bool:
    """Tell whether a smooth event before a sliding event, or after it, is part of it.

    Where an exit becomes tangential the branch folds and multipliers are infinite, and near there a location
    along the branch is good to the root of what the parameter is. A vertex is no such fold: the simpler
    orbits there have been solved. And where no multiplier is infinite a branch point or a doubling is known
    well: with little damping it lies as near to a slide of no length as the damping is small.
    """
    if event.kind in TERMINAL:
        return False
    apart = abs(event.position - end.arc)
    gap = abs(event.params[settings.parameter] - end.value) / settings.width
    if event.kind in _OPENS and gap > 0.0 and apart < SAME_LOCATION:
        return gap <= _TOLD * event.accuracy
    if apart < (SAME_TANGENCY if event.kind is Kind.T else SAME_LOCATION):
        return True
    if event.kind is Kind.T or event.orbit.system.segments != len(end.joints):
        return False
    return gap < SAME_VALUE and apart < SAME_FOLD
