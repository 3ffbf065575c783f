"""Events between two points of a branch: located, classified, grouped, in the order of the branch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.continuation.events import (
    ACCURACY,
    Bifurcation,
    Kind,
    hold_of_test,
    kind_of_margin,
    outward_rate,
)
from contfric.continuation.points import EXTRA, Point, Settings
from contfric.continuation.vertices import parabola_vertex, symmetric_part, undoubled_part
from contfric.orbit.counts import TALLY
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import polish
from contfric.orbit.system import Margin, Test

#: Margins below this at a located event vanish with it: they form a group. Located margins are
#: zero to about 1e-13; distinct events this near are beyond what a diagram can tell apart.
_TOGETHER = 1e-9
#: Arclength within which a smooth event belongs to a sliding event: where a stop becomes tangential
#: the branch folds and its multipliers are infinite, and where it meets a surface labels change.
SAME_PLACE = 1e-7
#: The same for a tangency: beside a tangential release (AS) the load overshoots its limit by the square
#: of the release's rate, which is rounding up to this distance.
_SAME_TANGENCY = 2e-6


#: Newton may fail right behind an event (a slide that vanishes, several conditions at once): it is reached
#: where the margin is this small.
_REACHED = 1e-8
#: Where two conditions fail together at an orbit that is symmetric in time (without damping), Newton fails
#: at the root of that: such an event is as good as this, relative to the range.
_ROUGHLY_REACHED = 1e-4
#: The same where several holds end at once; what their lengths do to the orbit is the square of it.
_NEARLY_REACHED = 1e-5
#: Share of the period below which a stick at a tangential release has vanished: the square root of
#: the rounding of its quadratic margin.
_VANISHED = 1e-5
#: Accuracy of an event (relative to the range) where CS and AS coincide: the root of rounding.
_ROUGH = 1e-6
#: A load that changes this slowly at a stop stands still there.
_STILL = 1e-4
#: A parameter that changes this slowly along a branch, in units of arclength, is constant: the orbits are
#: a continuum at one value, and the sign of the slope is rounding.
_VERTICAL = 1e-5
#: What it may change by over a step, relative to the range: the root of rounding.
_CONSTANT = 1e-7
#: Imaginary part from which a pair of multipliers on the unit circle counts as complex.
_COMPLEX = 1e-6


def locate_events(
    orbit: Orbit, before: Point, after: Point, settings: Settings
) -> list[tuple[Bifurcation, Point]]:
    """Return the bifurcations between two points with their located points, in order.

    A point that is ``lost`` is no event: Newton fails behind it before any condition is violated.
    """
    sliding = _sliding_events(orbit, before, after, settings)
    first = min((point.arc for _, point in sliding), default=np.inf)
    beyond = sliding[0][1] if sliding else after
    smooth = [
        (b, point)
        for b, point in _smooth_events(orbit, before, after, settings, beyond)
        if point.arc < first - (_SAME_TANGENCY if b.kind is Kind.T else SAME_PLACE)
    ]
    return sorted([*smooth, *sliding], key=lambda pair: pair[1].arc)


def _trial(
    orbit: Orbit,
    before: Point,
    after: Point,
    settings: Settings,
    kind: int,
    index: int,
    target: float = 0.0,
) -> Point | None:
    """Locate one change of sign; None if no point could be solved on the way."""
    from contfric.continuation.bracket import BY_TEST, locate

    system = orbit.system
    active = orbit.model.index_of(settings.parameter)
    vector = orbit.vector.copy()
    joints, tangent = before.joints.copy(), before.tangent.copy()
    tests, labels, mu = before.tests.copy(), before.labels.copy(), before.mu.copy()
    slope = np.empty(1)
    length = after.arc - before.arc
    ends = np.array([before.value, before.slope, after.value, after.slope, length])
    if kind == BY_TEST:
        values = np.array([before.tests[index], after.tests[index]])
    else:
        values = np.array([before.value - target, after.value - target])
    at = locate(
        system.functions(),
        system.layout,
        vector,
        active,
        settings.scale,
        settings.stability,
        kind,
        index,
        target,
        ends,
        values,
        joints,
        after.joints,
        tangent,
        after.tangent,
        tests,
        slope,
        labels,
        mu,
        TALLY,
    )
    if at < 0.0:
        if at == -1.0 or kind != BY_TEST:
            return None
        # Newton fails behind this point: the last good one, marked as such
        arc = before.arc - (at + 2.0) * (after.arc - before.arc)
        return Point(
            joints,
            float(vector[active]),
            tangent,
            float(slope[0]),
            tests,
            labels,
            mu,
            arc,
            lost=True,
        )
    arc = before.arc + at * (after.arc - before.arc)
    return Point(joints, float(vector[active]), tangent, float(slope[0]), tests, labels, mu, arc)


def locate_value(
    orbit: Orbit, before: Point, after: Point, settings: Settings, target: float
) -> Point:
    """Return the point at which the parameter takes a value."""
    from contfric.continuation.bracket import BY_PARAMETER

    if before.value == target:
        return before
    found = _trial(orbit, before, after, settings, BY_PARAMETER, 0, target)
    if found is None:
        return before
    # the bracket ends within rounding of the value: solve at the value itself
    vector = orbit.vector.copy()
    vector[orbit.model.index_of(settings.parameter)] = target
    exact = polish(Orbit(orbit.system, found.joints, vector, np.inf), damped=False)
    if exact.converged and np.max(np.abs(exact.joints - found.joints)) < 1e-6:
        found.joints, found.value = exact.joints, target
    return found


def _sliding_events(
    orbit: Orbit, before: Point, after: Point, settings: Settings
) -> list[tuple[Bifurcation, Point]]:
    from contfric.continuation.bracket import BY_TEST

    margins = len(orbit.system.tests)
    located: list[tuple[int, Point]] = []
    for k in range(margins):
        if after.tests[k] < 0.0:
            point = _trial(orbit, before, after, settings, BY_TEST, k)
            if point is not None:
                located.append((k, point))
    if not located:
        return []
    # what comes first ends the branch; what vanishes with it is of its group
    first, point = min(located, key=lambda pair: pair[1].arc)
    while hidden := _located_before(orbit, before, point, settings):
        first, point = min(hidden, key=lambda pair: pair[1].arc)
    here = point.orbit(orbit.system, orbit.vector, orbit.model.index_of(settings.parameter))
    kind = kind_of_margin(orbit.system, orbit.system.tests[first], here)
    together = _TOGETHER
    rough = False
    if point.lost:
        held = hold_of_test(orbit.system.tests[first], here) is not None
        rough = abs(point.tests[first]) >= (_NEARLY_REACHED if held else _REACHED)
        together = 2.0 * _ROUGHLY_REACHED if rough else _NEARLY_REACHED if held else _REACHED
        point.lost = bool(abs(point.tests[first]) >= _ROUGHLY_REACHED)
    vanished = _vanished_stick(here, kind, orbit.system.tests[first])
    if vanished is not None:
        point.lost = False
        return [(_bifurcation(Kind.CS, here, before, None, point, settings, (vanished,)), point)]
    group = tuple(
        test
        for k, test in enumerate(orbit.system.tests)
        if k == first
        or (
            abs(point.tests[k]) < together
            and kind_of_margin(orbit.system, test, here) is kind
            and _is_free(orbit.system.tests[first], test)
        )
    )
    found = _bifurcation(kind, here, before, None, point, settings, group)
    return [(replace(found, accuracy=_ROUGHLY_REACHED) if rough else found, point)]


def _located_before(
    orbit: Orbit, before: Point, point: Point, settings: Settings
) -> list[tuple[int, Point]]:
    """Return the margins violated at a located event: they vanish before it, and come back behind."""
    from contfric.continuation.bracket import BY_TEST

    violated = map(int, np.flatnonzero(point.tests[: len(orbit.system.tests)] < -_TOGETHER))
    found = [(k, _trial(orbit, before, point, settings, BY_TEST, k)) for k in violated]
    return [(k, p) for k, p in found if p is not None and p.arc < point.arc]


def _vanished_stick(here: Orbit, kind: Kind, test: Test) -> Test | None:
    """Return the stop (as a margin) of a stick that vanishes just where its release is tangential.

    CS and AS at once: the margin vanishes quadratically, and the orbit is one of a continuum (as at
    Omega = 1/2, where a slide lasts a whole natural period whatever its amplitude).
    """
    if kind is not Kind.AS or hold_of_test(test, here) is not None:
        return None
    start, end = here.cycle[test.segment, 0], here.ends[test.segment, 0]
    if end - start >= _VANISHED * here.period:
        return None
    surface, segment = here.word[test.segment][1], test.segment - 1
    if segment < 0:  # of a half: the stop is the mirror image of the last one
        segment += here.system.segments
        symmetry = here.model.symmetry
        if here.system.half and symmetry is not None:
            surface = {image: name for name, image in symmetry.surfaces.items()}[surface]
    return Test(Margin.JOINT, segment, surface)


def nearly_reached(orbit: Orbit, tip: Point, settings: Settings) -> Bifurcation | None:
    """Return the event at which several holds end at once, where Newton fails just before it.

    The ends of two holds are singular each (a hold without acceleration moves nothing), and together
    they stop Newton at the root of rounding.
    """
    here = tip.orbit(orbit.system, orbit.vector, orbit.model.index_of(settings.parameter))
    near = [
        test
        for test, value in zip(orbit.system.tests, tip.tests, strict=False)
        if 0.0 <= value < _NEARLY_REACHED and hold_of_test(test, here) is not None
    ]
    if not near:
        return None
    kind = kind_of_margin(orbit.system, near[0], here)
    group = tuple(test for test in near if kind_of_margin(orbit.system, test, here) is kind)
    return _bifurcation(kind, here, tip, None, tip, settings, group)


def _is_free(first: Test, other: Test) -> bool:
    """Tell whether two vanishing margins are two events: not the same surface at the same place."""
    return (first.segment, first.surface) != (other.segment, other.surface)


def _smooth_events(
    orbit: Orbit, before: Point, after: Point, settings: Settings, beyond: Point
) -> list[tuple[Bifurcation, Point]]:
    """Return folds, branch points, doublings, tori and tangencies; ``beyond`` is good behind them."""
    from contfric.continuation.bracket import BY_TEST
    from contfric.continuation.steps import CHI_MINUS, CHI_ONE, CHI_PAIR, FOLD

    base = len(before.tests) - EXTRA
    # an event behind a sliding one is none; but where a stop becomes tangential multipliers are infinite
    after = beyond if np.all(np.isfinite(beyond.tests[base:])) else after
    found: list[tuple[Bifurcation, Point]] = []
    folded = False
    for column in (FOLD, CHI_ONE, CHI_MINUS, CHI_PAIR):
        a, b = before.tests[base + column], after.tests[base + column]
        if not a * b < 0.0 or (column == CHI_ONE and folded):
            continue  # chi(1) of a fold vanishes with it
        point = _trial(orbit, before, after, settings, BY_TEST, base + column)
        if point is None or point.lost or _is_pole(point.tests[base + column], a, b):
            if column == FOLD:
                # at the vertex of a pitchfork or of a period doubling the arclength system itself is
                # singular, and Newton may be lost around it: look from between the two points
                between = parabola_vertex(before, after, a / (a - b))
                vertex = _fold(orbit, before, beyond, between, settings)
                folded = True
                if vertex[0].kind is Kind.SN:
                    if not _is_vertical(before, after, settings):
                        found.append(_not_located(orbit, Kind.SN, before, beyond, settings))
                else:
                    found.append(vertex)
            elif point is None or point.lost:
                # a pole is no event: multipliers are infinite where an exit becomes tangential
                half = orbit.system.half or column == CHI_ONE
                kind = Kind.NS if column == CHI_PAIR else Kind.BP if half else Kind.PD
                found.append(_not_located(orbit, kind, before, beyond, settings))
            continue
        if column == FOLD:
            folded = True
            vertex = _fold(orbit, before, beyond, point, settings)
            if vertex[0].kind is not Kind.SN or not _is_vertical(before, after, settings):
                found.append(vertex)
            continue
        kind = Kind.BP
        if column == CHI_PAIR:
            if abs(point.mu[0].imag) < _COMPLEX:
                continue  # two real multipliers with product 1: nothing happens
            kind = Kind.NS
        elif column == CHI_MINUS and not orbit.system.half:
            kind = Kind.PD
        active = orbit.model.index_of(settings.parameter)
        here = point.orbit(orbit.system, orbit.vector, active)
        if kind is Kind.BP and not orbit.system.half and _is_vertex(here, active):
            continue  # the fold there says what it is; beside it chi(1) is rounding
        found.append((_bifurcation(kind, here, before, beyond, point, settings), point))
    return [*found, *_tangencies(orbit, before, beyond, settings)]


def _is_vertical(before: Point, after: Point, settings: Settings) -> bool:
    """Tell whether the parameter is constant over a step: the sign of its slope is rounding."""
    slopes = max(abs(before.slope), abs(after.slope))
    return slopes < _VERTICAL and abs(after.value - before.value) < _CONSTANT * settings.width


def _is_vertex(here: Orbit, active: int) -> bool:
    """Tell whether an orbit is at the vertex of a pitchfork or of a period doubling."""
    return (symmetric_part(here, active) or undoubled_part(here, active)) is not None


def _not_located(
    orbit: Orbit, kind: Kind, before: Point, beyond: Point, settings: Settings
) -> tuple[Bifurcation, Point]:
    """Return an event that is known to lie behind a point, and no better: it is not kept silent."""
    here = before.orbit(orbit.system, orbit.vector, orbit.model.index_of(settings.parameter))
    bifurcation = _bifurcation(kind, here, before, beyond, before, settings)
    return replace(bifurcation, located=False), before


def _is_pole(value: float, a: float, b: float) -> bool:
    """Tell whether a test changes sign through infinity."""
    return not np.isfinite(value) or abs(value) > 2.0 * max(abs(a), abs(b))


def _tangencies(
    orbit: Orbit, before: Point, after: Point, settings: Settings
) -> list[tuple[Bifurcation, Point]]:
    """Return the events T: changes of the surfaces that a segment crosses."""
    from contfric.continuation.bracket import BY_LABEL

    found: list[tuple[Bifurcation, Point]] = []
    active = orbit.model.index_of(settings.parameter)
    for k in range(len(before.labels)):
        if before.labels[k] == after.labels[k]:
            continue
        # the first change, seen from the start, and the last one, seen from the end of the step
        first = _trial(orbit, before, after, settings, BY_LABEL, k, float(before.labels[k]))
        last = _trial(orbit, after, before, settings, BY_LABEL, k, float(after.labels[k]))
        places = [p for p in (first, last) if p is not None]
        if len(places) > 1 and places[1].arc - places[0].arc < SAME_PLACE:
            places.pop()
        if not places:
            found.append(_not_located(orbit, Kind.T, before, after, settings))
        for point in places:
            here = point.orbit(orbit.system, orbit.vector, active)
            test = Test(*_label_place(orbit, k))
            b = _bifurcation(Kind.T, here, point, point, point, settings, (test,))
            found.append((b, point))
    return found


def _label_place(orbit: Orbit, k: int) -> tuple[Margin, int, str]:
    segment, observable, *_ = orbit.system.layout.labels[k]
    name = orbit.model.observables[int(observable)].name
    return Margin.INTERIOR, int(segment), name


def _fold(
    orbit: Orbit, before: Point, after: Point, point: Point, settings: Settings
) -> tuple[Bifurcation, Point]:
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
    return _bifurcation(kind, here, before, after, point, settings), point


def _bifurcation(
    kind: Kind,
    here: Orbit,
    before: Point,
    after: Point | None,
    point: Point,
    settings: Settings,
    tests: tuple[Test, ...] = (),
) -> Bifurcation:
    return Bifurcation(
        kind,
        here.params,
        here,
        tests,
        point.arc,
        _stable(before, here, settings),
        None if after is None else _stable(after, here, settings),
        accuracy=_ROUGH if _is_rough(kind, here, tests) else ACCURACY,
    )


def _is_rough(kind: Kind, here: Orbit, tests: tuple[Test, ...]) -> bool:
    """Tell whether an event is located to the root of rounding only: CS where the load stands still."""
    return kind is Kind.CS and any(
        abs(outward_rate(here.system, test, here)) < _STILL for test in tests
    )


def _stable(point: Point, here: Orbit, settings: Settings) -> bool | None:
    if here.system.holds:
        return False
    return bool(np.all(np.abs(point.mu) < 1.0)) if settings.stability else None
