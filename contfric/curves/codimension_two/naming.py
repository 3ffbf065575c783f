"""Identifies a change of sign on a curve: which test it was, where it vanishes, and its name."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from contfric.bvp.system import EventFunction, Margin
from contfric.continuation.points import EXTRA, Point
from contfric.curves.codimension_two.births import end_of_asymmetry
from contfric.curves.codimension_two.locating import CurveStep, by_label, by_test
from contfric.curves.codimension_two.meeting import at_once
from contfric.curves.problem import Problem
from contfric.curves.special import CodimTwo, SpecialPoint
from contfric.events.bifurcation import Kind
from contfric.events.sliding_kinds import kind_of_margin

#: A multiplier this far from the real axis belongs to a complex pair.
_COMPLEX = 1e-6
#: Margins below this at a located point vanish with it: they are of one group.
_TOGETHER = 1e-8
#: Multipliers and coefficients that vanish all along a curve (of a continuum; of orbits that are symmetric
#: in time, without damping) do so to this, the root of rounding and a little: their signs are rounding.
MARGINAL = 1e-6
#: Arclength within which a tangency belongs to a sliding event: where a stop meets a surface labels change.
_OF_EVENT = 1e-5
#: Columns after the margins and the distances of the labels (``contfric.curves.core.correct``).
_BEND, _ONE, _MINUS, _PAIR = range(EXTRA)


@dataclass(eq=False)
class LocatedChange:
    """A change between two points of a curve: the located point, and what it is."""

    point: Point
    special: SpecialPoint
    terminal: bool


def crossings(step: CurveStep[Problem]) -> list[LocatedChange]:
    """Return what happens between two points, in order; the first terminal one is the last."""
    found = [
        *_margins(step),
        *_smooth(step),
        *_labels(step),
    ]
    found.sort(key=lambda c: c.point.arc)
    last = next((k for k, crossing in enumerate(found) if crossing.terminal), None)
    if last is None:
        return found
    end = found[last].point.arc
    return [c for c in found[: last + 1] if c.terminal or end - c.point.arc > _OF_EVENT]


def _margins(step: CurveStep[Problem]) -> list[LocatedChange]:
    """Return the first margin that is violated, with its group."""
    problem, after = step.problem, step.after
    tests, located = problem.system.tests, []
    for k in np.flatnonzero(after.tests[: len(tests)] < 0.0):
        index = int(k)
        point, fine = step.located(by_test(index))
        located.append((point.arc, index, point, fine))
    if not located:
        return []
    _, first, point, fine = min(located, key=lambda entry: entry[0])
    fine = fine and step.found_again(by_test(first), point)
    point, fine = at_once(problem, point, fine, tests[first])
    orbit = problem.orbit(point.joints, point.w)
    kind = kind_of_margin(problem.system, tests[first], orbit)
    ended = end_of_asymmetry(problem, point, tests[first]) if kind is problem.kind else None
    if ended is not None:
        return [LocatedChange(*ended, True)]
    group = tuple(
        test
        for k, test in enumerate(tests)
        if k == first
        or (
            k not in problem.condition.pinned
            and abs(point.tests[k]) < _TOGETHER
            and kind_of_margin(problem.system, test, orbit) is kind
        )
    )
    special = _special(
        problem, point, CodimTwo.MEETS, kind, (tests[first], *_rest(group, tests[first])), fine
    )
    return [LocatedChange(point, special, True)]


def _rest(group: tuple[EventFunction, ...], first: EventFunction) -> tuple[EventFunction, ...]:
    return tuple(test for test in group if test != first)


def _special(
    problem: Problem,
    point: Point,
    kind: CodimTwo,
    meets: Kind | None = None,
    tests: tuple[EventFunction, ...] = (),
    located: bool = True,
) -> SpecialPoint:
    orbit = problem.orbit(point.joints, point.w)
    name = kind.name.replace("_", "-")
    if kind is CodimTwo.MEETS:
        assert meets is not None
        name = f"{problem.kind.value}-{meets.value}"
    if kind is CodimTwo.TURNOVER:
        name = "CS-SS"
    located = located and not problem.at_limit(point.w)
    return SpecialPoint(kind, name, orbit.params, orbit, meets, tests, point.arc, located)


def _smooth(step: CurveStep[Problem]) -> list[LocatedChange]:
    """Return what the normal form and the multipliers tell."""
    problem, before, after = step.problem, step.before, step.after
    base = len(before.tests) - EXTRA
    found = []
    for column in (_BEND, _ONE, _MINUS, _PAIR):
        index = base + column
        a, b = before.tests[index], after.tests[index]
        if not a * b < 0.0 or max(abs(a), abs(b)) < MARGINAL:
            continue
        point, fine = step.located_twice(by_test(index))
        value = abs(point.tests[index])
        if not math.isfinite(value) or value > max(0.5 * min(abs(a), abs(b)), MARGINAL):
            continue  # it changes sign through infinity: an exit that becomes tangential
        named = _smooth_kind(problem, column, point)
        if named is not None:
            kind, meets = named
            special = _special(problem, point, kind, meets, located=fine)
            found.append(LocatedChange(point, special, False))
    return found


def _smooth_kind(
    problem: Problem, column: int, point: Point
) -> tuple[CodimTwo, Kind | None] | None:
    """Return the kind of a point, and the smooth event that meets the curve there."""
    half, kind = problem.system.half, problem.kind
    spectral = problem.test is None
    if column == _BEND:
        if not spectral:
            return CodimTwo.TURNOVER, None
        names = {Kind.SN: CodimTwo.CUSP, Kind.PD: CodimTwo.GPD, Kind.BP: CodimTwo.DBP}
        return names[kind], None
    if column == _PAIR:
        if not spectral:
            return None  # NS on a sliding event: its curves are not continued
        other = point.mu[int(np.argmax(np.abs(point.mu - problem.condition.sign)))]
        if abs(other.imag) > _COMPLEX or other.real * problem.condition.sign < 0.0:
            return None  # the other column tells of it
        return (CodimTwo.R1 if problem.condition.sign > 0.0 else CodimTwo.R2), None
    if column == _ONE:
        if not spectral:
            return CodimTwo.MEETS, Kind.SN
        return (CodimTwo.SN_BP if half else CodimTwo.SN_PD), Kind.SN
    other_kind = Kind.BP if half else Kind.PD
    if not spectral:
        return CodimTwo.MEETS, other_kind
    return (CodimTwo.SN_BP if half else CodimTwo.SN_PD), other_kind


def _labels(step: CurveStep[Problem]) -> list[LocatedChange]:
    """Return the tangencies that the curve meets: segments are relabelled, and the curve goes on."""
    problem, before, after = step.problem, step.before, step.after
    rows = problem.system.layout.labels
    observables = problem.model.observables
    found = []
    for k in np.flatnonzero(before.labels != after.labels):
        point, _ = step.located(by_label(int(k)))
        test = EventFunction(Margin.INTERIOR, int(rows[k][0]), observables[int(rows[k][1])].name)
        special = _special(problem, point, CodimTwo.MEETS, Kind.T, (test,))
        found.append(LocatedChange(point, special, False))
    return found
