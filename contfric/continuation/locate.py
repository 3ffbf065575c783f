"""Events between two points of a branch: located, classified, grouped, in the order of the branch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contfric.continuation.events import Bifurcation, Kind, kind_of_margin
from contfric.continuation.points import Point, Settings
from contfric.models.definition import FloatArray
from contfric.orbit.counts import TALLY
from contfric.orbit.orbit import Orbit
from contfric.orbit.solve import polish
from contfric.orbit.system import Margin, Test, build_system
from contfric.orbit.words import half_of

#: Margins below this at a located event vanish with it: they form a group. Located margins are
#: zero to about 1e-13; distinct events this near are beyond what a diagram can tell apart.
_TOGETHER = 1e-9
#: Share of a step within which a smooth test follows a sliding event: where a stop becomes tangential
#: the branch folds and its multipliers are infinite at the same point.
_SAME = 1e-6
#: Distance of a fold to its mirror image (or to its own second half) below which it may be the vertex
#: of a pitchfork (of a period doubling). There the system is singular and the state is good to about
#: 1e-5 only, while the parameter, stationary along the branch, is good to the square of that.
_NEARLY = 1e-2
#: At such a vertex the symmetric (the undoubled) orbit has a multiplier -1 of its turn; chi(-1) of it
#: is zero to the accuracy of the parameter, far below this.
_VERTEX_CHI = 1e-4


#: Share of the period below which a stick at a tangential release has vanished: the square root of
#: the rounding of its quadratic margin.
_VANISHED = 1e-5
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
    step = after.arc - before.arc
    beyond = sliding[0][1] if sliding else after
    smooth = [
        (b, point)
        for b, point in _smooth_events(orbit, before, after, settings, beyond)
        if point.arc < first - _SAME * step
    ]
    return sorted([*smooth, *sliding], key=lambda pair: pair[1].arc)


def _trial(
    orbit: Orbit,
    before: Point,
    after: Point,
    settings: Settings,
    kind: int,
    index: int,
    target: float,
    sign: float,
) -> Point | None:
    """Locate one change of sign; None if no point could be solved on the way."""
    from contfric.continuation.bracket import BY_TEST, locate

    system = orbit.system
    active = orbit.model.index_of(settings.parameter)
    vector = orbit.vector.copy()
    vector[active] = before.value
    joints, tangent = before.joints.copy(), before.tangent.copy()
    tests, labels, mu = before.tests.copy(), before.labels.copy(), before.mu.copy()
    slope = np.empty(1)
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
        sign,
        joints,
        np.ascontiguousarray(after.joints),
        tangent,
        after.value,
        before.slope,
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

    sign = 1.0 if before.value > target else -1.0
    if before.value == target:
        return before
    found = _trial(orbit, before, after, settings, BY_PARAMETER, 0, target, sign)
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
            point = _trial(orbit, before, after, settings, BY_TEST, k, 0.0, 1.0)
            if point is not None:
                located.append((k, point))
    if not located:
        return []
    # what comes first ends the branch; what vanishes with it is of its group
    first, point = min(located, key=lambda pair: pair[1].arc)
    here = point.orbit(orbit.system, orbit.vector, orbit.model.index_of(settings.parameter))
    kind = kind_of_margin(orbit.system, orbit.system.tests[first], here)
    if _is_degenerate(here, kind, orbit.system.tests[first]):
        point.lost = True
    group = tuple(
        test
        for k, test in enumerate(orbit.system.tests)
        if k == first
        or (
            abs(point.tests[k]) < _TOGETHER
            and kind_of_margin(orbit.system, test, here) is kind
            and _is_free(orbit.system.tests[first], test)
        )
    )
    return [(_bifurcation(kind, here, before, None, point, settings, group), point)]


def _is_degenerate(here: Orbit, kind: Kind, test: Test) -> bool:
    """Tell whether a stick vanishes just where its release becomes tangential.

    CS and AS at once: the margin vanishes quadratically, and the orbit is one of a continuum (as at
    Omega = 1/2, where a slide lasts a whole natural period whatever its amplitude).
    """
    start, end = here.cycle[test.segment, 0], here.ends[test.segment, 0]
    return kind is Kind.AS and end - start < _VANISHED * here.period


def _is_free(first: Test, other: Test) -> bool:
    """Tell whether two vanishing margins are two events: not the same surface at the same place."""
    return (first.segment, first.surface) != (other.segment, other.surface)


def _smooth_events(
    orbit: Orbit, before: Point, after: Point, settings: Settings, beyond: Point
) -> list[tuple[Bifurcation, Point]]:
    """Return folds, branch points, doublings, tori and tangencies; ``beyond`` is good behind them."""
    from contfric.continuation.bracket import BY_TEST
    from contfric.continuation.steps import CHI_MINUS, CHI_ONE, CHI_PAIR, FOLD

    base = len(orbit.system.tests)
    found: list[tuple[Bifurcation, Point]] = []
    folded = False
    for column in (FOLD, CHI_ONE, CHI_MINUS, CHI_PAIR):
        a, b = before.tests[base + column], after.tests[base + column]
        if not a * b < 0.0 or (column == CHI_ONE and folded):
            continue  # chi(1) of a fold vanishes with it
        sign = float(np.sign(a))
        point = _trial(orbit, before, after, settings, BY_TEST, base + column, 0.0, sign)
        if point is None or point.lost or _is_pole(point.tests[base + column], a, b):
            continue
        if column == FOLD:
            folded = True
            found.append(_fold(orbit, before, beyond, point, settings))
            continue
        kind = Kind.BP
        if column == CHI_PAIR:
            if abs(point.mu[0].imag) < _COMPLEX:
                continue  # two real multipliers with product 1: nothing happens
            kind = Kind.NS
        elif column == CHI_MINUS and not orbit.system.half:
            kind = Kind.PD
        here = point.orbit(orbit.system, orbit.vector, orbit.model.index_of(settings.parameter))
        found.append((_bifurcation(kind, here, before, beyond, point, settings), point))
    return [*found, *_tangencies(orbit, before, after, settings)]


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
        start = before
        while start.labels[k] != after.labels[k]:
            code = float(start.labels[k])
            point = _trial(orbit, start, after, settings, BY_LABEL, k, code, 1.0)
            if point is None or len(found) > 64:
                break
            here = point.orbit(orbit.system, orbit.vector, active)
            test = Test(*_label_place(orbit, k))
            found.append(
                (_bifurcation(Kind.T, here, point, point, point, settings, (test,)), point)
            )
            break
    return found


def _label_place(orbit: Orbit, k: int) -> tuple[Margin, int, str]:
    segment, observable, _ = orbit.system.layout.labels[k]
    name = orbit.model.observables[int(observable)].name
    return Margin.INTERIOR, int(segment), name


def _fold(
    orbit: Orbit, before: Point, after: Point, point: Point, settings: Settings
) -> tuple[Bifurcation, Point]:
    """Tell a fold from the vertex of a pitchfork or of a period doubling."""
    active = orbit.model.index_of(settings.parameter)
    here = point.orbit(orbit.system, orbit.vector, active)
    symmetric = _symmetric_part(here, active)
    if symmetric is not None:
        kind, here = Kind.BP, symmetric
    elif (undoubled := _undoubled_part(here, active)) is not None:
        kind, here = Kind.PD, undoubled
    else:
        kind = Kind.SN
    return _bifurcation(kind, here, before, after, point, settings), point


def _symmetric_part(orbit: Orbit, active: int) -> Orbit | None:
    """Return the symmetric orbit that an orbit has come to, solved on its half; None if far."""
    system = orbit.system
    half = None if system.half else half_of(orbit.model, system.word, system.periods)
    if half is None or orbit.model.symmetry is None:
        return None
    n = len(half)
    image = orbit.joints[n:].copy()
    image[:, 0] -= 0.5 * orbit.period
    image[:, 1:] = image[:, 1:] @ orbit.model.symmetry.array()
    if np.max(np.abs(image - orbit.joints[:n])) > _NEARLY:
        return None
    middle = 0.5 * (image + orbit.joints[:n])
    part = build_system(orbit.model, half, system.periods, half=True)
    return _vertex(replace(orbit, system=part, joints=middle), active)


def _undoubled_part(orbit: Orbit, active: int) -> Orbit | None:
    """Return the orbit of half the period that an orbit has come to; None if far."""
    system = orbit.system
    n, odd = divmod(len(system.word), 2)
    if system.half or odd or system.periods % 2 or system.word[:n] != system.word[n:]:
        return None
    image: FloatArray = orbit.joints[n:].copy()
    image[:, 0] -= 0.5 * orbit.period
    if np.max(np.abs(image - orbit.joints[:n])) > _NEARLY:
        return None
    part = build_system(orbit.model, system.word[:n], system.periods // 2)
    return _vertex(replace(orbit, system=part, joints=0.5 * (image + orbit.joints[:n])), active)


def _vertex(orbit: Orbit, active: int) -> Orbit | None:
    """Return the orbit solved if its turn has a multiplier -1, else None."""
    solved = polish(orbit, damped=False)
    if not solved.converged or abs(_chi_minus(solved)) > _VERTEX_CHI:
        return None
    return _refined(solved, active)


def _chi_minus(orbit: Orbit) -> float:
    return float(np.prod(1.0 + orbit.turn_multipliers).real)


def _refined(orbit: Orbit, active: int) -> Orbit:
    """Return the orbit whose turn has the multiplier -1 exactly, by secants in the parameter."""
    value = float(orbit.vector[active])
    offset = 1e-7 * (1.0 + abs(value))  # far above rounding, far below the branch's curvature
    orbits = [orbit, _moved(orbit, active, value + offset)]
    for _ in range(8):
        a, b = orbits[-2:]
        chi_a, chi_b = _chi_minus(a), _chi_minus(b)
        if not b.converged or chi_a == chi_b:
            return orbit
        step = -chi_b * float(b.vector[active] - a.vector[active]) / (chi_b - chi_a)
        if abs(step) > 100.0 * offset:
            return orbit
        orbits.append(_moved(b, active, float(b.vector[active]) + step))
        if abs(step) < 1e-15 * (1.0 + abs(value)):
            break
    return orbits[-1]


def _moved(orbit: Orbit, active: int, value: float) -> Orbit:
    vector = orbit.vector.copy()
    vector[active] = value
    return polish(replace(orbit, vector=vector), damped=False)


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
        _stable(before, settings),
        None if after is None else _stable(after, settings),
    )


def _stable(point: Point, settings: Settings) -> bool | None:
    return bool(np.all(np.abs(point.mu) < 1.0)) if settings.stability else None
