"""Smooth events between two points of a branch: folds, branch points, doublings, tori, tangencies."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from contfric.base.attributes import altered
from contfric.bvp.crossed_surfaces import TOUCH
from contfric.bvp.system import EventFunction, Margin
from contfric.continuation.accuracy.near_sliding_events import (
    NO_LENGTH,
    SAME_FOLD,
    SAME_LOCATION,
    SAME_VALUE,
    at_event,
    first_reliable,
    last_reliable,
    point_at,
)
from contfric.continuation.families.continuum import LEVEL
from contfric.continuation.half_branch import first_point
from contfric.continuation.located_event import ROUGH, bifurcation_at, event_in
from contfric.continuation.locating.change_of_sign import locate_change, locate_label
from contfric.continuation.points import EXTRA, Point
from contfric.continuation.singular_points.folds import (
    NEAR_ONE,
    SHORTEST_OVERSHOOT,
    Located,
    crossing_in,
    fold_at,
    fold_between,
    not_located,
)
from contfric.continuation.singular_points.vertices import (
    parabola_vertex,
    symmetric_part,
    undoubled_part,
)
from contfric.continuation.step import Step
from contfric.events.bifurcation import Bifurcation, Kind
from contfric.events.doubling_point import opens_through
from contfric.orbit.orbit import Orbit

#: The same for a tangency: near a tangential release (AS) the load overshoots its limit by the square
#: of the release's rate, which is rounding up to this distance.
SAME_TANGENCY = 2e-6
#: Between two points of a branch no condition is violated by more: a hundred times what a location is off by.
_OUTSIDE = 1e-9
#: Share of a margin that is left over where it vanishes.
_FALLEN = 1e-2
#: A function of the multipliers that changes by more than the second share of its change over a step, over
#: the first share of the step, is rounding; the longest step over which that is asked.
_NUDGE, _ERRATIC, _SHORT = 1e-3, 0.1, 1e-3
#: Share of the way from one change of a label to the next at which the other labels are asked.
_NEARBY = 0.01
#: Imaginary part from which a pair of multipliers on the unit circle counts as complex.
_COMPLEX = 1e-6


def smooth_events(step: Step) -> list[Located]:
    """Return folds, branch points, doublings, tori and tangencies."""
    from contfric.continuation.core.locate import BY_TEST
    from contfric.continuation.core.steps import CHI_MINUS, CHI_ONE, CHI_PAIR, FOLD, INFINITE

    orbit, before = step.orbit, step.before
    base = len(before.tests) - EXTRA
    size = min(1.0, orbit.model.size_of(step.active, before.value))
    # events after a sliding one do not happen
    slides = step.beyond is not step.after
    step = altered(step, after=last_reliable(step) or step.after)
    told = first_reliable(step)
    starts = [before.tests[base + FOLD], *told.tests[base + CHI_ONE :].tolist()]
    values = [*zip(starts, step.after.tests[base:].tolist(), strict=True)]
    found: list[Located] = []
    folded = False
    products = values[CHI_ONE], values[CHI_MINUS]
    # the largest multiplier changes its sign through infinity, or by rounding next to it
    infinite = all(a * b < 0.0 and min(abs(a), abs(b)) > INFINITE for a, b in products)
    for column, (a, b) in enumerate(values):
        if not a * b < 0.0 or (column == CHI_ONE and folded):
            continue  # chi(1) of a fold vanishes with it
        if infinite and column in (CHI_ONE, CHI_MINUS):
            continue
        if max(abs(a), abs(b)) < LEVEL * (size if column == FOLD else 1.0):
            continue  # zero on both sides: a continuum of orbits, and the sign is rounding
        if column != FOLD and _is_rounding(altered(step, before=told), base + column):
            continue
        share = a / (a - b) if np.isfinite(a) else 0.5  # infinite at a grazing: nothing is known
        may_cross = column == CHI_ONE and orbit.model.symmetry is None
        if may_cross and not _passes_vertex(step, share):
            crossing = crossing_in(step, share)
            if crossing is not None:
                found.append(crossing)
                continue
        first = before if column == FOLD else told
        point = locate_change(orbit, first, step.after, step.settings, BY_TEST, base + column)
        lost = point is None or point.lost
        if point is not None and (lost or _is_pole(point.tests[base + column], a, b)):
            point = None
        if column == FOLD:
            folded = True
            folds = fold_between(step, share) if point is None else fold_at(step, point)
            at_end = slides and _is_at_end(step, share)
            found += [
                fold
                for fold in folds
                if not (_is_sliding(step, fold[0]) or (at_end and not fold[0].located))
            ]
        elif point is not None:
            found += _at_multiplier(step, column, point)
        elif lost:  # a pole is no event: multipliers are infinite where an exit becomes tangential
            half = orbit.system.half or column == CHI_ONE
            kind = Kind.NS if column == CHI_PAIR else Kind.BP if half else Kind.PD
            found.append(_overshot(step, kind))
            if found[-1][1].lost:
                return found  # the step is taken back: what else is in it is found again
    step = altered(step, after=step.beyond)
    return [*found, *tangencies(_up_to_end(step) if slides else step)]


def _up_to_end(step: Step) -> Step:
    """Return a step without what is next to the sliding event at its end: labels there belong to it."""
    if step.length <= 2.0 * SAME_TANGENCY or (step.before.labels == step.after.labels).all():
        return step
    near = point_at(step, SAME_TANGENCY)
    return step if near is None else altered(step, after=near)


def _is_sliding(step: Step, fold: Bifurcation) -> bool:
    """Tell whether a fold is the sliding event next to it: slopes are rounding where curves cross."""
    left = float(fold.orbit.margins.min(initial=np.inf))
    if fold.kind is not Kind.SN or not (fold.located and left < _OUTSIDE):
        return False
    here = step.orbit_at(step.before)
    return left < _FALLEN * float(here.margins.min(initial=np.inf))


def _is_at_end(step: Step, share: float) -> bool:
    """Tell whether a slope changes its sign so near to a sliding event that a fold there is a part of it.

    Where the parameter stands at the event its slope there is rounding, and Newton's method may fail at the
    zero of rounding.
    """
    left = (1.0 - share) * step.length
    return (
        left < SAME_FOLD and 0.5 * abs(step.after.slope) * left < SAME_VALUE * step.settings.width
    )


def _is_rounding(step: Step, index: int) -> bool:
    """Tell whether a function of the multipliers changes its sign over a short step by rounding.

    Where a slip shrinks to nothing, of duration d, its ends are reached at rates of order d and d^2: times
    of events, and with them multipliers, are known to the rounding over the product of these rates, while
    the orbit is known well. What changes smoothly changes in proportion to the step, or like its root at an
    end; rounding is as large between two points however near they are.
    """
    before, after = step.before, step.after
    # next to an exit without a rate a multiplier has a pole, to which no point is told nearer than this
    small = min(_NUDGE * step.length, 0.01 * SAME_LOCATION)
    if not (step.length < _SHORT and np.isfinite([before.tests[index], after.tests[index]]).all()):
        return False
    over_step = abs(float(after.tests[index] - before.tests[index]))
    return any(
        _change_next_to(step, point, shift, index) > _ERRATIC * over_step
        for point, shift in ((before, small), (after, -small))
    )


def _change_next_to(step: Step, point: Point, shift: float, index: int) -> float:
    """Return by how much a test changes over a shift along the branch; 0 where no orbit is found there."""
    moved = point.along(step.orbit, step.active, shift)
    near = first_point(moved, step.settings, point.tangent, point.slope)
    return 0.0 if near is None else abs(float(near.tests[index] - point.tests[index]))


def _at_multiplier(step: Step, column: int, point: Point) -> list[Located]:
    """Return what a multiplier on the unit circle is: a branch point, a doubling, a torus, or nothing."""
    from contfric.continuation.core.steps import CHI_MINUS, CHI_PAIR

    kind, value = Kind.BP, -1.0 if column == CHI_MINUS else 1.0
    if column != CHI_PAIR and np.all(np.abs(point.mu - value) > NEAR_ONE):
        return []  # chi changed its sign through infinity, where an impact grazes
    if column == CHI_PAIR:
        if abs(point.mu[0].imag) < _COMPLEX:
            return []  # two real multipliers with product 1: nothing happens
        kind = Kind.NS
    elif column == CHI_MINUS and not step.orbit.system.half:
        kind = Kind.PD
    active, here = step.active, step.orbit_at(point)
    if kind is Kind.BP and not here.system.half and _is_vertex(here, active):
        return []  # the fold there says what it is; near it chi(1) is rounding
    event = event_in(step, kind, here, point)
    if column == CHI_MINUS and not opens_through(here, active):
        event = altered(event, bound=ROUGH)
    return [(event, point)]


def _passes_vertex(step: Step, share: float) -> bool:
    """Tell whether a step passes the vertex of a pitchfork or a doubling: its fold says what it is."""
    if step.orbit.system.half:
        return False
    between = parabola_vertex(step.before, step.after, share)
    return _is_vertex(step.orbit_at(between), step.active)


def _is_vertex(here: Orbit, active: int) -> bool:
    """Tell whether an orbit is at the vertex of a pitchfork or of a period doubling."""
    return (symmetric_part(here, active) or undoubled_part(here, active)) is not None


def _overshot(step: Step, kind: Kind) -> Located:
    """Return what stands for a step between whose ends no branch is found: it is to be taken back.

    A step as short as can be is not: then the event is reported as not located.
    """
    if step.length <= SHORTEST_OVERSHOOT:
        return not_located(step, kind)
    found = event_in(step, kind, step.orbit_at(step.before), step.before)
    return found, altered(step.before, lost=True)


def _is_pole(value: float, a: float, b: float) -> bool:
    """Tell whether a test changes sign through infinity."""
    return not np.isfinite(value) or abs(value) > 2.0 * max(abs(a), abs(b))


def tangencies(step: Step) -> list[Located]:
    """Return the events T of a step: changes of the surfaces that a segment crosses.

    At an event at which a segment comes in, of no length, it is rounding what it and those next to it cross.
    """
    found: list[Located] = []
    same = bool((step.before.labels == step.after.labels).all())
    if same and not (at_event(step.before) or at_event(step.after)):
        return found
    for k in (step.before.labels != step.after.labels).nonzero()[0].tolist():
        found += _changes(step, k) if _is_told(step, k) else []
    found += _undone(step, found)
    return _once(found) if step.orbit.model.joined else found


def _is_told(step: Step, k: int) -> bool:
    """Tell whether rounding can tell on which side the turns of a label are, as the march asks it."""
    from contfric.bvp.convergence import INTEGRATED
    from contfric.continuation.core.steps import TOLD

    at = len(step.before.tests) - EXTRA - len(step.before.labels) + k
    joints, rounding = step.after.joints, step.orbit.system.layout.rounding
    turn = 0.0 if rounding > INTEGRATED else abs(float(joints[-1, 0]))
    known = TOLD * rounding * (1.0 + turn) * (1.0 + float(np.abs(joints[:, 1:]).max()))
    return not TOUCH < max(step.before.tests[at], step.after.tests[at]) < known


def _changes(step: Step, k: int) -> list[Located]:
    """Return the changes of one label between two points at which it differs."""
    found: list[Located] = []
    orbit, settings = step.orbit, step.settings
    vanishes = _vanishes(step, k)
    locations = locate_label(orbit, step.before, step.after, settings, k)
    if len(locations) > 1 and locations[1].arc - locations[0].arc < SAME_LOCATION:
        locations.pop()
    if not locations and not (vanishes or _meets(orbit, k, step.orbit_at(step.after))):
        found.append(not_located(step, Kind.T))
    for point in locations:
        # where curves cross a trial may lie on another one
        if point.tests[: len(orbit.system.tests)].min(initial=0.0) < -_OUTSIDE:
            continue
        if _jumps(step, k, point):
            continue
        if vanishes and _stays(step, k, point):
            continue
        here = step.orbit_at(point)
        test = EventFunction(*_label_location(orbit, k))
        b = bifurcation_at(Kind.T, here, point, point, point, settings, (test,))
        found.append((b, point))
    return found


def _jumps(step: Step, k: int, point: Point) -> bool:
    """Tell whether a label differs on two sides of a location only as trials there lie on two curves.

    Where it changes along one curve what touches a surface there has no distance left to it.
    """
    of_label = len(step.orbit.system.tests) + k
    left, *ends = (float(p.tests[of_label]) for p in (point, step.before, step.after))
    return left > max(_OUTSIDE, _FALLEN * max(ends))


def _stays(step: Step, k: int, point: Point) -> bool:
    """Tell whether a label is the same half the way from a located change to either end of its step."""
    active, labels = step.orbit.model.index_of(step.settings.parameter), set()
    for end in (step.before, step.after):
        moved = point.along(step.orbit, active, 0.5 * (end.arc - point.arc))
        near = first_point(moved, step.settings, point.tangent, point.slope)
        if near is None:
            return False
        labels.add(int(near.labels[k]))
    return len(labels) == 1


def _undone(step: Step, others: list[Located]) -> list[Located]:
    """Return the changes of labels that are the same at both ends of a step in which others change.

    One touch may go from segment to segment: what it changes in one of them is undone soon. So labels are
    asked on both sides of the changes that are known, first by the tangent, which is near enough there. So
    they are next to a sliding event: what touches a surface there may be on either side of it by rounding.
    """
    from contfric.continuation.core.locate import BY_PARAMETER

    orbit, before, after = step.orbit, step.before, step.after
    found: list[Located] = []
    if not (before.labels == after.labels).any():
        return found
    known = sorted((point for event, point in others if event.located), key=lambda p: p.arc)
    within = [(before, at_event(before)), *((p, True) for p in known), (after, at_event(after))]
    for (one, near), (other, far) in pairwise(within):
        if other.arc - one.arc < SAME_TANGENCY or one.value == other.value:
            continue
        sides = [(one, _NEARBY)] * near + [(other, -_NEARBY)] * far
        for point, share in sides:
            asked = point.along(orbit, step.active, share * (other.arc - one.arc)).labels
            if not ((before.labels == after.labels) & (asked != before.labels)).any():
                continue
            value = point.value + share * (other.value - one.value)
            nearby = locate_change(orbit, one, other, step.settings, BY_PARAMETER, 0, value)
            if nearby is None or nearby.lost:
                continue
            same = (before.labels == after.labels) & (nearby.labels != before.labels)
            for k in np.flatnonzero(same).tolist():
                changes = [
                    *_changes(altered(step, after=nearby, beyond=nearby), k),
                    *_changes(altered(step, before=nearby), k),
                ]
                found += [c for c in changes if all(_apart(c, o) for o in (*others, *found))]
    return found


def _apart(one: Located, other: Located) -> bool:
    """Tell whether two changes of labels are at two locations."""
    return one[0].located and abs(one[1].arc - other[1].arc) > SAME_TANGENCY


def _vanishes(step: Step, k: int) -> bool:
    """Tell whether the segment of a label, or one next to it, has no length at an end of a step."""
    system = step.orbit.system
    i, n = int(system.layout.labels[k][0]), system.segments
    near = [(i + step) % n for step in (-1, 0, 1)]
    motions = map(step.orbit_at, (step.before, step.after))
    return any((m.durations[near] < NO_LENGTH).any() for m in motions)


def _meets(orbit: Orbit, k: int, here: Orbit) -> bool:
    """Tell whether a joint of the segment of a label lies on a surface that it does not end on.

    At an event it does, and where that is known to the root of rounding what the segment crosses is, too.
    """
    i, c, came, goes = (int(number) for number in orbit.system.layout.labels[k][:4])
    model = orbit.model
    observable = model.observables[c].name
    for joint, own in ((here.begins[i], came), (here.ends[i], goes)):
        value = here.flow.observe(observable, float(joint[0]), joint[1:])
        for j, surface in enumerate(model.surfaces):
            gap = abs(value - here.flow.level(surface.name))
            if surface.observable == observable and j != own and gap < NO_LENGTH:
                return True
    return False


def _once(found: list[Located]) -> list[Located]:
    """Return one tangency of those in one location: where a joint on a section is, is of no importance."""
    kept: list[Located] = []
    for event in sorted(found, key=lambda pair: pair[1].arc):
        if not kept or event[1].arc - kept[-1][1].arc > SAME_TANGENCY:
            kept.append(event)
    return kept


def _label_location(orbit: Orbit, k: int) -> tuple[Margin, int, str]:
    segment, observable, *_ = orbit.system.layout.labels[k]
    name = orbit.model.observables[int(observable)].name
    return Margin.INTERIOR, int(segment), name
