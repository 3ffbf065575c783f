"""Smooth events between two points of a branch: folds, branch points, doublings, tori, tangencies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.continuation.continuum import LEVEL
from contfric.continuation.crossing import crossing_between
from contfric.continuation.events import Bifurcation, Kind
from contfric.continuation.locate_change import locate_change, locate_label
from contfric.continuation.points import EXTRA, Point, Settings
from contfric.continuation.report import ROUGH, bifurcation_at
from contfric.continuation.split_touch import as_split
from contfric.continuation.vertices import (
    opens_through,
    parabola_vertex,
    symmetric_part,
    undoubled_part,
)
from contfric.orbit.orbit import Orbit
from contfric.orbit.system import Margin, Test

#: Arclength within which a smooth event belongs to a sliding event: where a stop becomes tangential
#: the branch folds and its multipliers are infinite, and where it meets a surface labels change.
SAME_PLACE = 1e-7
#: The same for a tangency: near a tangential release (AS) the load overshoots its limit by the square
#: of the release's rate, which is rounding up to this distance.
SAME_TANGENCY = 2e-6
#: A parameter that changes this slowly along a branch, in units of arclength, is constant: the orbits are
#: a continuum at one value, and the sign of the slope is rounding.
_VERTICAL = 1e-3
#: A parameter is solved for to this (relative to 1).
_ROUNDING = 1e-13
#: A multiplier of a continuum is 1 to the root of rounding and a little.
_MARGINAL = 1e-5
#: A fold has a multiplier 1, located to far better than this.
_NEAR_ONE = 0.1
#: What it may change by over a step, relative to the range, where it is constant: the root of rounding.
_CONSTANT = 1e-7
#: A step shorter than this (arclength) is not taken back: there is nothing to be found in between.
_SHORTEST_LEAP = 1e-7
#: Imaginary part from which a pair of multipliers on the unit circle counts as complex.
_COMPLEX = 1e-6


#: An event with the point of the branch at which it is.
Located = tuple[Bifurcation, Point]


def smooth_events(
    orbit: Orbit, before: Point, after: Point, settings: Settings, beyond: Point
) -> list[Located]:
    """Return folds, branch points, doublings, tori and tangencies; ``beyond`` is good behind them."""
    from contfric.continuation.bracket import BY_TEST
    from contfric.continuation.steps import CHI_MINUS, CHI_ONE, CHI_PAIR, FOLD

    base = len(before.tests) - EXTRA
    # events behind a sliding one do not happen; where a stop becomes tangential multipliers are infinite
    after = beyond if np.isfinite(beyond.tests[base:]).all() else after
    values = zip(before.tests[base:].tolist(), after.tests[base:].tolist(), strict=True)
    found: list[Located] = []
    folded = False
    for column, (a, b) in zip((FOLD, CHI_ONE, CHI_MINUS, CHI_PAIR), values, strict=True):
        if not a * b < 0.0 or (column == CHI_ONE and folded):
            continue  # chi(1) of a fold vanishes with it
        if max(abs(a), abs(b)) < LEVEL:
            continue  # zero on both sides: a continuum of orbits, and the sign is rounding
        share = a / (a - b) if np.isfinite(a) else 0.5  # infinite at a grazing: nothing is known
        may_cross = column == CHI_ONE and orbit.model.symmetry is None
        if may_cross and not _passes_vertex(orbit, before, after, share, settings):
            crossing = _crossing(orbit, before, after, beyond, share, settings)
            if crossing is not None:
                found.append(crossing)
                continue
        point = locate_change(orbit, before, after, settings, BY_TEST, base + column)
        lost = point is None or point.lost
        if point is not None and (lost or _is_pole(point.tests[base + column], a, b)):
            point = None
        if column == FOLD:
            folded = True
            found += (
                _fold_between(orbit, before, after, beyond, share, settings)
                if point is None
                else _fold_at(orbit, before, after, beyond, point, settings)
            )
        elif point is not None:
            found += _at_multiplier(orbit, column, before, beyond, point, settings)
        elif lost:  # a pole is no event: multipliers are infinite where an exit becomes tangential
            half = orbit.system.half or column == CHI_ONE
            kind = Kind.NS if column == CHI_PAIR else Kind.BP if half else Kind.PD
            found.append(_overshot(orbit, kind, before, after, beyond, settings))
            if found[-1][1].lost:
                return found  # the step is taken back: what else is in it is found again
    return [*found, *_tangencies(orbit, before, beyond, settings)]


def _fold_between(
    orbit: Orbit, before: Point, after: Point, beyond: Point, share: float, settings: Settings
) -> list[Located]:
    """Return what a change of sign of the slope is for which no point was found.

    At the vertex of a pitchfork or of a period doubling the arclength system itself is singular, and Newton
    may be lost around it: it is looked for from between the two points.
    """
    between = parabola_vertex(before, after, share)
    vertex = _fold(orbit, before, beyond, between, settings)
    if vertex[0].kind is not Kind.SN:
        return [vertex]
    crossing = _vertex_of_crossing(orbit, before, after, beyond, share, settings)
    if crossing is not None:
        return [crossing]
    split = _split_between(orbit, before, after, share, settings)
    if split is not None:
        return [split]
    vertical = _is_vertical(before, after, settings)
    return [] if vertical else [_not_located(orbit, Kind.SN, before, beyond, settings)]


def _split_between(
    orbit: Orbit, before: Point, after: Point, share: float, settings: Settings
) -> Located | None:
    """Return where the touch that a hold is pinned to splits, if that is why the slope changes its sign.

    Around it Newton may be lost: the step is taken back until it is as short as the place is known.
    """
    if not orbit.system.holds:
        return None
    here = before.orbit(orbit.system, orbit.vector, orbit.model.index_of(settings.parameter))
    found = bifurcation_at(Kind.SN, here, before, after, before, settings)
    split = as_split(found, before.tangent + share * (after.tangent - before.tangent))
    if split is None:
        return None
    far = after.arc - before.arc > _SHORTEST_LEAP
    return replace(split, bound=ROUGH), replace(before, lost=far)


def _fold_at(
    orbit: Orbit, before: Point, after: Point, beyond: Point, point: Point, settings: Settings
) -> list[Located]:
    """Return what a change of sign of the slope at a point is: a fold, a vertex, or nothing."""
    vertex = _fold(orbit, before, beyond, point, settings)
    if vertex[0].kind is not Kind.SN:
        return [vertex]
    share = (point.arc - before.arc) / (after.arc - before.arc)
    crossing = _vertex_of_crossing(orbit, before, after, beyond, share, settings)
    if crossing is not None:
        return [crossing]
    split = as_split(vertex[0], point.tangent)
    if split is not None:
        return [(split, point)]
    vertical = _is_vertical(before, after, settings, point)
    return [] if vertical or _is_idle(orbit, before, point, after, settings) else [vertex]


def _at_multiplier(
    orbit: Orbit, column: int, before: Point, beyond: Point, point: Point, settings: Settings
) -> list[Located]:
    """Return what a multiplier on the unit circle is: a branch point, a doubling, a torus, or nothing."""
    from contfric.continuation.steps import CHI_MINUS, CHI_PAIR

    kind, value = Kind.BP, -1.0 if column == CHI_MINUS else 1.0
    if column != CHI_PAIR and np.all(np.abs(point.mu - value) > _NEAR_ONE):
        return []  # chi changed its sign through infinity, where an impact grazes
    if column == CHI_PAIR:
        if abs(point.mu[0].imag) < _COMPLEX:
            return []  # two real multipliers with product 1: nothing happens
        kind = Kind.NS
    elif column == CHI_MINUS and not orbit.system.half:
        kind = Kind.PD
    active = orbit.model.index_of(settings.parameter)
    here = point.orbit(orbit.system, orbit.vector, active)
    if kind is Kind.BP and not orbit.system.half and _is_vertex(here, active):
        return []  # the fold there says what it is; near it chi(1) is rounding
    event = bifurcation_at(kind, here, before, beyond, point, settings)
    if column == CHI_MINUS and not opens_through(here, active):
        event = replace(event, bound=ROUGH)
    return [(event, point)]


def _passes_vertex(
    orbit: Orbit, before: Point, after: Point, share: float, settings: Settings
) -> bool:
    """Tell whether a step passes the vertex of a pitchfork or a doubling: its fold says what it is."""
    if orbit.system.half:
        return False
    active = orbit.model.index_of(settings.parameter)
    between = parabola_vertex(before, after, share)
    return _is_vertex(between.orbit(orbit.system, orbit.vector, active), active)


def _crossing(
    orbit: Orbit, before: Point, after: Point, beyond: Point, share: float, settings: Settings
) -> Located | None:
    """Return the branch point in a step, if there is one: another curve of orbits crosses there.

    Along one parameter that takes a symmetry. One that is declared is dealt with by the orbits that have
    it; the search is for models whose author did not declare it.
    """
    if orbit.model.symmetry is not None:
        return None
    found = crossing_between(orbit, before, after, share, settings)
    if found is None:
        return None
    crossing, point = found
    if np.all(np.abs(crossing.orbit.multipliers - 1.0) > _NEAR_ONE):
        return None  # where an impact grazes multipliers are infinite, and singular is no crossing
    return bifurcation_at(Kind.BP, crossing.orbit, before, beyond, point, settings), point


def _vertex_of_crossing(
    orbit: Orbit, before: Point, after: Point, beyond: Point, share: float, settings: Settings
) -> Located | None:
    """Return the branch point at which the parameter turns, if that is what a fold is."""
    found = _crossing(orbit, before, after, beyond, share, settings)
    return found if found is not None and found[1].slope == 0.0 else None


def overshot_vertex(
    orbit: Orbit, before: Point, after: Point, share: float, settings: Settings
) -> Located | None:
    """Return the vertex between two points on its two sides, if it is one."""
    point = parabola_vertex(before, after, share)
    point.w = before.w + share * (after.w - before.w)
    found, place = _fold(orbit, before, after, point, settings)
    if found.kind is Kind.SN:
        return None
    return found, place


def vertex_at(orbit: Orbit, point: Point, settings: Settings) -> Bifurcation | None:
    """Return the vertex that a point is next to, if it is."""
    found, _ = _fold(orbit, point, point, point, settings)
    return None if found.kind is Kind.SN else found


def _is_vertical(
    before: Point, after: Point, settings: Settings, between: Point | None = None
) -> bool:
    """Tell whether the parameter is constant over a step: the sign of its slope is rounding.

    At a fold the multiplier passes 1 as fast as the parameter turns; on a continuum it is 1. Without
    multipliers (on a bridge) a parameter that is beyond that of the fold on neither side, by more than
    rounding, turns.
    """
    slopes = max(abs(before.slope), abs(after.slope))
    if slopes > _VERTICAL or abs(after.value - before.value) > _CONSTANT * settings.width:
        return False
    if not settings.stability:
        if between is None:
            return True
        gaps = [side.value - between.value for side in (before, after)]
        least = _ROUNDING * (1.0 + abs(between.value))
        return not (gaps[0] * gaps[1] > 0.0 and min(map(abs, gaps)) > least)
    return all(float(np.min(np.abs(point.mu - 1.0))) < _MARGINAL for point in (before, after))


def _is_idle(orbit: Orbit, before: Point, point: Point, after: Point, settings: Settings) -> bool:
    """Tell whether a parameter comes to a stand with no multiplier near 1: no fold.

    Where a slide begins at rest in its equilibrium, or grazes, its duration is arbitrary: a vertical line
    that the branch meets at its end, and on which the sign of the slope is rounding. At a fold the
    parameter turns: its values on both sides lie on one side of that at the fold, and away from it. So
    one that turns is a fold whatever the multipliers are.
    """
    leaves = min(abs(side.value - point.value) for side in (before, after))
    if leaves > _CONSTANT * settings.width:
        return False
    known = settings.stability and not orbit.system.holds and point.mu.size > 0
    return bool(known and np.all(np.abs(point.mu - 1.0) > _NEAR_ONE))


def _is_vertex(here: Orbit, active: int) -> bool:
    """Tell whether an orbit is at the vertex of a pitchfork or of a period doubling."""
    return (symmetric_part(here, active) or undoubled_part(here, active)) is not None


def _not_located(
    orbit: Orbit, kind: Kind, before: Point, beyond: Point, settings: Settings
) -> Located:
    """Return an event that is known to lie behind a point, and no better: it is not kept silent.

    Its bound is that of an event at the point, and as much again for the way behind it.
    """
    here = before.orbit(orbit.system, orbit.vector, orbit.model.index_of(settings.parameter))
    bifurcation = bifurcation_at(kind, here, before, beyond, before, settings)
    return replace(bifurcation, located=False, bound=2.0 * bifurcation.accuracy), before


def _overshot(
    orbit: Orbit, kind: Kind, before: Point, after: Point, beyond: Point, settings: Settings
) -> Located:
    """Return what stands for a step between whose ends no branch is found: it is to be taken back.

    A step as short as can be is not: then the event is reported as not located.
    """
    if after.arc - before.arc <= _SHORTEST_LEAP:
        return _not_located(orbit, kind, before, beyond, settings)
    here = before.orbit(orbit.system, orbit.vector, orbit.model.index_of(settings.parameter))
    found = bifurcation_at(kind, here, before, beyond, before, settings)
    return found, replace(before, lost=True)


def _is_pole(value: float, a: float, b: float) -> bool:
    """Tell whether a test changes sign through infinity."""
    return not np.isfinite(value) or abs(value) > 2.0 * max(abs(a), abs(b))


def _tangencies(orbit: Orbit, before: Point, after: Point, settings: Settings) -> list[Located]:
    """Return the events T: changes of the surfaces that a segment crosses."""
    found: list[Located] = []
    active = orbit.model.index_of(settings.parameter)
    for k in range(len(before.labels)):
        if before.labels[k] == after.labels[k]:
            continue
        places = locate_label(orbit, before, after, settings, k)
        if len(places) > 1 and places[1].arc - places[0].arc < SAME_PLACE:
            places.pop()
        if not places:
            found.append(_not_located(orbit, Kind.T, before, after, settings))
        for point in places:
            here = point.orbit(orbit.system, orbit.vector, active)
            test = Test(*_label_place(orbit, k))
            b = bifurcation_at(Kind.T, here, point, point, point, settings, (test,))
            found.append((b, point))
    return _once(found) if orbit.model.joined else found


def _once(found: list[Located]) -> list[Located]:
    """Return one tangency of those in one place: where a joint on a section is, is of no importance."""
    kept: list[Located] = []
    for event in sorted(found, key=lambda pair: pair[1].arc):
        if not kept or event[1].arc - kept[-1][1].arc > SAME_TANGENCY:
            kept.append(event)
    return kept


def _label_place(orbit: Orbit, k: int) -> tuple[Margin, int, str]:
    segment, observable, *_ = orbit.system.layout.labels[k]
    name = orbit.model.observables[int(observable)].name
    return Margin.INTERIOR, int(segment), name


def _fold(orbit: Orbit, before: Point, after: Point, point: Point, settings: Settings) -> Located:
    """Tell a fold from the vertex of a pitchfork or of a period doubling."""
    active = orbit.model.index_of(settings.parameter)
    here = point.orbit(orbit.system, orbit.vector, active)
    symmetric = symmetric_part(here, active)
    if symmetric is not None:
        kind, here = Kind.BP, symmetric
    elif (undoubled := undoubled_part(here, active)) is not None:
        kind, here = Kind.PD, undoubled
    else:
        kind = Kind.SN
    found = bifurcation_at(kind, here, before, after, point, settings)
    if kind is not Kind.SN and not opens_through(here, active):
        found = replace(found, bound=ROUGH)
    return found, point
